"""What the live twin shows and by which light: changed from one thread, taken up by the cameras between two frames."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass, replace
from typing import Any

import msgspec
import numpy as np

from rhot_app.errors import SimulatorError
from rhot_app.simulator.film.foreign_tracker import RATE_HZ, ForeignTracker
from rhot_app.simulator.film.scene_objects import SceneObject, make_object
from rhot_app.simulator.film.shot import camera_seed
from rhot_app.simulator.nodes.remote import CoverRequest, LampRequest, Request, ShowRequest, TrackerRequest
from rhot_app.simulator.render.camera_controls import Lamp
from rhot_app.simulator.render.exposure_samples import FrameTime, Shutter
from rhot_app.simulator.render.painter import Painter
from rhot_app.simulator.scene.background import background_image
from rhot_app.simulator.scene.scene import Scene
from rhot_app.simulator.scene.scene_description import RulerShow, Show

TAKE_UP_S = 5.0
"""A change is taken up with the next frame; a twin that needs longer is stuck."""


TRACKER_KEPT_NS = 1_000_000_000
"""ns: the foreign tracker's poses that may still be asked for."""


@dataclass(frozen=True, eq=False)
class Setting:
    """What stands on the stage. `painters`: one per camera; `covered`: names of the cameras that see nothing of it."""

    show: Show
    scene_object: SceneObject
    painters: tuple[Painter, ...]
    lamp: Lamp
    covered: frozenset[str] = frozenset()


class LiveScene:
    """`perform` changes the setting; the cameras take the new one with `take`."""

    def __init__(self, scene: Scene, show: Show) -> None:
        """Raises SimulatorError, RigError, CalibrationError when the show cannot be."""
        self._scene = scene
        self.backgrounds = [background_image(scene.settings.background, scene.camera(index), scene.settings.distance_m,
                                              scene.seed) for index in range(len(scene.names))]
        """What each camera sees behind everything, (3, H, W)."""
        self._build(RulerShow(), Lamp())  # compiles what paper is drawn with, before any node waits for frames
        self._changed = threading.Condition()
        self._setting = self._build(show, scene.settings.lamp)
        self._taken = self._setting
        self.playing: tuple[SceneObject, int] | None = None
        """What moves before the cameras, and the monotonic time of its scene time 0, ns; the cameras set it."""
        self._tracker = ForeignTracker(scene.seed)
        self.report: dict[str, Any] = {}
        """What the cameras say about themselves, for `StateRequest`."""

    @property
    def setting(self) -> Setting:
        """What stands on the stage."""
        return self._setting

    def take(self) -> Setting | None:
        """The setting, when it is not the one taken last."""
        with self._changed:
            if self._setting is self._taken:
                return None
            self._taken = self._setting
            self._changed.notify_all()
            return self._setting

    def perform(self, request: Request) -> dict[str, Any]:
        """Do what is asked and wait until the cameras show it. Raises SimulatorError, RigError, CalibrationError."""
        now = self._setting
        if isinstance(request, TrackerRequest):
            return {"poses": self._tracker_rows(request.since_ns)}
        if isinstance(request, ShowRequest):
            self._put(replace(self._build(request.what, now.lamp), covered=now.covered))
        elif isinstance(request, LampRequest):
            try:
                self._put(replace(now, lamp=request.change(now.lamp)))
            except msgspec.ValidationError as exc:
                raise SimulatorError(f"there is no such lamp: {exc}") from exc
        elif isinstance(request, CoverRequest):
            self._cover(request.cameras)
        setting = self._setting
        return {"name": setting.scene_object.name, "show": setting.show, "lamp": setting.lamp,
                "covered": sorted(setting.covered), **self.report}

    def _tracker_rows(self, since_ns: int) -> list[tuple[int, list[float]]]:
        """(monotonic time, ns; position and quaternion) after `since_ns`, of the last second."""
        if self.playing is None:
            return []
        (scene_object, began_ns), step_ns, now_ns = self.playing, round(1e9 / RATE_HZ), time.monotonic_ns()
        first = max(since_ns, now_ns - TRACKER_KEPT_NS) // step_ns + 1
        times_ns = step_ns * np.arange(first, now_ns // step_ns + 1)
        ids = self._scene.markers.ids
        marker = ids.index("index") if "index" in ids else 0
        rows = self._tracker.rows(scene_object, marker, 1e-9 * (times_ns - began_ns).astype(np.float64))
        return list(zip(times_ns.tolist(), rows.tolist(), strict=True))

    def _cover(self, cameras: tuple[str, ...]) -> None:
        strangers = [name for name in cameras if name not in self._scene.names]
        if strangers:
            raise SimulatorError(f"there is no camera {strangers[0]!r} to cover, only {', '.join(self._scene.names)}.")
        covered = frozenset(cameras)
        if covered != self._setting.covered:
            self._put(replace(self._setting, covered=covered))

    def _build(self, show: Show, lamp: Lamp) -> Setting:
        """An act with painters that have painted once: nothing is loaded or compiled in the cameras' time."""
        scene = self._scene
        scene_object = make_object(show, scene)
        painters = tuple(scene_object.painter(scene.camera(index), background, scene.settings.shading,
                                              camera_seed(scene, index))
                         for index, background in enumerate(self.backgrounds))
        shutter = Shutter(1e-9 * scene.exposure_ns, 1e-9 * scene.row_time_ns)
        for painter in painters:
            painter.paint(scene_object.source, FrameTime(shutter, scene.preset.height, 0.0), 0)
        return Setting(show, scene_object, painters, lamp)

    def _put(self, setting: Setting) -> None:
        with self._changed:
            self._setting = setting
            if not self._changed.wait_for(lambda: self._taken is setting, TAKE_UP_S):
                raise SimulatorError(f"the simulated cameras did not take up the change within {TAKE_UP_S:.0f} s.")
