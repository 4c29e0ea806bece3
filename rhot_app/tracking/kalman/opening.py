"""The directions in which a hand can move with every marker in its place, and the way back to habit within them.

A pose x of natural covariance S, of which markers that stay in their places tell 0 = J x + noise, has the covariance
L = S - K J S, with K = S J^T (J S J^T + R)^-1 as in any update. An Ornstein-Uhlenbeck process with this stationary
covariance goes back by a share of L W, W being what habit knows, the inverse of S: L W = 1 - K J. So nothing is ever
multiplied by W or L W, but by J and K, which have far fewer rows.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rhot_app.hand.linear import factorise
from rhot_app.lean import lean, room
from rhot_app.tracking.kalman.combine import add_rows, add_squares, dot, fill, scale
from rhot_app.tracking.kalman.estimate import ANGLES, BIAS, MOST_MARKERS, POSE, ROTATION, Estimate
from rhot_app.tracking.kalman.habits import Habits

Array = NDArray[np.float64]

STRIDE_RAD = 0.1
"""A hand goes back to habit in steps of no more than this: the open directions turn on the way."""

SHARPNESS_M = 3e-5
"""What moves no marker by more than this counts as open."""

_MOST_ROWS = 3 * MOST_MARKERS
_MOST_KEPT = POSE + _MOST_ROWS


class Opening(NamedTuple):
    """Room to work in, for a state of N numbers of which S, the pose and the biases of M markers, may be open:
    `left_open` (S, S), L; `gains` (3 M, S), K^T; `factor` (3 M, 3 M); `seen` (3 M, N), `back` (S, N), `kept` (S, S)."""

    left_open: Array
    gains: Array
    factor: Array
    seen: Array
    back: Array
    kept: Array


def empty_opening(markers: int) -> Opening:
    """Room for so many markers."""
    rows, size, kept = 3 * markers, BIAS + 3 * markers, POSE + 3 * markers
    return Opening(np.empty((kept, kept)), np.empty((rows, kept)), np.empty((rows, rows)), np.empty((rows, size)),
                   np.empty((kept, size)), np.empty((kept, kept)))


@lean
def open_directions(jacobian: Array, usual: Array, bias_variance: Array, out: Opening) -> None:
    """Fill `out.left_open` (27 + 3 M, 27 + 3 M) with the covariance that habit leaves to the pose and the biases of
    markers that are seen to stay in their places; `factor` and `gains` with C and C^-1 J S, C C^T = J S J^T + R.

    `jacobian` (M, 3, 27) of what is seen of the markers' places per pose number (`sighted.keep_shown`); `usual`
    (27, 27) as in `Habits`; `bias_variance` (M,).
    """
    left_open, gains, factor, rows = out.left_open, out.gains, out.factor, out.gains.shape[0]
    for k in range(rows):
        gains[k] = 0.0
        add_rows(gains[k, :POSE], jacobian[k // 3, k % 3], usual, 1.0)
        gains[k, POSE + k] = bias_variance[k // 3]
        for other in range(k + 1):
            factor[k, other] = dot(gains[k, :POSE], jacobian[other // 3, other % 3])
        factor[k, k] += bias_variance[k // 3] + SHARPNESS_M * SHARPNESS_M
    factorise(factor)
    left_open[:] = 0.0
    for i in range(POSE):
        fill(left_open[i, :POSE], usual[i])
    for k in range(rows):
        left_open[POSE + k, POSE + k] = bias_variance[k // 3]
        add_rows(gains[k], factor[k, :k], gains, -1.0)
        scale(gains[k], 1.0 / factor[k, k])
    add_squares(left_open, gains, -1.0)


@lean
def open_up(estimate: Estimate, share: float, habits: Habits, bias_variance: Array, jacobian: Array, room_for: Opening,
            step: Array) -> None:
    """A `share` of the way back to habit, within the open directions; adds to `step` (N,) what the mean moves by.
    Leaves what is open of the pose in the estimate; others as in `open_directions`."""
    covariance, size, kept = estimate.covariance, estimate.covariance.shape[0], room_for.left_open.shape[0]
    open_directions(jacobian, habits.usual, bias_variance, room_for)
    for i in range(POSE):
        fill(estimate.left_open[i], room_for.left_open[i, :POSE])
    _complete_gains(room_for)
    moved = room((_MOST_KEPT,))
    share *= _way_back(estimate, share, habits, jacobian, room_for, moved)
    for i in range(kept):
        step[_number(i)] -= moved[i]
    _fill_back(covariance, share, habits.usual, jacobian, room_for)
    _fill_kept(share, habits.usual, jacobian, room_for)
    for i in range(kept):
        row, back = covariance[_number(i)], room_for.back[i]
        for j in range(size):
            row[j] -= back[j]
    for j in range(size):
        for i in range(kept):
            covariance[j, _number(i)] -= room_for.back[i, j]
    for i in range(kept):
        for j in range(kept):
            covariance[_number(i), _number(j)] += 0.5 * (room_for.kept[i, j] + room_for.kept[j, i])


@lean
def _number(i: int) -> int:
    """Which number of the state the i-th is of the pose and the biases."""
    return i if i < POSE else BIAS + i - POSE


@lean
def _complete_gains(room_for: Opening) -> None:
    """C^-1 J S becomes (C C^T)^-1 J S."""
    gains, factor = room_for.gains, room_for.factor
    for k in range(gains.shape[0] - 1, -1, -1):
        for other in range(k + 1, gains.shape[0]):
            weight = factor[other, k]
            for i in range(gains.shape[1]):
                gains[k, i] -= weight * gains[other, i]
        scale(gains[k], 1.0 / factor[k, k])


@lean
def _way_back(estimate: Estimate, share: float, habits: Habits, jacobian: Array, room_for: Opening,
              moved: Array) -> float:
    """Fill `moved` (S,) with a `share` of L W times how far the hand is from habit, or less of it, lest it go too far;
    returns which part of the share that is."""
    away, farthest = room((POSE,)), 0.0
    away[:] = 0.0
    for i in range(ANGLES, POSE):
        away[i] = estimate.angles[i - ANGLES] - habits.mean[i - ANGLES]
    kept, rows = room_for.left_open.shape[0], room_for.gains.shape[0]
    for i in range(kept):
        moved[i] = share * (away[i] if i < POSE else estimate.bias[(i - POSE) // 3, (i - POSE) % 3])
    for k in range(rows):
        seen = dot(jacobian[k // 3, k % 3], away) + estimate.bias[k // 3, k % 3]
        for i in range(kept):
            moved[i] -= share * seen * room_for.gains[k, i]
    for i in range(ROTATION, POSE):
        farthest = max(farthest, abs(moved[i]))
    if farthest <= STRIDE_RAD:
        return 1.0
    for i in range(kept):
        moved[i] *= STRIDE_RAD / farthest
    return STRIDE_RAD / farthest


@lean
def _fill_back(covariance: Array, share: float, usual: Array, jacobian: Array, room_for: Opening) -> None:
    """`back` becomes a `share` of L W P, of the rows of pose and biases. Habit knows nothing of the palm: W is without
    what the inverse of S has of it."""
    seen, weights = room_for.seen, room((_MOST_ROWS,))
    rows = seen.shape[0]
    for k in range(rows):
        fill(seen[k], covariance[BIAS + k])
        add_rows(seen[k], jacobian[k // 3, k % 3], covariance, 1.0)
    for i in range(room_for.back.shape[0]):
        back = room_for.back[i]
        fill(back, covariance[_number(i)])
        for k in range(rows):
            weights[k] = room_for.gains[k, i]
        add_rows(back, weights[:rows], seen, -1.0)
        for k in range(ANGLES):
            weights[k] = room_for.left_open[i, k] / usual[k, k]
        add_rows(back, weights[:ANGLES], covariance, -1.0)
        scale(back, share)


@lean
def _fill_kept(share: float, usual: Array, jacobian: Array, room_for: Opening) -> None:
    """`kept` becomes `back` times a `share` of (L W)^T, of pose and biases, and what comes in of L."""
    one, seen, rows, kept = room((_MOST_KEPT,)), room((_MOST_ROWS,)), room_for.gains.shape[0], room_for.kept.shape[0]
    for i in range(kept):
        out = room_for.kept[i]
        for j in range(kept):
            one[j] = room_for.back[i, _number(j)]
        for k in range(rows):
            seen[k] = dot(jacobian[k // 3, k % 3], one[:POSE]) + one[POSE + k]
        fill(out, one[:kept])
        add_rows(out, seen[:rows], room_for.gains, -1.0)
        for k in range(ANGLES):
            seen[k] = one[k] / usual[k, k]
        add_rows(out, seen[:ANGLES], room_for.left_open, -1.0)
        scale(out, share)
        for j in range(kept):
            out[j] += share * (2.0 - share) * room_for.left_open[i, j]
