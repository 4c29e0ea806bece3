"""Joint limits, and how the joints of a relaxed human hand move together.

The pose prior is a Gaussian on the 21 angles, for joints that no marker observes. Its couplings are soft, because
people can break all of them; the standard deviations say how readily.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.hand.anatomy import DIP_PER_PIP
from rhot_app.hand.skeleton import ANGLES, FINGERS

Array = NDArray[np.float64]

MCP_PER_PIP = 0.7
"""Flexion of the MCP joint per flexion of the PIP joint when a hand closes around something (Santello 1998)."""

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
    rows, values = [], []

    def expect(value_deg: float, sd_deg: float, **factors: float) -> None:
        """The sum of factor x angle is Gaussian, in degrees."""
        row = np.zeros(len(ANGLES))
        for name, factor in factors.items():
            row[ANGLES.index(name)] = factor
        rows.append(row / math.radians(sd_deg))
        values.append(value_deg / sd_deg)

    expect(5.0, 18.0, thumb_cmc_abduction=1.0)
    expect(5.0, 15.0, thumb_cmc_flexion=1.0)
    expect(0.0, 6.0, thumb_mcp_abduction=1.0)
    expect(15.0, 20.0, thumb_mcp_flexion=1.0)
    expect(0.0, 12.0, thumb_ip_flexion=1.0, thumb_mcp_flexion=-1.0)
    for name in FINGERS[1:]:
        mcp, pip, dip = (f"{name}_{joint}_flexion" for joint in ("mcp", "pip", "dip"))
        expect(0.0, 12.0 if name == "little" else 8.0, **{f"{name}_mcp_abduction": 1.0})
        expect(0.0, 5.0, **{dip: 1.0, pip: -DIP_PER_PIP})
        expect(0.0, 20.0, **{mcp: 1.0, pip: -MCP_PER_PIP})
        expect(30.0, 40.0, **{pip: 1.0})
    for name, neighbour in pairwise(FINGERS[1:]):
        # Neighbours share tendons: one finger bends the next (RHOT 2.1.1, inter-finger constraints).
        expect(0.0, 20.0, **{f"{name}_mcp_flexion": 1.0, f"{neighbour}_mcp_flexion": -1.0})
    return prior_of(np.array(rows), np.array(values))


@njit(cache=True)
def wrap(angle: float) -> float:
    """The same direction within -pi..pi."""
    return angle - 2.0 * math.pi * math.floor(angle / (2.0 * math.pi) + 0.5)


@njit(cache=True)
def clamp_angle(angle: float, low: float, high: float) -> float:
    """The angle of low..high that points nearest to `angle`."""
    middle = 0.5 * (low + high)
    return min(max(middle + wrap(angle - middle), low), high)
