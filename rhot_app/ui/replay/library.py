"""The recordings of a folder: what each is, how well the hand was tracked in it, and renaming and deleting. No Qt."""

from __future__ import annotations

import contextlib
import hashlib
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import msgspec
import numpy as np

from rhot_app.engine.observer import condition_of
from rhot_app.engine.offline.replay_summary import replay_states
from rhot_app.engine.pipeline import warm_up
from rhot_app.errors import RecordingError, RhotError
from rhot_app.progress import Progress, silent
from rhot_app.project import with_tracker
from rhot_app.recording.bookmarks import bookmarks_of
from rhot_app.recording.raw_log import CONTINUES, LogReader
from rhot_app.recording.video import videos_of
from rhot_app.sources.replay import LogValidator
from rhot_app.tracking.scene import make_tracker
from rhot_app.ui.dialogs.recordings import LOG_SUFFIX
from rhot_app.ui.language import tr
from rhot_app.ui.replay.run import CODES, LOST, ReadableLog, being_recorded, condition_bins
from rhot_node.errors import NodeError, printable
from rhot_node.files import write_document

TRASH = ".trash"
"""Folder beside the recordings for those that were deleted, until the library is closed."""

BAR_PARTS = 240
_HASHED_BYTES = 1 << 16  # header and first records: no two recordings begin alike
_FORMAT = 1


@dataclass(frozen=True, slots=True)
class Entry:
    """One recording in the list. `problem` says why it cannot be read, "" when it can. `video`: its nodes
    recorded their frames, too. `continues`: the recording whose next part it is, "" for none."""

    path: Path
    created: datetime
    size: int
    rig_name: str
    problem: str = ""
    video: bool = False
    continues: str = ""


class Summary(msgspec.Struct, frozen=True):
    """How well the hand was tracked, by the classic tracker. `conditions`: codes of `BAR_PARTS` parts."""

    duration_s: float
    states: int
    conditions: list[int]
    bookmarks: int
    note: str = ""
    format: int = _FORMAT


def summarise_log(log: Path, *, progress: Progress = silent) -> Summary:
    """Track the whole log and keep the condition alone. Raises RecordingError, RigError."""
    reader = LogReader(log)
    try:
        rig = with_tracker(reader.rig, "classic")
        tracker = make_tracker(rig)
        warm_up(tracker, rig)
        records = ReadableLog(reader, progress)
        times, codes = [], []
        for state in replay_states(iter(records), LogValidator(rig), tracker):
            times.append(state.t_master_ns)
            codes.append(CODES.get(condition_of(state), LOST))
        since_first_s = 1e-9 * (np.array(times, np.int64) - (records.first_ns or 0))
        bins = condition_bins(np.maximum(since_first_s, 0.0), np.array(codes, np.int8), records.duration_s, BAR_PARTS)
        note = records.note if records.datagrams else tr("It holds no datagrams: nothing was streaming.")
        return Summary(records.duration_s, len(times), bins.tolist(), len(bookmarks_of(records.marked)), note)
    finally:
        reader.close()


class Library:
    """The recordings in `folder`; summaries are kept in `cache`, found again whatever a recording is called."""

    def __init__(self, folder: Path, cache: Path) -> None:
        self.folder, self.cache = folder, cache
        self._deleted: list[tuple[Path, Path]] = []  # where each log was, and where it lies in the trash

    def entries(self) -> list[Entry]:
        """All recordings, the newest first. Reads their headers."""
        found = [_entry(path) for path in self.folder.glob(f"*{LOG_SUFFIX}") if path.is_file()]
        return sorted(found, key=lambda entry: (entry.created, entry.path.name), reverse=True)

    # -- summaries -------------------------------------------------------------------------------------------------

    def known_summary(self, path: Path) -> Summary | None:
        """The summary kept of a recording as it is now; None when there is none."""
        with contextlib.suppress(OSError, msgspec.MsgspecError):
            summary = msgspec.json.decode(self._place(path).read_bytes(), type=Summary)
            return summary if summary.format == _FORMAT and len(summary.conditions) == BAR_PARTS else None
        return None

    def keep_summary(self, path: Path, summary: Summary) -> None:
        """Find it again the next time; where nothing can be written it is made anew then."""
        with contextlib.suppress(OSError, NodeError):
            self.cache.mkdir(parents=True, exist_ok=True)
            write_document(self._place(path), summary)

    def _place(self, path: Path) -> Path:
        facts = path.stat()
        with path.open("rb") as file:
            begin = file.read(_HASHED_BYTES)
        digest = hashlib.sha256(f"{facts.st_size} {facts.st_mtime_ns} ".encode() + begin).hexdigest()
        return self.cache / f"{digest[:32]}.json"

    # -- changes ---------------------------------------------------------------------------------------------------

    def rename(self, path: Path, name: str) -> Path:
        """Call a recording `name`; returns its new path. Raises RecordingError."""
        name = name.strip().removesuffix(LOG_SUFFIX)
        if not name or name.startswith(".") or "/" in name or not name.isprintable():
            raise RecordingError(tr("“{name}” is no name for a recording: use letters, figures, blanks, dots and "
                                    "dashes, no slash, and no dot at the beginning.", name=name))
        target = path.with_name(f"{name}{LOG_SUFFIX}")
        if target == path:
            return path
        _refuse_while_recorded(path)
        if target.exists():
            raise RecordingError(tr("there is a recording called {name} already; choose another name.", name=name))
        return _move_all(path, target)

    def delete(self, path: Path) -> None:
        """Move a recording to the trash. Raises RecordingError."""
        _refuse_while_recorded(path)
        trash = self.folder / TRASH
        try:
            trash.mkdir(exist_ok=True)
        except OSError as exc:
            raise RecordingError(tr("{trash}: cannot be made ({strerror}), so nothing was deleted.", trash=trash,
                                    strerror=exc.strerror)) from exc
        target = trash / path.name
        number = 1
        while target.exists() or videos_of(target):
            number += 1
            target = trash / f"{path.stem} {number}{LOG_SUFFIX}"
        self._deleted.append((path, _move_all(path, target)))

    @property
    def undoable(self) -> str:
        """Name of the recording that `undo` brings back, "" for none."""
        return self._deleted[-1][0].stem if self._deleted else ""

    def undo(self) -> Path | None:
        """Bring back the recording that was deleted last; returns its path. Raises RecordingError."""
        if not self._deleted:
            return None
        before, lies_at = self._deleted[-1]
        if before.exists():
            raise RecordingError(tr("there is another recording called {stem} now; rename it first.", stem=before.stem))
        _move_all(lies_at, before)
        self._deleted.pop()
        return before

    def empty_trash(self) -> None:
        """Remove what was deleted, for good."""
        for _, lies_at in self._deleted:
            for path in (lies_at, *videos_of(lies_at)):
                with contextlib.suppress(OSError):
                    path.unlink()
        self._deleted.clear()
        with contextlib.suppress(OSError):
            (self.folder / TRASH).rmdir()


def _entry(path: Path) -> Entry:
    try:
        facts = path.stat()
        written = datetime.fromtimestamp(facts.st_mtime).astimezone()
        reader = LogReader(path)
    except (RhotError, NodeError, OSError) as exc:
        return Entry(path, datetime.fromtimestamp(0).astimezone(), 0, "", str(exc)) if isinstance(exc, OSError) else (
            Entry(path, written, facts.st_size, "", str(exc)))
    reader.close()
    with contextlib.suppress(ValueError, TypeError):
        written = datetime.fromisoformat(reader.about.get("created", "")).astimezone()
    continues = Path(str(reader.about.get(CONTINUES, ""))).stem
    return Entry(path, written, facts.st_size, reader.rig.name, "", "video" in reader.about, printable(continues))


def _refuse_while_recorded(path: Path) -> None:
    try:
        if being_recorded(path):
            raise RecordingError(tr("{stem} is being recorded; stop the recording first.", stem=path.stem))
    except OSError as exc:
        raise RecordingError(tr("{path}: cannot be read ({strerror}).", path=path, strerror=exc.strerror)) from exc


def _move_all(path: Path, target: Path) -> Path:
    """Move a log and the videos that were collected beside it; returns the log's new path. Raises RecordingError."""
    videos = videos_of(path)
    if videos and videos_of(target):
        raise RecordingError(tr("there are videos of another recording called {stem} already; move them first.",
                                stem=target.stem))
    moved = _move(path, target)
    for video in videos:
        _move(video, target.with_name(target.stem + video.name.removeprefix(path.stem)))
    return moved


def _move(path: Path, target: Path) -> Path:
    try:
        return path.rename(target)
    except OSError as exc:
        raise RecordingError(tr("{path}: cannot be moved to {target} ({strerror}).", path=path, target=target,
                                strerror=exc.strerror)) from exc
