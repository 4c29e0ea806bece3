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

from rhot_app.tracking.kalman.estimate import BIAS
from rhot_app.tracking.kalman.gain import Gain

Array = NDArray[np.float64]

MOST = 63
"""Directions held at most: all angles, their velocities and their accelerations."""


class Held(NamedTuple):
    """`used` (1,): directions held. `directions` (63, N): each of them, a row that the state is multiplied with;
    `loads` (63, N): what is not known of each and what goes with it, P = P of the rest + loads^T loads."""

    used: NDArray[np.int64]
    directions: Array
    loads: Array


def empty_held(size: int) -> Held:
    """Room for what may be held of a state with `size` numbers."""
    return Held(np.zeros(1, np.int64), np.zeros((MOST, size)), np.zeros((MOST, size)))


@njit(cache=True)
def withhold(covariance: Array, held: Held) -> None:
    """Make `covariance` (N, N) that of a hand of which the held directions are known; fills `held.loads`."""
    size = covariance.shape[0]
    for k in range(held.used[0]):
        direction, load, variance = held.directions[k], held.loads[k], 0.0
        load[:] = 0.0
        for i in range(size):
            if direction[i] != 0.0:
                for j in range(size):
                    load[j] += direction[i] * covariance[i, j]
        for i in range(size):
            variance += direction[i] * load[i]
        load *= 1.0 / math.sqrt(variance) if variance > 1e-14 else 0.0
        for i in range(size):
            if load[i] != 0.0:
                for j in range(size):
                    covariance[i, j] -= load[i] * load[j]


@njit(cache=True)
def release(covariance: Array, held: Held) -> None:
    """Undo `withhold`; nothing is held any more."""
    for k in range(held.used[0]):
        _add_square(covariance, held.loads[k])
    held.used[0] = 0
    held.directions[:] = 0.0


@njit(cache=True)
def restore(covariance: Array, held: Held, gain: Gain, bias_variance: Array) -> None:
    """Put back into the updated `covariance` what is not known of the held directions, and what follows from it.

    A marker's place on the hand is never known less than by its making, `bias_variance` (M,) m^2: it does not pay for
    what is not known of the palm.
    """
    size, count = covariance.shape[0], gain.used[0]
    shown = np.empty(count)
    for h in range(held.used[0]):
        load = held.loads[h]
        for k in range(count):  # L^-1 H load
            shown[k] = 0.0
            for i in range(size):
                shown[k] += gain.jacobian[k, i] * load[i]
            for other in range(k):
                shown[k] -= gain.factor[k, other] * shown[other]
            shown[k] /= gain.factor[k, k]
        for k in range(count):
            for i in range(size):
                load[i] -= gain.rows[k, i] * shown[k]
        _add_square(covariance, load)
    if held.used[0] > 0:
        for i in range(BIAS, size):
            most = bias_variance[(i - BIAS) // 3]
            if covariance[i, i] > most:
                scale = math.sqrt(most / covariance[i, i])
                covariance[i] *= scale
                covariance[:, i] *= scale


@njit(cache=True)
def _add_square(covariance: Array, load: Array) -> None:
    for i in range(load.shape[0]):
        if load[i] != 0.0:
            for j in range(load.shape[0]):
                covariance[i, j] += load[i] * load[j]
