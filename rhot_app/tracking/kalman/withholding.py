"""Updates that leave some directions of the state alone, and a covariance that says so (Schmidt 1966).

For the update the held directions count as known: what is seen is explained by the others, exactly, not in shares by
what was believed about each. Afterwards the covariance says again what is not known of them (`gain.contract`).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rhot_app.lean import lean, room, slots
from rhot_app.tracking.kalman.combine import add_chosen, add_rows, dot, scale
from rhot_app.tracking.kalman.estimate import BIAS, MOST_NUMBERS
from rhot_app.tracking.kalman.gain import MOST_HELD, Gain, pick

Array = NDArray[np.float64]


class Held(NamedTuple):
    """`used` (1,): directions held. `directions` (64, N): each of them, a row that the state is multiplied with; zero
    beyond the used ones. `sight` (3,): the unit vector, world, along which alone the palm's place is held before a
    camera that has seen the hand alone for a while, else zero."""

    used: NDArray[np.int64]
    directions: Array
    sight: Array


def empty_held(size: int) -> Held:
    """Room for what may be held of a state with `size` numbers."""
    return Held(np.zeros(1, np.int64), np.zeros((MOST_HELD, size)), np.zeros(3))


@lean
def withhold(covariance: Array, held: Held, gain: Gain) -> None:
    """Fill the first of `gain.rows` with what is not known of each held direction, and what goes with it: `covariance`
    less their squares is that of a hand of which the held directions are known."""
    count = held.used[0]
    shares, weights, chosen = room((MOST_HELD,)), room((MOST_NUMBERS,)), slots((MOST_NUMBERS,))
    for k in range(count):
        direction, load = held.directions[k], gain.rows[k]
        load[:] = 0.0
        picked = pick(direction, chosen, weights)
        add_chosen(load, weights, covariance, chosen[:picked])
        for other in range(k):  # what goes with those before is theirs
            shares[other] = dot(direction, gain.rows[other])
        add_rows(load, shares[:k], gain.rows, -1.0)
        variance = dot(direction, load)
        scale(load, 1.0 / math.sqrt(variance) if variance > 1e-14 else 0.0)
    gain.used[:] = count


@lean
def bound_biases(covariance: Array, bias_variance: Array) -> None:
    """A marker's place on the hand is never known less than by its making, `bias_variance` (M,) m^2: it does not pay
    for what is not known of what was held."""
    for i in range(BIAS, covariance.shape[0]):
        most = bias_variance[(i - BIAS) // 3]
        if covariance[i, i] > most:
            share = math.sqrt(most / covariance[i, i])
            scale(covariance[i], share)
            for j in range(covariance.shape[0]):
                covariance[j, i] *= share
