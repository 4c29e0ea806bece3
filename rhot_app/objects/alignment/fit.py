"""Aligns the world of another tracker (e.g. a Vive tracker's, RHOT 6.3.5) with the rig, from two streams of one motion.

The foreign tracker reports poses of a device; the rig reports positions of a fingertip or tag that is rigidly connected
to it. For an instant t of the rig's clock the model is

    position(t) = R (P(t - offset) + Q(t - offset) p) + translation

with rig_from_foreign (R, translation), the device's pose (Q, P) and p, the origin of tracker_from_body. The start is
linear in the inverse rotation (hand-eye equations, Park and Martin 1994), which is projected onto rotations (Horn 1987,
Umeyama 1991). Gauss-Newton steps with Student's t weights (Lange, Little and Taylor 1989) refine everything.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.errors import CalibrationError
from rhot_app.estimation.least_squares import LEAST_DAMPING, Dense, fit_linear, minimise
from rhot_app.estimation.quantiles import chi_squared
from rhot_app.estimation.residual import UNIT, Rows, student
from rhot_app.estimation.se3 import exp_so3, skew
from rhot_app.geometry.transforms import best_rotation, rigid
from rhot_app.objects.alignment.motion_stream import SAMPLES, MotionStream
from rhot_app.objects.pose import CONVERGED, STEPS

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

UNKNOWNS = 10
TRANSLATION, ROTATION, POINT, OFFSET = (slice(first, min(first + 3, UNKNOWNS)) for first in range(0, UNKNOWNS, 3))
"""Order of the covariance: rig_from_foreign's translation (m) and rotation (rad, along the rig's axes),
tracker_from_body's translation (m, the device's axes), and the time offset (s)."""

GAP_S = 0.04
"""s: no interpolation across longer intervals. A cubic spline errs by 5/384 h^4 |x''''| (de Boor 1978), here 0.3 mm for
10 mm at 5 Hz."""

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

INLIER_GATE = float(chi_squared(0.999, 3))
"""Squared Mahalanobis distance of an inlier: 99.9 % of Gaussian errors."""

KERNEL = student(4.0)
"""Heavy tails: either tracker fails now and then."""

ROUNDS = 4
"""Of a robust fit and its noise, by turns: after them neither changes."""

_START_ROWS = 10 * SAMPLES  # of the search


@dataclass(frozen=True, slots=True)
class AlignmentEstimate:
    """The unknowns: `rotation` (3, 3) rig_from_foreign; `centre` (3,) m, where the rig sees the foreign point
    `AlignmentModel.centre`; `point` (3,) m on the device; `offset_s`, rig less foreign clock."""

    rotation: Array
    centre: Array
    point: Array
    offset_s: float

    def moved(self, step: Array) -> AlignmentEstimate:
        """After a step (UNKNOWNS,) in the order of the covariance."""
        return AlignmentEstimate(exp_so3(step[ROTATION]) @ self.rotation, self.centre + step[TRANSLATION],
                                 self.point + step[POINT], self.offset_s + float(step[OFFSET][0]))


class AlignmentModel:
    """The residuals of two streams at the samples of the sparser one, whose noise is then hardly correlated."""

    def __init__(self, foreign: MotionStream, rig: MotionStream) -> None:
        self.foreign, self.rig = foreign, rig
        self.at_rig = len(rig.times_s) / rig.duration_s <= len(foreign.times_s) / foreign.duration_s
        self.centre = foreign.positions.mean(axis=0)
        self._times = rig.times_s if self.at_rig else foreign.times_s

    def select(self, offset_s: float) -> None:
        """Use the instants at which the other stream can be interpolated, if `offset_s` is about true."""
        if self.at_rig:
            self._times = self.rig.times_s[self.foreign.covers(self.rig.times_s - offset_s, GAP_S)]
        else:
            self._times = self.foreign.times_s[self.rig.covers(self.foreign.times_s + offset_s, GAP_S)]

    @property
    def count(self) -> int:
        """Instants used."""
        return len(self._times)

    @property
    def duration_s(self) -> float:
        """From the first used instant to the last."""
        return float(self._times[-1] - self._times[0])

    def thin(self, count: int) -> None:
        """Use at most so many instants."""
        self._times = self._times[::max(1, math.ceil(len(self._times) / count))]

    def sampled(self, offset_s: float) -> tuple[tuple[Array, Array, Array, Array], tuple[Array, Array, Array, Array]]:
        """Position, velocity, rotation and angular velocity of the device and of the body at the used instants."""
        foreign_s, rig_s = ((self._times - offset_s, self._times) if self.at_rig else
                            (self._times, self._times + offset_s))
        return self.foreign.at(foreign_s), self.rig.at(rig_s)

    def linearise(self, estimate: AlignmentEstimate) -> tuple[Array, Array]:
        """Errors (N, 3) m, and the Jacobian (N, 3, UNKNOWNS) of the predicted positions: minus that of the error."""
        (place, speed, device, turning), (seen, seen_speed, _, _) = self.sampled(estimate.offset_s)
        arm = device @ estimate.point
        predicted = (place - self.centre + arm) @ estimate.rotation.T
        jacobian = np.zeros((len(place), 3, UNKNOWNS))
        jacobian[:, :, TRANSLATION] = np.eye(3)
        jacobian[:, :, ROTATION] = -skew(predicted)
        jacobian[:, :, POINT] = estimate.rotation @ device
        body_speed = (speed + np.cross(turning, arm)) @ estimate.rotation.T if self.at_rig else seen_speed
        jacobian[:, :, OFFSET.start] = -body_speed
        return seen - predicted - estimate.centre, jacobian

    def noise_m(self, estimate: AlignmentEstimate) -> float:
        """Standard deviation of an axis' error, by the median distance."""
        squared = np.sum(self.linearise(estimate)[0] ** 2, axis=1)
        return math.sqrt(max(float(np.median(squared)) / float(chi_squared(0.5, 3)), 1e-18))


@dataclass(frozen=True, slots=True)
class AlignmentFit:
    """A solved alignment.

    `covariance` (UNKNOWNS, UNKNOWNS), by the noise of the residuals, and `lasting`, by errors that last (LASTING_M), in
    the order of TRANSLATION. `centre` (3,) m, rig frame, is the middle of the motion; `centre_covariance` (3, 3) m^2 of
    a position there, by both. `noise_m`: standard deviation of an axis' residual. `errors` (N, 3) m, `inlier` (N,);
    `kept`: share of the samples that agree with their neighbours. `velocity` (N, 3) m/s and `places` (N, 3) m of the
    body, rig frame; `device` (N, 3, 3) foreign_from_device.
    """

    rig_from_foreign: Array
    tracker_from_body: Array
    offset_s: float
    covariance: Array
    lasting: Array
    centre: Array
    centre_covariance: Array
    noise_m: float
    errors: Array
    inlier: Mask
    kept: float
    velocity: Array
    places: Array
    device: Array
    duration_s: float

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
    """Solve for rig_from_foreign, the point on the device and the time offset.

    `foreign` has rotations. Raises CalibrationError when the streams are too short or do not overlap. Whether the
    motion determines the answer is for `rhot_app.objects.alignment.report.judge_alignment` to say.
    """
    if foreign.rotations is None:
        raise CalibrationError("The foreign stream has positions only; its rotations are needed to find where the "
                               "fingertip sits on the tracker. Record its poses.")
    _require_overlap(foreign, rig, search_s)
    model = AlignmentModel(foreign.without_outliers(), rig.without_outliers())
    found = search(model, search_s, progress)
    estimate = found.estimate
    for _ in range(ROUNDS):
        model.select(estimate.offset_s)
        start = _whitened(model, estimate)
        refined, _ = minimise(start, STEPS, CONVERGED**2)
        estimate = refined.state
    if model.count < SAMPLES:
        raise _no_overlap(foreign, rig)
    # two samples at either end have no neighbours to be compared with
    kept = (len(model.foreign.times_s) + 4) / len(foreign.times_s) * (len(model.rig.times_s) + 4) / len(rig.times_s)
    return _finished(model, estimate, kept), found


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
        progress("searching the time offset", number / len(offsets))
    if not starts:
        raise _no_overlap(model.foreign, model.rig)
    best = int(np.argmin(median))
    return OffsetSearch(starts[best][0], offsets, median, starts[best][2])


def linear_start(model: AlignmentModel, offset_s: float) -> tuple[AlignmentEstimate, float, float]:
    """The estimate for a known time offset, its median residual, m, and the scale of the foreign world (1: metres).

    P = N z - Q p + k, with N the inverse rotation, is linear in N, p and k. N is then projected onto the rotations; its
    singular values are the foreign scale.
    """
    (place, _, device, _), (seen, _, _, _) = model.sampled(offset_s)
    target, unit = place - model.centre, np.eye(3)
    columns = np.concatenate([np.einsum("ij,nk->nijk", unit, seen - seen.mean(axis=0)).reshape(len(place), 3, 9),
                              -device, np.tile(unit, (len(place), 1, 1))], axis=2)
    solution, _ = fit_linear(columns, target, KERNEL, ROUNDS, rcond=1e-3)
    inverse, point = solution[:9].reshape(3, 3), solution[9:12]
    sizes = np.linalg.svd(inverse, compute_uv=False)
    rotation = best_rotation(inverse.T)
    centre = np.median(seen - (target + device @ point) @ rotation.T, axis=0)
    median = float(np.sqrt(np.median(np.sum((target - columns @ solution) ** 2, axis=1))))
    return (AlignmentEstimate(rotation, centre, point, offset_s), median / max(float(sizes[1]), 1e-9),
            float(np.mean(sizes[:2])))


def _whitened(model: AlignmentModel, estimate: AlignmentEstimate) -> Dense[AlignmentEstimate]:
    """The robust problem from `estimate` on, its errors by the noise that they have there."""
    noise_m = model.noise_m(estimate)

    def rows(estimate: AlignmentEstimate) -> list[Rows]:
        error, jacobian = model.linearise(estimate)
        return [Rows(error.ravel() / noise_m, jacobian.reshape(-1, UNKNOWNS) / noise_m, UNIT, KERNEL,
                     np.arange(0, error.size, 3))]
    return Dense(estimate, rows, AlignmentEstimate.moved, UNKNOWNS)


def _finished(model: AlignmentModel, estimate: AlignmentEstimate, kept: float) -> AlignmentFit:
    noise_m, normal = model.noise_m(estimate), _whitened(model, estimate).normal
    covariance = np.linalg.inv(normal + LEAST_DAMPING * np.diag(np.diag(normal)))  # what does not show is unknown
    # to a long recording an error of correlation time T is white noise of spectral density 2 T s^2
    lasting = covariance * 2.0 * LASTING_S * (LASTING_M / noise_m) ** 2 * model.count / model.duration_s
    offset = estimate.rotation @ model.centre
    change = np.eye(UNKNOWNS)
    change[TRANSLATION, ROTATION] = skew(offset)
    error, jacobian = model.linearise(estimate)
    (_, _, device, _), (places, _, _, _) = model.sampled(estimate.offset_s)
    return AlignmentFit(
        rigid(estimate.rotation, estimate.centre - offset), rigid(np.eye(3), estimate.point), estimate.offset_s,
        change @ covariance @ change.T, change @ lasting @ change.T, estimate.centre,
        (covariance + lasting)[TRANSLATION, TRANSLATION], noise_m, error,
        np.sum(error**2, axis=1) < noise_m**2 * INLIER_GATE, kept, -jacobian[:, :, OFFSET.start], places, device,
        model.duration_s)


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
