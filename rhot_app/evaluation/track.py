"""A tracker's states over a whole run as columns, and the way from a log's records to them."""

from __future__ import annotations

import time
from array import array
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, fields

import msgspec
import numpy as np
from numpy.typing import NDArray

from rhot_app.engine.offline.replay_summary import replay_states
from rhot_app.engine.pipeline import warm_up
from rhot_app.errors import SimulatorError
from rhot_app.project import Rig, TrackerSettings
from rhot_app.recording.raw_log import Record, RecordKind
from rhot_app.simulator.film.node_log import T0_MASTER_NS
from rhot_app.sources.replay import LogValidator
from rhot_app.state import HandState
from rhot_app.tracking.extrapolation import Extrapolator
from rhot_app.tracking.scene import make_tracker
from rhot_app.tracking.tracker import Tracker

Array = NDArray[np.float64]


DISPLAY_HZ = 60.0


@dataclass(frozen=True, slots=True)
class Predicted:
    """What a tracker said of the fingertips at each tick of a display, at that tick, by what had arrived; K ticks. NaN
    while there was no hand."""

    times_s: Array  # (K,)
    fingertip_positions: Array  # (K, 5, 3)
    fingertip_covariances: Array  # (K, 5, 3, 3)


@dataclass(frozen=True, slots=True)
class TrackedStates:
    """N states of a tracker; M markers. Rig frame, m and rad; times are scene times, s. As in `HandState`.

    `receive_s` (N,): when the datagram that completed the state arrived. `compute_s` (D,): per datagram, from its bytes
    to the state, if it made one. `predicted`: None of a tracker that predicts nothing.
    """

    times_s: Array  # (N,)
    receive_s: Array  # (N,)
    marker_positions: Array  # (N, M, 3)
    marker_raw_positions: Array  # (N, M, 3)
    marker_covariances: Array  # (N, M, 3, 3)
    marker_knowledge: NDArray[np.uint8]  # (N, M)
    joint_positions: Array  # (N, 21, 3)
    joint_covariances: Array  # (N, 21, 3, 3)
    joint_knowledge: NDArray[np.uint8]  # (N, 21)
    fingertip_positions: Array  # (N, 5, 3)
    fingertip_covariances: Array  # (N, 5, 3, 3)
    angles: Array  # (N, 21)
    angle_sd: Array  # (N, 21)
    angle_knowledge: NDArray[np.uint8]  # (N, 21)
    world_from_palm: Array  # (N, 4, 4)
    palm_covariance: Array  # (N, 6, 6)
    hand_scale: Array  # (N,)
    hand_scale_sd: Array  # (N,)
    compute_s: Array  # (D,)
    predicted: Predicted | None = None

    def where(self, chosen: NDArray[np.bool_]) -> TrackedStates:
        """The states of a mask (N,) alone."""
        columns = {field.name: getattr(self, field.name) for field in fields(self)}
        return TrackedStates(**{name: column if name in _OF_RUN else column[chosen]
                                for name, column in columns.items()})


_OF_RUN = "compute_s", "predicted"
_OF_STATES = tuple(field.name for field in fields(TrackedStates)
                   if field.name not in ("times_s", "receive_s", *_OF_RUN))


def track_of(states: Sequence[HandState], compute_s: Array | None = None,
             predicted: Predicted | None = None) -> TrackedStates:
    """The columns of states of one run. Raises SimulatorError when there are fewer than two."""
    if len(states) < 2:
        raise SimulatorError(f"the tracker made {len(states)} states of the whole log; there is nothing to judge.")
    columns = {name: np.array([getattr(state, name) for state in states]) for name in _OF_STATES}
    return TrackedStates(times_s=1e-9 * np.array([state.t_master_ns - T0_MASTER_NS for state in states]),
                         receive_s=1e-9 * np.array([state.t_receive_ns - T0_MASTER_NS for state in states]),
                         compute_s=np.empty(0) if compute_s is None else compute_s, predicted=predicted, **columns)


def rig_with(rig: Rig, settings: TrackerSettings) -> Rig:
    """The rig with another tracker."""
    return msgspec.structs.replace(rig, tracker=settings)


def states_of(records: Iterable[Record], rig: Rig, tracker: Tracker | None = None) -> Iterator[HandState]:
    """What the rig's tracker, or another one, makes of a log's records, one by one. The first costs no compilation."""
    chosen = make_tracker(rig) if tracker is None else tracker
    warm_up(chosen, rig)
    yield from replay_states(records, LogValidator(rig), chosen)


def tracked(records: Iterable[Record], rig: Rig, tracker: Tracker | None = None) -> TrackedStates:
    """What the rig's tracker, or another one, makes of a log's records; as fast as it can, one thread.

    Raises SimulatorError when it makes nothing.
    """
    states: list[HandState] = []
    display = Display(records, rig, states) if rig.tracker.kind == "estimator" else None
    timed = Timed(records if display is None else display)
    states.extend(states_of(timed, rig, tracker))  # one by one, as they come
    return track_of(states, np.array(timed.compute_s), None if display is None else display.predicted())


class Display:
    """Records that pass, and a display that predicts the newest of the `states` to each of its ticks."""

    def __init__(self, records: Iterable[Record], rig: Rig, states: Sequence[HandState]) -> None:
        self._records, self._extrapolator, self._states = records, Extrapolator(rig), states
        self._times_s: list[float] = []
        self._tips: list[Array] = []
        self._covariances: list[Array] = []

    def __iter__(self) -> Iterator[Record]:
        number = 0
        for record in self._records:
            while number < DISPLAY_HZ * 1e-9 * (record.t_master_ns - T0_MASTER_NS):
                self._ask(number / DISPLAY_HZ)
                number += 1
            yield record

    def _ask(self, now_s: float) -> None:
        newest = self._states[-1] if self._states else None
        state = None if newest is None else self._extrapolator.at(newest, T0_MASTER_NS + round(1e9 * now_s))
        self._times_s.append(now_s)
        self._tips.append(np.full((5, 3), np.nan) if state is None else state.fingertip_positions)
        self._covariances.append(np.full((5, 3, 3), np.nan) if state is None else state.fingertip_covariances)

    def predicted(self) -> Predicted:
        """All that it was told."""
        return Predicted(np.array(self._times_s), np.array(self._tips).reshape(-1, 5, 3),
                        np.array(self._covariances).reshape(-1, 5, 3, 3))


class Timed:
    """Records that pass, and how long whoever takes them works on each datagram, s: by the clock, and of the processor,
    which other programs do not lengthen."""

    def __init__(self, records: Iterable[Record]) -> None:
        self.compute_s, self.cpu_s = array("d"), array("d")  # no objects: memory is measured beside it
        self._records = records

    def __iter__(self) -> Iterator[Record]:
        for record in self._records:
            begun, begun_cpu = time.perf_counter(), time.thread_time()
            yield record
            if record.kind is RecordKind.DATAGRAM:
                self.cpu_s.append(time.thread_time() - begun_cpu)
                self.compute_s.append(time.perf_counter() - begun)
