"""The process that runs the nodes of a set of cameras: ``python -m rhot_app.sources.cameras.serve --rig RIG``.

It writes the nodes' ports into the rig file and prints one JSON line when all are ready. It starts a node again that
has died, and ends on SIGTERM with all. With ``--while-locked`` it also ends when the program that started it and the
engine have ended.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from rhot_app.errors import SourceError
from rhot_app.project import load_rig, save_rig
from rhot_app.sources.cameras.camera_set import CameraSet, camera_set_of, node_settings, nodes_folder, with_ports
from rhot_app.sources.local_nodes import POLL_S, NodeSupervisor, add_serve_arguments, serve, settings_path
from rhot_node.config import NodeSettings, load_settings
from rhot_node.errors import SettingsError
from rhot_node.files import write_atomically
from rhot_node.terminal import cut_log

_BEGIN_NS = 300_000_000
"""From the moment that all films are open until they begin."""


class Films:
    """Has the films of a set begin at one instant, also after the node of one was started again."""

    def __init__(self, cameras: CameraSet, start: Path) -> None:
        self._films = [number for number, camera in enumerate(cameras.cameras) if camera.film]
        self._start = start
        self._again: set[int] = set()  # started again, and not ready yet
        self._waiting = False  # for all, to begin together
        self.specs = [f"{camera.spec}?start={start}" if camera.film else camera.spec for camera in cameras.cameras]

    def begin(self) -> None:
        """Let all films play from the same instant."""
        write_atomically(self._start, str(time.monotonic_ns() + _BEGIN_NS).encode())

    def follow(self, supervisor: NodeSupervisor) -> None:
        """Have dead nodes started again; all films begin anew with the one of a dead node."""
        if any(not supervisor.nodes[number].alive for number in self._films):
            self._start.unlink(missing_ok=True)
        self._again |= set(supervisor.step()) & set(self._films)

        def ready(numbers: Iterable[int]) -> bool:
            return all(supervisor.nodes[number].alive and supervisor.nodes[number].ready_waits for number in numbers)
        if self._again and ready(self._again):
            for number in set(self._films) - self._again:
                supervisor.start_again(number)
            self._again.clear()
            self._waiting = True
        if self._waiting and ready(self._films):
            self._waiting = False
            self.begin()


def run(rig_path: Path, log_path: Path | None, over: Callable[[], bool]) -> None:
    """Run until `over` or interrupted (KeyboardInterrupt). Raises RhotError, NodeError, OSError."""
    cameras, rig, folder = camera_set_of(rig_path), load_rig(rig_path), nodes_folder(rig_path)
    if cameras is None or len(cameras.cameras) != len(rig.nodes):
        raise SourceError(f"{rig_path}: its list of cameras is missing. Choose the cameras again.")
    films = Films(cameras, folder / "start")
    settings = [node_settings(camera, node, rig, _kept_settings(folder, node.name))
                for camera, node in zip(cameras.cameras, rig.nodes, strict=True)]
    (folder / "start").unlink(missing_ok=True)
    with contextlib.closing(NodeSupervisor(folder, settings, films.specs, loop=True)) as supervisor:
        save_rig(rig_path, with_ports(rig, supervisor.wait_ready()))
        films.begin()
        print(json.dumps({"event": "ready", "rig": str(rig_path), "pid": os.getpid()}), flush=True)
        while not over():
            films.follow(supervisor)
            if log_path is not None:
                cut_log(log_path)
            time.sleep(POLL_S)


def _kept_settings(folder: Path, name: str) -> NodeSettings | None:
    with contextlib.suppress(SettingsError):
        return load_settings(settings_path(folder, name))
    return None


def main(arguments: Sequence[str] | None = None) -> int:
    """The process; exit code 0 when ended by a signal, 2 after an error."""
    parser = argparse.ArgumentParser(prog="python -m rhot_app.sources.cameras.serve",
                                     description="Nodes of this computer's cameras.")
    parser.add_argument("--rig", type=Path, required=True, help="rig file of a set of cameras")
    parser.add_argument("--log", type=Path, help="file that standard error goes to, which is kept short")
    add_serve_arguments(parser)
    args = parser.parse_args(arguments)
    return serve(lambda over: run(args.rig, args.log, over), args.while_locked)


if __name__ == "__main__":
    sys.exit(main())
