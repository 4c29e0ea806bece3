"""Inverse kinematics of single fingers within joint limits, the palm's pose known.

FABRIK brings the marker near its target; a constrained Gauss-Newton descent then meets the target exactly and spends
the joints that the target leaves free on the natural pose (DIP = 2/3 PIP, RHOT eq. 2.4).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.estimation.least_squares import Stop, descend, implements
from rhot_app.hand.model import HandModel
from rhot_app.hand.skeleton import FINGER_ANGLES, HandPose
from rhot_app.hand.solvers.fabrik import fabrik_within
from rhot_app.hand.solvers.finger_chain import MISSING, Solution, clamp, linearise, miss, norm, status_of, to_finger
from rhot_app.hand.solvers.pose_descent import STEP_MAX

Array = NDArray[np.float64]

TOLERANCE = 5e-5
"""A finger has reached its target within this distance, m."""

FABRIK_ITERATIONS = 10

FAR = 3.0
"""FABRIK that ends this many standard deviations from its target was stopped by limits: meet it before weighing it."""

COMPLIANCE, NEAR = 2e-10, 1e-6
"""Weights of the natural pose against the target, m^2: it shifts a reached marker by less than a micrometre; and while
the pose is looked for, near the target."""

STOP = Stop(12, 1e-4, 1e-6, 0.0)


def solve_fingers(model: HandModel, pose: HandPose, targets: Array, target_sd: float = 0.0) -> Solution:
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
                         model.pose_prior.information, target_sd, residuals, iterations, statuses)
    return Solution(angles, residuals, iterations, statuses)


@njit(cache=True)
def solve_fingers_arrays(angles: Array, world_from_palm: Array, mirror: float, base: Array, base_rotation: Array,
                         lengths: Array, bends: Array, limits: Array, targets: Array, mean: Array,
                         information: Array, target_sd: float, residuals: Array, iterations: NDArray[np.int64],
                         statuses: NDArray[np.uint8]) -> None:
    """`solve_fingers` on arrays, in place on `angles`, `residuals`, `iterations` and `statuses`; `lengths` (5, 3) and
    `bends` (5,) are the model's `chain` and `chain_bend`: the way to a marker beside the bone is that much more bent
    than the bone, and so are its limits and its natural angle."""
    local = np.empty(3)
    for finger in range(5):
        residuals[finger], iterations[finger], statuses[finger] = np.nan, 0, MISSING
        if math.isnan(targets[finger, 0] + targets[finger, 1] + targets[finger, 2]):
            continue
        to_finger(world_from_palm, mirror, base[finger], base_rotation[finger], targets[finger], local)
        low, high = FINGER_ANGLES[finger]
        box, usual = limits[low:high].copy(), mean[low:high].copy()
        angles[high - 1] += bends[finger]
        usual[-1] += bends[finger]
        for side in range(2):
            box[-1, side] += bends[finger]
        residuals[finger], iterations[finger], statuses[finger] = solve_arrays(
            angles[low:high], lengths[finger], box, local, usual,
            np.ascontiguousarray(information[low:high, low:high]), target_sd)
        angles[high - 1] -= bends[finger]


class FingerProblem(NamedTuple):
    """cost(q) = |t - s(q)|^2 / (2 variance) + (q - mean)^T information (q - mean) / 2 of one finger in its base frame.

    `lengths` (3,) m, `limits` (n, 2) rad, `target` t (3,) m with its `variance` m^2; `mean` (n,) rad and `information`
    (n, n) 1/rad^2 of the angles q.
    """

    lengths: Array
    limits: Array
    target: Array
    variance: float
    mean: Array
    information: Array


@njit(cache=True)
def linearise_finger(problem: FingerProblem, angles: Array, matrix: Array, right: Array, low: Array, high: Array
                     ) -> float:
    """The cost at `angles` (n,); fills the Hessian `matrix` (n, n), the negative gradient `right` (n,) and the bounds
    of a step."""
    count, weight = angles.shape[0], 1.0 / problem.variance
    limits, mean, information = problem.limits, problem.mean, problem.information
    joints, jacobian, error = np.empty((4, 3)), np.empty((3, count)), np.empty(3)
    cost = 0.5 * weight * linearise(angles, problem.lengths, problem.target, joints, jacobian, error) ** 2
    for i in range(count):
        low[i], high[i] = max(limits[i, 0] - angles[i], -STEP_MAX), min(limits[i, 1] - angles[i], STEP_MAX)
        x, y, z, pull = weight * jacobian[0, i], weight * jacobian[1, i], weight * jacobian[2, i], 0.0
        for j in range(count):
            pull += information[i, j] * (mean[j] - angles[j])
            matrix[i, j] = information[i, j] + x * jacobian[0, j] + y * jacobian[1, j] + z * jacobian[2, j]
        right[i] = pull + x * error[0] + y * error[1] + z * error[2]
        cost += 0.5 * pull * (mean[i] - angles[i])
    return cost


implements(FingerProblem, linearise_finger)


@njit(cache=True)
def solve_arrays(angles: Array, lengths: Array, limits: Array, target: Array, mean: Array, information: Array,
                 target_sd: float) -> tuple[float, int, int]:
    """One finger in its base frame, in place on `angles`; returns the residual, m, FABRIK's iterations and the status.

    `mean` and `information`: the natural pose of these angles. FABRIK that limits stop leaves off at once.
    """
    clamp(angles, limits)
    start, iterations, near = angles.copy(), 0, max(TOLERANCE, target_sd)
    if miss(angles, lengths, target) > near:
        iterations, _ = fabrik_within(angles, lengths, limits, target, near, FABRIK_ITERATIONS)
    if target_sd == 0.0 or miss(angles, lengths, target) > FAR * near:
        _meet(angles, start, FingerProblem(lengths, limits, target, COMPLIANCE, mean, information))
    if target_sd > 0.0:  # joints that go together move together
        problem = FingerProblem(lengths, limits, target, target_sd ** 2, start, information)
        descend(problem, angles, angles.shape[0], STOP)
    residual = miss(angles, lengths, target)
    return residual, iterations, status_of(angles, lengths, limits, norm(target), residual, TOLERANCE, False)


@njit(cache=True)
def _meet(angles: Array, start: Array, problem: FingerProblem) -> None:
    """Descend from `angles`, in place, until the target is met in the most natural pose.

    Stopped by a limit or a local minimum it tries again: from the middle of the range, from `start`, stretched. The
    pose comes first near the target, then exactly: along the constraint of an exact target steps are short.
    """
    limits, least = problem.limits, miss(angles, problem.lengths, problem.target)
    near = FingerProblem(problem.lengths, limits, problem.target, NEAR, problem.mean, problem.information)
    for attempt in range(4):
        trial = start.copy()
        for k in range(angles.shape[0]):
            if attempt == 0:
                trial[k] = angles[k]
            elif attempt == 1:
                trial[k] = 0.5 * (limits[k, 0] + limits[k, 1])
            elif attempt == 3 and k > 0:
                trial[k] = limits[k, 0]
        descend(near, trial, trial.shape[0], STOP)
        descend(problem, trial, trial.shape[0], STOP)
        residual = miss(trial, problem.lengths, problem.target)
        if residual <= TOLERANCE or residual < least:
            angles[:], least = trial, residual
        if residual <= TOLERANCE:
            break
