"""The live twin's cameras: rendered in turn, handed over when a sensor would have read them out, told by nodes."""

from __future__ import annotations

import contextlib
import select
import socket
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
from numpy.typing import NDArray

from rhot_app.errors import SimulatorError
from rhot_app.simulator.film.shot import renderer_of
from rhot_app.simulator.nodes.live_scene import LiveScene, Setting
from rhot_app.simulator.render.camera_controls import controls_of
from rhot_app.simulator.render.exposure_samples import Shutter
from rhot_app.simulator.render.render import FrameRenderer
from rhot_app.simulator.scene.scene import Scene
from rhot_node.capture.camera import available_delay_ns, sleep_until
from rhot_node.capture.stream import StreamHeader, pack_header, take_settings
from rhot_node.config import CameraSettings
from rhot_node.errors import CameraError

# Frames go out; what the node tells its camera comes in.

_WAIT_S = 0.25  # for a node to take a frame; the rest of it then goes with the next ones, which are lost
STUCK_S = 10.0
"""A node that takes no byte for so long is stuck; it may connect again."""

_BUFFER_BYTES = 1 << 20


class FrameSocket:
    """Listens at `path`; frames go to whichever node connected last and are lost while there is none, or while it is
    behind: on a busy computer a node may not run for a while."""

    def __init__(self, path: Path, stuck_s: float = STUCK_S) -> None:
        """Raises SimulatorError when the socket cannot be made."""
        self._path = path
        self._peer: socket.socket | None = None
        self._received = bytearray()
        self._rest = memoryview(b"")  # of the last frame
        self._stuck_s, self._taken_s = stuck_s, 0.0
        self._listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            path.unlink(missing_ok=True)
            self._listener.bind(str(path))
        except OSError as exc:
            raise SimulatorError(f"{path}: no socket for frames can be made there ({exc}).") from exc
        self._listener.setblocking(False)
        self._listener.listen(4)

    def hear(self) -> CameraSettings | None:
        """Let in a node that waits, and return what a node has told its camera since the last call; None: nothing."""
        self._accept()
        wanted = None
        if self._peer is not None:
            try:
                if select.select([self._peer], [], [], 0.0)[0]:
                    self._received += self._peer.recv(_BUFFER_BYTES)
                while (settings := take_settings(self._received)) is not None:
                    wanted = settings
            except (OSError, CameraError):
                self._drop()
        return wanted

    def send(self, header: StreamHeader, frame: NDArray[Any]) -> bool:
        """Send one packed I420 frame to the node that `hear` has let in; False when there is none to take it, or it has
        not taken the one before."""
        behind = bool(self._rest)
        if self._peer is not None and not behind:
            self._rest = memoryview(pack_header(header) + frame.tobytes())
        self._hand_over(0.0 if behind else _WAIT_S)
        return self._peer is not None and not behind

    def _hand_over(self, wait_s: float) -> None:
        """What the node takes within `wait_s`."""
        now_s = time.monotonic()
        end_s = now_s + wait_s
        try:
            while self._peer is not None and self._rest:
                if select.select([], [self._peer], [], max(0.0, end_s - now_s))[1]:
                    self._rest = self._rest[self._peer.send(self._rest):]
                    self._taken_s = now_s = time.monotonic()
                elif time.monotonic() - self._taken_s > self._stuck_s:
                    self._drop()
                else:
                    return
        except OSError:
            self._drop()

    def _accept(self) -> None:
        """A new connection replaces the old one: the node has come back."""
        with contextlib.suppress(BlockingIOError):
            while True:
                peer, _ = self._listener.accept()
                self._drop()
                peer.setblocking(False)
                peer.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _BUFFER_BYTES)
                self._peer, self._taken_s = peer, time.monotonic()

    def _drop(self) -> None:
        if self._peer is not None:
            self._peer.close()
            self._peer = None
        self._rest = memoryview(b"")
        self._received.clear()

    def close(self) -> None:
        """Close and remove the socket. May be called twice."""
        self._drop()
        self._listener.close()
        with contextlib.suppress(OSError):
            self._path.unlink()


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
        stage.playing = self._setting.scene_object, self._began_ns
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
            wanted = self._sockets[index].hear()
            if wanted is not None:
                self._obey(self._renderers[index], wanted)
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
            self._stage.playing = setting.scene_object, self._began_ns
        self._setting = setting

    def _obey(self, renderer: FrameRenderer, wanted: CameraSettings) -> None:
        """As a sensor does what its driver says. No exposure outlasts a frame; size and rate are the preset's."""
        exposure_s = min(1e-6 * wanted.exposure_us, 1.0 / self._scene.preset.fps)
        shutter = Shutter(exposure_s, renderer.exposure.shutter.row_time_s)
        renderer.expose(replace(renderer.exposure, shutter=shutter, controls=controls_of(wanted)))


WINDOW_S = 2.0
"""Rates are means over this long: a single late frame is none of the user's business."""

SHORT = 0.95  # of the preset's rate: below it the rig is slow
CHANGE = 0.15  # of the rate said last: what is worth saying again


class Pace:
    """Counts frames; `note` returns what to say, seldom."""

    def __init__(self, preset_hz: float) -> None:
        self._preset_hz = preset_hz
        self._began_s: float | None = None
        self._frames = 0
        self._said_hz = preset_hz
        self.rate_hz = 0.0
        """Frames per second, of late; 0 until that is known."""

    def note(self, now_s: float) -> dict[str, Any] | None:
        """A frame is out at monotonic time `now_s`. Returns an event for programs to read, or None:
        ``{"event": "slow", "achieved_hz": 21.4, "preset_hz": 40.0, "text": sentence}``, and once the rate is back
        ``{"event": "in_time", ...}`` with the same fields."""
        if self._began_s is None:
            self._began_s = now_s
            return None
        self._frames += 1
        if now_s - self._began_s < WINDOW_S:
            return None
        achieved_hz = self._frames / (now_s - self._began_s)
        self._began_s, self._frames, self.rate_hz = now_s, 0, achieved_hz
        slow, was_slow = (rate < SHORT * self._preset_hz for rate in (achieved_hz, self._said_hz))
        if slow == was_slow and (not slow or abs(achieved_hz - self._said_hz) < CHANGE * self._said_hz):
            return None
        self._said_hz = achieved_hz
        return {"event": "slow" if slow else "in_time", "achieved_hz": round(achieved_hz, 1),
                "preset_hz": self._preset_hz, "text": self._sentence(achieved_hz, slow)}

    def _sentence(self, achieved_hz: float, slow: bool) -> str:
        if not slow:
            return f"The simulated cameras run at their {self._preset_hz:g} frames per second again."
        return (f"The simulated cameras run at {achieved_hz:.0f} instead of {self._preset_hz:g} frames per second: "
                "rendering takes only what this machine can spare. Rates and latency are not those of a real rig.")
