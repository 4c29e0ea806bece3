"""Updates that leave some directions of the state alone, and a covariance that says so (Schmidt 1966).

For the update the held directions count as known: what is seen is explained by the others, exactly, not in shares by
what was believed about each. Afterwards what is not known of them goes back into the covariance in Joseph's form, which
is true of any gain, also of one that is not the best.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.tracking.kalman.combine import add_rows, add_squares, dot
from rhot_app.tracking.kalman.estimate import BIAS
from rhot_app.tracking.kalman.gain import Gain

Array = NDArray[np.float64]

MOST = 64
"""Directions held at most; all fingers stiff, the palm held whole and the hand's size make 52."""


class Held(NamedTuple):
    """`used` (1,): directions held. `directions` (64, N): each of them, a row that the state is multiplied with; zero
    beyond the used ones. `loads` (64, N): what is not known of each and what goes with it, P = P of the rest +
    loads^T loads."""

    used: NDArray[np.int64]
    directions: Array
    loads: Array


def empty_held(size: int) -> Held:
    """Room for what may be held of a state with `size` numbers."""
    return Held(np.zeros(1, np.int64), np.zeros((MOST, size)), np.zeros((MOST, size)))


@njit(cache=True)
def withhold(covariance: Array, held: Held) -> None:
    """Make `covariance` (N, N) that of a hand of which the held directions are known; fills `held.loads`."""
    order = np.arange(held.used[0])
    shares = np.empty(held.used[0])
    for k in range(held.used[0]):
        direction, load = held.directions[k], held.loads[k]
        load[:] = 0.0
        picked = np.flatnonzero(direction)
        add_rows(load, direction[picked], covariance, picked, 0)
        for other in range(k):  # what goes with those before is theirs
            shares[other] = -dot(direction, held.loads[other])
        add_rows(load, shares[:k], held.loads, order[:k], 0)
        variance = dot(direction, load)
        load *= 1.0 / math.sqrt(variance) if variance > 1e-14 else 0.0
    add_squares(covariance, held.loads, held.used[0], -1.0)


@njit(cache=True)
def release(covariance: Array, held: Held) -> None:
    """Undo `withhold`; nothing is held any more."""
    add_squares(covariance, held.loads, held.used[0], 1.0)
    held.directions[:held.used[0]] = 0.0
    held.used[0] = 0


@njit(cache=True)
def restore(covariance: Array, held: Held, gain: Gain, bias_variance: Array) -> None:
    """Put back into the updated `covariance` what is not known of the held directions, and what follows from it.

    A marker's place on the hand is never known less than by its making, `bias_variance` (M,) m^2: it does not pay for
    what is not known of the palm.
    """
    if held.used[0] == 0:
        return
    count, order = gain.used[0], np.arange(gain.used[0])
    shown = np.empty(count)
    for h in range(held.used[0]):
        load = held.loads[h]
        for k in range(count):  # - L^-1 H load
            shown[k] = -dot(gain.jacobian[k], load)
            for other in range(k):
                shown[k] -= gain.factor[k, other] * shown[other]
            shown[k] /= gain.factor[k, k]
        add_rows(load, shown, gain.rows, order, 0)
    add_squares(covariance, held.loads, held.used[0], 1.0)
    for i in range(BIAS, covariance.shape[0]):
        most = bias_variance[(i - BIAS) // 3]
        if covariance[i, i] > most:
            scale = math.sqrt(most / covariance[i, i])
            covariance[i] *= scale
            covariance[:, i] *= scale
