"""Inverse kinematics of single fingers within joint limits, the palm's pose known.

FABRIK brings the marker near its target; a constrained Gauss-Newton descent then meets the target exactly and spends
the joints that the target leaves free on the natural pose (DIP = 2/3 PIP, RHOT eq. 2.4).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.hand.linear import solve_in_box
from rhot_app.hand.model import HandModel
from rhot_app.hand.skeleton import FINGER_ANGLES, HandPose
from rhot_app.hand.solvers.finger_chain import MISSING, chain_points, distance, fabrik_within, miss, status_of

Array = NDArray[np.float64]

TOLERANCE = 5e-5
"""A finger has reached its target within this distance, m."""

FABRIK_ITERATIONS = 10

FAR = 3.0
"""FABRIK that ends this many standard deviations from its target was stopped by limits: meet it before weighing it."""

DESCENT_STEPS = 12
STEP_MAX = 0.4
"""Largest change of an angle in one Gauss-Newton step, rad: beyond it the linearisation says nothing."""

COMPLIANCE = 2e-10
"""Weight of the natural pose against the target, m^2: it shifts a reached marker by less than a micrometre."""

CONTINUITY = 1.0
"""Information of the start angles, 1/rad^2: they settle what neither target nor natural pose does."""


@dataclass(frozen=True, slots=True)
class FingersSolution:
    """All five fingers: `angles` (21,) rad, `residuals` (5,) m (NaN without a target), `iterations` (5,), `reached`
    (5,) bool, `statuses` (5,) of Status."""

    angles: Array
    residuals: Array
    iterations: NDArray[np.int64]
    reached: NDArray[np.bool_]
    statuses: NDArray[np.uint8]


def solve_fingers(model: HandModel, pose: HandPose, targets: Array, tolerance: float = TOLERANCE,
                  max_iterations: int = FABRIK_ITERATIONS, target_sd: float = 0.0) -> FingersSolution:
    """Bring the marker of every finger with a target there: `targets` (5, 3) m world; NaN rows keep the pose's angles.

    Nearby targets give nearby angles. A target out of reach stretches the finger towards it as far as the limits allow.

    `target_sd` is the standard deviation of the targets, m. Zero meets them exactly. A nearly stretched or fully
    curled finger turns a millimetre of noise into tens of degrees; with its `target_sd` known it keeps to the pose
    it starts from as far as the noise allows, and `reached` then says little.
    """
    angles, residuals = np.array(pose.angles), np.empty(5)
    iterations, statuses = np.empty(5, dtype=np.int64), np.empty(5, dtype=np.uint8)
    solve_fingers_arrays(angles, pose.world_from_palm, model.mirror, model.base, model.base_rotation,
                         model.chain, model.chain_bend, model.limits, targets, model.pose_prior.mean,
                         model.pose_prior.information, tolerance, max_iterations, target_sd, residuals, iterations,
                         statuses)
    return FingersSolution(angles, residuals, iterations, residuals <= tolerance, statuses)


@njit(cache=True)
def to_finger(world_from_palm: Array, mirror: float, base: Array, base_rotation: Array, point: Array,
              local: Array) -> None:
    """Fill `local` (3,): a world point in one finger's base frame, mirrored into a right hand."""
    palm = np.zeros(3)
    for i in range(3):
        for j in range(3):
            palm[i] += world_from_palm[j, i] * (point[j] - world_from_palm[j, 3])
    palm[1] *= mirror
    for i in range(3):
        local[i] = 0.0
        for j in range(3):
            local[i] += base_rotation[j, i] * (palm[j] - base[j])


@njit(cache=True)
def solve_fingers_arrays(angles: Array, world_from_palm: Array, mirror: float, base: Array, base_rotation: Array,
                         lengths: Array, bends: Array, limits: Array, targets: Array, mean: Array,
                         information: Array, tolerance: float, max_iterations: int, target_sd: float,
                         residuals: Array, iterations: NDArray[np.int64], statuses: NDArray[np.uint8]) -> None:
    """`solve_fingers` on arrays, in place on `angles`, `residuals`, `iterations` and `statuses`; `lengths` (5, 3) and
    `bends` (5,) are the model's `chain` and `chain_bend`."""
    local = np.empty(3)
    for finger in range(5):
        residuals[finger], iterations[finger], statuses[finger] = np.nan, 0, MISSING
        if math.isnan(targets[finger, 0] + targets[finger, 1] + targets[finger, 2]):
            continue
        to_finger(world_from_palm, mirror, base[finger], base_rotation[finger], targets[finger], local)
        low, high = FINGER_ANGLES[finger]
        residuals[finger], iterations[finger], statuses[finger] = solve_bent(
            angles[low:high], lengths[finger], bends[finger], limits[low:high], local, mean[low:high],
            information[low:high, low:high], tolerance, max_iterations, target_sd)


@njit(cache=True)
def solve_bent(angles: Array, lengths: Array, bend: float, limits: Array, target: Array, mean: Array,
               information: Array, tolerance: float, max_iterations: int, target_sd: float) -> tuple[float, int, int]:
    """`solve_arrays` for a marker beside the bone, in the finger's plane: the last link is `bend` rad more bent than
    the bone that carries it, and so are its limits and its natural angle."""
    last = angles.shape[0] - 1
    shifted, usual = limits.copy(), mean.copy()
    shifted[last, 0] += bend
    shifted[last, 1] += bend
    usual[last] += bend
    angles[last] += bend
    result = solve_arrays(angles, lengths, shifted, target, usual, information, tolerance, max_iterations, target_sd)
    angles[last] -= bend
    return result


@njit(cache=True)
def solve_arrays(angles: Array, lengths: Array, limits: Array, target: Array, mean: Array, information: Array,
                 tolerance: float, max_iterations: int, target_sd: float) -> tuple[float, int, int]:
    """One finger in its base frame, in place on `angles`; returns the residual, m, FABRIK's iterations and the status.

    `mean` and `information`: the natural pose of these angles. FABRIK that limits stop leaves off at once.
    """
    count = angles.shape[0]
    for k in range(count):
        angles[k] = min(max(angles[k], limits[k, 0]), limits[k, 1])
    start, iterations, near = angles.copy(), 0, max(tolerance, target_sd)
    if miss(angles, lengths, target) > near:
        iterations, _ = fabrik_within(angles, lengths, limits, target, near, max_iterations)
    residual = miss(angles, lengths, target)
    if target_sd == 0.0 or residual > FAR * near:
        residual = _meet(angles, start, lengths, limits, target, mean, information, tolerance)
    if target_sd > 0.0:
        residual = _settle(angles, start, lengths, limits, target, information, target_sd)
    away = math.sqrt(target[0] ** 2 + target[1] ** 2 + target[2] ** 2)
    return residual, iterations, status_of(angles, lengths, limits, away, residual, tolerance, False)


@njit(cache=True)
def _meet(angles: Array, start: Array, lengths: Array, limits: Array, target: Array, mean: Array, information: Array,
          tolerance: float) -> float:
    """Descend from `angles`, in place, until the target is met; returns the residual, m.

    Stopped by a limit or a local minimum it tries again: from the middle of the range, from `start`, stretched.
    """
    least = miss(angles, lengths, target)
    for attempt in range(4):
        trial = start.copy()
        for k in range(angles.shape[0]):
            if attempt == 0:
                trial[k] = angles[k]
            elif attempt == 1:
                trial[k] = 0.5 * (limits[k, 0] + limits[k, 1])
            elif attempt == 3 and k > 0:
                trial[k] = limits[k, 0]
        residual = _descend(trial, start, lengths, limits, target, mean, information)
        if residual <= tolerance or residual < least:
            angles[:], least = trial, residual
        if residual <= tolerance:
            break
    return least


@njit(cache=True)
def _descend(angles: Array, start: Array, lengths: Array, limits: Array, target: Array, mean: Array,
             information: Array) -> float:
    """Gauss-Newton steps to the most natural angles that meet the target, in place; returns the residual, m.

    Steps are not tested for descent: on the way along the target's constraint the residual must rise for a moment.
    When it stays far from zero the steps are damped more and more, and the best angles seen are the result.
    """
    count = angles.shape[0]
    joints, jacobian = np.empty((4, 3)), np.empty((3, count))
    error, step, low, high, best = np.empty(3), np.empty(count), np.empty(count), np.empty(count), angles.copy()
    matrix, right = np.empty((count, count)), np.empty(count)
    least, damping = np.inf, 0.0
    for _ in range(DESCENT_STEPS):
        chain_points(angles, lengths, joints, jacobian)
        for k in range(3):
            error[k] = target[k] - joints[3, k]
        residual = distance(joints[3], target)
        damping = 0.1 * damping if residual <= max(0.7 * least, 1e-6) else max(4.0 * damping, 10.0)
        if residual <= max(least, 1e-6):
            least = residual
            best[:] = angles
        _normal_equations(angles, mean, information, jacobian, error, COMPLIANCE, CONTINUITY + damping, matrix, right)
        for i in range(count):
            right[i] += CONTINUITY * (start[i] - angles[i])
        largest = _step_within(matrix, right, limits, angles, low, high, step)
        for i in range(count):
            angles[i] += step[i]
        if largest < 1e-3 and residual < 1e-6:
            break
    residual = miss(angles, lengths, target)
    if residual > max(least, 1e-6):
        angles[:] = best
        return least
    return residual


@njit(cache=True)
def _settle(angles: Array, start: Array, lengths: Array, limits: Array, target: Array, information: Array,
            target_sd: float) -> float:
    """Levenberg-Marquardt to the likeliest angles near `start`, in place; returns the residual, m.

    The target counts with its standard deviation, a change of the angles as much as the natural pose resists it:
    joints that go together move together.
    """
    count = angles.shape[0]
    joints, jacobian = np.empty((4, 3)), np.empty((3, count))
    error, step, low, high, trial = np.empty(3), np.empty(count), np.empty(count), np.empty(count), angles.copy()
    matrix, damped, right = np.empty((count, count)), np.empty((count, count)), np.empty(count)
    least, damping, residual = np.inf, 1e-3, 0.0
    for _ in range(DESCENT_STEPS):
        chain_points(trial, lengths, joints, jacobian)
        for k in range(3):
            error[k] = target[k] - joints[3, k]
        missed = distance(joints[3], target)
        cost = (missed / target_sd) ** 2
        for i in range(count):
            for j in range(count):
                cost += (trial[i] - start[i]) * information[i, j] * (trial[j] - start[j])
        if cost <= least:
            settled = least - cost < 1e-4 * (1.0 + cost)
            least, residual, damping = cost, missed, 0.1 * damping
            angles[:] = trial
            if settled:
                break
            _normal_equations(angles, start, information, jacobian, error, target_sd ** 2, 0.0, matrix, right)
        else:
            damping = max(10.0 * damping, 1e-2)
        damped[:] = matrix
        for i in range(count):
            damped[i, i] *= 1.0 + damping
        _step_within(damped, right, limits, angles, low, high, step)
        for i in range(count):
            trial[i] = angles[i] + step[i]
    return residual


@njit(cache=True)
def _step_within(matrix: Array, right: Array, limits: Array, angles: Array, low: Array, high: Array,
                 step: Array) -> float:
    """Fill `step`, no longer than STEP_MAX, so that angles + step keep the limits; returns its length before that."""
    for i in range(angles.shape[0]):
        low[i], high[i] = limits[i, 0] - angles[i], limits[i, 1] - angles[i]
    solve_in_box(matrix, right, low, high, step)
    largest = 0.0
    for i in range(angles.shape[0]):
        largest = max(largest, abs(step[i]))
    for i in range(angles.shape[0]):
        step[i] *= min(1.0, STEP_MAX / max(largest, 1e-12))
    return largest


@njit(cache=True)
def _normal_equations(angles: Array, mean: Array, information: Array, jacobian: Array, error: Array,
                      variance: float, damping: float, matrix: Array, right: Array) -> None:
    """Fill the Gauss-Newton `matrix` and `right` of |target error|^2 / variance plus the pull towards `mean`."""
    count = angles.shape[0]
    for i in range(count):
        right[i] = 0.0
        for j in range(count):
            matrix[i, j] = information[i, j]
            right[i] += information[i, j] * (mean[j] - angles[j])
            for k in range(3):
                matrix[i, j] += jacobian[k, i] * jacobian[k, j] / variance
        for k in range(3):
            right[i] += jacobian[k, i] * error[k] / variance
        matrix[i, i] += damping
