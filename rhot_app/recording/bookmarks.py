"""Bookmarks of a raw log: short texts about moments, written while recording or appended later. docs/log.md."""

from __future__ import annotations

import contextlib
import errno
import fcntl
import os
from collections.abc import Iterable
from dataclasses import dataclass
from io import FileIO
from pathlib import Path
from typing import Final

from rhot_app.errors import RecordingError
from rhot_app.recording.raw_log import LogReader, Record, RecordKind, encode_record
from rhot_node.files import KIB
from rhot_node.wire.fields import TIME_MAX_NS

TEXT_MAX: Final = KIB  # bytes of UTF-8


@dataclass(frozen=True, slots=True)
class Bookmark:
    """A text about a moment: `t_master_ns`, the master's monotonic clock, as of the log's datagrams."""

    t_master_ns: int
    text: str


def bookmark_record(bookmark: Bookmark) -> Record:
    """The record of a bookmark. Raises RecordingError when the text is too long or has control characters."""
    data = bookmark.text.encode(errors="replace")
    if len(data) > TEXT_MAX or not (bookmark.text.isprintable()):
        raise RecordingError(f"a bookmark is one line of at most {TEXT_MAX} bytes, without control characters.")
    if abs(bookmark.t_master_ns) >= TIME_MAX_NS:
        raise RecordingError("a bookmark's time is a number of nanoseconds of the master's clock.")
    return Record(RecordKind.BOOKMARK, 0, bookmark.t_master_ns, data)


def bookmarks_of(records: Iterable[Record]) -> list[Bookmark]:
    """The bookmarks among a log's records, by time. Of one moment the last one written stands, and none if empty."""
    texts = {record.t_master_ns: _text(record.data) for record in records if record.kind is RecordKind.BOOKMARK}
    return [Bookmark(t_ns, text) for t_ns, text in sorted(texts.items()) if text]


def read_bookmarks(path: Path) -> list[Bookmark]:
    """The bookmarks of a log, by time. Raises RecordingError as LogReader does."""
    reader = LogReader(path)
    try:
        return bookmarks_of(reader)
    finally:
        reader.close()


def append_bookmark(path: Path, bookmark: Bookmark) -> None:
    """Write a bookmark behind the last record of a log; a torn record there is cut off first.

    A bookmark at the time of an earlier one replaces it; with an empty text it removes it. Raises RecordingError: not
    a log, not writable, still being recorded (the engine's command `bookmark` is for that), or no room.
    """
    data = encode_record(bookmark_record(bookmark))
    reader = LogReader(path)
    try:
        with FileIO(path, "r+b") as file:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            for _ in reader:
                pass
            end = file.seek(0, 2) - reader.torn_bytes
            file.truncate(end)
            file.seek(end)
            try:
                if file.write(data) != len(data):
                    raise OSError(errno.ENOSPC, "there is no room for it")
                os.fsync(file.fileno())
            except OSError:
                with contextlib.suppress(OSError):
                    file.truncate(end)
                raise
    except BlockingIOError as exc:
        raise RecordingError(f"{path}: is being recorded; only its engine can set a bookmark now.") from exc
    except OSError as exc:
        raise RecordingError(f"{path}: the bookmark cannot be written ({exc.strerror}).") from exc
    finally:
        reader.close()


def _text(data: bytes) -> str:
    """What a bookmark says, safe to show."""
    return "".join(char if char.isprintable() else " " for char in data[:TEXT_MAX].decode(errors="replace"))
