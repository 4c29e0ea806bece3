"""The live twin: a process that renders both cameras as fast as the machine allows, for two real node daemons.

``python -m rhot_app.simulator.nodes.live --directory DIR --rig OUT.json``. It writes a rig file with the daemons' real
ports and prints one JSON line when all is ready, later others about its pace. It shows what its clients ask for
(docs/twin.md), starts a daemon again that has died, and ends on SIGTERM with both. With ``--while-locked`` it also ends
when the program that started it and the engine have ended.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import msgspec
import zmq

from rhot_app.errors import RhotError, SimulatorError
from rhot_app.project import save_rig
from rhot_app.simulator.film.scene_objects import with_start_pose, write_held
from rhot_app.simulator.nodes.live_cameras import FrameSocket, LiveCameras, Pace
from rhot_app.simulator.nodes.live_scene import LiveScene
from rhot_app.simulator.nodes.remote import SCENE_NAME, SERVER_NAME, Request, decode_request, refusal, server_address
from rhot_app.simulator.scene.scene import Scene, build_rig, node_settings
from rhot_app.simulator.scene.scene_arguments import add_scene_arguments, add_show_argument, fields_of
from rhot_app.simulator.scene.scene_description import Show
from rhot_app.simulator.scene.scene_file import write_scene
from rhot_app.sources.local_nodes import NodeSupervisor, add_serve_arguments, serve
from rhot_node.errors import NodeError
from rhot_node.network.context import Context
from rhot_node.terminal import cut_log
from rhot_node.threads import Worker

Perform = Callable[[Request], dict[str, Any]]

_REQUEST_MAX = 1 << 16
_POLL_MS = 200


class TwinServer:
    """Answers requests with what `perform` returns, in a thread, so that building a show never holds up the cameras."""

    def __init__(self, directory: Path, perform: Perform) -> None:
        """Open the door; raises SimulatorError when it cannot be opened there."""
        self._path = directory / SERVER_NAME
        self._perform = perform
        self._context = Context()
        self._socket = self._context.socket(zmq.REP)
        self._socket.maxmsgsize = _REQUEST_MAX
        try:
            self._path.unlink(missing_ok=True)
            self._socket.bind(server_address(directory))
        except (zmq.ZMQError, OSError) as exc:
            self._context.destroy(0)
            raise SimulatorError(f"{self._path}: the twin's door cannot be opened there ({exc}).") from exc
        self._worker = Worker("answers the twin's clients", lambda: self.step(_POLL_MS), hang_s=None)

    def start(self) -> None:
        """Serve from now on."""
        self._worker.start()

    def step(self, timeout_ms: int) -> bool:
        """Answer one request; False when none came in time."""
        if not self._socket.poll(timeout_ms):
            return False
        self._socket.send(msgspec.json.encode(self._answer(self._socket.recv())))
        return True

    def close(self) -> None:
        """Close and remove the door. May be called twice."""
        self._worker.close()
        self._context.destroy(0)
        with contextlib.suppress(OSError):
            self._path.unlink()

    def _answer(self, data: bytes) -> dict[str, Any]:
        try:
            return {"ok": True, **self._perform(decode_request(data))}
        except msgspec.DecodeError as exc:
            return refusal(f"the simulated rig cannot do that: {exc}")
        except (RhotError, NodeError) as exc:
            return refusal(str(exc))


def socket_path(directory: Path, name: str) -> Path:
    """Where the frames of the camera `name` are offered."""
    return directory / f"{name}.frames"


_NICE = 5
LOG_NAME = "twin.log"  # where the app has it write (`EngineDirectory.twin_log_file`)


def run(scene: Scene, show: Show, directory: Path, rig_path: Path, over: Callable[[], bool] = lambda: False) -> None:
    """Run until `over` or interrupted (KeyboardInterrupt). Raises RhotError, NodeError."""
    directory.mkdir(parents=True, exist_ok=True)
    stage = LiveScene(scene, show)
    with contextlib.ExitStack() as stack:
        sockets = [stack.enter_context(contextlib.closing(FrameSocket(socket_path(directory, name))))
                   for name in scene.names]
        door = stack.enter_context(contextlib.closing(TwinServer(directory, stage.perform)))
        cameras = LiveCameras(scene, stage, sockets)
        supervisor = stack.enter_context(contextlib.closing(NodeSupervisor(
            directory, [node_settings(scene, index) for index in range(len(scene.names))],
            [f"stream:{socket_path(directory, name)}" for name in scene.names])))
        ports = tuple(supervisor.wait_ready(cameras.step))
        rig = build_rig(scene, ports, write_held(stage.setting.scene_object, rig_path.parent))
        save_rig(rig_path, with_start_pose(rig, stage.setting.scene_object))
        door.start()
        print(json.dumps({"event": "ready", "rig": str(rig_path), "pid": os.getpid()}), flush=True)
        pace = Pace(scene.preset.fps)
        while not over():
            cameras.step()
            supervisor.step()
            cut_log(directory / LOG_NAME)
            event = pace.note(time.monotonic())
            if event is not None:
                print(json.dumps(event), flush=True)
            stage.report = {"cameras": cameras.report(), "rate_hz": round(pace.rate_hz, 1),
                            "preset_hz": scene.preset.fps}


def main(arguments: Sequence[str] | None = None) -> int:
    """The process; exit code 0 when ended by a signal, 2 after an error."""
    parser = argparse.ArgumentParser(prog="python -m rhot_app.simulator.nodes.live", description="Simulated rig, live.")
    add_scene_arguments(parser)
    add_show_argument(parser)
    parser.add_argument("--directory", type=Path, required=True, help="folder for sockets, settings and logs")
    parser.add_argument("--rig", type=Path, required=True, help="rig file to write when the nodes are ready")
    add_serve_arguments(parser)
    args = parser.parse_args(arguments)
    with contextlib.suppress(OSError):
        os.nice(_NICE)

    def start(over: Callable[[], bool]) -> None:
        directory, fields = args.directory.absolute(), fields_of(args)
        directory.mkdir(parents=True, exist_ok=True)
        write_scene(directory / SCENE_NAME, fields)
        run(fields.scene(), fields.shown(), directory, args.rig.absolute(), over)

    return serve(start, args.while_locked)


if __name__ == "__main__":
    sys.exit(main())
