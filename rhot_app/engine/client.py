"""The engine as its clients see it: states, status and previews to poll, commands to give.

For the app, for commands and for tests; imports neither Qt nor the tracker.
"""

from __future__ import annotations

import contextlib
import time
from pathlib import Path
from types import TracebackType
from typing import Any

import msgspec
import zmq

from rhot_app.engine.directory import EngineDirectory, default_directory
from rhot_app.engine.status import (
    SLOW_S,
    TOPIC_CONTOUR,
    TOPIC_PREVIEW,
    TOPIC_STATE,
    TOPIC_STATUS,
    EngineStatus,
    Published,
    decode,
)
from rhot_app.errors import EngineError
from rhot_app.project import Rig, parse_rig
from rhot_app.state import HandState
from rhot_node.files import decode_message
from rhot_node.network.context import Context

VANISHED_S = 1.0
"""An engine publishes its status ten times a second; after this long without one it is gone."""

ABSENT_S = 2.0
"""An engine that starts makes its sockets sooner."""

ASKED_S, SILENT_S = 5.0, 30.0
"""So often an engine that is at a slow command is asked whether it is still there, and after so long without an answer
it is not: a busy computer may keep it from answering for some seconds."""

_RECEIVE_QUEUE = 2000  # messages a slow client may fall behind before the oldest are dropped


class EngineClient:
    """Connection to the engine in `directory`. May be made before the engine starts and outlives its restarts.

    One thread only. `state` and `status` are the newest of each kind that `poll` has seen.
    """

    def __init__(self, directory: Path | None = None, *, states: bool = True, events: bool = True) -> None:
        """Connect; no message is exchanged yet. `states` False leaves the stream of hand states out, `events` False
        status and previews: for a client that only gives commands, and polls nothing."""
        self.directory = EngineDirectory((directory or default_directory()).absolute())
        self.state: HandState | None = None
        self.status: EngineStatus | None = None
        self._heard_at = -1e9
        self._context = Context()
        self._stream = self._context.socket(zmq.SUB)
        self._stream.setsockopt(zmq.RCVHWM, _RECEIVE_QUEUE)
        self._stream.setsockopt(zmq.RECONNECT_IVL, 50)
        self._stream.setsockopt(zmq.RECONNECT_IVL_MAX, 200)
        if events:
            self._stream.setsockopt(zmq.SUBSCRIBE, TOPIC_STATUS)
            self._stream.setsockopt(zmq.SUBSCRIBE, TOPIC_PREVIEW)
            self._stream.setsockopt(zmq.SUBSCRIBE, TOPIC_CONTOUR)
            self._stream.connect(self.directory.events)
        if states:
            self._stream.setsockopt(zmq.SUBSCRIBE, TOPIC_STATE)
            self._stream.connect(self.directory.states)

    def poll(self, timeout_s: float = 0.0) -> list[Published]:
        """Everything that arrived since the last call, oldest first; waits up to `timeout_s` when there is nothing.

        Raises EngineError when the engine is of another version.
        """
        if timeout_s > 0.0:
            self._stream.poll(round(1e3 * timeout_s))
        messages: list[Published] = []
        while True:
            try:
                topic, payload = self._stream.recv_multipart(zmq.DONTWAIT)
            except zmq.Again:
                return messages
            message = decode(topic, payload)
            if isinstance(message, HandState):
                self.state = message
            elif isinstance(message, EngineStatus):
                self.status = message
                self._heard_at = time.monotonic()
            messages.append(message)

    @property
    def connected(self) -> bool:
        """Whether a status came within the last second (by what `poll` has seen)."""
        return time.monotonic() - self._heard_at < VANISHED_S

    def command(self, name: str, *, timeout_s: float = 3.0, **arguments: Any) -> dict[str, Any]:
        """Give one command and wait for its answer; docs/engine.md lists them.

        Returns the answer's fields. Raises EngineError with the engine's own sentence when it refuses, or when it
        does not answer within `timeout_s`. A command of `SLOW_S` is waited for longer, while the engine answers others.
        """
        begun_s = time.monotonic()
        socket = self._context.socket(zmq.REQ)
        try:
            socket.connect(self.directory.commands)
            socket.send(msgspec.json.encode({"command": name, **arguments}))
            absent = not Path(self.directory.commands.removeprefix("ipc://")).exists()
            if absent:
                timeout_s = min(timeout_s, ABSENT_S)
            elif name in SLOW_S:
                self._follow(socket, SLOW_S[name])
                timeout_s = 0.0
            if not socket.poll(round(1e3 * timeout_s)):
                if absent:
                    raise EngineError(f"There is no engine in {self.directory.path}. Start it with "
                                      "`rhot engine --rig FILE`.")
                raise EngineError(f"the engine in {self.directory.path} gave no answer to {name!r} in "
                                  f"{time.monotonic() - begun_s:.0f} s. Is it running? Start it with "
                                  "`rhot engine --rig FILE`.")
            frames = socket.recv_multipart()
        finally:
            socket.close()
        return _read_answer(frames)

    def _follow(self, socket: zmq.Socket[bytes], most_s: float) -> None:
        """Wait until an answer has come, or `most_s` are over, or the engine has answered nothing for `SILENT_S`."""
        begun_s = heard_s = time.monotonic()
        while not socket.poll(round(1e3 * ASKED_S)) and time.monotonic() < min(begun_s + most_s, heard_s + SILENT_S):
            with contextlib.suppress(EngineError):
                self.command("hello")
                heard_s = time.monotonic()

    def rig(self, *, timeout_s: float = 3.0) -> Rig:
        """The engine's rig. Raises EngineError as `command` does."""
        document = self.command("rig", timeout_s=timeout_s)["document"]
        return parse_rig(msgspec.json.encode(document), "the engine's rig")

    def close(self) -> None:
        """Disconnect. May be called twice."""
        with contextlib.suppress(zmq.ZMQError):
            self._stream.close(0)
            self._context.destroy(0)

    def __enter__(self) -> EngineClient:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        self.close()


def _read_answer(frames: list[bytes]) -> dict[str, Any]:
    """An answer is one JSON frame; bytes (a picture) follow in a second frame and take the name it announces."""
    try:
        answer: dict[str, Any] = decode_message(frames[0], dict[str, Any])
    except msgspec.MsgspecError as exc:
        raise EngineError(f"the engine's answer cannot be read ({exc}); restart engine and app.") from exc
    if not answer.pop("ok", False):
        raise EngineError(str(answer.get("error", "the engine refused without a reason")))
    attachment = answer.pop("attachment", None)
    if attachment is not None and len(frames) > 1:
        answer[str(attachment)] = frames[1]
    return answer
