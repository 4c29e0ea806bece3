"""Aligns the world of another tracker (e.g. a Vive tracker's, RHOT 6.3.5) with the rig, from two streams of one motion.

The foreign tracker reports poses of a device; the rig reports positions of a fingertip or tag, or poses of a body, that
is rigidly connected to the device. For an instant t of the rig's clock the model is

    position(t) = R (P(t - offset) + Q(t - offset) p) + translation       rotation(t) = R Q(t - offset) S

with rig_from_foreign (R, translation), the device's pose (Q, P) and tracker_from_body (S, p). The start is linear in
the inverse rotation (hand-eye equations, Park and Martin 1994) and is projected onto rotations (Horn 1987, Umeyama
1991). Gauss-Newton steps with Student's t weights (Lange, Little and Taylor 1989) refine everything.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rhot_app.errors import CalibrationError
from rhot_app.estimation.least_squares import LEAST_DAMPING, Dense, fit_linear, minimise
from rhot_app.estimation.quantiles import chi_squared
from rhot_app.estimation.residual import Rows, student
from rhot_app.estimation.se3 import skew
from rhot_app.geometry.transforms import best_rotation, rigid
from rhot_app.objects.alignment.model import GAP_S, OFFSET, ROTATION, TRANSLATION, AlignmentEstimate, AlignmentModel
from rhot_app.objects.alignment.motion_stream import SAMPLES, MotionStream

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

SEARCH_S = 1.0
"""s: the offset between the clocks is searched within this, either way."""

STEP_S = 0.02
"""s: of the search, a tenth of a period at 5 Hz; hands wave more slowly."""

OVERLAP_S = 2.0
"""s: streams that overlap less are not aligned; a movement of a hand takes as long."""

LASTING_M = 0.5e-3
"""m: error of a fingertip's position that lasts and goes with its pose
(`tracking.markers.marker_model.PAINT_SD_M`, of a disc)."""

LASTING_S = 1.0
"""s: correlation time of that error (`hand.motion.hand_process.BIAS_S`)."""

AXES = 3
"""Numbers of a position's error, and of a rotation's."""

INLIER_GATE = float(chi_squared(0.999, AXES))
"""Squared Mahalanobis distance of an inlier: 99.9 % of Gaussian errors."""

KERNEL = student(4.0)
"""Heavy tails: either tracker fails now and then."""



def _weights(squared: Array) -> Array:
    return KERNEL.weights(squared, np.full(len(squared), float(AXES)))


def _weighted_square(squared: Array) -> float:
    """Of an axis, by squared Mahalanobis distances (N,) of three."""
    return float(np.mean(_weights(squared) * squared)) / AXES


_GAUSSIAN = _weighted_square(np.asarray(chi_squared((np.arange(1000) + 0.5) / 1000.0, AXES)))  # at unit variance
_LEVER_M = 0.1  # of the start: a rotation counts as the motion of a point this far away
_START_ROWS = 500
_ITERATIONS, _CONVERGED = 50, 1e-8


@dataclass(frozen=True, slots=True)
class AlignmentFit:
    """A solved alignment.

    `covariance` (10, 10) or (13, 13), by the noise of the residuals, and `lasting`, by errors that last (LASTING_M), in
    the order of `alignment.model.TRANSLATION`. `centre` (3,) m, rig frame, is the middle of the motion;
    `centre_covariance` (3, 3) m^2 of a position there, by both. `noise_m` and `noise_rad` (NaN without poses): standard
    deviation of an axis' residual. `errors` (N, 3) m, `inlier` (N,); `kept`: share of the samples that agree with their
    neighbours. `velocity` (N, 3) m/s and `places` (N, 3) m of the body, rig frame; `device` (N, 3, 3)
    foreign_from_device.
    """

    rig_from_foreign: Array
    tracker_from_body: Array
    offset_s: float
    covariance: Array
    lasting: Array
    centre: Array
    centre_covariance: Array
    noise_m: float
    noise_rad: float
    errors: Array
    inlier: Mask
    kept: float
    velocity: Array
    places: Array
    device: Array
    duration_s: float
    poses: bool

    @property
    def rms_m(self) -> float:
        """Root mean square distance of the inliers, m."""
        return float(np.sqrt(np.mean(np.sum(self.errors[self.inlier] ** 2, axis=1))))

    @property
    def inlier_ratio(self) -> float:
        """Share of the samples that agree with the alignment and with their neighbours."""
        return self.kept * float(np.mean(self.inlier))


@dataclass(frozen=True, slots=True)
class OffsetSearch:
    """The start: an estimate, the median residual, m, of each trial offset, and the foreign unit in metres (1: m)."""

    estimate: AlignmentEstimate
    offsets_s: Array
    median_m: Array
    scale: float


def align(foreign: MotionStream, rig: MotionStream, search_s: float = SEARCH_S,
          progress: Callable[[str, float], None] = lambda text, part: None) -> tuple[AlignmentFit, OffsetSearch]:
    """Solve for rig_from_foreign, tracker_from_body and the time offset.

    `foreign` has rotations. Raises CalibrationError when the streams are too short or do not overlap. Whether the
    motion determines the answer is for `rhot_app.objects.alignment.report.judge_alignment` to say.
    """
    if not foreign.has_rotations:
        raise CalibrationError("The foreign stream has positions only; its rotations are needed to find where the "
                               "fingertip sits on the tracker. Record its poses.")
    _require_overlap(foreign, rig, search_s)
    model = AlignmentModel(foreign.without_outliers(), rig.without_outliers())
    found = search(model, search_s, progress)
    model.select(found.estimate.offset_s)
    estimate, scales = found.estimate, (max(float(found.median_m.min()), 1e-6), 0.02)
    for part in (0.8, 0.9):
        estimate, scales = _solve(model, estimate, scales)
        model.select(estimate.offset_s)
        progress("refining the alignment", part)
    if model.count < SAMPLES:
        raise _no_overlap(foreign, rig)
    kept = (len(model.foreign.times_s) + 4) / len(foreign.times_s) * (len(model.rig.times_s) + 4) / len(rig.times_s)
    return _finished(model, estimate, scales, kept), found


def search(model: AlignmentModel, search_s: float, progress: Callable[[str, float], None]) -> OffsetSearch:
    """Solve linearly for every trial offset; the best one begins the refinement."""
    steps = math.ceil(search_s / STEP_S)
    offsets = np.array([STEP_S * step for step in range(-steps, steps + 1)])
    median, starts = np.full(len(offsets), np.inf), {}
    for number, offset_s in enumerate(offsets):
        model.select(offset_s)
        model.thin(_START_ROWS)
        if model.count >= SAMPLES:
            starts[number] = linear_start(model, float(offset_s))
            median[number] = starts[number][1]
        progress("searching the time offset", 0.7 * number / len(offsets))
    if not starts:
        raise _no_overlap(model.foreign, model.rig)
    best = int(np.argmin(median))
    return OffsetSearch(starts[best][0], offsets, median, starts[best][2])


def linear_start(model: AlignmentModel, offset_s: float) -> tuple[AlignmentEstimate, float, float]:
    """The estimate for a known time offset, its median residual, m, and the scale of the foreign world (1: metres).

    P = N z - Q p + k, with N the inverse rotation, is linear in N, p and k; poses add that N turns the body's rotation
    vectors into the device's. N is then projected onto the rotations; its singular values are the foreign scale.
    """
    (place, _, device, _), (seen, _, seen_rotation, _) = model.sampled(offset_s)
    middle = seen.mean(axis=0)
    count = len(place)
    columns = np.zeros((count, 3, 15))
    for axis in range(3):
        columns[:, axis, 3 * axis:3 * axis + 3] = seen - middle
    columns[:, :, 9:12], columns[:, :, 12:15] = -device, np.eye(3)
    target = place - model.centre
    if model.poses:
        first, later = slice(None, -(count // 10)), slice(count // 10, None)
        turn = _LEVER_M * Rotation.from_matrix(device[later] @ device[first].transpose(0, 2, 1)).as_rotvec()
        body = _LEVER_M * Rotation.from_matrix(seen_rotation[later] @ seen_rotation[first].transpose(0, 2, 1)
                                               ).as_rotvec()
        more = np.zeros((len(turn), 3, 15))
        for axis in range(3):
            more[:, axis, 3 * axis:3 * axis + 3] = body
        columns, target = np.concatenate([columns, more]), np.concatenate([target, turn])
    solution, _ = fit_linear(columns, target, KERNEL, rounds=4, rcond=1e-3)
    inverse = solution[:9].reshape(3, 3)
    sizes = np.linalg.svd(inverse, compute_uv=False)
    rotation = best_rotation(inverse.T)
    predicted = (target[:count] + device @ solution[9:12]) @ rotation.T
    centre = np.median(seen - predicted, axis=0)
    body_rotation = np.eye(3)
    if model.poses:
        body_rotation = best_rotation(np.einsum("nji,nkj,nkl->il", device, rotation[None], seen_rotation))
    estimate = AlignmentEstimate(rotation, centre, solution[9:12], offset_s, body_rotation)
    median = float(np.sqrt(np.median(np.sum((target - columns @ solution)[:count] ** 2, axis=1))))
    return estimate, median / max(float(sizes[1]), 1e-12), float(np.mean(sizes[:2]))


def _rows(model: AlignmentModel, scales: tuple[float, float], estimate: AlignmentEstimate) -> list[Rows]:
    error, jacobian, turned, by = model.linearise(estimate)
    rows = []
    for each, slopes, scale in ((error, jacobian, scales[0]), (turned, by, scales[1])):
        if len(each):
            rows.append(Rows(each.ravel() / scale, slopes.reshape(-1, model.size) / scale, np.ones(()), KERNEL,
                             np.arange(0, each.size, AXES)))
    return rows


def _solve(model: AlignmentModel, estimate: AlignmentEstimate, scales: tuple[float, float]) \
        -> tuple[AlignmentEstimate, tuple[float, float]]:
    """The most probable estimate and the scales of the residuals, m and rad: a Gauss-Newton step, then the scales' next
    iterate, up to their fixed point."""
    for _ in range(_ITERATIONS):
        start = Dense(estimate, partial(_rows, model, scales), AlignmentEstimate.moved, model.size)
        found, _ = minimise(start, steps=1, least_gain=0.0, damping=LEAST_DAMPING)
        estimate, before, scales = found.state, scales, _rescaled(model, found.state, scales)
        if start.cost - found.cost < _CONVERGED * model.count and abs(math.log(scales[0] / before[0])) < 1e-4:
            break
    return estimate, scales


def _rescaled(model: AlignmentModel, estimate: AlignmentEstimate, scales: tuple[float, float]) -> tuple[float, float]:
    """The scales' next iterate: the weighted mean square over what it is for Gaussian errors."""
    out = []
    for rows, scale in zip(_rows(model, scales, estimate), scales, strict=False):
        squared = np.sum(rows.error.reshape(-1, 3) ** 2, axis=1)
        out.append(max(scale * math.sqrt(_weighted_square(squared) / _GAUSSIAN), 1e-9))
    return out[0], out[1] if len(out) > 1 else scales[1]


def _finished(model: AlignmentModel, estimate: AlignmentEstimate, scales: tuple[float, float],
              kept: float) -> AlignmentFit:
    rows = _rows(model, scales, estimate)
    covariance, curvature = _covariance(rows, model.size)
    # to a long recording an error of correlation time T is white noise of spectral density 2 T s^2
    lasting = curvature * 2.0 * LASTING_S * (LASTING_M / scales[0]) ** 2 * model.count / model.duration_s
    offset = estimate.rotation @ model.centre
    change = np.eye(model.size)
    change[TRANSLATION, ROTATION] = skew(offset)
    error, jacobian, _, _ = model.linearise(estimate)
    (_, _, device, _), (places, _, _, _) = model.sampled(estimate.offset_s)
    inlier = np.sum(rows[0].error.reshape(-1, 3) ** 2, axis=1) < INLIER_GATE
    return AlignmentFit(
        rigid(estimate.rotation, estimate.centre - offset), rigid(estimate.body, estimate.point), estimate.offset_s,
        change @ covariance @ change.T, change @ lasting @ change.T, estimate.centre,
        (covariance + lasting)[TRANSLATION, TRANSLATION], scales[0], scales[1] if model.poses else math.nan, error,
        inlier, kept, -jacobian[:, :, OFFSET.start], places, device, model.duration_s, model.poses)


def _covariance(rows: list[Rows], size: int) -> tuple[Array, Array]:
    """Covariance and inverse Hessian of whitened rows. The first is the sandwich of an M-estimator (Huber 1967), its
    scores correlated over time (Newey and West 1987)."""
    hessian, scores = np.zeros((size, size)), np.zeros((len(rows[0].error) // 3, size))
    for each in rows:
        error, slopes = each.error.reshape(-1, 3), each.jacobian.reshape(-1, 3, size)
        squared = np.sum(error**2, axis=1)
        weights = _weights(squared)
        bend = np.where(weights < 1.0, 2.0 * weights**2 / (KERNEL.parameter + AXES), 0.0)
        along = np.einsum("ni,nij->nj", error, slopes)
        hessian += np.einsum("n,nij,nik->jk", weights, slopes, slopes) - np.einsum("n,nj,nk->jk", bend, along, along)
        scores += weights[:, None] * along
    count = len(scores)
    lags = int(4.0 * (count / 100.0) ** (2.0 / 9.0))
    middle = scores.T @ scores
    for lag in range(1, lags + 1):
        product = scores[lag:].T @ scores[:-lag]
        middle += (1.0 - lag / (lags + 1.0)) * (product + product.T)
    sizes = np.sqrt(np.maximum(np.abs(np.diag(hessian)), 1e-300))
    bread = np.linalg.pinv(hessian / np.outer(sizes, sizes), rcond=1e-12, hermitian=True) / np.outer(sizes, sizes)
    return np.asarray(bread @ middle @ bread * count / max(count - size, 1)), np.asarray(bread)


def _require_overlap(foreign: MotionStream, rig: MotionStream, search_s: float) -> None:
    first = max(foreign.times_s[0] - search_s, rig.times_s[0])
    last = min(foreign.times_s[-1] + search_s, rig.times_s[-1])
    if last - first < OVERLAP_S:
        raise _no_overlap(foreign, rig)


def _no_overlap(foreign: MotionStream, rig: MotionStream) -> CalibrationError:
    return CalibrationError(
        f"The streams do not overlap: the foreign one is from {foreign.times_s[0]:.3f} to {foreign.times_s[-1]:.3f} s, "
        f"the rig's from {rig.times_s[0]:.3f} to {rig.times_s[-1]:.3f} s. Record both at once, with times of one "
        f"clock; the faster one needs a sample every {1e3 * GAP_S:.0f} ms.")

