"""The thesis's tracker: pair, filter pixels, triangulate, filter positions, fit the palm, solve every finger."""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import NDArray

from rhot_app.filters.one_euro import OneEuroFilter
from rhot_app.geometry.silhouette import ellipsoid
from rhot_app.hand.model import build_model
from rhot_app.project import Rig
from rhot_app.tracking import locate, trust
from rhot_app.tracking.hand_solver import HandSolver, SolvedHand
from rhot_app.tracking.pairing import Paired, Pairing
from rhot_app.tracking.rig_arrays import compile_rig, filter_settings
from rhot_app.tracking.state import Condition, HandState, Knowledge
from rhot_app.tracking.tracker import CameraObservations

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

LOST_AFTER_S = 0.5
"""No marker measured for this long: the hand is lost, not merely hidden."""


class ClassicTracker:
    """Implements `Tracker` for one rig. `solve` is due work; `ingest` only stores."""

    def __init__(self, rig: Rig) -> None:
        self._rig = compile_rig(rig)
        cameras, markers = len(self._rig.camera_names), len(self._rig.marker_ids)
        self._pairing = Pairing(cameras, markers, self._rig.time_offsets_ns)
        self._hand = HandSolver(build_model(rig.hand))
        pixel, position = filter_settings(rig)
        self._filtering = rig.filters.enabled
        self._pixel_filter = OneEuroFilter.from_settings([s for _ in range(cameras) for s in pixel for _ in range(2)])
        self._position_filter = OneEuroFilter.from_settings([s for s in position for _ in range(3)])
        self._sequence = 0
        self.reset()

    def reset(self) -> None:
        """Forget everything but the count of states: a new session, or a clock was set."""
        self._pairing.reset()
        self._hand.reset()
        self._pixel_filter.reset()
        self._position_filter.reset()
        self._memory = trust.empty_memory(len(self._rig.marker_ids))
        self._anchors = np.full((len(self._rig.marker_ids), 3), np.nan)
        self._epoch_ns: int | None = None
        self._last_s = 0.0
        self._measured_s: float | None = None

    def ingest(self, observations: CameraObservations) -> None:
        """Take one frame in; about 10 µs."""
        self._pairing.ingest(observations)

    def solve(self) -> HandState | None:
        """The state that is due, or None."""
        clock = _Stopwatch()
        paired = self._pairing.due()
        if paired is None:
            return None
        t_s = self._seconds(paired.t_ns)
        clock.lap("pair")
        markers = self._locate(t_s, paired, clock)
        self._predict(t_s, markers)
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
            self._measured_s = None
        self._last_s = t_s
        return t_s

    def _locate(self, t_s: float, paired: Paired, clock: _Stopwatch) -> _Markers:
        """Raw positions decide what to believe; believed pixels are filtered and located again."""
        markers = _Markers(len(self._rig.cameras), len(self._rig.marker_ids))
        shapes = self._shapes()
        locate.choose_views(paired.flags, paired.live, markers.used, markers.doubtful)
        self._triangulate(paired.pixels, paired.covariances, shapes, markers.used, markers.raw, markers.covariances,
                          markers.errors)
        trust.judge(t_s, markers.raw, markers.covariances, self._memory, markers.believed, markers.restarted)
        markers.raw[~markers.believed] = np.nan
        markers.used &= markers.believed
        clock.lap("triangulate")
        if not self._filtering:
            markers.positions[:] = markers.raw
            return markers
        self._restart_filters(markers.restarted)
        pixels = np.where(markers.used[:, :, None], paired.pixels, np.nan)
        pixels = self._pixel_filter(t_s, pixels.reshape(-1)).reshape(pixels.shape)
        clock.lap("filter")
        self._triangulate(pixels, paired.covariances, shapes, markers.used.copy(), markers.positions,
                          np.empty_like(markers.covariances), np.empty_like(markers.errors))
        clock.lap("triangulate")
        markers.positions = self._position_filter(t_s, markers.positions.reshape(-1)).reshape(-1, 3)
        clock.lap("filter")
        markers.believed &= np.isfinite(markers.positions).all(axis=1)
        return markers

    def _triangulate(self, pixels: Array, pixel_covariances: Array, shapes: Array, used: Mask, positions: Array,
                     covariances: Array, errors: Array) -> None:
        rig = self._rig
        locate.locate_all(pixels, pixel_covariances, used, rig.intrinsics, rig.cameras, rig.focal, shapes, positions,
                          covariances, errors)

    def _shapes(self) -> Array:
        """The markers' bodies; a band lies as the hand's last pose says."""
        pose = self._hand.pose
        if pose is None or self._rig.band_half_axes is None:
            return self._rig.shapes
        shapes = self._rig.shapes.copy()
        shapes[self._rig.wrist] = ellipsoid(pose.world_from_palm[:3, :3], self._rig.band_half_axes)
        return shapes

    def _restart_filters(self, restarted: Mask) -> None:
        if restarted.any():
            cameras = len(self._rig.cameras)
            self._pixel_filter.reset(np.tile(np.repeat(restarted, 2), cameras))
            self._position_filter.reset(np.repeat(restarted, 3))

    def _predict(self, t_s: float, markers: _Markers) -> None:
        """Say where the markers out of sight should be, and how each is known."""
        self._anchors[markers.believed] = markers.positions[markers.believed]
        trust.predict(t_s, self._memory, markers.believed, self._anchors, markers.positions, markers.covariances)
        known = np.isfinite(markers.positions).all(axis=1)
        markers.knowledge[known] = Knowledge.INFERRED
        markers.knowledge[markers.believed & ~markers.doubtful] = Knowledge.MEASURED
        if (markers.knowledge == Knowledge.MEASURED).any():
            self._measured_s = t_s

    def _solve_hand(self, t_s: float, markers: _Markers) -> SolvedHand:
        rig = self._rig
        wrist, wrist_knowledge = np.full(3, np.nan), int(Knowledge.UNKNOWN)
        if rig.wrist >= 0:
            wrist, wrist_knowledge = markers.positions[rig.wrist], int(markers.knowledge[rig.wrist])
        tips, tip_knowledge = np.full((5, 3), np.nan), np.full(5, Knowledge.UNKNOWN, np.uint8)
        worn = rig.tips >= 0
        tips[worn] = markers.positions[rig.tips[worn]]
        tip_knowledge[worn] = markers.knowledge[rig.tips[worn]]
        return self._hand.solve(t_s, wrist, tips, wrist_knowledge, tip_knowledge)

    def _condition(self, t_s: float, paired: Paired, knowledge: NDArray[np.uint8]) -> Condition:
        if self._measured_s is None:
            return Condition.SEARCHING
        if paired.live.sum() < 2 or t_s - self._measured_s > LOST_AFTER_S:
            return Condition.LOST
        return Condition.TRACKING if (knowledge == Knowledge.MEASURED).all() else Condition.PARTIAL

    def _state(self, t_s: float, paired: Paired, markers: _Markers, hand: SolvedHand, clock: _Stopwatch) -> HandState:
        pixels, flags = self._pairing.last_seen()
        self._sequence += 1
        completed = paired.completed_by
        return HandState(
            sequence=self._sequence - 1,
            t_master_ns=paired.t_ns,
            t_receive_ns=completed.t_receive_ns,
            condition=self._condition(t_s, paired, markers.knowledge),
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
            latency_s={"detect": completed.detect_s, "network": completed.network_s, **clock.laps},
        )


class _Markers:
    """Work sheet of one state: C cameras, M markers."""

    def __init__(self, cameras: int, markers: int) -> None:
        self.used = np.zeros((cameras, markers), np.bool_)
        self.doubtful = np.zeros(markers, np.bool_)
        self.believed = np.zeros(markers, np.bool_)
        self.restarted = np.zeros(markers, np.bool_)
        self.raw = np.empty((markers, 3))
        self.positions = np.empty((markers, 3))
        self.covariances = np.empty((markers, 3, 3))
        self.errors = np.empty(markers)
        self.knowledge = np.full(markers, Knowledge.UNKNOWN, np.uint8)


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
