"""An engine in its directory with everything around it: lock, sockets, threads, signals. Shared by the commands."""

from __future__ import annotations

import contextlib
import gc
import logging
import os
import signal
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import zmq

from rhot_app.engine.core import Engine, MakeSource
from rhot_app.engine.directory import EngineDirectory, EngineLock, open_directory
from rhot_app.engine.node_control import NodeControl
from rhot_app.engine.server import Server, StatePublisher
from rhot_app.project import Rig
from rhot_app.sources.realtime import hurry_this_thread
from rhot_app.tracking.make import make_tracker

SWITCH_INTERVAL_S = 1e-4
"""A receiver that wakes up waits no longer than this for the interpreter (Python's default is 5 ms)."""

_COLLECT_S = 5.0
_STEP_S = 0.05

log = logging.getLogger(__name__)


@contextlib.contextmanager
def serving(rig: Rig, rig_path: Path | None, make_source: MakeSource,
            directory: Path | None) -> Iterator[tuple[Engine, Server, EngineDirectory]]:
    """An engine in its directory, warmed up, its pipeline running; the caller runs the server.

    Raises EngineError when another engine holds the directory, SourceError when a port is taken.
    """
    place = open_directory(directory)
    lock = EngineLock(place)
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
    with contextlib.ExitStack() as stack:
        stack.callback(lock.release)
        stack.callback(context.destroy, 0)
        publish = StatePublisher(context, place)
        nodes = NodeControl(context)
        engine = Engine(rig, rig_path, make_source, make_tracker, publish, nodes.message)
        stack.callback(engine.close)
        server = Server(context, place, engine, nodes)
        stack.callback(server.close)
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, lambda *_: server.end())
        prepare_process()
        ending = threading.Event()
        pipeline = threading.Thread(target=_run_pipeline, args=(engine, ending), name="pipeline", daemon=True)
        pipeline.start()
        stack.callback(pipeline.join)
        stack.callback(ending.set)
        yield engine, server, place


def prepare_process() -> None:
    """Keep the interpreter out of a sample's way."""
    sys.setswitchinterval(SWITCH_INTERVAL_S)
    with contextlib.suppress(OSError):
        os.nice(-5)
    gc.collect()
    gc.freeze()
    gc.disable()  # collected between states, see `_run_pipeline`


def _run_pipeline(engine: Engine, ending: threading.Event) -> None:
    hurry_this_thread()
    collected_s = time.monotonic()
    while not ending.is_set():
        try:
            state = engine.step(_STEP_S)
        except Exception as exc:  # a tracker's fault must not end the stream for good
            log.exception("the tracker failed over a frame")
            engine.fail(f"The tracker failed over a frame ({type(exc).__name__}: {exc}) and began anew. "
                        "Record a log and report this.")
            continue
        # The moment after a state is the longest one before the next frame.
        if state is not None and time.monotonic() - collected_s > _COLLECT_S:
            gc.collect()
            collected_s = time.monotonic()
