"""A raw log tracked from its beginning to its end, and what was lost on the way."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType

import numpy as np

from rhot_app.calibration.recorded_observations import why_none
from rhot_app.diagnostics import Diagnostic, diagnostics_of
from rhot_app.engine.offline.replay_summary import replay_states
from rhot_app.errors import ExportError, RecordingError, take_losses
from rhot_app.export.states import HandStates, in_blocks
from rhot_app.progress import Progress, silent
from rhot_app.project import Rig, TrackerKind, load_rig, with_tracker
from rhot_app.recording.raw_log import LogReader, Record, wall_clock_offset_ns
from rhot_app.sources.frame_sets import film_period_ns
from rhot_app.sources.replay import LogValidator
from rhot_app.state import HandState
from rhot_app.tracking.scene import make_tracker
from rhot_app.tracking.smoothing import NOT_SMOOTHED
from rhot_app.tracking.tracker import CameraFrame, CameraObservations

RATE_AFTER_S = 5.0
"""The cameras' rate is that of this much of a log: some hundred frames have a good median."""

_RECORD_BYTES = 21  # around a record's data (docs/log.md)
_REPORT_BYTES = 1 << 14


class TrackedLog:
    """One pass of a raw log through the tracker, as a stream of `HandStates`. A context manager; one pass only.

    `rig`: what it is tracked with. `losses`: sentences about what could not be read, complete after the pass.
    """

    def __init__(self, path: Path, rig: Rig | Path | None = None, tracker: TrackerKind | None = None,
                 progress: Progress = silent, *, smooth: bool = False) -> None:
        """Open the log; `rig` and `tracker` replace those that it was recorded with. `smooth`: every state uses the
        whole log, not only what came before it.

        Raises RecordingError when it is no log, RigError when the rig is none or does not suit the tracker, ExportError
        when the tracker does not smooth.
        """
        self.path = path
        self.losses: list[str] = []
        self.count = 0  # of states so far
        self.tracked = 0  # of them, with a hand
        self._first_t_master_ns = 0
        self._progress = progress
        self._reader = LogReader(path)
        try:
            own = self._reader.rig if rig is None else load_rig(rig) if isinstance(rig, Path) else rig
            self.rig = own if tracker is None else with_tracker(own, tracker)
            if smooth and not self.rig.tracker.smooths:
                raise ExportError(NOT_SMOOTHED)
            self.tracker = make_tracker(self.rig, smooth=smooth)
            self._frames = _FrameTimes(len(self.rig.nodes))
        except BaseException:
            self._reader.close()
            raise
        self._door = LogValidator(self.rig)
        self._size = max(path.stat().st_size, 1)

    @property
    def created(self) -> str:
        """When the log was begun, UTC, as it says itself; empty when it does not."""
        return str(self._reader.about.get("created", ""))

    @property
    def wall_clock_offset_ns(self) -> int | None:
        """ns since 1970 less the master's clock, once there are states; None when the log does not say."""
        return wall_clock_offset_ns(self._reader.about, self._first_t_master_ns)

    @property
    def camera_rate_hz(self) -> float:
        """Frames per second of one camera, by those until now; 0 while too few have come."""
        return self._frames.rate_hz

    def blocks(self) -> Iterator[HandStates]:
        """The states, some hundred at a time. Raises RecordingError when there is none."""
        states = replay_states(self._records(), self._door, self.tracker, self._frames.note)
        period_ns = film_period_ns(self._reader.about, self.path)
        for block in in_blocks(states if period_ns is None else one_of_each_instant(states, period_ns // 2)):
            self.count += len(block)
            self.tracked += int(np.count_nonzero(block.tracked))
            yield block
        self.losses += [one.sentence for one in self._diagnosed("error")]
        if self._door.gaps:
            self.losses.append(f"the disk was too slow while recording: {self._door.gaps} records are missing")
        if not self.count:
            raise RecordingError(self._why_nothing())

    @property
    def warnings(self) -> list[str]:
        """Sentences about what was ambiguous in it, complete after the pass."""
        return [one.sentence for one in self._diagnosed("warning")]

    def _diagnosed(self, level: str) -> list[Diagnostic]:
        return [one for one in diagnostics_of(self.tracker).all() if one.level == level]

    def _records(self) -> Iterator[Record]:
        """All that can be read; a broken log ends where it breaks."""
        done, reported = 0, 0
        try:
            for record in self._reader:
                self._first_t_master_ns = self._first_t_master_ns or record.t_master_ns
                done += _RECORD_BYTES + len(record.data)
                if done - reported >= _REPORT_BYTES:
                    reported = done
                    self._progress(f"tracking {self.path.name}", min(done / self._size, 1.0))
                yield record
        except RecordingError as exc:
            self.losses.append(str(exc).removeprefix(f"{self.path}: "))
        if self._reader.losses.damage:
            self.losses.append(self._reader.losses.damage)
        if self._reader.losses.end:
            self.losses.append(self._reader.losses.end)
        take_losses()  # they are said by whoever exports

    def _why_nothing(self) -> str:
        read = f" What could be read of it: {'; '.join(self.losses)}." if self.losses else ""
        if self._frames.count:
            return (f"{self.path}: the tracker makes no state of its {self._frames.count} frames: the cameras' frames "
                    f"nowhere overlap in time. Record again while all nodes stream.{read}")
        return (f"{self.path}: no frame in it can be used with the rig {self.rig.name!r} ({why_none(self._door)}). "
                f"Give the rig that the log was recorded with (--rig), or record again.{read}")

    def close(self) -> None:
        """Close the file. May be called twice."""
        self._reader.close()

    def __enter__(self) -> TrackedLog:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        self.close()


class _FrameTimes:
    """Counts frames, and notes when the first of them were, to tell the cameras' rate."""

    def __init__(self, cameras: int) -> None:
        self.count = 0
        self._times_ns: list[list[int]] = [[] for _ in range(cameras)]  # of the first seconds

    def note(self, frame: CameraFrame) -> None:
        """Note one frame with markers."""
        if not isinstance(frame, CameraObservations):
            return
        self.count += 1
        times, t_ns = self._times_ns[frame.camera], frame.t_row0_master_ns
        if not times or t_ns - times[0] < 1e9 * RATE_AFTER_S:
            times.append(t_ns)

    @property
    def rate_hz(self) -> float:
        """The fastest camera's rate, by the median of its periods."""
        periods = [float(np.median(np.diff(times))) for times in self._times_ns if len(times) > 1]
        return max((1e9 / period for period in periods if period > 0.0), default=0.0)


def read_log(path: Path, rig: Rig | Path | None = None) -> tuple[Rig, str]:
    """The rig of a log (or the given one) and when it was begun; nothing is tracked. Raises as `TrackedLog` does."""
    with contextlib.closing(LogReader(path)) as reader:
        own = reader.rig if rig is None else load_rig(rig) if isinstance(rig, Path) else rig
        return own, str(reader.about.get("created", ""))


def one_of_each_instant(states: Iterator[HandState], half_ns: int) -> Iterator[HandState]:
    """Of the states of one frame set the last, which knows all its pictures."""
    waiting: HandState | None = None
    first_ns = 0
    for state in states:
        if waiting is not None and state.t_master_ns - first_ns > half_ns:
            yield waiting
            waiting = None
        if waiting is None:
            first_ns = state.t_master_ns
        waiting = state
    if waiting is not None:
        yield waiting
