"""A raw log smoothed before it is replayed: a tracker that gives the states of the log's frames as they come again."""

from __future__ import annotations

import contextlib
import tempfile
from array import array
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from rhot_app.engine.codec import TOPIC_STATE, decode, encode
from rhot_app.engine.replay_summary import smoothed_states
from rhot_app.errors import EngineError, RecordingError
from rhot_app.progress import Progress, silent
from rhot_app.project import Rig
from rhot_app.recording.raw_log import LogReader, Record
from rhot_app.sources.replay import LogValidator
from rhot_app.tracking.smoothing import SmoothedTracker
from rhot_app.tracking.state import HandState
from rhot_app.tracking.tracker import CameraObservations

_RECORD_BYTES = 21  # around a record's data (docs/log.md)


class SmoothedReplay:
    """Implements `Tracker` for the frames of one log, in any number of passes. Its states lie in a temporary file."""

    def __init__(self, path: Path, rig: Rig, progress: Progress = silent) -> None:
        """Smooth the log with the rig's tracker, the estimator. Raises RecordingError when nothing comes of it or
        when the disk is full, RigError as `make_tracker` does."""
        self._path, self._rig = path, rig
        self._newest: list[CameraObservations | None] = [None] * len(rig.nodes)
        self._offsets, received_ns = array("q", [0]), array("q")
        self._file = tempfile.TemporaryFile()  # noqa: SIM115 - open as long as the tracker
        with contextlib.closing(LogReader(path)) as reader:
            try:
                records = _watched(reader, progress)
                for state in smoothed_states(records, LogValidator(rig), SmoothedTracker(rig)):
                    self._offsets.append(self._offsets[-1] + self._file.write(encode(state)))
                    received_ns.append(state.t_receive_ns)
            except OSError as exc:
                raise RecordingError(f"the smoothed states cannot be written ({exc.strerror}). They take about 5 kB "
                                     "each; make room in the folder for temporary files.") from exc
        if not received_ns:
            raise RecordingError(f"{path}: nothing in it can be tracked, so there is nothing to smooth.")
        self._received_ns = np.array(received_ns, np.int64)
        self._latest_ns = np.maximum.accumulate(self._received_ns)
        self._count = self._place = 0
        self._frame: CameraObservations | None = None
        self._begins = True

    def for_rig(self, rig: Rig) -> SmoothedReplay:
        """Itself. Raises EngineError for another rig than its own."""
        if rig != self._rig:
            raise EngineError("a smoothed replay keeps its rig. Start it again with the other one: "
                              f"rhot replay {self._path} --smooth --rig FILE.")
        return self

    def reset(self) -> None:
        """Go on wherever the next frame is in the log."""
        self._begins = True

    def ingest(self, observations: CameraObservations) -> None:
        """Take one frame of the log."""
        if self._begins:
            self._begins = False
            self._place = int(np.searchsorted(self._latest_ns, observations.t_receive_ns))
        self._frame = self._newest[observations.camera] = observations

    def newest_frames(self) -> tuple[CameraObservations | None, ...]:
        """Each camera's newest frame, None before its first."""
        return tuple(self._newest)

    def solve(self) -> HandState | None:
        """The next state in the order of time whose frame has come, None when it has not."""
        frame, place = self._frame, self._place
        if frame is None or place == len(self._received_ns) or self._received_ns[place] > frame.t_receive_ns:
            return None
        self._place += 1
        self._file.seek(self._offsets[place])
        state = decode(TOPIC_STATE, self._file.read(self._offsets[place + 1] - self._offsets[place]))
        assert isinstance(state, HandState)
        self._count += 1
        other = None if state.other is None else replace(state.other, sequence=self._count - 1)
        return replace(state, sequence=self._count - 1, other=other)


def _watched(reader: LogReader, progress: Progress) -> Iterator[Record]:
    size, done = max(reader.path.stat().st_size, 1), 0
    for record in reader:
        done += _RECORD_BYTES + len(record.data)
        progress(f"smoothing {reader.path.name}", min(done / size, 1.0))
        yield record
