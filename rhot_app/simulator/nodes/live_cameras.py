"""The live twin's cameras: rendered in turn, handed over when a sensor would have read them out, told by nodes."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import msgspec

from rhot_app.simulator.nodes.frame_socket import FrameSocket
from rhot_app.simulator.nodes.shot import renderer_of
from rhot_app.simulator.render.exposure_samples import Shutter
from rhot_app.simulator.render.render import FrameRenderer
from rhot_app.simulator.scene.camera_controls import controls_of
from rhot_app.simulator.scene.live_scene import LiveScene, Setting
from rhot_app.simulator.scene.scene import Scene
from rhot_node.capture.pace import available_delay_ns, sleep_until
from rhot_node.capture.stream import StreamHeader
from rhot_node.config import CameraSettings

CORE_SHARE = 0.6
"""Part of one processor core that rendering may take; engine, nodes and window need the rest."""

RATE_MAX_HZ = 30.0
_SMOOTHING = 0.1  # of the measured cost of a frame


class LiveCameras:
    """Renders every camera in turn. `step` is one frame of each."""

    def __init__(self, scene: Scene, stage: LiveScene, sockets: Sequence[FrameSocket]) -> None:
        self._scene, self._stage, self._sockets = scene, stage, sockets
        self._setting = stage.setting
        self._renderers = [renderer_of(scene, index, painter, background) for index, (painter, background)
                           in enumerate(zip(self._setting.painters, stage.backgrounds, strict=True))]
        for renderer in self._renderers:
            # compiles on the first start; no node waits for it yet
            renderer.render(self._setting.scene_object.source, 0.0, 0)
        self._began_ns = self._tick_ns = time.monotonic_ns()
        self._number = 0
        self._cost_s = 0.0

    @property
    def period_s(self) -> float:
        """Time from frame to frame: the preset's, or what this machine can sustain."""
        preset_s = 1.0 / min(self._scene.preset.fps, RATE_MAX_HZ)
        return max(preset_s, self._cost_s / CORE_SHARE)

    def report(self) -> dict[str, Any]:
        """The settings that each camera obeys, by the camera's name."""
        return {name: {"exposure_us": round(1e6 * renderer.exposure.shutter.exposure_s, 1),
                       **msgspec.to_builtins(renderer.exposure.controls)}
                for name, renderer in zip(self._scene.names, self._renderers, strict=True)}

    def step(self) -> None:
        """One frame of every camera."""
        setting = self._stage.take()
        if setting is not None and setting is not self._setting:
            self._change(setting)
        cost = 0.0
        for index in sorted(range(len(self._sockets)), key=lambda index: self._scene.phases_s[index]):
            began = time.thread_time()
            told = self._sockets[index].hear()
            if told is not None:
                self._obey(self._renderers[index], told)
            cost += self._expose(index, began)
        self._cost_s += (cost - self._cost_s) * (1.0 if self._number == 0 else _SMOOTHING)
        self._number += 1
        # A late tick is not made up for: frames in a burst would look like a camera that no sensor is.
        self._tick_ns = max(self._tick_ns + round(1e9 * self.period_s), time.monotonic_ns() - self._delay_ns(0))

    def _expose(self, index: int, began: float) -> float:
        """Render and hand over one camera's frame; returns the processor time since `began`, s."""
        scene, renderer = self._scene, self._renderers[index]
        t_ns = self._tick_ns + round(1e9 * scene.phases_s[index])
        frame, _ = renderer.render(self._setting.scene_object.source, 1e-9 * (t_ns - self._began_ns), self._number)
        cost = time.thread_time() - began
        sleep_until(t_ns + self._delay_ns(index))
        header = StreamHeader(scene.preset.width, scene.preset.height, self._number, t_ns, self._exposure_ns(index),
                              scene.row_time_ns)
        self._sockets[index].send(header, frame)
        return cost

    def _exposure_ns(self, index: int) -> int:
        return round(1e9 * self._renderers[index].exposure.shutter.exposure_s)

    def _delay_ns(self, index: int) -> int:
        return available_delay_ns(self._exposure_ns(index), self._scene.row_time_ns, self._scene.preset.height)

    def _change(self, setting: Setting) -> None:
        """What is new on the stage; a new act begins now."""
        for name, renderer, painter in zip(self._scene.names, self._renderers, setting.painters, strict=True):
            if setting.scene_object is not self._setting.scene_object:
                renderer.show(painter)
            exposure = replace(renderer.exposure, lamp=setting.lamp, covered=name in setting.covered)
            if exposure != renderer.exposure:
                renderer.expose(exposure)
        if setting.scene_object is not self._setting.scene_object:
            self._began_ns = self._tick_ns
        self._setting = setting

    def _obey(self, renderer: FrameRenderer, told: CameraSettings) -> None:
        """As a sensor does what its driver says. No exposure outlasts a frame; size and rate are the preset's."""
        exposure_s = min(1e-6 * told.exposure_us, 1.0 / self._scene.preset.fps)
        shutter = Shutter(exposure_s, renderer.exposure.shutter.row_time_s)
        renderer.expose(replace(renderer.exposure, shutter=shutter, controls=controls_of(told)))
