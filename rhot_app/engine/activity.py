"""What an engine does, noted in its directory. An engine that is started after a crash continues with it."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec

from rhot_app.engine.directory import EngineDirectory
from rhot_app.errors import RigError
from rhot_app.project import OutputSettings, Rig, parse_rig
from rhot_node.files import decode_message, read_input, write_document

if TYPE_CHECKING:
    from rhot_app.engine.core import Engine


class Activity(msgspec.Struct, frozen=True):
    """`document` is the rig in force, which its file at `rig_path` need not have. `log_path`: what is being recorded,
    with videos of the nodes if `video`; empty when nothing is. `outputs`: those of the command line."""

    document: dict[str, Any]
    rig_path: str
    running: bool
    log_path: str = ""
    video: bool = False
    outputs: tuple[OutputSettings, ...] = ()

    @property
    def rig(self) -> Rig:
        """The rig in force. Raises RigError."""
        return parse_rig(msgspec.json.encode(self.document), "the rig of the engine before")


def read_activity(directory: EngineDirectory) -> Activity | None:
    """What the last engine in `directory` did when it died; None when there is no note, or one that cannot be used."""
    try:
        activity = decode_message(read_input(directory.activity_file), Activity)
        _ = activity.rig
    except (OSError, msgspec.MsgspecError, RigError):
        return None
    return activity


class ActivityNote:
    """Keeps the note of one engine; a replay has none. One thread only."""

    def __init__(self, directory: EngineDirectory, engine: Engine, outputs: Iterable[OutputSettings] = ()) -> None:
        """`outputs`: those of the command line. Another engine's note is removed."""
        self._path: Path = directory.activity_file
        self._engine = engine
        self._outputs = tuple(outputs)
        self._noted: tuple[object, ...] = ()
        with contextlib.suppress(OSError):
            self._path.unlink(missing_ok=True)

    def step(self, *, ended: bool = False) -> None:
        """Write the note anew when the engine does something else. One that has `ended` in order records no more."""
        engine, recorder = self._engine, self._engine.recorder
        log_path = "" if recorder is None or ended else str(recorder.path)
        video = bool(engine.video and log_path)
        noted = (engine.rig, engine.rig_path, engine.running, log_path, video)
        if noted == self._noted or not engine.live:
            return
        self._noted = noted
        activity = Activity(msgspec.to_builtins(engine.rig), str(engine.rig_path or ""), engine.running, log_path,
                            video, self._outputs)
        with contextlib.suppress(OSError):  # tracking goes on where no note can be written
            write_document(self._path, activity)
