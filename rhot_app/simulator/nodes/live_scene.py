"""What the live twin shows and by which light: changed from one thread, taken up by the cameras between two frames."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass, replace
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rhot_app.errors import SimulatorError
from rhot_app.estimation.se3 import quaternion_from_rotation
from rhot_app.geometry.transforms import rigid
from rhot_app.simulator.film.scene_objects import SceneObject, make_object
from rhot_app.simulator.film.shot import camera_seed
from rhot_app.simulator.nodes.remote import CoverRequest, LampRequest, Request, ShowRequest, TrackerRequest
from rhot_app.simulator.render.body import HandBody
from rhot_app.simulator.render.camera_controls import Lamp
from rhot_app.simulator.render.exposure_samples import FrameTime, Shutter
from rhot_app.simulator.render.painter import Painter, lit_image
from rhot_app.simulator.scene.background import background_image
from rhot_app.simulator.scene.scene import Scene
from rhot_app.simulator.scene.scene_description import RulerShow, Show

Array = NDArray[np.float64]

RATE_HZ = 120.0
DELAY_S = 0.037
"""s: what it reports at an instant is the pose of so long ago."""

NOISE_M, NOISE_RAD = 0.1e-3, 0.05e-2
"""m and rad, of an axis: of the order of a Vive's at rest (Niehorster, Li and Lappe 2017)."""

_WORLD_M, _LEVER_M = 1.0, 0.06  # how far its world's origin and it itself are away
_SEED = 0x51FE


class ForeignTracker:
    """Everything random in it is drawn from the scene's `seed`. On a hand it sits at the index fingertip, else at the
    origin of what is shown."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng([seed, _SEED])
        self.foreign_from_rig = rigid(Rotation.random(random_state=rng).as_matrix(),
                                      rng.uniform(-_WORLD_M, _WORLD_M, 3))
        away = rng.normal(size=3)
        self.body_from_tracker = rigid(Rotation.random(random_state=rng).as_matrix(),
                                       _LEVER_M * away / np.linalg.norm(away))
        self._noise = rng

    def rows(self, scene_object: SceneObject, marker: int, times_s: Array) -> Array:
        """(N, 7): position, m, and quaternion wxyz in its own world, reported at scene times (N,), s. `marker` is the
        number of the fingertip's in the set."""
        poses = self.foreign_from_rig @ world_from_body(scene_object, marker, times_s - DELAY_S)
        poses = poses @ self.body_from_tracker
        turns = Rotation.from_rotvec(self._noise.normal(0.0, NOISE_RAD, (len(times_s), 3))).as_matrix()
        places = poses[:, :3, 3] + self._noise.normal(0.0, NOISE_M, (len(times_s), 3))
        quaternions = [quaternion_from_rotation(turn) for turn in poses[:, :3, :3] @ turns]
        return np.column_stack([places, np.array(quaternions).reshape(-1, 4)])


def world_from_body(scene_object: SceneObject, marker: int, times_s: Array) -> Array:
    """(N, 4, 4) m: the segment that carries a hand's marker, its origin at the marker; another thing's own pose."""
    transforms, angles = scene_object.source.sample(times_s)
    if isinstance(scene_object.thing, HandBody):
        return scene_object.thing.marker_poses(transforms, angles, marker)
    return transforms


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
        painters = tuple(scene_object.painter(scene.camera(index), scene.settings.shading, camera_seed(scene, index))
                         for index in range(len(scene.names)))
        shutter = Shutter(1e-9 * scene.exposure_ns, 1e-9 * scene.row_time_ns)
        for painter, background in zip(painters, self.backgrounds, strict=True):
            painter.paint(lit_image(background, np.ones(3)), scene_object.source,
                          FrameTime(shutter, scene.preset.height, 0.0), 0)
        return Setting(show, scene_object, painters, lamp)

    def _put(self, setting: Setting) -> None:
        with self._changed:
            self._setting = setting
            if not self._changed.wait_for(lambda: self._taken is setting, TAKE_UP_S):
                raise SimulatorError(f"the simulated cameras did not take up the change within {TAKE_UP_S:.0f} s.")
