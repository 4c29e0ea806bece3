"""The live twin: a process that renders both cameras as fast as the machine allows, for two real node daemons.

``python -m rhot_app.simulator.live --directory DIR --rig OUT.json``. It writes a rig file with the daemons' real ports,
prints one JSON line when all is ready, and others about its pace later on (docs/twin.md), starts a daemon again that
has died, and ends on SIGTERM with both.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import signal
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from rhot_app.errors import RhotError
from rhot_app.project import save_rig
from rhot_app.simulator.frame_socket import FrameSocket
from rhot_app.simulator.nodes import READY_TIMEOUT_S, NodePorts, TwinNode
from rhot_app.simulator.pace import Pace
from rhot_app.simulator.scene import Scene, build_rig, node_settings
from rhot_app.simulator.shot import Shot, make_renderer, make_shot
from rhot_app.simulator.simulate_command import add_scene_arguments, scene_of
from rhot_node.capture.pace import available_delay_ns, sleep_until
from rhot_node.capture.stream import StreamHeader
from rhot_node.errors import NodeError

CORE_SHARE = 0.6
"""Part of one processor core that rendering may take; engine, nodes and window need the rest."""

RATE_MAX_HZ = 30.0
_RESTART_PAUSE_S = 0.5
_SMOOTHING = 0.1  # of the measured cost of a frame
_NICE = 5


class LiveCameras:
    """Renders both cameras in turn and hands each frame over when a real sensor would have read it out."""

    def __init__(self, shot: Shot, sockets: Sequence[FrameSocket]) -> None:
        self._shot = shot
        self._sockets = sockets
        self._renderers = [make_renderer(shot, index) for index in range(len(sockets))]
        scene = shot.scene
        self._delay_ns = available_delay_ns(scene.exposure_ns, scene.row_time_ns, scene.preset.height)
        for renderer in self._renderers:
            renderer.render(shot.act.source, 0.0, 0)  # compiles on the first start of all; no node waits for it yet
        self._origin_ns = time.monotonic_ns()
        self._tick_ns = self._origin_ns
        self._number = 0
        self._cost_s = 0.0

    @property
    def period_s(self) -> float:
        """Time from frame to frame: the preset's, or what this machine can sustain."""
        preset_s = 1.0 / min(self._shot.scene.preset.fps, RATE_MAX_HZ)
        return max(preset_s, self._cost_s / CORE_SHARE)

    def step(self) -> None:
        """One frame of every camera."""
        scene, preset = self._shot.scene, self._shot.scene.preset
        order = sorted(range(len(self._sockets)), key=lambda index: scene.phases_s[index])
        cost = 0.0
        for index in order:
            t_ns = self._tick_ns + round(1e9 * scene.phases_s[index])
            began = time.thread_time()
            t_s = 1e-9 * (t_ns - self._origin_ns)
            frame, _ = self._renderers[index].render(self._shot.act.source, t_s, self._number)
            cost += time.thread_time() - began
            sleep_until(t_ns + self._delay_ns)
            self._sockets[index].send(StreamHeader(preset.width, preset.height, self._number, t_ns, scene.exposure_ns,
                                                   scene.row_time_ns), frame)
        self._cost_s += (cost - self._cost_s) * (1.0 if self._number == 0 else _SMOOTHING)
        self._number += 1
        # A late tick is not made up for: frames in a burst would look like a camera that no sensor is.
        self._tick_ns = max(self._tick_ns + round(1e9 * self.period_s), time.monotonic_ns() - self._delay_ns)


class Supervisor:
    """Keeps one daemon per camera alive, on the ports it had first."""

    def __init__(self, scene: Scene, directory: Path) -> None:
        self._scene, self._directory = scene, directory
        self._nodes = [self._start(index, None) for index in range(len(scene.names))]
        self._ports: list[NodePorts] = []
        self._died_s: dict[int, float] = {}

    def _start(self, index: int, ports: NodePorts | None) -> TwinNode:
        camera = f"stream:{socket_path(self._directory, self._scene.names[index])}"
        return TwinNode(self._directory, node_settings(self._scene, index, ports=ports), camera)

    def ports(self, deadline_s: float) -> list[NodePorts] | None:
        """The daemons' ports, once all have said them; None before. Raises SimulatorError when one cannot start."""
        while len(self._ports) < len(self._nodes):
            node = self._nodes[len(self._ports)]
            if not node.ready_waits and node.alive and time.monotonic() < deadline_s:
                return None
            self._ports.append(node.wait_ready(deadline_s))
        return self._ports

    def step(self) -> None:
        """Start again what has died, a moment later."""
        for index, node in enumerate(self._nodes):
            if node.alive:
                continue
            died = self._died_s.setdefault(index, time.monotonic())
            if time.monotonic() - died >= _RESTART_PAUSE_S:
                node.close()
                self._nodes[index] = self._start(index, self._ports[index])
                del self._died_s[index]

    def close(self) -> None:
        """End every daemon."""
        for node in self._nodes:
            node.close()


def socket_path(directory: Path, name: str) -> Path:
    """Where the frames of the camera `name` are offered."""
    return directory / f"{name}.frames"


def run(scene: Scene, motion: str, directory: Path, rig_path: Path) -> None:
    """Run until interrupted (KeyboardInterrupt). Raises RhotError, NodeError."""
    directory.mkdir(parents=True, exist_ok=True)
    shot = make_shot(scene, motion, 1.0)
    with contextlib.ExitStack() as stack:
        sockets = [stack.enter_context(contextlib.closing(FrameSocket(socket_path(directory, name))))
                   for name in scene.names]
        cameras = LiveCameras(shot, sockets)
        supervisor = stack.enter_context(contextlib.closing(Supervisor(scene, directory)))
        deadline = time.monotonic() + READY_TIMEOUT_S
        ready, pace = False, Pace(scene.preset.fps)
        while True:
            cameras.step()
            if ready:
                supervisor.step()
                event = pace.note(time.monotonic())
                if event is not None:
                    print(json.dumps(event), flush=True)
            elif (ports := supervisor.ports(deadline)) is not None:
                save_rig(rig_path, build_rig(scene, tuple(ports)))
                print(json.dumps({"event": "ready", "rig": str(rig_path), "pid": os.getpid()}), flush=True)
                ready = True


def main(arguments: Sequence[str] | None = None) -> int:
    """The process; exit code 0 when ended by a signal, 2 after an error."""
    parser = argparse.ArgumentParser(prog="python -m rhot_app.simulator.live", description="Simulated rig, live.")
    add_scene_arguments(parser)
    parser.add_argument("--directory", type=Path, required=True, help="folder for sockets, settings and logs")
    parser.add_argument("--rig", type=Path, required=True, help="rig file to write when the nodes are ready")
    args = parser.parse_args(arguments)
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    with contextlib.suppress(OSError):
        os.nice(_NICE)
    try:
        run(scene_of(args), args.motion, args.directory.absolute(), args.rig.absolute())
    except (RhotError, NodeError) as exc:
        print(f"rhot: {exc}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 0
    return 0


if __name__ == "__main__":
    sys.exit(main())
