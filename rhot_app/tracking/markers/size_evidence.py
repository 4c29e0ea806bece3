"""What one instant's markers say of a hand's size: the evidence for a size, whatever the pose.

A larger hand holds its markers in the same places when it bends its fingers more. How plausible that is, its pose says:
by the natural pose, by the joints' limits, and by how much room there is for such poses. Fingers that are nearly
stretched hold their tips near the farthest place that they reach, where many poses differ little; that all of them
should end there by chance on a hand that is larger is not likely, and a smaller hand does not reach so far. So the
evidence integrates over the pose (Laplace's method, MacKay 2003, chapter 27), about the most plausible one.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.hand.dh import DhArrays
from rhot_app.hand.kinematics import TWIST, forward_arrays, jacobian_arrays, move
from rhot_app.hand.limits import PERSON_LIMIT_SD_RAD
from rhot_app.hand.linear import factorise, substitute
from rhot_app.hand.skeleton import ANGLES

Array = NDArray[np.float64]

STEPS = 20
"""Of the descent at most; a pose found for a neighbouring size needs three or four."""

_STEP_RAD = 0.5
_SMALL_GAIN = 1e-4
_RETRIES = 6
_SIZE = TWIST + len(ANGLES)


class Posture(NamedTuple):
    """What holds of a hand in any pose. `dh`: its table with one point per marker; `limits` (21, 2) rad; `mean` (21,)
    rad and `information` (21, 21) 1/rad^2 of its angles without evidence."""

    dh: DhArrays
    limits: Array
    mean: Array
    information: Array


class Fitting(NamedTuple):
    """Normal equations of one pose: `matrix` (27, 27) and `right` (27,), the negative gradient."""

    matrix: Array
    right: Array


@njit(cache=True)
def implausibility(posture: Posture, places: Array, information: Array, log_scale: float, world: Array,
                   angles: Array) -> tuple[float, float]:
    """How implausible a hand exp(log_scale) times as large is: the negative logarithm of the evidence, but for a
    constant, and the part of it that is misfit and strain of the most plausible pose.

    `places` (M, 3) m, world, NaN for a marker that was not located; `information` (M, 3, 3) 1/m^2, the inverse of their
    covariances. The descent (Levenberg-Marquardt) starts from `world` (4, 4) and `angles` (21,) rad, which become the
    most plausible pose.
    """
    now = Fitting(np.empty((_SIZE, _SIZE)), np.empty(_SIZE))
    then = Fitting(np.empty((_SIZE, _SIZE)), np.empty(_SIZE))
    scale, factor, step = math.exp(log_scale), np.empty((_SIZE, _SIZE)), np.empty(_SIZE)
    trial_world, trial_angles = world.copy(), angles.copy()
    cost = linearise(posture, places, information, scale, world, angles, now)
    damping = 1e-4
    for _ in range(STEPS):
        before = cost
        for _ in range(_RETRIES):
            _factorise_damped(now.matrix, damping, factor)
            substitute(factor, now.right, step)
            step *= min(1.0, _STEP_RAD / max(np.abs(step[3:]).max(), 1e-9))
            move(world, angles, step, trial_world, trial_angles)
            trial = linearise(posture, places, information, scale, trial_world, trial_angles, then)
            if trial <= cost:
                cost, damping = trial, max(0.1 * damping, 1e-9)
                world[:], angles[:] = trial_world, trial_angles
                now.matrix[:], now.right[:] = then.matrix, then.right
                break
            damping = max(10.0 * damping, 1e-3)
        if before - cost < _SMALL_GAIN:
            break
    _factorise_damped(now.matrix, 0.0, factor)
    room = 0.0
    for i in range(_SIZE):
        room += math.log(factor[i, i])
    return cost + room, cost


@njit(cache=True)
def _factorise_damped(matrix: Array, damping: float, factor: Array) -> None:
    factor[:] = matrix
    for i in range(_SIZE):
        factor[i, i] *= 1.0 + damping
    factorise(factor)


@njit(cache=True)
def linearise(posture: Posture, places: Array, information: Array, scale: float, world: Array, angles: Array,
              fitting: Fitting) -> float:
    """Fill the normal equations of misfit and strain at one pose; returns half the sum of their squares. Arguments as
    in `implausibility`."""
    dh, matrix, right = posture.dh, fitting.matrix, fitting.right
    frames, points = np.empty((dh.parent.shape[0], 3, 4)), np.empty((dh.point_row.shape[0], 3))
    jacobian, weighed = np.empty((points.shape[0], 3, _SIZE)), np.empty(3)
    forward_arrays(dh, world, angles, frames, points)
    jacobian_arrays(dh, world, frames, points, jacobian)
    matrix[:], right[:] = 0.0, 0.0
    cost = _strain(posture, angles, matrix, right)
    off, used = np.empty(3), np.empty(_SIZE, np.int64)
    for m in range(points.shape[0]):
        if math.isnan(places[m, 0]):
            continue
        for i in range(3):
            off[i] = places[m, i] - world[i, 3] - scale * (points[m, i] - world[i, 3])
            for j in range(3, _SIZE):
                jacobian[m, i, j] *= scale
        count = _columns(jacobian[m], used)
        for a in range(count):
            column = used[a]
            for i in range(3):
                weighed[i] = 0.0
                for k in range(3):
                    weighed[i] += jacobian[m, k, column] * information[m, k, i]
            for i in range(3):
                right[column] += weighed[i] * off[i]
            for b in range(count):
                for i in range(3):
                    matrix[column, used[b]] += weighed[i] * jacobian[m, i, used[b]]
        for i in range(3):
            for k in range(3):
                cost += 0.5 * off[i] * information[m, i, k] * off[k]
    return cost


@njit(cache=True)
def _columns(jacobian: Array, used: NDArray[np.int64]) -> int:
    """Note the columns of a point's `jacobian` (3, 27) that are not zero; returns how many: ten of 27 for a tip."""
    count = 0
    for j in range(_SIZE):
        if jacobian[0, j] != 0.0 or jacobian[1, j] != 0.0 or jacobian[2, j] != 0.0:
            used[count] = j
            count += 1
    return count


@njit(cache=True)
def _strain(posture: Posture, angles: Array, matrix: Array, right: Array) -> float:
    """Add how far `angles` (21,) are from the natural pose and beyond their limits.

    A limit sets in softly, over its standard deviation: the evidence shall not jump where a joint meets its limit.
    """
    cost = 0.0
    for i in range(angles.shape[0]):
        pull = 0.0
        for j in range(angles.shape[0]):
            pull += posture.information[i, j] * (posture.mean[j] - angles[j])
            matrix[TWIST + i, TWIST + j] = posture.information[i, j]
        cost += 0.5 * pull * (posture.mean[i] - angles[i])
        right[TWIST + i] = pull
    for i in range(angles.shape[0]):
        for side in range(2):
            sign = 2.0 * side - 1.0
            beyond = sign * (angles[i] - posture.limits[i, side]) / PERSON_LIMIT_SD_RAD
            root = math.sqrt(beyond * beyond + 1.0)
            soft, slope = 0.5 * (beyond + root), 0.5 * (1.0 + beyond / root) / PERSON_LIMIT_SD_RAD
            cost += 0.5 * soft * soft
            right[TWIST + i] -= sign * slope * soft
            matrix[TWIST + i, TWIST + i] += slope * slope
    return cost
