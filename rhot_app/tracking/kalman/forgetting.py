"""What a filter must forget to stay honest.

What no marker in sight can show fades fast. Six markers leave nine of a hand's 27 freedoms open: directions in which it
can move with every marker in its place; hidden ones leave more. They turn with the pose. A filter that linearises anew
with every frame, each time about a slightly other pose, sees each time a slightly other subspace left open, and takes
the sum of what it saw for knowledge of everything, which it is not (Huang et al. 2010 call it inconsistency). So within
these directions, and only there, the pose returns to habit: an Ornstein-Uhlenbeck process whose mean is the natural
pose and whose covariance is what habit leaves to a hand with its markers where they are seen. What the palm's own
markers do not place goes on as it went (`holding.py`) and returns more slowly.

Everything about the pose fades slowly, in the manner of stabilised forgetting (Kulhavy and Zarrop 1993): information is
given up and that of the natural pose comes in for it. What markers show is there again with the next frame; a joint
that none shows becomes as uncertain as habit says, no more and no less.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rhot_app.lean import lean, room
from rhot_app.tracking.kalman.combine import mirror
from rhot_app.tracking.kalman.estimate import (
    ANGLES,
    FADING,
    FIRST_FINGER,
    GOES_ON,
    GROUP_OF,
    MOST_NUMBERS,
    OPENING,
    PLACED,
    POSE,
    ROTATION,
    TURN_HELD,
    Estimate,
)
from rhot_app.tracking.kalman.gain import Gain, add_step, contract, project_rows
from rhot_app.tracking.kalman.habits import Habits
from rhot_app.tracking.kalman.holding import ENOUGH
from rhot_app.tracking.kalman.opening import Opening, open_up
from rhot_app.tracking.kalman.rows import ROWS_MAX
from rhot_app.tracking.kalman.sighted import FRESH_S

Array = NDArray[np.float64]

FADE_S = 2.0
"""Time constant of what is known of a pose."""

AWAY_S = 0.3
"""The same of a finger out of sight: soon the others tell more of it than what it did."""

OPEN_S = 0.05
"""Time constant of what seems to be known of directions that no marker shows."""

SHAPE_S = 2.0
"""The same while a single camera sees the palm, and does not see its distance: its course tells more for a while."""

ALONE_S = 40.0
"""The same while that camera alone sees all of the hand: how a hand looks that is nearer or farther away is so much
like one that bends its fingers otherwise that habit would move it by centimetres."""

HIDDEN_S = 1.0
"""The same while none sees it: soon its fingertips tell more than its course."""

SETTLED_RAD = 0.25
"""Standard deviation of the palm's turn below which it has been found, and only then can be seen to turn."""

LEAST_SHOWN = 3
"""With fewer markers in sight the hand's course tells more of it than habit does."""

FADING_S = 0.04
"""Both are done in steps of this: it is as good, and costs less."""

WIDEST = 0.7
"""Standard deviation, m and rad, beyond which a palm's place is not worth knowing."""


@lean
def forget(estimate: Estimate, dt: float, habits: Habits, bias_variance: Array, jacobian: Array, gain: Gain,
           opening: Opening, step: Array, away: Array) -> None:
    """Let knowledge fade for `dt` s; fills `step` (N,), what the mean moves by. `gain` and `opening` are room to work
    in; `away` (5,): s since each finger was seen; others as in `open_directions`.

    It depends on how the hand is held (`holding.py`).
    """
    step[:] = 0.0
    estimate.unfaded[OPENING] += dt
    estimate.unfaded[FADING] += dt
    how, what = estimate.held[0], OPENING if estimate.unfaded[OPENING] >= estimate.unfaded[FADING] else FADING
    passed = estimate.unfaded[what]
    if passed >= FADING_S:  # in turns, lest one update in three take twice as long as the others
        if what == FADING:
            fading = room((POSE,))
            _fill_fading(away, fading)
            _fade(estimate.covariance, passed, fading)
            if how < PLACED:
                _return_to_habits(estimate, passed, fading, habits, gain, step)
        elif how != GOES_ON and _shown(jacobian) >= LEAST_SHOWN:
            constant = OPEN_S
            if how >= PLACED:
                constant = HIDDEN_S
                if _palm_shown(jacobian) > 0:
                    constant = SHAPE_S if _placed(jacobian) else ALONE_S
            settled = _is_settled(estimate)
            open_up(estimate, -math.expm1(-passed / constant), habits, bias_variance, jacobian, opening, step)
            if settled and how == TURN_HELD:  # what habit has to bring on turns
                turned = math.sqrt(step[ROTATION] ** 2 + step[ROTATION + 1] ** 2 + step[ROTATION + 2] ** 2)
                estimate.turning[0] = max(estimate.turning[0], turned / passed)
        mirror(estimate.covariance)  # rounding must not make it unsymmetric: what fades would let it grow
        estimate.unfaded[what] = 0.0
    if how > TURN_HELD or _palm_shown(jacobian) >= ENOUGH:
        estimate.left_open[:] = 0.0


@lean
def _shown(jacobian: Array) -> int:
    """How many markers are seen: their places go with the palm's."""
    count = 0
    for m in range(jacobian.shape[0]):
        count += _moves(jacobian[m], 0, ROTATION)
    return count


@lean
def _palm_shown(jacobian: Array) -> int:
    """How many markers are seen that go with the palm alone."""
    count = 0
    for m in range(jacobian.shape[0]):
        count += _moves(jacobian[m], 0, ROTATION) and not _moves(jacobian[m], ANGLES, POSE)
    return count


@lean
def _moves(jacobian: Array, first: int, end: int) -> bool:
    """Whether what has `jacobian` (3, 27) moves with any of the numbers first to end - 1."""
    for i in range(3):
        for j in range(first, end):
            if jacobian[i, j] != 0.0:
                return True
    return False


@lean
def _placed(jacobian: Array) -> bool:
    """Whether any marker is seen by two cameras: then none of its three directions has been left out."""
    most = 0.0
    for m in range(jacobian.shape[0]):
        most = max(most, jacobian[m, 0, 0] + jacobian[m, 1, 1] + jacobian[m, 2, 2])
    return most > 2.5


@lean
def _is_settled(estimate: Estimate) -> bool:
    """Whether it has been found how the palm is turned."""
    doubt = 0.0
    for i in range(ROTATION, ANGLES):
        doubt += estimate.covariance[i, i]
    return bool(doubt < SETTLED_RAD * SETTLED_RAD)


@lean
def _fill_fading(away: Array, out: Array) -> None:
    """Fill `out` (27,) with the time constants, s, of what is known of each pose number."""
    out[:] = FADE_S
    for i in range(ANGLES, POSE):
        if away[GROUP_OF[i] - FIRST_FINGER] > FRESH_S:
            out[i] = AWAY_S


@lean
def _fade(covariance: Array, dt: float, fading: Array) -> None:
    """Give up a part of the information about the pose, but never so much that its place is not worth knowing."""
    size = covariance.shape[0]
    factor = room((MOST_NUMBERS,))
    factor[:] = 1.0
    for i in range(POSE):
        grow = math.exp(0.5 * dt / fading[i])
        factor[i] = grow
        if i < ANGLES and covariance[i, i] * grow * grow > WIDEST * WIDEST:
            factor[i] = WIDEST / math.sqrt(covariance[i, i])
    for i in range(size):
        row, own = covariance[i], factor[i]
        for j in range(size):
            row[j] *= own * factor[j]


@lean
def _return_to_habits(estimate: Estimate, dt: float, fading: Array, habits: Habits, gain: Gain, step: Array) -> None:
    """Weigh what habits say of `dt` s, in one linear update: as much as fades. `gain` is room for it."""
    count = habits.rows.shape[0]
    noise, right = room((ROWS_MAX, 2)), room((ROWS_MAX,))
    for k in range(count):
        right[k] = habits.values[k]
        shortest = FADE_S
        for a in range(ANGLES, POSE):
            if habits.rows[k, a - ANGLES] != 0.0:
                shortest = min(shortest, fading[a])
        noise[k, 0], noise[k, 1] = -1.0 / math.expm1(-dt / shortest), 0.0
        gain.jacobian[k] = 0.0
        for a in range(ANGLES, POSE):
            gain.jacobian[k, a] = habits.rows[k, a - ANGLES]
            right[k] -= gain.jacobian[k, a] * (estimate.angles[a - ANGLES] + step[a])
    gain.used[0], gain.used[1] = 0, count
    project_rows(gain, estimate.covariance, noise)
    add_step(gain, right, step)
    contract(estimate.covariance, gain)
