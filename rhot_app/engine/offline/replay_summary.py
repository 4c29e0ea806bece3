"""Replays a whole log at once through the live door into a tracker, and sums up what came of it. No threads."""

from __future__ import annotations

import contextlib
import tempfile
from array import array
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from rhot_app.diagnostics import diagnostics_of
from rhot_app.engine.status import TOPIC_STATE, decode, encode
from rhot_app.errors import EngineError, RecordingError
from rhot_app.progress import Progress, silent
from rhot_app.project import Rig
from rhot_app.recording.raw_log import LogReader, Record, RecordKind
from rhot_app.sources.replay import LogValidator
from rhot_app.state import HandState, Knowledge
from rhot_app.tracking.kinds.tags import TagKind
from rhot_app.tracking.scene import make_tracker
from rhot_app.tracking.tracker import CameraFrame, CameraObservations, Tracker, frame_part, states_after


def replay_states(records: Iterable[Record], door: LogValidator, tracker: Tracker,
                  watch: Callable[[CameraFrame], None] = lambda frame: None) -> Iterator[HandState]:
    """The states that the engine would have published from these records, one for every frame that completes one; of a
    tracker that smooths all of them, in the order of time, some seconds late. A frame over which the tracker fails is
    lost and counted (`Diagnostics`). `watch` is given every frame before."""
    changes, diagnostics, cameras = door.changes, diagnostics_of(tracker), [link.node.name for link in door.links]
    for record in records:
        frame = door.feed(record)
        if frame is None:
            continue
        if door.changes != changes:
            changes = door.changes
            tracker.reset()
        watch(frame)
        states: list[HandState] = []
        with frame_part(diagnostics, tracker, frame, cameras):
            states = states_after(tracker, frame)
        yield from states
    yield from tracker.finish()


def summarise(reader: LogReader, rig: Rig, tracker: Tracker) -> dict[str, Any]:
    """What a log holds and what the tracker makes of it; every key ends in its unit.

    Raises RecordingError when not one record of the log can be read.
    """
    door = LogValidator(rig)
    times = _Span()
    records = times.watch(reader)
    states = list(replay_states(records, door, tracker))
    duration_s = 1e-9 * (states[-1].t_master_ns - states[0].t_master_ns) if len(states) > 1 else 0.0
    return {
        "log": str(reader.path), "duration_s": times.duration_s, "torn_bytes": reader.torn_bytes,
        "end_missing": reader.losses.end_missing,
        "damaged_places": reader.losses.places, "skipped_bytes": reader.losses.skipped_bytes,
        "damaged_header_bytes": reader.losses.header_bytes,
        "missed_records": door.gaps, "unknown_node_records": door.unknown_nodes,
        "smoothed": tracker.smooths,
        "diagnostics": [{"level": one.level, "what": one.what, "frames": one.count}
                        for one in diagnostics_of(tracker).all()],
        "states": len(states), "state_rate_hz": (len(states) - 1) / duration_s if duration_s else 0.0,
        "nodes": {link.node.name: {
            "received": link.door.received, "accepted": link.door.accepted,
            "fiducials": link.door.frames[TagKind.name], "lost": link.door.sequence.lost,
            "dropped": link.door.dropped, "clock_offset_s": link.clock.offset_s, "clock_bound_s": link.clock.bound_s,
        } for link in door.links},
        "markers": _marker_statistics(states, rig),
    }


def _marker_statistics(states: list[HandState], rig: Rig) -> dict[str, Any]:
    """Per marker: part of the states in which it was measured, its mean place, its spread about it."""
    if not states:
        return {}
    raw = np.array([state.marker_raw_positions for state in states])
    measured = np.array([state.marker_knowledge for state in states]) == Knowledge.MEASURED
    found: dict[str, Any] = {}
    for row, marker_id in enumerate(rig.markers.ids):
        seen = raw[measured[:, row], row]
        found[marker_id] = {
            "measured_fraction": float(measured[:, row].mean()),
            "mean_mm": (1e3 * seen.mean(axis=0)).tolist() if len(seen) else None,
            "sd_mm": (1e3 * seen.std(axis=0)).tolist() if len(seen) else None,
        }
    return found


class _Span:
    """Notes the first and last receive time of the datagrams that pass."""

    def __init__(self) -> None:
        self._first_ns: int | None = None
        self._last_ns = 0

    @property
    def duration_s(self) -> float:
        """From the first datagram to the last, s."""
        return 0.0 if self._first_ns is None else 1e-9 * (self._last_ns - self._first_ns)

    def watch(self, records: Iterable[Record]) -> Iterator[Record]:
        """The same records."""
        for record in records:
            if record.kind is RecordKind.DATAGRAM:
                self._first_ns = record.t_master_ns if self._first_ns is None else self._first_ns
                self._last_ns = record.t_master_ns
            yield record


_RECORD_BYTES = 21  # around a record's data (docs/log.md)


class SmoothedReplay(Tracker):
    """Plays the frames of one log, in any number of passes. Its states lie in a temporary file."""

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
                for state in replay_states(records, LogValidator(rig), make_tracker(rig, smooth=True)):
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

    def ingest(self, frame: CameraFrame) -> None:
        """Take one frame of the log."""
        if not isinstance(frame, CameraObservations):
            return
        if self._begins:
            self._begins = False
            self._place = int(np.searchsorted(self._latest_ns, frame.t_receive_ns))
        self._frame = self._newest[frame.camera] = frame

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
