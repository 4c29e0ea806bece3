"""Commands of clients: one JSON object in, one out. docs/engine.md lists them. No sockets here."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

import msgspec

from rhot_app.engine.core import Engine
from rhot_app.errors import EngineError, RhotError
from rhot_app.project import parse_rig
from rhot_node.errors import NodeError, printable
from rhot_node.files import decode_message

log = logging.getLogger(__name__)

Arguments = dict[str, Any]
Answer = dict[str, Any]

NAME_MAX = 64  # characters of a command's name


def parse(data: bytes) -> tuple[str, Arguments]:
    """Name and arguments of a command; raises EngineError when the bytes are none."""
    try:
        arguments = decode_message(data, dict[str, Any])
    except msgspec.MsgspecError as exc:
        raise EngineError(f"a command is a JSON object; this is not one ({exc}).") from exc
    name = arguments.pop("command", None)
    if not isinstance(name, str) or len(name) > NAME_MAX:
        raise EngineError('a command needs a "command" field with its name.')
    return name, arguments


def refusal(error: Exception) -> Answer:
    """The answer that says why a command was not carried out."""
    return {"ok": False, "error": str(error)}


class Commands:
    """Carries out the commands that the engine answers at once."""

    def __init__(self, engine: Engine, *, quit_: Callable[[], None], preview: Callable[[bool], None]) -> None:
        self._engine = engine
        self._preview = preview
        self._table: dict[str, Callable[[Arguments], Answer | None]] = {
            "hello": lambda _: self._hello(), "rig": lambda _: self._rig(),
            "status": lambda _: {"status": msgspec.to_builtins(engine.status())},
            "start": lambda _: {"session": engine.start()}, "stop": lambda _: engine.stop(),
            "record": self._record, "record_stop": lambda _: {"path": str(engine.record_stop() or "")},
            "bookmark": self._bookmark, "set_rig": self._set_rig,
            "save_rig": lambda arguments: {"path": str(engine.save_rig(_path(arguments)))},
            "preview": self._set_preview, "refined": lambda _: engine.refined(), "adapted": lambda _: engine.adapted(),
            "measured": lambda _: engine.measured(), "quit": lambda _: quit_(),
        }

    @property
    def names(self) -> tuple[str, ...]:
        """All commands that `answer` knows."""
        return tuple(self._table)

    def answer(self, name: str, arguments: Arguments) -> tuple[Answer, bytes | None]:
        """Carry out one command: the answer, and what is attached to it. Whatever is wrong becomes a sentence."""
        action = self._table.get(name)
        if action is None:
            return refusal(EngineError(f"there is no command {name!r}; there are {', '.join(sorted(self._table))}, "
                                       "node and still.")), None
        try:
            done = action(arguments) or {}
        except (RhotError, NodeError) as exc:
            return refusal(exc), None
        except Exception as exc:  # a command must never end the engine; the log has the whole story
            log.exception("the command %r failed", name)
            return refusal(EngineError(f"the engine could not do that: {printable(repr(exc))}. See its log.")), None
        attached = done.pop(done["attachment"]) if "attachment" in done else None
        return {"ok": True, **done}, attached

    def _hello(self) -> Answer:
        engine = self._engine
        return {"program": "rhot", "version": version("rhot"), "pid": os.getpid(), "running": engine.running,
                "rig_name": engine.rig.name, "rig_path": str(engine.rig_path or "")}

    def _record(self, arguments: Arguments) -> Answer:
        path = _path(arguments)
        if path is None:
            raise EngineError('record needs the "path" of the log to write.')
        video = arguments.get("video", False)
        if not isinstance(video, bool):
            raise EngineError('"video" of record is true or false.')
        self._engine.record(path, video=video)
        return {"path": str(path)}

    def _bookmark(self, arguments: Arguments) -> Answer:
        text = arguments.get("text")
        if not isinstance(text, str) or not text:
            raise EngineError('bookmark needs a "text": one line about this moment.')
        t_ns = arguments.get("t_master_ns")
        if "t_master_ns" in arguments and (type(t_ns) is not int or not 0 <= t_ns < 1 << 63):
            raise EngineError('bookmark needs "t_master_ns": a time of the master\'s monotonic clock, in nanoseconds.')
        return {"t_master_ns": self._engine.bookmark(text, t_ns)}

    def _rig(self) -> Answer:
        return {"document": msgspec.to_builtins(self._engine.rig), "path": str(self._engine.rig_path or "")}

    def _set_rig(self, arguments: Arguments) -> None:
        document = arguments.get("document")
        if not isinstance(document, dict):
            raise EngineError('set_rig needs a "document": the whole rig as an object.')
        self._engine.set_rig(parse_rig(msgspec.json.encode(document), "the new rig"))

    def _set_preview(self, arguments: Arguments) -> None:
        on = arguments.get("on")
        if not isinstance(on, bool):
            raise EngineError('preview needs "on": true or false.')
        self._preview(on)


def _path(arguments: Arguments) -> Path | None:
    """The absolute path in a command. The engine's working directory is not the client's, so it must be absolute."""
    path = arguments.get("path")
    if path is None:
        return None
    if not isinstance(path, str) or not path.startswith("/") or "\0" in path:
        raise EngineError(f'"path" must be an absolute path, not {path!r}.')
    return Path(path)
