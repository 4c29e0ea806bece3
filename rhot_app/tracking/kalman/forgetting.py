"""What a filter must forget to stay honest.

Two things are forgotten, in the manner of stabilised forgetting (Kulhavy and Zarrop 1993): information is given up and
that of the natural pose comes in for it, so that a joint which nothing shows becomes as uncertain as habits say, no
more and no less.

Everything about the pose fades slowly: what markers show is there again with the next frame.

What no worn marker can show, now or ever, fades fast. Six markers leave nine of a hand's 27 freedoms open: directions
in which it can move with every marker in its place. They turn with the pose. A filter that linearises anew with every
frame, each time about a slightly other pose, sees each time a slightly other subspace left open, and takes the sum of
what it saw for knowledge of everything, which it is not (Huang et al. 2010 call it inconsistency).
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.hand.linear import factorise
from rhot_app.tracking.kalman.estimate import ANGLES, POSE, Estimate
from rhot_app.tracking.kalman.motion import Habits

Array = NDArray[np.float64]

FADE_S = 2.0
"""Time constant of what is known of a pose."""

OPEN_S = 0.15
"""Time constant of what seems to be known of directions that no marker shows."""

SHARPNESS_M = 3e-5
"""What moves no marker by more than this counts as open."""

WIDEST = 0.7
"""Standard deviation, m and rad, beyond which a palm's place is not worth knowing."""


@njit(cache=True)
def open_directions(jacobian: Array, usual: Array, out: Array) -> None:
    """Fill `out` (27, 27) with the covariance that habits leave to a pose whose markers all stay in their places.

    `jacobian` (M, 3, 27) of the markers' places per pose number; `usual` (27, 27) as in `Habits`.
    """
    rows = 3 * jacobian.shape[0]
    flat = jacobian.reshape(rows, POSE)
    gains = flat @ usual
    total = gains @ flat.T
    for k in range(rows):
        total[k, k] += SHARPNESS_M * SHARPNESS_M
    factorise(total)
    for k in range(rows):  # gains becomes L^-1 J Sigma
        for other in range(k):
            for i in range(POSE):
                gains[k, i] -= total[k, other] * gains[other, i]
        for i in range(POSE):
            gains[k, i] /= total[k, k]
    out[:] = usual - gains.T @ gains


@njit(cache=True)
def forget(estimate: Estimate, dt: float, habits: Habits, jacobian: Array, step: Array) -> None:
    """Let knowledge fade for `dt` s. `jacobian` as in `open_directions`; fills `step` (N,), what the mean moves by."""
    covariance = estimate.covariance
    _fade(covariance, dt)
    left_open = np.empty((POSE, POSE))
    open_directions(jacobian, habits.usual, left_open)
    share = -math.expm1(-dt / OPEN_S)
    for i in range(POSE):
        for j in range(POSE):
            covariance[i, j] += share * 0.5 * (left_open[i, j] + left_open[j, i])
    _return_to_habits(estimate, share - math.expm1(-dt / FADE_S), habits, step)


@njit(cache=True)
def _fade(covariance: Array, dt: float) -> None:
    """Give up a part of the information about the pose, but never so much that its place is not worth knowing."""
    size = covariance.shape[0]
    grow = math.exp(0.5 * dt / FADE_S)
    for i in range(POSE):
        factor = grow
        if i < ANGLES and covariance[i, i] * grow * grow > WIDEST * WIDEST:
            factor = WIDEST / math.sqrt(covariance[i, i])
        for j in range(size):
            covariance[i, j] *= factor
        for j in range(size):
            covariance[j, i] *= factor


@njit(cache=True)
def _return_to_habits(estimate: Estimate, share: float, habits: Habits, step: Array) -> None:
    """Weigh a `share` of what habits say: every row is one scalar observation, exact because it is linear."""
    covariance = estimate.covariance
    size = covariance.shape[0]
    step[:] = 0.0
    gain = np.empty(size)
    for k in range(habits.rows.shape[0]):
        row = habits.rows[k]
        gain[:] = 0.0
        expected = 0.0
        for a in range(21):
            if row[a] != 0.0:
                expected += row[a] * (estimate.angles[a] + step[ANGLES + a])
                for j in range(size):
                    gain[j] += row[a] * covariance[ANGLES + a, j]
        variance = 1.0 / share
        for a in range(21):
            if row[a] != 0.0:
                variance += row[a] * gain[ANGLES + a]
        pull = (habits.values[k] - expected) / variance
        for i in range(size):
            step[i] += gain[i] * pull
            factor = gain[i] / variance
            for j in range(size):
                covariance[i, j] -= factor * gain[j]
