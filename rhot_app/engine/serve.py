"""An engine in its directory with everything around it: lock, sockets, threads, signals. Shared by the commands."""

from __future__ import annotations

import argparse
import contextlib
import functools
import gc
import json
import logging
import os
import signal
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec
import zmq

from rhot_app.engine.client import EngineDirectory, EngineLock, default_directory, open_directory
from rhot_app.engine.commands import Answer, Commands, parse, refusal
from rhot_app.engine.core import Engine, MakeSource, MakeTracker
from rhot_app.engine.node_control import NodeControl
from rhot_app.engine.node_meter import most_urgent_first
from rhot_app.engine.output_process import OutputProcess
from rhot_app.engine.status import TOPIC_PREVIEW, TOPIC_STATE, TOPIC_STATUS, encode
from rhot_app.errors import EngineError
from rhot_app.outputs.spec import HELP, WEB_PORT, parse_output, web_settings
from rhot_app.project import OutputSettings, Rig
from rhot_app.sources.receiver import share_interpreter
from rhot_app.tracking.trackers import make_tracker
from rhot_node.compiled import announce_compilation
from rhot_node.keys import KeyPair

if TYPE_CHECKING:
    from rhot_app.project import OutputSettings, Rig


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


# -- the engine's sockets towards its clients --------------------------------------------------------------------------

STATUS_NS = 100_000_000
"""Status is published ten times a second, so that a client misses an engine within one."""

_SEND_QUEUE = 1000  # messages kept for a slow client before it misses some
_POLL_MS = 20


class StatePublisher:
    """The socket of the hand states; used by the pipeline's thread only. Never blocks: a slow client misses states."""

    def __init__(self, context: zmq.Context[zmq.Socket[bytes]], directory: EngineDirectory) -> None:
        self.count = 0
        self._socket = _bind(context, zmq.PUB, directory.states)

    def __call__(self, payload: bytes) -> None:
        """Publish one state's bytes."""
        self._socket.send_multipart((TOPIC_STATE, payload), zmq.DONTWAIT, copy=True)
        self.count += 1

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()


class Server:
    """Answers commands, publishes status and previews. `step` belongs to one thread."""

    def __init__(self, context: zmq.Context[zmq.Socket[bytes]], directory: EngineDirectory, engine: Engine,
                 nodes: NodeControl) -> None:
        self.ending = False
        self._engine = engine
        self._nodes = nodes
        self._events = _bind(context, zmq.PUB, directory.events)
        self._commands_socket = _bind(context, zmq.ROUTER, directory.commands)
        self._commands = Commands(engine, quit_=self.end, preview=nodes.set_preview)
        self._poller = zmq.Poller()
        self._poller.register(self._commands_socket, zmq.POLLIN)
        self._status_due_ns = 0

    def end(self) -> None:
        """Have `run` return after the step at hand."""
        self.ending = True

    def step(self, timeout_ms: int = _POLL_MS) -> None:
        """Wait for a command or a node's answer, deal with all that wait, publish what is due."""
        self._nodes.follow(self._engine.rig)
        self._nodes.record_video(self._engine.video)
        if self._poller.poll(timeout_ms):
            self._answer_commands()
        for client, node_answer in self._nodes.answers():
            self._send(client, *node_answer)
        for preview in self._nodes.previews():
            self._publish(TOPIC_PREVIEW, encode(preview))
        now_ns = time.monotonic_ns()
        if now_ns >= self._status_due_ns:
            self._status_due_ns = now_ns + STATUS_NS
            status = self._engine.status()
            self._nodes.ask_for_states(status)
            status = replace(status, advice=most_urgent_first((*status.advice, *self._nodes.advice())))
            self._publish(TOPIC_STATUS, encode(status))

    def run(self, until: Callable[[], bool] = lambda: False) -> None:
        """Serve until `end`, or until `until` is true."""
        while not self.ending and not until():
            self.step()

    def close(self) -> None:
        """Close all sockets; what was answered last still reaches the client."""
        self._nodes.close()
        self._events.close()
        self._commands_socket.close(linger=200)

    def _publish(self, topic: bytes, payload: bytes) -> None:
        self._events.send_multipart((topic, payload), zmq.DONTWAIT)

    def _answer_commands(self) -> None:
        while True:
            try:
                client, *frames = self._commands_socket.recv_multipart(zmq.DONTWAIT)
            except zmq.Again:
                return
            if len(frames) == 2 and frames[0] == b"":  # as REQ sends them; anything else cannot be answered
                self._answer(client, frames[1])

    def _answer(self, client: bytes, data: bytes) -> None:
        try:
            name, arguments = parse(data)
            if name in self._nodes.commands:
                self._nodes.ask(client, name, arguments)
                return
        except EngineError as exc:
            self._send(client, refusal(exc))
            return
        self._send(client, *self._commands.answer(name, arguments))

    def _send(self, client: bytes, answer: Answer, attachment: bytes | None = None) -> None:
        frames = [client, b"", msgspec.json.encode(answer)]
        self._commands_socket.send_multipart(frames if attachment is None else [*frames, attachment])


def _bind(context: zmq.Context[zmq.Socket[bytes]], kind: int, endpoint: str) -> zmq.Socket[bytes]:
    """A socket bound to `endpoint`; a socket file left behind by a dead engine is replaced (the lock is ours)."""
    socket = context.socket(kind)
    socket.setsockopt(zmq.LINGER, 0)
    socket.setsockopt(zmq.SNDHWM, _SEND_QUEUE)
    try:
        socket.bind(endpoint)
        Path(endpoint.removeprefix("ipc://")).chmod(0o600)
    except (zmq.ZMQError, OSError) as exc:
        socket.close()
        raise EngineError(f"{endpoint}: cannot be opened ({exc}); choose another --directory.") from exc
    return socket


# -- ``rhot engine``: the engine as a process of its own, with or without a screen nearby ------------------------------
# What tracks is imported when it runs, so that ``--help`` is there at once.

def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot engine``."""
    parser.add_argument("--rig", type=Path, required=True, metavar="FILE", help="the rig file (rhot-rig, JSON)")
    parser.add_argument("--record", "--log", type=Path, dest="log", metavar="FILE",
                        help="write the raw log of all datagrams to this new file")
    parser.add_argument("--video", action="store_true",
                        help="have every node record its frames, too, as long as --record writes; `rhot video "
                             "collect` fetches them")
    parser.add_argument("--unchecked", action="store_true",
                        help="serve also a rig that `rhot check` refuses, to calibrate it")
    parser.add_argument("--start", action="store_true", help="tell the nodes to stream at once")
    add_serving_arguments(parser)
    parser.add_argument("--json", action="store_true",
                        help="print one JSON object on standard output when ready: pid, directory, rig")


def _require_acceptable(rig: Rig, path: Path) -> None:
    """Raises RigError when `rhot check` refuses the rig."""
    from rhot_app.calibration.check.checks import check_rig
    from rhot_app.calibration.verdict import Grade
    from rhot_app.errors import RigError

    verdict = check_rig(rig).verdict
    if not verdict.acceptable:
        wrong = " ".join(finding.sentence for finding in verdict.findings if finding.grade is Grade.POOR)
        raise RigError(f"{path}: cannot be tracked with. {wrong} `rhot check` says more; --unchecked starts all the "
                       "same, to calibrate the rig.")


def add_serving_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of every command that serves states to clients."""
    parser.add_argument("--directory", type=Path, metavar="DIR",
                        help=f"private directory of the engine's sockets (default {default_directory()})")
    parser.add_argument("--output", action="append", default=[], dest="outputs", metavar="SPEC",
                        help="send every state to other programs, see below; may be given more than once")
    parser.add_argument("--web", nargs="?", const="", metavar="[HOST:]PORT",
                        help=f"show the hand in browsers, on this computer's port {WEB_PORT} unless told otherwise; "
                             "the address with its secret is printed")
    parser.add_argument("--verbose", action="store_true", help="log what happens on standard error")
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.epilog = HELP


def asked_outputs(args: argparse.Namespace) -> tuple[OutputSettings, ...]:
    """The outputs of the command line. Raises OutputError."""
    return (*map(parse_output, args.outputs), *(() if args.web is None else (web_settings(args.web),)))


def print_addresses(serve: Serving) -> None:
    """Say on standard error where clients of the outputs connect."""
    for output in serve.engine.status().outputs:
        if output.url:
            what = "the web view" if output.kind == "web" else f"output {output.spec}"
            print(f"rhot: {what} is at {output.url}", file=sys.stderr, flush=True)


def run(args: argparse.Namespace) -> int:
    """Run the engine until SIGTERM, SIGINT or the command ``quit``."""
    from rhot_app.engine.advice import calibration_advice
    from rhot_app.engine.serve import serving
    from rhot_app.errors import EngineError
    from rhot_app.keys import load_master_keys
    from rhot_app.project import load_rig
    from rhot_app.sources.links import UdpNodes

    if args.video and args.log is None:
        raise EngineError("--video needs --log FILE: the videos belong to a recording.")
    logging.basicConfig(level=logging.INFO if args.verbose else logging.WARNING, format="%(message)s")
    rig = load_rig(args.rig)
    if not args.unchecked:
        _require_acceptable(rig, args.rig)
    own = load_master_keys().own
    source = functools.partial(UdpNodes, own=own)
    with serving(rig, args.rig.absolute(), source, args.directory, own, asked_outputs(args)) as serve:
        if args.log is not None:
            serve.engine.record(args.log.absolute(), video=args.video)
        if args.start:
            serve.engine.start()
        if args.json:
            urls = {output.spec: output.url for output in serve.engine.status().outputs if output.url}
            print(json.dumps({"pid": os.getpid(), "directory": str(serve.directory.path), "rig": rig.name}
                             | ({"outputs": urls} if urls else {})), flush=True)
        else:
            told = "nodes are told to stream" if args.start else "nodes stream once a client says start"
            print(f"rhot: the engine of {rig.name} serves clients in {serve.directory.path}; {told}. Ctrl+C ends it.",
                  file=sys.stderr, flush=True)
        for advice in calibration_advice(rig):
            print(f"rhot: {advice.text}", file=sys.stderr, flush=True)
            print_addresses(serve)
        serve.server.run()
    return 0
