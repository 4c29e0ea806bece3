"""An engine in its directory with everything around it: lock, sockets, threads, signals. Shared by the commands."""

from __future__ import annotations

import contextlib
import gc
import os
import signal
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import zmq

from rhot_app.engine.core import Engine, MakeSource, MakeTracker
from rhot_app.engine.directory import EngineDirectory, EngineLock, open_directory
from rhot_app.engine.node_control import NodeControl
from rhot_app.engine.output_process import OutputProcess
from rhot_app.engine.server import Server, StatePublisher
from rhot_app.project import OutputSettings, Rig
from rhot_app.sources.realtime import share_interpreter
from rhot_app.tracking.make import make_tracker
from rhot_node.compiled import announce_compilation
from rhot_node.keys import KeyPair

_COLLECT_S = 5.0


@dataclass(frozen=True, slots=True)
class Serving:
    """An engine that serves clients."""

    engine: Engine
    server: Server
    directory: EngineDirectory
    states: StatePublisher


@contextlib.contextmanager
def serving(rig: Rig, rig_path: Path | None, make_source: MakeSource, directory: Path | None,
            own: KeyPair | None = None, outputs: Iterable[OutputSettings] = (),
            rig_outputs: bool = True, trackers: MakeTracker = make_tracker) -> Iterator[Serving]:
    """An engine in its directory, warmed up, frames passing; the caller runs the server. `own`: the master's keys.
    `outputs`: opened besides those of the rig; these are left out without `rig_outputs`. `trackers`: makes
    the tracker of a rig.

    Raises EngineError when another engine holds the directory, SourceError when a port is taken, OutputError for an
    output that cannot be.
    """
    announce_compilation()
    place = open_directory(directory)
    lock = EngineLock(place)
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
    with contextlib.ExitStack() as stack:
        stack.callback(lock.release)
        stack.callback(context.destroy, 0)
        publish = StatePublisher(context, place)
        nodes = NodeControl(context, own)
        streams = OutputProcess(place.states, outputs, follow_rig=rig_outputs)
        stack.callback(streams.close)
        engine = Engine(rig, rig_path, make_source, trackers, publish, nodes.message, GarbageMan(), streams,
                        nodes.black)
        stack.callback(engine.close)
        server = Server(context, place, engine, nodes)
        stack.callback(server.close)
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, lambda *_: server.end())
        prepare_process()
        streams.settle()  # whoever is told an address finds it open
        yield Serving(engine, server, place, publish)


def prepare_process() -> None:
    """Keep the interpreter out of a sample's way."""
    share_interpreter()
    with contextlib.suppress(OSError):
        os.nice(-5)
    gc.collect()
    gc.freeze()
    gc.disable()  # collected between states, by the `GarbageMan`


class GarbageMan:
    """Collects garbage now and then. Called after a state: that is the longest moment before the next frame."""

    def __init__(self) -> None:
        self._collected_s = time.monotonic()

    def __call__(self) -> None:
        """Collect when it is due."""
        if time.monotonic() - self._collected_s > _COLLECT_S:
            gc.collect()
            self._collected_s = time.monotonic()
