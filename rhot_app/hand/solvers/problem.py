"""What every solver is asked and what it answers: five fingers with the palm known, one target each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.hand.model import HandModel
from rhot_app.hand.skeleton import HandPose
from rhot_app.hand.solvers.finger_chain import chain_points, distance
from rhot_app.hand.solvers.finger_ik import to_finger

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Problem:
    """Five fingers in their base frames (x along the first bone at zero angles, flexion about y, abduction about z).

    `lengths` (5, 3) m, the last bone only as far as the point to be placed; `limits` (21, 2) rad, low and high;
    `start` (21,) rad; `targets` (5, 3) m, NaN rows for fingers without one.
    """

    lengths: Array
    limits: Array
    start: Array
    targets: Array


@dataclass(frozen=True, slots=True)
class Solution:
    """`angles` (21,) rad, `residuals` (5,) m (NaN without a target), `iterations` (5,), `statuses` (5,) of Status,
    `handed_over` (5,) bool: limits stopped FABRIK, and Levenberg-Marquardt went on.

    `joints` (5, 4, 3) m in the base frames, root to the placed point: where the angles put them, but of a solver
    without angles (free FABRIK) its own, which the angles only approximate.
    """

    angles: Array
    residuals: Array
    iterations: NDArray[np.int64]
    statuses: NDArray[np.uint8]
    handed_over: NDArray[np.bool_]
    joints: Array


def make_problem(model: HandModel, start: HandPose, targets: Array) -> Problem:
    """The problem of bringing the marker centres of a hand in `start` to `targets` (5, 3) m, world."""
    local = np.empty((5, 3))
    for finger in range(5):
        to_finger(start.world_from_palm, model.mirror, model.base[finger], model.base_rotation[finger],
                  np.asarray(targets[finger], dtype=np.float64), local[finger])
    return Problem(model.chain, model.limits, np.array(start.angles, dtype=np.float64), local)


@njit(cache=True)
def assign(values: Array, out: Array) -> None:
    """Copy `values` (n,) into `out`. A slice assignment does the same, and takes ten times as long to compile."""
    for k in range(values.shape[0]):
        out[k] = values[k]


@njit(cache=True)
def clamp(angles: Array, limits: Array) -> None:
    """Bring `angles` (n,) within `limits` (n, 2), in place."""
    for k in range(angles.shape[0]):
        angles[k] = min(max(angles[k], limits[k, 0]), limits[k, 1])


@njit(cache=True)
def linearise(angles: Array, lengths: Array, target: Array, joints: Array, jacobian: Array, error: Array) -> float:
    """Fill `joints` (4, 3), `jacobian` (3, n) and `error` (3,), target less end; returns the error's length."""
    chain_points(angles, lengths, joints, jacobian)
    for i in range(3):
        error[i] = target[i] - joints[3, i]
    return distance(joints[3], target)


@njit(cache=True)
def norm(vector: Array) -> float:
    """Length of a vector (3,)."""
    return np.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)
