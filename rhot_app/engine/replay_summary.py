"""Replays a whole log at once through the live door into a tracker, and sums up what came of it. No threads."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any, Protocol

import numpy as np

from rhot_app.project import Rig
from rhot_app.recording.raw_log import LogReader, Record, RecordKind
from rhot_app.sources.replay import LogValidator
from rhot_app.tracking.smoothing import SmoothedTracker
from rhot_app.tracking.state import HandState, Knowledge
from rhot_app.tracking.tracker import CameraObservations, Tracker


class FrameSmoother(Protocol):
    """What `smoothed_states` asks of a `SmoothedTracker`, or of what stands before one."""

    def reset(self) -> None:
        """A new session, or a clock was set."""
        ...

    def ingest(self, observations: CameraObservations) -> None:
        """Take one frame in."""
        ...

    def states(self) -> Iterator[HandState]:
        """The states that have become final."""
        ...

    def finish(self) -> Iterator[HandState]:
        """The rest of them."""
        ...


def replay_states(records: Iterable[Record], door: LogValidator, tracker: Tracker) -> Iterator[HandState]:
    """The states that the engine would have published from these records, one for every frame that completes one."""
    changes = door.changes
    for record in records:
        frame = door.feed(record)
        if frame is None:
            continue
        if door.changes != changes:
            changes = door.changes
            tracker.reset()
        tracker.ingest(frame)
        state = tracker.solve()
        if state is not None:
            yield state


def smoothed_states(records: Iterable[Record], door: LogValidator, tracker: FrameSmoother) -> Iterator[HandState]:
    """The states of these records by all of them, in the order of time; they come some seconds late."""
    changes = door.changes
    for record in records:
        frame = door.feed(record)
        if frame is None:
            continue
        if door.changes != changes:
            changes = door.changes
            tracker.reset()
        tracker.ingest(frame)
        yield from tracker.states()
    yield from tracker.finish()


def summarise(reader: LogReader, rig: Rig, tracker: Tracker | SmoothedTracker) -> dict[str, Any]:
    """What a log holds and what the tracker makes of it; every key ends in its unit.

    Raises RecordingError when not one record of the log can be read.
    """
    door = LogValidator(rig)
    times = _Span()
    records = times.watch(reader)
    states = list(smoothed_states(records, door, tracker) if isinstance(tracker, SmoothedTracker)
                  else replay_states(records, door, tracker))
    duration_s = 1e-9 * (states[-1].t_master_ns - states[0].t_master_ns) if len(states) > 1 else 0.0
    return {
        "log": str(reader.path), "duration_s": times.duration_s, "torn_bytes": reader.torn_bytes,
        "damaged_places": reader.losses.places, "skipped_bytes": reader.losses.skipped_bytes,
        "damaged_header_bytes": reader.losses.header_bytes,
        "missed_records": door.gaps, "unknown_node_records": door.unknown_nodes,
        "smoothed": isinstance(tracker, SmoothedTracker),
        "states": len(states), "state_rate_hz": (len(states) - 1) / duration_s if duration_s else 0.0,
        "nodes": {link.node.name: {
            "received": link.door.received, "accepted": link.door.accepted, "lost": link.door.sequence.lost,
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
