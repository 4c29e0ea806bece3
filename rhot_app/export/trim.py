"""A part of a recording as a recording of its own: raw log, bookmarks and what was collected of its videos.

``rhot trim``, and the replay's window. What a reader needs of the time before the part comes with it: the sessions'
starts and the last minute of the clock exchanges. Nothing is tracked, decoded or compressed again.
"""

from __future__ import annotations

import contextlib
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from rhot_app.barehand.observations import EdgeFrame
from rhot_app.errors import RecordingError
from rhot_app.export.export import check_place, whole_file
from rhot_app.progress import Progress, silent
from rhot_app.recording.raw_log import CONTINUES, END, LogReader, Record, RecordKind, encode_header, encode_record
from rhot_app.recording.video import video_path, write_times
from rhot_app.sources.replay import LogValidator
from rhot_app.tracking.tracker import CameraObservations
from rhot_node.files import open_input
from rhot_node.video.avi import append_picture, begin_video, finish_video, pictures_of, video_size

CLOCK_NS: Final = 60_000_000_000
"""How long before its part the clock exchanges are kept: the clock model looks no farther back (docs/log.md)."""

TRIMMED_FROM: Final = "trimmed_from"
"""In the header of a part: the name of the log that it was taken from."""


_OF_THE_LINK = frozenset((RecordKind.START, RecordKind.STOP, RecordKind.CLOCK_REQUEST, RecordKind.CLOCK_REPLY,
                          RecordKind.SLICES))
"""Records that say how what follows is to be read."""


@dataclass(frozen=True, slots=True)
class Trimmed:
    """What came of it: the new log with its datagrams and bookmarks, the videos beside it, and `losses`, what of the
    old log could not be read."""

    path: Path
    datagrams: int
    bookmarks: int
    videos: tuple[Path, ...]
    losses: tuple[str, ...]


def trim_log(log: Path, out: Path, begin_ns: int, end_ns: int, *, again: bool = False,
             progress: Progress = silent) -> Trimmed:
    """Write what `log` has of the frames from `begin_ns` to `end_ns`, the master's clock, to the log `out`, and of the
    videos beside it.

    Raises RecordingError when it is no log or has no frame then, ExportError or NodeError when a file cannot be written
    or read. `again`: existing files are written over. Whatever `progress` raises ends it, and nothing is left.
    """
    videos: list[tuple[int, Path, Path]] = []
    with contextlib.closing(LogReader(log)) as reader, contextlib.ExitStack() as undo:
        for camera, node in enumerate(reader.rig.nodes):
            if (old := video_path(log, node.name)).exists():
                videos.append((camera, old, video_path(out, node.name)))
        for old, new in ((log, out), *((old, new) for _, old, new in videos)):
            check_place(old, new, again)
        about = {key: value for key, value in reader.about.items() if key not in ("video", CONTINUES)}
        part, written = _Part(reader, begin_ns, end_ns, progress), list[Path]()
        with whole_file(out, lambda: progress(f"trimmed {log.name}", 1.0)) as path:
            with path.open("wb") as file:
                file.write(encode_header(reader.rig, about | {TRIMMED_FROM: log.name}, marks_end=True))
                file.writelines(encode_record(record) for record in part)
                file.write(END)
            if not part.frames:
                raise RecordingError(f"{log}: it has no frame in that range. Choose another one; the replay shows "
                                     "where there are states.")
            for camera, old, new in videos:
                if camera in part.node_ns:
                    undo.callback(_remove_video, new)
                    _trim_video(old, new, *part.node_ns[camera])
                    written.append(new)
        undo.pop_all()
    losses = tuple(one for one in (reader.losses.damage, reader.losses.end) if one)
    return Trimmed(out, part.datagrams, part.bookmarks, tuple(written), losses)


def _remove_video(video: Path) -> None:
    for path in (video, video.with_suffix(".csv")):
        path.unlink(missing_ok=True)


class _Part:
    """The records of a part, one after the other. `node_ns`: by camera, the node's times of its first and last
    frame."""

    def __init__(self, reader: LogReader, begin_ns: int, end_ns: int, progress: Progress) -> None:
        self.datagrams = self.bookmarks = self.frames = 0
        self.node_ns: dict[int, tuple[int, int]] = {}
        self._reader, self._progress = reader, progress
        self._begin_ns, self._end_ns = begin_ns, end_ns

    def __iter__(self) -> Iterator[Record]:
        door, before = LogValidator(self._reader.rig), deque[Record]()
        size, done = max(self._reader.path.stat().st_size, 1), 0
        for record in self._reader:
            done += len(record.data)
            frame = door.feed(record)
            t_ns = getattr(frame, "t_row0_master_ns", record.t_master_ns)
            if record.kind in _OF_THE_LINK:
                if t_ns <= self._end_ns:
                    before.append(record)
                continue
            if not self._begin_ns <= t_ns <= self._end_ns:
                continue
            if record.kind is RecordKind.DATAGRAM:
                self._progress(f"trimming {self._reader.path.name}", min(done / size, 0.99))
                self.datagrams += 1
                self.frames += frame is not None
                if isinstance(frame, CameraObservations | EdgeFrame) and frame.t_row0_node_ns > 0:
                    self._note(frame.camera, frame.t_row0_node_ns)
            self.bookmarks += record.kind is RecordKind.BOOKMARK and bool(record.data)
            if record.kind is not RecordKind.BOOKMARK:  # it may stand anywhere
                for earlier in before:
                    if earlier.kind is RecordKind.START or earlier.t_master_ns >= self._begin_ns - CLOCK_NS:
                        yield earlier
                before.clear()
            yield record

    def _note(self, camera: int, node_ns: int) -> None:
        first, last = self.node_ns.get(camera, (node_ns, node_ns))
        self.node_ns[camera] = min(first, node_ns), max(last, node_ns)


def _trim_video(old: Path, new: Path, first_ns: int, last_ns: int) -> None:
    """The pictures of a video from one node time to another, and their table. Raises NodeError, ExportError."""
    with open_input(old) as source, whole_file(new, lambda: None) as path, path.open("r+b") as target:
        begin_video(target, *video_size(source))
        for picture in pictures_of(source):
            if first_ns <= picture.stamp.t_node_ns <= last_ns:
                source.seek(picture.offset)
                append_picture(target, source.read(picture.size))
        finish_video(target)
    write_times(new)
