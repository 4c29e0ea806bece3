"""A raw log tracked from its beginning to its end: every state is kept in a file and found again by its number. No Qt.

Tracking needs no clock, so the same log with the same rig gives the same bytes. Stages of latency that this
computer measured are left out of the states; `detect` and `network` are in the log and stay.
"""

from __future__ import annotations

import contextlib
import fcntl
import io
import mmap
import os
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rhot_app.engine.observer import condition_of
from rhot_app.engine.offline.replay_summary import replay_states
from rhot_app.engine.pipeline import warm_up
from rhot_app.engine.status import TOPIC_STATE, decode, encode
from rhot_app.errors import RecordingError
from rhot_app.progress import Progress, silent
from rhot_app.project import Rig
from rhot_app.recording.bookmarks import Bookmark, bookmarks_of
from rhot_app.recording.raw_log import LogReader, Record, RecordKind
from rhot_app.sources.frame_sets import RecordedFilm, recorded_films
from rhot_app.sources.replay import LogValidator
from rhot_app.state import Condition, HandState
from rhot_app.tracking.scene import make_tracker
from rhot_app.tracking.smoothing import NOT_SMOOTHED
from rhot_app.ui.language import tr
from rhot_app.ui.models.meters import JitterWindow

Array = NDArray[np.float64]
Codes = NDArray[np.int8]

TRACKING, PARTIAL, LOST = range(3)
"""Codes of a state's condition, the worse the greater; SEARCHING counts as LOST."""

NO_STATE = -1
"""Code of a time in which there is no state."""

CODES = {Condition.TRACKING: TRACKING, Condition.PARTIAL: PARTIAL}
_IN_THE_LOG = ("detect", "network")
_SAMPLE_NS = 100_000_000  # the plots' rows, as live
_RECORD_BYTES = 21  # of a record beside its data, docs/log.md
_ABANDONED_S = 86_400.0


@dataclass(frozen=True, slots=True, eq=False)
class Tracked:
    """What is known of N states beside their bytes, of a rig with M markers. Times are the recording's master clock.

    State k lies at `offsets[k]:offsets[k + 1]` of the file. `jitter` has K rows, a tenth of a second apart.
    `note` says what of the log could not be read, "" when all was.
    """

    rig: Rig
    times_ns: NDArray[np.int64]  # (N,), growing; a clock that was set back moves on by 1 ns a state
    offsets: NDArray[np.int64]  # (N + 1,)
    conditions: Codes  # (N,)
    fingertips: Array  # (N, 5, 3) m
    jitter_times_ns: NDArray[np.int64]  # (K,)
    jitter: Array  # (K, M) mm
    note: str = ""
    bookmarks: tuple[Bookmark, ...] = ()  # of the log, by time
    films: tuple[RecordedFilm, ...] = ()  # the videos beside the log


def track_log(log: Path, rig: Rig, out: Path, smooth: bool = False, *, progress: Progress = silent) -> Tracked:
    """Track the whole log with `rig` and write all states to `out`. `smooth`: every state uses the whole log, not only
    what came before it. An error or a cancel leaves no file.

    Raises RecordingError when the log is none, holds nothing that can be tracked, or the rig's tracker does not smooth;
    RigError as the tracker does.
    """
    if smooth and not rig.tracker.smooths:
        raise RecordingError(NOT_SMOOTHED)
    reader = LogReader(log)
    try:
        tracker = make_tracker(rig, smooth=smooth)
        progress(tr("Preparing the tracker …"), 0.0)
        warm_up(make_tracker(rig), rig)
        records = ReadableLog(reader, progress)
        collected = _Collected(rig)
        with out.open("wb", buffering=0) as file:
            for state in replay_states(iter(records), LogValidator(rig), tracker):
                _write(file, collected.take(state), out)
        if not collected.times_ns:
            raise RecordingError(f"{log}: {_why_nothing(records)}")
        note, films = records.note, tuple[RecordedFilm, ...]()
        try:
            films = recorded_films(log, rig)
        except RecordingError as exc:
            note = f"{note} {exc}".lstrip()
        return collected.tracked(note, tuple(bookmarks_of(records.marked)), films)
    except BaseException:
        out.unlink(missing_ok=True)
        raise
    finally:
        reader.close()


def being_recorded(path: Path) -> bool:
    """Whether an engine is writing this log: it holds a lock on it. Some network file systems have no locks. Raises
    OSError when there is no such file."""
    with path.open("rb") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
        except OSError:
            return False
        return False


def _write(file: io.FileIO, data: bytes, out: Path) -> None:
    """All bytes; a raw file may take only a part of them at a time."""
    try:
        view = memoryview(data)
        while view:
            view = view[file.write(view):]
    except OSError as exc:
        raise RecordingError(tr("{out}: the states of the recording cannot be written ({strerror}). They take about 5 "
                                "kB each; make room there.", out=out, strerror=exc.strerror)) from exc


def _why_nothing(records: ReadableLog) -> str:
    if not records.datagrams:
        return tr("it holds no datagrams: nothing was streaming while it was recorded. There is nothing to replay.")
    return (tr("no state could be made of its {datagrams} datagrams. Is this the rig that it was recorded with, and "
               "were both cameras streaming?", datagrams=records.datagrams))


class ReadableLog:
    """The records of a log, with the progress of whoever takes them, and what they tell beside the hand.

    `first_ns` and `last_ns` are the receive times of the first and last datagram that have passed, `marked` the records
    of bookmarks.
    """

    def __init__(self, reader: LogReader, progress: Progress) -> None:
        self.datagrams = 0
        self.first_ns: int | None = None
        self.last_ns = 0
        self.marked: list[Record] = []
        self._reader, self._progress = reader, progress
        self._growing = being_recorded(reader.path)

    def __iter__(self) -> Iterator[Record]:
        size, done = max(1, self._reader.path.stat().st_size), 0
        for record in self._reader:
            done += _RECORD_BYTES + len(record.data)
            if record.kind is RecordKind.DATAGRAM:
                self.datagrams += 1
                self.first_ns = record.t_master_ns if self.first_ns is None else self.first_ns
                self.last_ns = record.t_master_ns
                if self.datagrams % 64 == 0:
                    self._progress(tr("Tracking the recording …"), min(1.0, done / size))
            elif record.kind is RecordKind.BOOKMARK:
                self.marked.append(record)
            yield record

    @property
    def duration_s(self) -> float:
        """From the first datagram to the last, s."""
        return 0.0 if self.first_ns is None else 1e-9 * (self.last_ns - self.first_ns)

    @property
    def note(self) -> str:
        """What of the log could not be read, "" when all was."""
        losses, said = self._reader.losses, list[str]()
        if self._growing:
            return tr("{path} is still being recorded: what was written until now is shown.", path=self._reader.path)
        if losses.damage:
            said.append(tr("In {path} {damage}.", path=self._reader.path, damage=losses.damage))
        if losses.end:
            said.append(tr("Of {path} {end}.", path=self._reader.path, end=losses.end))
        return " ".join([*said, tr("Everything else is shown.")] if said else said)


class _Collected:
    """Takes states in their order and keeps what `Tracked` needs of them."""

    def __init__(self, rig: Rig) -> None:
        self.times_ns: list[int] = []
        self._rig = rig
        self._offsets = [0]
        self._conditions: list[int] = []
        self._fingertips: list[Array] = []
        self._jitter = JitterWindow()
        self._jitter_times: list[int] = []
        self._jitter_rows: list[Array] = []

    def take(self, state: HandState) -> bytes:
        """Note a state; its bytes, the same for every run."""
        state = _without_measured_times(state)
        data = encode(state)
        t_ns = max(state.t_master_ns, self.times_ns[-1] + 1) if self.times_ns else state.t_master_ns
        self.times_ns.append(t_ns)
        self._offsets.append(self._offsets[-1] + len(data))
        self._conditions.append(CODES.get(condition_of(state), LOST))
        self._fingertips.append(state.fingertip_positions)
        self._jitter.add(state)
        if not self._jitter_times or t_ns - self._jitter_times[-1] >= _SAMPLE_NS:
            self._jitter_times.append(t_ns)
            self._jitter_rows.append(1e3 * self._jitter.rms(t_ns))
        return data

    def tracked(self, note: str, bookmarks: tuple[Bookmark, ...], films: tuple[RecordedFilm, ...]) -> Tracked:
        """All that was noted."""
        return Tracked(self._rig, np.array(self.times_ns, np.int64), np.array(self._offsets, np.int64),
                       np.array(self._conditions, np.int8), np.array(self._fingertips),
                       np.array(self._jitter_times, np.int64), np.array(self._jitter_rows), note, bookmarks,
                       films)


def _without_measured_times(state: HandState) -> HandState:
    latency = {stage: state.latency_s[stage] for stage in _IN_THE_LOG if stage in state.latency_s}
    other = None if state.other is None else _without_measured_times(state.other)
    return replace(state, latency_s=latency, other=other)


class Run:
    """A tracked log. Its file has no name any more: it is gone when the run is closed, or the program has ended."""

    def __init__(self, tracked: Tracked, path: Path) -> None:
        """Take the file over; raises OSError when it cannot be read."""
        self.tracked = tracked
        with path.open("rb") as file:
            self._bytes = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
        path.unlink()

    def __len__(self) -> int:
        return len(self.tracked.times_ns)

    @property
    def rig(self) -> Rig:
        """The rig that it was tracked with."""
        return self.tracked.rig

    @property
    def times_s(self) -> Array:
        """(N,) s since the first state."""
        times = self.tracked.times_ns
        return np.asarray(1e-9 * (times - times[0]))

    def data(self, number: int) -> bytes:
        """The bytes of a state."""
        begin, end = self.tracked.offsets[number:number + 2].tolist()
        return self._bytes[begin:end]

    def state(self, number: int) -> HandState:
        """A state; a few dozen microseconds."""
        state = decode(TOPIC_STATE, self.data(number))
        assert isinstance(state, HandState)
        return state

    def close(self) -> None:
        """Free the file. May be called twice."""
        self._bytes.close()


def new_run_path(folder: Path, number: int) -> Path:
    """Where the states of a run are written; what a program that died has left there a day ago is removed.

    Raises RecordingError when the folder cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as exc:
        raise RecordingError(tr("{folder}: cannot be made ({strerror}), so there is no room for the states.",
                                folder=folder, strerror=exc.strerror)) from exc
    for path in folder.glob("*.states"):
        with contextlib.suppress(OSError):
            if time.time() - path.stat().st_mtime > _ABANDONED_S:
                path.unlink()
    return folder / f"{os.getpid()}-{number}.states"


def condition_bins(times_s: Array, conditions: Codes, duration_s: float, count: int) -> Codes:
    """(count,) the worst condition in each part of the duration; NO_STATE where no state falls into it.

    States that are sparser than the parts fill those up to the next state, for at most half a second.
    """
    bins = np.full(count, NO_STATE, np.int8)
    if not len(times_s) or duration_s <= 0.0:
        return bins
    width_s = duration_s / count
    ends = np.minimum(np.append(times_s[1:], duration_s), times_s + 0.5)
    first = np.clip((times_s / width_s).astype(int), 0, count - 1)
    last = np.clip(np.ceil(ends / width_s).astype(int) - 1, first, count - 1)
    for reach in range(int((last - first).max()) + 1):
        inside = last - first >= reach
        np.maximum.at(bins, first[inside] + reach, conditions[inside])
    return bins
