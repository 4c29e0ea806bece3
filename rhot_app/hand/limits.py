"""How hard joint limits are, and how the joints of a relaxed human hand move together.

The limits themselves are of the hand file: `model.HandModel.limits`. They are enforced by `motion.null_space` in the
estimator, by `solvers` in the classic tracker, and by `barehand.contour_residual.JointLimits` for contours.

The pose prior is a Gaussian on the 21 angles, for joints that no marker observes. Its couplings are soft, because
people can break all of them; the standard deviations say how readily.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.hand.skeleton import ANGLES
from rhot_app.hand.tables import TABLES

Array = NDArray[np.float64]

LIMIT_SD_RAD = math.radians(0.5)
"""rad: how far joints go beyond their passive limits."""

PERSON_LIMIT_SD_RAD = math.radians(5.0)
"""rad: how far a person's limits lie from the hand file's, which are means over people."""


class PosePrior(NamedTuple):
    """`mean` (21,) rad, the natural pose, and `information` (21, 21) 1/rad^2, the inverse of the covariance. `rows`
    (K, 21) of factors and `values` (K,), both over the standard deviation, are the terms that make it."""

    mean: Array
    information: Array
    rows: Array
    values: Array

    def with_terms(self, rows: Array, values: Array) -> PosePrior:
        """The prior with further terms: `rows` (K, 21) of factors and `values` (K,), over the standard deviations."""
        return prior_of(np.vstack([self.rows, rows]), np.concatenate([self.values, values]))


def prior_of(rows: Array, values: Array) -> PosePrior:
    """The Gaussian of K independent terms: `rows` (K, 21) of factors, `values` (K,), over the standard deviations."""
    information = rows.T @ rows
    mean = np.asarray(np.linalg.solve(information, rows.T @ values), dtype=np.float64)
    return PosePrior(mean, information, rows, values)


def pose_prior() -> PosePrior:
    """The angles of a relaxed hand, and how they go together."""
    rows, values = np.zeros((len(TABLES.pose_prior), len(ANGLES))), np.empty(len(TABLES.pose_prior))
    for row, (mean_deg, sd_deg, factors) in enumerate(TABLES.pose_prior):
        for name, factor in factors.items():
            rows[row, ANGLES.index(name)] = factor / math.radians(sd_deg)
        values[row] = mean_deg / sd_deg
    return prior_of(rows, values)


@njit(cache=True)
def wrap(angle: float) -> float:
    """The same direction within -pi..pi."""
    return angle - 2.0 * math.pi * math.floor(angle / (2.0 * math.pi) + 0.5)


@njit(cache=True)
def clamp_angle(angle: float, low: float, high: float) -> float:
    """The angle of low..high that points nearest to `angle`."""
    middle = 0.5 * (low + high)
    return min(max(middle + wrap(angle - middle), low), high)
