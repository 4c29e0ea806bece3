"""What every solver is asked and what it answers: five fingers with the palm known, one target each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.hand.model import HandModel
from rhot_app.hand.skeleton import HandPose
from rhot_app.hand.solvers.finger_chain import to_finger

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
