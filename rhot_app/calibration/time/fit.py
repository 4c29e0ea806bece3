"""Finds the cameras' times: a coarse search over offsets, then Gauss-Newton with weights that outliers lose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.time.model import TimeModel, Times
from rhot_app.errors import CalibrationError
from rhot_app.progress import Progress, silent

Array = NDArray[np.float64]

SEARCH_S, SEARCH_STEP_S = 0.15, 0.003
"""Offsets that are tried: a driver may hold a picture back for some frames."""

ROW_PRIOR_S = 60e-6
"""What is known of a row time beforehand, standard deviation about what the node says: sensors take 5 to 70 us."""

_OFFSET_PRIOR_S = 0.5
_HELD_S = 1e-9
SOFT = 0.1
"""A hand is not stiff: so far its change of shape may go with its speed, as a correlation, and look like a row time."""

_ITERATIONS = 30
_SETTLED_S = 1e-6, 2e-8  # steps of offsets and row times
_TUKEY = 4.685
_BLOCK_S = 1.0
_LEAST_SAMPLES = 40  # shared by two cameras


@dataclass(frozen=True, slots=True)
class OffsetSearch:
    """The coarse search of one camera against another: rms px (robust) over offsets (N,) s."""

    camera: int
    against: int
    offsets_s: Array
    rms_px: Array

    @property
    def best_s(self) -> float:
        """Where the rays meet best."""
        return float(self.offsets_s[int(np.nanargmin(self.rms_px))])

    @property
    def rival(self) -> float:
        """The smallest rms further than 30 ms from the best, as a multiple of the best: near 1 means that the movement
        repeats itself so evenly that one period passes for another."""
        far = np.abs(self.offsets_s - self.best_s) > 0.03
        return float(np.nanmin(self.rms_px[far]) / np.nanmin(self.rms_px)) if far.any() else np.inf


@dataclass(frozen=True, slots=True)
class TimeFit:
    """Times with their covariance (2 C, 2 C) s^2; what is left of the misses (E,) px, misalignment taken off, and their
    derivatives (E, 2 C) px/s."""

    times: Times
    covariance: Array
    left_px: Array
    slopes: Array

    @property
    def sd(self) -> Times:
        """Standard deviations; 0 for the reference camera's offset."""
        return Times.of(np.sqrt(np.maximum(np.diagonal(self.covariance), 0.0)))


def search(model: TimeModel, reference: int = 0) -> tuple[Times, tuple[OffsetSearch, ...]]:
    """Offsets to within a few ms, each camera against one that is known already; row times as the nodes say.

    Raises CalibrationError when some camera shares no moving marker with any other.
    """
    count = len(model.cameras)
    offsets, rows = np.zeros(count), np.array([camera.row_time_s for camera in model.cameras])
    shared = {(pair.first, pair.second): _shared(model, k) for k, pair in enumerate(model.pairs)}
    known, searches = {reference}, []
    while len(known) < count:
        links = [(number, k) for k, ((a, b), number) in enumerate(shared.items()) if (a in known) != (b in known)]
        number, k = max(links)
        if number < _LEAST_SAMPLES:
            missing = ", ".join(model.cameras[c].name for c in range(count) if c not in known)
            raise CalibrationError(f"camera {missing} never saw a marker beyond doubt at the same time as the others. "
                                   "Wave where all cameras see the markers, for 20 s.")
        pair = model.pairs[k]
        camera, against = (pair.first, pair.second) if pair.second in known else (pair.second, pair.first)
        found = _scan(model, k, camera, against, Times(offsets, rows))
        offsets[camera] = found.best_s
        searches.append(found)
        known.add(camera)
    return Times(offsets, rows), tuple(searches)


def fit(model: TimeModel, start: Times, *, reference: int = 0, hold_rows: bool = False,
        progress: Progress = silent) -> TimeFit:
    """Improve `start`. `hold_rows`: the nodes' row times are taken for true, only offsets are sought."""
    priors = np.concatenate([np.full(len(model.cameras), _OFFSET_PRIOR_S),
                             np.full(len(model.cameras), _HELD_S if hold_rows else ROW_PRIOR_S)])
    priors[reference] = _HELD_S
    middle = np.concatenate([np.zeros(len(model.cameras)), [camera.row_time_s for camera in model.cameras]])
    middle[:len(model.cameras)] = start.offsets_s
    if hold_rows:
        start = Times(start.offsets_s, middle[len(model.cameras):])
    vector, free = start.vector, len(middle)
    nuisance = model.misalignment()
    for k in range(_ITERATIONS):
        progress("fitting the cameras' times", k / _ITERATIONS)
        system = _System(model, Times.of(vector), nuisance, priors, middle)
        step = system.step()
        vector = vector + step[:free]
        if (np.abs(step[:free]) < np.repeat(_SETTLED_S, len(model.cameras))).all():
            break
    system = _System(model, Times.of(vector), nuisance, priors, middle)
    step = system.step()
    left = system.found.miss_px + nuisance @ step[free:]
    return TimeFit(Times.of(vector), system.covariance()[:free, :free], left, system.found.miss_slopes)


class _System:
    """The normal equations at one place, residuals in units of their own spread, and what they say of certainty."""

    def __init__(self, model: TimeModel, times: Times, nuisance: Array, priors: Array, middle: Array) -> None:
        self.found = found = model.residuals(times)
        unknowns = found.miss_slopes.shape[1] + nuisance.shape[1]
        seen, known = np.isfinite(found.miss_px), np.isfinite(found.breath_m)
        groups = model.breath_group[known]
        aligned = np.linalg.lstsq(nuisance[seen], -found.miss_px[seen], rcond=None)[0]
        scale = _spread(found.miss_px[seen] + nuisance[seen] @ aligned)
        scales = np.array([_spread(found.breath_m[known][groups == k]) for k in range(len(model.marker_pairs))])[groups]
        residuals = np.concatenate([found.miss_px[seen] / scale, found.breath_m[known] / scales])
        self._jacobian = np.zeros((len(residuals), unknowns))
        count = int(seen.sum())
        self._jacobian[:count] = np.column_stack([found.miss_slopes[seen], nuisance[seen]]) / scale
        self._jacobian[count:, :found.breath_slopes.shape[1]] = found.breath_slopes[known] / scales[:, None]
        still = residuals.copy()
        still[:count] += nuisance[seen] @ aligned / scale
        self._weights = np.square(np.clip(1.0 - np.square(still / _TUKEY), 0.0, None))
        together = self._jacobian[count:, len(model.cameras):2 * len(model.cameras)].sum(axis=1)
        self._weights[count:] *= _stiffness(together, groups)
        self._residuals = residuals
        self._prior = np.zeros(unknowns)
        self._prior[:len(priors)] = 1.0 / np.square(priors)
        self._pull = np.zeros(unknowns)
        self._pull[:len(priors)] = self._prior[:len(priors)] * (times.vector - middle)
        self._blocks = np.concatenate([model.miss_times_s[seen], model.breath_times_s[known]]) // _BLOCK_S
        self._normal = (self._jacobian * self._weights[:, None]).T @ self._jacobian + np.diag(self._prior)

    def step(self) -> Array:
        """(U,) change of times, then the misalignment itself."""
        gradient = (self._jacobian * self._weights[:, None]).T @ self._residuals + self._pull
        return -np.linalg.solve(self._normal, gradient)

    def covariance(self) -> Array:
        """(U, U): the larger of what the noise says and what blocks of a second say of each other (a sandwich), since
        errors of one second are alike."""
        inverse = np.linalg.inv(self._normal)
        left = self._residuals + self._jacobian @ self.step()
        scores = self._jacobian * (self._weights * left)[:, None]
        _, block = np.unique(self._blocks, return_inverse=True)
        sums = np.zeros((int(block.max()) + 1, scores.shape[1]))
        np.add.at(sums, block, scores)
        meat = len(sums) / max(len(sums) - 1, 1) * sums.T @ sums + np.diag(self._prior)
        sandwich = inverse @ meat @ inverse
        widen = np.sqrt(np.maximum(np.diagonal(sandwich) / np.diagonal(inverse), 1.0))
        return inverse * np.outer(widen, widen)


def _stiffness(slopes: Array, groups: NDArray[np.int64]) -> float:
    """By how much the distances' say is lessened, 0..1, so that they tell the common row time no better than a
    correlation of SOFT with all of them would falsify it. `slopes` (R,): what a row time changes in each distance, in
    units of its marker pair's spread, per s."""
    strengths = np.array([np.sqrt(np.mean(np.square(slopes[groups == group]))) for group in np.unique(groups)])
    total = float(np.sum(np.square(slopes)))
    if not total > 0.0:
        return 1.0
    softness_s = SOFT * float(strengths.sum()) / float(strengths @ strengths)
    return min(1.0, 1.0 / (softness_s**2 * total))


def _shared(model: TimeModel, pair: int) -> int:
    """How many samples two cameras share, at the nodes' own times or at the best offset of the coarse grid."""
    count = len(model.cameras)
    rows = np.array([camera.row_time_s for camera in model.cameras])
    found = model.pair_misses(model.pairs[pair], Times(np.zeros(count), rows))
    return int(np.count_nonzero(np.isfinite(found)))


def _scan(model: TimeModel, pair: int, camera: int, against: int, times: Times) -> OffsetSearch:
    grid = np.arange(-SEARCH_S, SEARCH_S + 0.5 * SEARCH_STEP_S, SEARCH_STEP_S)
    rms = np.full(len(grid), np.nan)
    for k, offset in enumerate(grid):
        trial = times.offsets_s.copy()
        trial[camera] = times.offsets_s[against] + offset
        miss = model.pair_misses(model.pairs[pair], Times(trial, times.row_times_s))
        miss = miss[np.isfinite(miss)]
        if len(miss) >= _LEAST_SAMPLES:
            rms[k] = _spread(miss)
    return OffsetSearch(camera, against, times.offsets_s[against] + grid, rms)


def _spread(values: Array) -> float:
    """Standard deviation by the median of magnitudes about the median; never 0."""
    if not len(values):
        return 1.0
    return max(1.4826 * float(np.median(np.abs(values - np.median(values)))), 1e-9)
