"""The thesis's tracker: pair, filter pixels, triangulate, filter positions, fit the palm, solve every finger."""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import NDArray

from rhot_app.filters.one_euro import OneEuroFilter
from rhot_app.hand.model import build_model
from rhot_app.hand.places import with_markers
from rhot_app.project import Rig
from rhot_app.tracking import stages, trust
from rhot_app.tracking.association import MarkerAssociation
from rhot_app.tracking.hand_solver import HandSolver, SolvedHand
from rhot_app.tracking.pairing import Paired, Pairing
from rhot_app.tracking.rig_arrays import compile_rig, filter_settings
from rhot_app.tracking.stages import Sheet
from rhot_app.tracking.state import UNESTIMATED, Condition, HandState
from rhot_app.tracking.tracker import CameraObservations

Array = NDArray[np.float64]

LOST_AFTER_S = 0.5
"""No marker measured for this long: the hand is lost, not merely hidden."""


class ClassicTracker:
    """Implements `Tracker` for one rig. `solve` is due work; `ingest` only stores."""

    def __init__(self, rig: Rig) -> None:
        self._rig = compile_rig(rig)
        cameras, markers = len(self._rig.camera_names), len(self._rig.marker_ids)
        self._pairing = Pairing(cameras, markers)
        self._association = MarkerAssociation(self._rig)
        self._hand = HandSolver(with_markers(build_model(rig.hand), rig.markers))
        pixel, position = filter_settings(rig)
        self._filtering = rig.filters.enabled
        self._pixel_filter = OneEuroFilter.from_settings([s for _ in range(cameras) for s in pixel for _ in range(2)])
        self._position_filter = OneEuroFilter.from_settings([s for s in position for _ in range(3)])
        self._turned_shapes = self._rig.shapes.copy()
        self._sequence = 0
        self.reset()

    def reset(self) -> None:
        """Forget everything but the count of states: a new session, or a clock was set."""
        self._pairing.reset()
        self._hand.reset()
        self._pixel_filter.reset()
        self._position_filter.reset()
        self._association.reset()
        self._memory = trust.empty_memory(len(self._rig.marker_ids))
        self._confirmed = np.zeros(len(self._rig.marker_ids), np.bool_)
        self._anchors = np.full((len(self._rig.marker_ids), 3), np.nan)
        self._epoch_ns: int | None = None
        self._last_s = 0.0
        self._measured_s: float | None = None
        self._all_measured = False

    def ingest(self, observations: CameraObservations) -> None:
        """Take one frame in; about 10 µs."""
        self._pairing.ingest(self._association.select(observations))

    def newest_frames(self) -> tuple[CameraObservations | None, ...]:
        """Each camera's newest frame, None before its first."""
        return tuple(self._pairing.newest_frames)

    def solve(self) -> HandState | None:
        """The state that is due, or None."""
        clock = _Stopwatch()
        paired = self._pairing.due()
        if paired is None:
            return None
        t_s = self._seconds(paired.t_ns)
        clock.lap("pair")
        markers = self._locate(t_s, paired, clock)
        self._association.update(paired.t_ns, np.where(self._confirmed[:, None], markers.raw, np.nan))
        hand = self._solve_hand(t_s, markers)
        clock.lap("solve")
        return self._state(t_s, paired, markers, hand, clock)

    def _seconds(self, t_ns: int) -> float:
        """Time since the first state, s: small enough for floats to keep nanoseconds. A step back starts anew."""
        if self._epoch_ns is None:
            self._epoch_ns = t_ns
        t_s = 1e-9 * (t_ns - self._epoch_ns)
        if t_s < self._last_s:
            self._hand.reset()
            self._pixel_filter.reset()
            self._position_filter.reset()
            self._memory[:] = np.nan
            self._confirmed[:] = False
            self._measured_s = None
        self._last_s = t_s
        return t_s

    def _locate(self, t_s: float, paired: Paired, clock: _Stopwatch) -> Sheet:
        """Raw positions decide what to believe; believed pixels are filtered and located again."""
        rig, shapes = self._rig, self._shapes()
        markers = Sheet(len(rig.cameras), len(rig.marker_ids))
        stages.locate_raw(t_s, paired.flags, paired.live, paired.pixels, paired.covariances, rig.intrinsics,
                          rig.cameras, rig.focal, shapes, rig.law, rig.reach, self._memory, self._confirmed,
                          markers.used, markers.doubtful, markers.believed, markers.restarted, markers.raw,
                          markers.covariances, markers.errors)
        clock.lap("triangulate")
        if not self._filtering:
            markers.positions[:] = markers.raw
            return markers
        pixel, position = self._pixel_filter, self._position_filter
        pixels = np.empty_like(paired.pixels)
        stages.filter_pixels(t_s, markers.used, markers.restarted, paired.pixels, pixel.parameters, pixel.state,
                             position.state, pixel.gap_s, pixels)
        clock.lap("filter")
        stages.locate_filtered(pixels, paired.covariances, markers.used, rig.intrinsics, rig.cameras, rig.focal,
                               shapes, rig.law, markers.positions)
        clock.lap("triangulate")
        stages.filter_positions(t_s, markers.positions, position.parameters, position.state, position.gap_s,
                                markers.believed)
        clock.lap("filter")
        return markers

    def _shapes(self) -> Array:
        """The markers' bodies; a band lies as the hand's last pose says."""
        pose, band = self._hand.pose, self._rig.band_half_axes
        if pose is None or band is None:
            return self._rig.shapes
        stages.turn_band(pose.world_from_palm, band, self._turned_shapes[self._rig.wrist])
        return self._turned_shapes

    def _solve_hand(self, t_s: float, markers: Sheet) -> SolvedHand:
        """Say how each marker is known, those out of sight too, and solve the hand that wears them."""
        rig = self._rig
        wrist, tips, tip_knowledge = np.empty(3), np.empty((5, 3)), np.empty(5, np.uint8)
        measured, wrist_knowledge = stages.conclude(
            t_s, self._memory, markers.believed, markers.doubtful, self._anchors, markers.positions,
            markers.covariances, markers.knowledge, rig.wrist, rig.tips, wrist, tips, tip_knowledge)
        if measured:
            self._measured_s = t_s
        self._all_measured = measured == len(markers.knowledge)
        return self._hand.solve(t_s, wrist, tips, wrist_knowledge, tip_knowledge)

    def _condition(self, t_s: float, paired: Paired) -> Condition:
        if self._measured_s is None:
            return Condition.SEARCHING
        if np.count_nonzero(paired.live) < 2 or t_s - self._measured_s > LOST_AFTER_S:
            return Condition.LOST
        return Condition.TRACKING if self._all_measured else Condition.PARTIAL

    def _state(self, t_s: float, paired: Paired, markers: Sheet, hand: SolvedHand, clock: _Stopwatch) -> HandState:
        pixels, flags = self._pairing.last_seen()
        self._sequence += 1
        completed = paired.completed_by
        return HandState(
            sequence=self._sequence - 1,
            t_master_ns=paired.t_ns,
            t_receive_ns=completed.t_receive_ns,
            condition=self._condition(t_s, paired),
            marker_ids=self._rig.marker_ids,
            marker_positions=markers.positions,
            marker_raw_positions=markers.raw,
            marker_covariances=markers.covariances,
            marker_knowledge=markers.knowledge,
            camera_names=self._rig.camera_names,
            camera_pixels=pixels,
            camera_flags=flags,
            joint_positions=hand.joint_positions,
            joint_knowledge=hand.joint_knowledge,
            fingertip_positions=hand.fingertip_positions,
            angles=hand.angles,
            angle_knowledge=hand.angle_knowledge,
            world_from_palm=hand.world_from_palm,
            palm_knowledge=hand.palm_knowledge,
            epipolar_error_px=markers.errors,
            **UNESTIMATED,
            latency_s={"detect": completed.detect_s, "network": completed.network_s, **clock.laps},
        )


class _Stopwatch:
    """Adds up the time between laps by stage, s."""

    def __init__(self) -> None:
        self.laps: dict[str, float] = {"pair": 0.0, "triangulate": 0.0, "filter": 0.0, "solve": 0.0}
        self._since = time.perf_counter()

    def lap(self, stage: str) -> None:
        """Charge the time since the last lap to `stage`."""
        now = time.perf_counter()
        self.laps[stage] += now - self._since
        self._since = now
