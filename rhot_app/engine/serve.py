"""An engine in its directory with everything around it: lock, sockets, threads, signals. Shared by the commands."""

from __future__ import annotations

import contextlib
import functools
import gc
import logging
import os
import signal
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import msgspec
import zmq

from rhot_app.engine.activity import ActivityNote
from rhot_app.engine.commands import Answer, Arguments, Commands, parse, refusal
from rhot_app.engine.core import Engine, MakeSource, MakeTracker
from rhot_app.engine.directory import EngineDirectory, EngineLock, open_directory
from rhot_app.engine.node_control import NodeControl
from rhot_app.engine.output_process import OutputProcess
from rhot_app.engine.status import (
    SLOW_S,
    TOPIC_CONTOUR,
    TOPIC_PREVIEW,
    TOPIC_STATE,
    TOPIC_STATUS,
    EngineStatus,
    Preview,
    encode,
    most_urgent_first,
)
from rhot_app.errors import EngineError
from rhot_app.project import OutputSettings, Rig
from rhot_app.sources.receiver import share_interpreter
from rhot_app.tracking.scene import make_tracker
from rhot_node.compiled import announce_compilation
from rhot_node.files import JSON_BYTES_MAX
from rhot_node.keys import KeyPair
from rhot_node.network.context import Context
from rhot_node.terminal import cut_log
from rhot_node.threads import OneShotThread

_COLLECT_S = 5.0

log = logging.getLogger(__name__)


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
            rig_outputs: bool = True, trackers: MakeTracker = make_tracker,
            end_unused: bool = False) -> Iterator[Serving]:
    """An engine in its directory, warmed up, frames passing; the caller runs the server. `own`: the master's keys.
    `outputs`: opened besides those of the rig; these are left out without `rig_outputs`. `trackers`: makes
    the tracker of a rig. `end_unused`: the server ends when the engine has been unused for `UNUSED_S`.

    Raises EngineError when another engine holds the directory, SourceError when a port is taken, OutputError for an
    output that cannot be.
    """
    announce_compilation()
    outputs = tuple(outputs)
    place = open_directory(directory)
    lock = EngineLock(place)
    context = Context()
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
        server = Server(context, place, engine, nodes, ActivityNote(place, engine, outputs), end_unused=end_unused)
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


STATUS_NS = 100_000_000
"""Status is published ten times a second, so that a client misses an engine within one."""

UNUSED_S = 30.0
"""An engine in the background ends after this long without recording, clients and commands: a window that crashed is
opened again within it, and finds the rig as it was."""

_COMMAND_MAX = 2 * JSON_BYTES_MAX  # a longer one is cut off, with its client's connection
_SEND_QUEUE = 1000  # messages kept for a slow client before it misses some
_POLL_MS = 20
OBSERVED_NS = 100_000_000
"""So long a preview waits for the datagram of its frame, which was sent before it."""


class StatePublisher:
    """The socket of the hand states; used by the pipeline's thread only. Never blocks: a slow client misses states."""

    def __init__(self, context: Context, directory: EngineDirectory) -> None:
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

    def __init__(self, context: Context, directory: EngineDirectory, engine: Engine, nodes: NodeControl,
                 note: ActivityNote | None = None, *, end_unused: bool = False, unused_s: float = UNUSED_S) -> None:
        """`note`: written at every change. With `end_unused` it ends when for `unused_s` nothing is recorded, no client
        listens to the events or is connected to an output, and no command has come."""
        self.ending = False
        self._note = note
        self._end_unused, self._unused_s = end_unused, unused_s
        self._used_s = time.monotonic()
        self._listened: set[bytes] = set()  # topics of the events to which somebody listens
        self._engine = engine
        self._nodes = nodes
        self._events = _bind(context, zmq.XPUB, directory.events)
        self._commands_socket = _bind(context, zmq.ROUTER, directory.commands)
        self._commands = Commands(engine, quit_=self.end, preview=nodes.set_preview)
        self._poller = zmq.Poller()
        self._poller.register(self._commands_socket, zmq.POLLIN)
        self._status_due_ns = 0
        self._previews: list[tuple[Preview, int]] = []  # until when each waits for its observations
        self._slow: deque[tuple[bytes, str, Arguments]] = deque()  # commands that wait for the one before
        self._change: _Change | None = None
        self._log_file = directory.log_file

    def end(self) -> None:
        """Have `run` return after the step at hand."""
        self.ending = True

    def step(self, timeout_ms: int = _POLL_MS) -> None:
        """Wait for a command or a node's answer, deal with all that wait, publish what is due."""
        self._nodes.follow(self._engine.rig)
        self._nodes.record_video(self._engine.video)
        if self._poller.poll(timeout_ms):
            self._answer_commands()
        self._follow_slow_commands()
        for client, node_answer in self._nodes.answers():
            self._send(client, *node_answer)
        self._publish_previews()
        if self._nodes.previewing:
            for contour in self._engine.contours():
                self._publish(TOPIC_CONTOUR, encode(contour))
        now_ns = time.monotonic_ns()
        if now_ns >= self._status_due_ns:
            self._status_due_ns = now_ns + STATUS_NS
            status = self._engine.status()
            self._nodes.ask_for_states(status)
            status = replace(status, advice=tuple(most_urgent_first((*status.advice, *self._nodes.advice()))))
            self._publish(TOPIC_STATUS, encode(status))
            cut_log(self._log_file)
            self._note_use(status)
            if self._note is not None:
                self._note.step()

    def _publish_previews(self) -> None:
        """A preview is published with what was found in it: datagrams are sent first, but may be taken in later."""
        now_ns = time.monotonic_ns()
        self._previews += [(preview, now_ns + OBSERVED_NS) for preview in self._nodes.previews()]
        waiting = []
        for preview, until_ns in self._previews:
            annotated = self._engine.annotated(preview)
            if annotated is preview and self._engine.running and now_ns < until_ns:
                waiting.append((preview, until_ns))
            else:
                self._publish(TOPIC_PREVIEW, encode(annotated))
        self._previews = waiting

    def run(self, until: Callable[[], bool] = lambda: False) -> None:
        """Serve until `end`, or until `until` is true."""
        while not self.ending and not until():
            self.step()

    def close(self) -> None:
        """Close all sockets; what was answered last still reaches the client."""
        if self._note is not None:
            self._note.step(ended=self.ending)
        self._nodes.close()
        self._events.close()
        self._commands_socket.close(linger=200)

    def _note_use(self, status: EngineStatus) -> None:
        """Note whether somebody uses the engine, and end when nobody has for long."""
        with contextlib.suppress(zmq.Again):
            while True:
                change = self._events.recv(zmq.DONTWAIT)
                (self._listened.add if change[:1] == b"\x01" else self._listened.discard)(change[1:])
        now_s = time.monotonic()
        if self._listened or status.log_path or any(output.clients for output in status.outputs):
            self._used_s = now_s
        if self._end_unused and now_s - self._used_s > self._unused_s:
            log.warning("Nothing was recorded and no client was connected for %g s: the engine ends.", self._unused_s)
            self.end()

    def _publish(self, topic: bytes, payload: bytes) -> None:
        self._events.send_multipart((topic, payload), zmq.DONTWAIT)

    def _answer_commands(self) -> None:
        while True:
            try:
                client, *frames = self._commands_socket.recv_multipart(zmq.DONTWAIT)
            except zmq.Again:
                return
            self._used_s = time.monotonic()
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
        if name in SLOW_S:
            self._slow.append((client, name, arguments))
            return
        self._send(client, *self._commands.answer(name, arguments))

    def _follow_slow_commands(self) -> None:
        """Have them carried out one after the other, in a thread: the status goes on meanwhile."""
        if self._change is not None and not self._change.task.running:
            done, self._change = self._change, None
            self._send(done.client, *done.answer)
        if self._change is None and self._slow:
            client, name, arguments = self._slow.popleft()
            self._change = _Change(client, functools.partial(self._commands.answer, name, arguments))

    def _send(self, client: bytes, answer: Answer, attachment: bytes | None = None) -> None:
        frames = [client, b"", msgspec.json.encode(answer)]
        self._commands_socket.send_multipart(frames if attachment is None else [*frames, attachment])


class _Change:
    """A command that is being carried out in a thread of its own."""

    def __init__(self, client: bytes, carry_out: Callable[[], tuple[Answer, bytes | None]]) -> None:
        self.client = client
        self.answer: tuple[Answer, bytes | None] = refusal(EngineError("the engine could not do that.")), None
        self._carry_out = carry_out
        self.task = OneShotThread("changes the rig", self._run)

    def _run(self) -> None:
        self.answer = self._carry_out()


def _bind(context: Context, kind: int, endpoint: str) -> zmq.Socket[bytes]:
    """A socket bound to `endpoint`; a socket file left behind by a dead engine is replaced (the lock is ours)."""
    socket = context.socket(kind)
    socket.setsockopt(zmq.SNDHWM, _SEND_QUEUE)
    socket.setsockopt(zmq.MAXMSGSIZE, _COMMAND_MAX)
    try:
        socket.bind(endpoint)
        Path(endpoint.removeprefix("ipc://")).chmod(0o600)
    except (zmq.ZMQError, OSError) as exc:
        socket.close()
        raise EngineError(f"{endpoint}: cannot be opened ({exc}); choose another --directory.") from exc
    return socket
