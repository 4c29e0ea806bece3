"""Watches a running rig for calibrations that have gone stale, and says which one mends what it sees.

Fed some times a second with what the tracker publishes anyway; judges the last twenty seconds. Every finding is gone
once what it saw is: nothing is latched.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.registry import calibrations
from rhot_app.calibration.verdict import Finding
from rhot_app.hand.model import build_model
from rhot_app.hand.skeleton import FINGERS, TIP_ROLES, WRIST_ROLE
from rhot_app.project import Rig
from rhot_node.wire.messages import MarkerFlag

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# -- advice on stale calibrations --------------------------------------------------------------------------------------

FAIR_ERROR_PX = 0.5
"""Median reprojection error (rms over cameras; half the distance of a pair's epipolar lines). A calibrated rig has 0.1
to 0.3; markers are refused from 2.5 on."""


@dataclass(frozen=True, slots=True)
class HealthFinding:
    """A finding and the name of the calibration that mends it (`calibration.registry`)."""

    mender: str
    finding: Finding


@dataclass(frozen=True, slots=True)
class RigidDrift:
    """Two markers on one bone: their distance in the run's first seconds, and now, m."""

    markers: tuple[str, str]
    learnt_m: float
    now_m: float


@dataclass(frozen=True, slots=True)
class Reach:
    """How far a fingertip's marker was from the wrist (95th percentile), and the sum of the bones between, m."""

    marker: str
    seen_m: float
    longest_m: float


@dataclass(frozen=True, slots=True)
class MarkerQuality:
    """A marker in one camera: median quality of plain observations, and the part of all in which another blob of its
    colour was as likely; NaN where seen too seldom."""

    camera: str
    marker: str
    quality: float
    ambiguous: float


@dataclass(frozen=True, slots=True)
class HealthFigures:
    """Twenty seconds. `errors_px`: median reprojection error of all, of slow and of fast markers, NaN unknown.
    `misfit`: why rays may miss each other, as `misfit_cause` says of the rig."""

    errors_px: tuple[float, float, float]
    misfit: str
    rigid: tuple[RigidDrift, ...]
    reaches: tuple[Reach, ...]
    qualities: tuple[MarkerQuality, ...]

    @property
    def late(self) -> bool:
        """Whether the rays of fast markers alone miss each other."""
        _, slow, fast = self.errors_px
        return slow < FAIR_ERROR_PX < fast and fast > 2.0 * slow

    @property
    def apart(self) -> bool:
        """Whether the rays of all markers do."""
        return self.errors_px[0] > FAIR_ERROR_PX and not self.late


def misfit_cause(rig: Rig) -> str:
    """Why the rays of a rig's cameras may miss each other, by what the rig says of its calibration."""
    if rig.depth.mode == "disparity":
        return "The rig has no stereo calibration: it takes its cameras for equal and parallel."
    if rig.calibration is None:
        return "The rig has no stereo calibration, and its cameras do not stand as it says."
    if rig.calibration.method == "outdated":
        return "Intrinsics were calibrated anew after the stereo calibration."
    return "The stereo calibration is stale: a camera was moved or turned, or its lens refocused."


def findings_of(figures: HealthFigures) -> tuple[HealthFinding, ...]:
    """All findings, the gravest first. Comparisons with what is not known are false, and so say nothing."""
    found = [HealthFinding(one.name, finding) for one in calibrations() for finding in one.check(figures)]
    return tuple(sorted(found, key=lambda one: -one.finding.grade.rank))


# -- the monitor of a running rig --------------------------------------------------------------------------------------

WINDOW_S = 20.0
_CAPACITY = 240  # samples: the window at 12 Hz; faster feeding shortens it
_LEARN_SAMPLES = 100  # of a rigid distance that no calibration states
_LEAST_SAMPLES = 50  # of one figure, before it is judged
_LEAST_ERRORS = 150  # over all markers
_SLOW_M_S, _FAST_M_S = 0.15, 0.4

_DOUBTFUL = int(MarkerFlag.LOST | MarkerFlag.PARTIAL | MarkerFlag.EDGE | MarkerFlag.AMBIGUOUS)
_AMBIGUOUS, _LOST = int(MarkerFlag.AMBIGUOUS), int(MarkerFlag.LOST)
_PALM_WORDS = ("hand_", "palm_", "back_of_hand")


@dataclass(frozen=True, slots=True)
class HealthSample:
    """One look at a running tracker. M markers, C cameras.

    `t_ns` of the state; `positions` (M, 3) m unfiltered, NaN where not located; `measured` (M,); `errors_px` (M,) rms
    reprojection error, told for refused markers too; `qualities` (C, M) and `flags` (C, M) of the cameras' newest
    frames.
    """

    t_ns: int
    positions: Array
    measured: Mask
    errors_px: Array
    qualities: Array
    flags: NDArray[np.uint16]


class HealthMonitor:
    """Looks at painted markers alone: landmarks err by pixels where the calibration is right.

    `feed` it up to twelve times a second (50 µs), ask for `findings` every few seconds (below a millisecond). One
    thread. A new rig needs a new one.
    """

    def __init__(self, rig: Rig) -> None:
        roles = [marker.role or "" for marker in rig.markers.markers]
        cameras, markers = len(rig.nodes), len(roles)
        self._rig = rig
        self._painted = np.array([marker.shape != "landmark" for marker in rig.markers.markers])
        self._stereo = rig.depth.mode == "stereo"
        self._wrist = roles.index(WRIST_ROLE) if WRIST_ROLE in roles else -1
        tips = [(finger, roles.index(role)) for finger, role in enumerate(TIP_ROLES) if role in roles]
        self._tips = np.array([marker for _, marker in tips], dtype=np.intp)
        model = build_model(rig.hand)
        longest_m = np.linalg.norm(model.base, axis=1) + model.chain.sum(axis=1)
        self._longest_m = [float(longest_m[finger]) for finger, _ in tips]
        self._rigid = [(a, b) for a, b in itertools.combinations(range(markers), 2) if _one_bone(roles[a], roles[b])]
        self._times = np.empty(_CAPACITY)
        self._errors, self._speeds = np.empty((2, _CAPACITY, markers))
        self._reaches = np.empty((_CAPACITY, len(tips)))
        self._distances = np.empty((_CAPACITY, len(self._rigid)))
        self._qualities, self._ambiguous = np.empty((2, _CAPACITY, cameras, markers))
        self.reset()

    def reset(self) -> None:
        """Forget everything: a new run begins."""
        for ring in (self._times, self._errors, self._speeds, self._reaches, self._distances, self._qualities,
                     self._ambiguous):
            ring[:] = np.nan
        self._count = 0
        self._last: HealthSample | None = None
        self._learnt: list[list[float]] = [[] for _ in self._rigid]

    def feed(self, sample: HealthSample) -> None:
        """Take one sample; a step back in time begins anew."""
        if self._last is not None and sample.t_ns < self._last.t_ns:
            self.reset()
        row = self._count % _CAPACITY
        positions = np.where(sample.measured[:, None], sample.positions, np.nan)
        self._times[row] = 1e-9 * sample.t_ns
        self._errors[row] = np.where(self._painted, sample.errors_px, np.nan)
        self._speeds[row] = self._speed(sample)
        self._reaches[row] = np.linalg.norm(positions[self._tips] - positions[self._wrist], axis=1)
        for k, (a, b) in enumerate(self._rigid):
            self._distances[row, k] = distance = float(np.linalg.norm(positions[a] - positions[b]))
            if len(self._learnt[k]) < _LEARN_SAMPLES and np.isfinite(distance):
                self._learnt[k].append(distance)
        self._qualities[row] = np.where((sample.flags & _DOUBTFUL != 0) | ~self._painted, np.nan, sample.qualities)
        self._ambiguous[row] = np.where((sample.flags & _LOST != 0) | ~self._painted, np.nan,
                                        (sample.flags & _AMBIGUOUS) != 0)
        self._count += 1
        self._last = sample

    def findings(self) -> tuple[HealthFinding, ...]:
        """What is stale now, the gravest first; empty when all is well or too little was seen."""
        if self._last is None:
            return ()
        rows = self._times > 1e-9 * self._last.t_ns - WINDOW_S
        return findings_of(HealthFigures(
            errors_px=self._error(rows), misfit=misfit_cause(self._rig), rigid=tuple(self._rigid_drifts(rows)),
            reaches=tuple(self._reach(rows)), qualities=tuple(self._marker_qualities(rows))))

    def _speed(self, sample: HealthSample) -> Array:
        """(M,) m/s since the sample before; NaN where not known or too long ago."""
        last = self._last
        if last is None or not 0 < sample.t_ns - last.t_ns < 400_000_000:
            return np.full(len(sample.positions), np.nan)
        way = np.linalg.norm(sample.positions - last.positions, axis=1)
        return np.asarray(way / (1e-9 * (sample.t_ns - last.t_ns)))

    def _error(self, rows: Mask) -> tuple[float, float, float]:
        """Median reprojection error of all samples, of slow and of fast ones, px; NaN where too few."""
        errors, speeds = self._errors[rows], self._speeds[rows]
        known = np.isfinite(errors)
        return (_median(errors[known], _LEAST_ERRORS), _median(errors[known & (speeds < _SLOW_M_S)], _LEAST_SAMPLES),
                _median(errors[known & (speeds > _FAST_M_S)], _LEAST_SAMPLES))

    def _rigid_drifts(self, rows: Mask) -> list[RigidDrift]:
        ids = self._rig.markers.ids
        now = _quantiles(self._distances[rows], 0.5).tolist()
        return [RigidDrift((ids[a], ids[b]), float(np.median(learnt)), distance)
                for (a, b), learnt, distance in zip(self._rigid, self._learnt, now, strict=True)
                if len(learnt) == _LEARN_SAMPLES and np.isfinite(distance)]

    def _reach(self, rows: Mask) -> list[Reach]:
        """Nothing for a rig whose distances are estimates, nor without a wrist."""
        if not self._stereo or self._wrist < 0:
            return []
        found = []
        for k, far in enumerate(_quantiles(self._reaches[rows], 0.95)):
            if np.isfinite(far):
                found.append(Reach(self._rig.markers.ids[self._tips[k]], float(far), self._longest_m[k]))
        return found

    def _marker_qualities(self, rows: Mask) -> list[MarkerQuality]:
        cameras, ids = [node.name for node in self._rig.nodes], self._rig.markers.ids
        qualities = _quantiles(self._qualities[rows].reshape(-1, len(cameras) * len(ids)), 0.5)
        doubled = self._ambiguous[rows].reshape(-1, len(cameras) * len(ids))
        known = np.isfinite(doubled).sum(axis=0)
        parts = np.where(known >= _LEAST_SAMPLES, np.nansum(doubled, axis=0) / np.maximum(known, 1), np.nan)
        return [MarkerQuality(camera, marker, quality, part) for (camera, marker), quality, part in zip(
            itertools.product(cameras, ids), qualities.tolist(), parts.tolist(), strict=True)]


def _one_bone(first: str, second: str) -> bool:
    """Whether two markers sit on one bone, by their roles: both on the back of the hand, or on the same phalanx."""
    if first.startswith(_PALM_WORDS) and second.startswith(_PALM_WORDS):
        return True
    return first != "" and first == second and first.split("_")[0] in FINGERS


def _median(values: Array, least: int) -> float:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) >= least else float("nan")


def _quantiles(columns: Array, part: float) -> Array:
    """The quantile of each column (N, K), NaN where it has too few values. All at once: this runs beside a tracker."""
    known = np.isfinite(columns).sum(axis=0)
    if not len(columns):
        return np.full(columns.shape[1], np.nan)
    ordered = np.sort(columns, axis=0)  # NaN last
    found = ordered[np.maximum(np.rint(part * (known - 1)), 0.0).astype(np.intp), np.arange(columns.shape[1])]
    return np.where(known >= _LEAST_SAMPLES, found, np.nan)
