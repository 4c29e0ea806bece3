"""The live twin: a process that renders both cameras as fast as the machine allows, for two real node daemons.

``python -m rhot_app.simulator.nodes.live --directory DIR --rig OUT.json``. It writes a rig file with the daemons' real
ports and prints one JSON line when all is ready, later others about its pace. It shows what its clients ask for
(docs/twin.md), starts a daemon again that has died, and ends on SIGTERM with both.
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
from rhot_app.simulator.nodes.frame_socket import FrameSocket
from rhot_app.simulator.nodes.live_cameras import LiveCameras
from rhot_app.simulator.nodes.nodes import READY_TIMEOUT_S
from rhot_app.simulator.nodes.pace import Pace
from rhot_app.simulator.nodes.supervisor import Supervisor, socket_path
from rhot_app.simulator.nodes.twin_server import TwinServer
from rhot_app.simulator.scene.live_scene import LiveScene
from rhot_app.simulator.scene.scene import Scene, build_rig
from rhot_app.simulator.scene.scene_arguments import add_show_arguments, show_of
from rhot_app.simulator.scene.scene_description import Show
from rhot_app.simulator.simulate_command import add_scene_arguments, scene_of
from rhot_node.errors import NodeError

_NICE = 5


def run(scene: Scene, show: Show, directory: Path, rig_path: Path) -> None:
    """Run until interrupted (KeyboardInterrupt). Raises RhotError, NodeError."""
    directory.mkdir(parents=True, exist_ok=True)
    stage = LiveScene(scene, show)
    with contextlib.ExitStack() as stack:
        sockets = [stack.enter_context(contextlib.closing(FrameSocket(socket_path(directory, name))))
                   for name in scene.names]
        door = stack.enter_context(contextlib.closing(TwinServer(directory, stage.perform)))
        cameras = LiveCameras(scene, stage, sockets)
        supervisor = stack.enter_context(contextlib.closing(Supervisor(scene, directory)))
        deadline = time.monotonic() + READY_TIMEOUT_S
        while (ports := supervisor.ports(deadline)) is None:
            cameras.step()
        save_rig(rig_path, build_rig(scene, tuple(ports)))
        door.start()
        print(json.dumps({"event": "ready", "rig": str(rig_path), "pid": os.getpid()}), flush=True)
        pace = Pace(scene.preset.fps)
        while True:
            cameras.step()
            supervisor.step()
            event = pace.note(time.monotonic())
            if event is not None:
                print(json.dumps(event), flush=True)
            stage.report = {"cameras": cameras.report(), "rate_hz": round(pace.rate_hz, 1),
                            "preset_hz": scene.preset.fps}


def main(arguments: Sequence[str] | None = None) -> int:
    """The process; exit code 0 when ended by a signal, 2 after an error."""
    parser = argparse.ArgumentParser(prog="python -m rhot_app.simulator.nodes.live", description="Simulated rig, live.")
    add_scene_arguments(parser)
    add_show_arguments(parser)
    parser.add_argument("--directory", type=Path, required=True, help="folder for sockets, settings and logs")
    parser.add_argument("--rig", type=Path, required=True, help="rig file to write when the nodes are ready")
    args = parser.parse_args(arguments)
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    with contextlib.suppress(OSError):
        os.nice(_NICE)
    try:
        run(scene_of(args), show_of(args), args.directory.absolute(), args.rig.absolute())
    except (RhotError, NodeError) as exc:
        print(f"rhot: {exc}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 0
    return 0


if __name__ == "__main__":
    sys.exit(main())
