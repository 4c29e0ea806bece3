"""What an update of the filter consists of, compiled: all that needs to know no block of observations."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.lean import lean, room
from rhot_app.tracking.kalman.estimate import (
    BIAS,
    FINGERS,
    FREE,
    MOST_NUMBERS,
    POSE,
    ROTATION,
    SCALE,
    Estimate,
    displace,
    empty_estimate,
    take_size,
)
from rhot_app.tracking.kalman.forgetting import forget
from rhot_app.tracking.kalman.gain import Gain, contract, empty_gain, misfit, solve
from rhot_app.tracking.kalman.habits import Habits
from rhot_app.tracking.kalman.holding import TURN_ALONE, hold, hold_size, hold_turn, let_go, rest, strangeness
from rhot_app.tracking.kalman.limits import project
from rhot_app.tracking.kalman.markers import Outfit, place_markers
from rhot_app.tracking.kalman.motion import predict
from rhot_app.tracking.kalman.reappearing import loosen, loosen_palm
from rhot_app.tracking.kalman.rows import ROWS_MAX, Rows, empty_rows
from rhot_app.tracking.kalman.share import Share
from rhot_app.tracking.kalman.sighted import fingers_away, keep_shown, note_sights
from rhot_app.tracking.kalman.surprise import UNLIKELY, appraise, note_trend
from rhot_app.tracking.kalman.withholding import Held, bound_biases, empty_held, withhold

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

LONGEST_RAD = 0.35
"""A step that turns anything by more is shortened to this and the rows are linearised again: what moves along an arc
would be led off it."""

ASTRAY_M = 0.3
"""Standard deviation of a palm's place beyond which it must be looked for."""

FASTEST_M_S, FASTEST_RAD_S = 12.0, 40.0
"""No palm is faster: a boxer's fist peaks near 10 m/s, a forearm turns at 25 rad/s."""


class Desk(NamedTuple):
    """All that an update works with: the `estimate`, a `trial` of it, and room for what comes between."""

    estimate: Estimate
    trial: Estimate
    rows: Rows
    gain: Gain
    held: Held
    step: Array  # (N,)
    believed: Mask
    widening: Array
    back: Mask  # (5,) fingers that have just come back into sight
    outfit: Outfit
    habits: Habits
    limits: Array
    size: Array  # (2,): the logarithm of the hand's scale, and the variance of it, 0 for a size that is certain
    strange: Array  # (1,): `holding.strangeness` of the estimate


def set_desk(outfit: Outfit, habits: Habits, limits: Array) -> Desk:
    """A desk with its room; arguments as of `HandFilter`."""
    shape = len(outfit.cameras.pose), len(outfit.worn.part)
    size = BIAS + 3 * shape[1]
    return Desk(empty_estimate(*shape), empty_estimate(*shape), empty_rows(size), empty_gain(ROWS_MAX, size),
                empty_held(size), np.empty(size), np.empty(ROWS_MAX, np.bool_), np.empty(ROWS_MAX),
                np.empty(FINGERS, np.bool_), outfit, habits, limits, np.zeros(2), np.zeros(1))


@njit(cache=True)
def is_astray(shared: Share) -> bool:
    """Whether the shared desk's estimate is worth nothing any more, as `HandFilter.astray`."""
    return _is_astray(shared.of.estimate)


@lean
def _is_astray(estimate: Estimate) -> bool:
    variance, speed, spin = 0.0, 0.0, 0.0
    for i in range(ROTATION):
        variance += estimate.covariance[i, i]
        speed += estimate.velocity[i] ** 2
        spin += estimate.velocity[ROTATION + i] ** 2
    return not (variance < ASTRAY_M**2 and speed < FASTEST_M_S**2 and spin < FASTEST_RAD_S**2)


@njit(cache=True)
def carry_on(shared: Share, dt: float) -> None:
    """Carry a shared desk's estimate on by `dt` s to the instant of what is to be observed; nothing is yet."""
    _carry_on(shared.of, dt)


@lean
def _carry_on(desk: Desk, dt: float) -> None:
    desk.rows.used[:] = 0
    predict(desk.estimate, dt, desk.outfit.worn.part, desk.habits, desk.estimate.bias_variance)
    if desk.size[1] > 0.0:
        take_size(desk.estimate, desk.size)


@njit(cache=True)
def prepare(shared: Share, dt: float) -> tuple[bool, bool, float, float]:
    """Decide what is held of the hand and which observations are believed, and take a first step; returns whether they
    are all likely, whether more is held than how the palm is turned and the hand's size, and what `improve` does."""
    likely, holds = _prepare(shared.of, dt)
    turn, turned = _improve(shared.of, 1.0)
    return likely, holds, turn, turned


@lean
def _prepare(desk: Desk, dt: float) -> tuple[bool, bool]:
    estimate, rows, worn, back = desk.estimate, desk.rows, desk.outfit.worn, desk.back
    desk.step[:] = 0.0
    hold(estimate, rows, worn.part, worn.palmar, desk.outfit.cameras.pose, desk.habits, desk.held)
    rest(estimate, desk.held.sight, dt)
    loosen(estimate, worn.part, rows, desk.habits.usual, back)
    if loosen_palm(estimate, desk.outfit, rows, desk.habits.usual):
        estimate.held[0] = FREE
        let_go(desk.held)
    hold_size(estimate.covariance, desk.held)
    appraise(rows, estimate, desk.habits.together, back, desk.believed, desk.widening)
    withhold(estimate.covariance, desk.held, desk.gain)
    unlikely = 0
    for observation in range(rows.used[1]):
        unlikely += desk.widening[observation] > UNLIKELY
    return unlikely == 0, desk.held.used[0] > TURN_ALONE + (desk.size[1] > 0.0)


@njit(cache=True)
def misfit_of(shared: Share) -> float:
    """The shared desk's `gain.misfit`."""
    desk: Desk = shared.of
    return misfit(desk.rows, desk.believed, desk.widening)


@njit(cache=True)
def hold_turn_alone(shared: Share) -> None:
    """Let go of all that is held but the palm's turn, and begin anew."""
    _hold_turn_alone(shared.of)


@lean
def _hold_turn_alone(desk: Desk) -> None:
    desk.step[:] = 0.0
    let_go(desk.held)
    hold_turn(desk.held)
    hold_size(desk.estimate.covariance, desk.held)
    withhold(desk.estimate.covariance, desk.held, desk.gain)


@njit(cache=True)
def improve(shared: Share, share: float) -> tuple[float, float]:
    """One iteration, a `share` of what it wants to be and no longer than `LONGEST_RAD`; the trial becomes the new mean.
    Returns its largest turn and that of the whole step, rad."""
    return _improve(shared.of, share)


@lean
def _improve(desk: Desk, share: float) -> tuple[float, float]:
    estimate, gain, step, before = desk.estimate, desk.gain, desk.step, room((MOST_NUMBERS,))
    size = step.shape[0]
    for i in range(size):
        before[i] = step[i]
    solve(desk.rows, estimate.covariance, desk.believed, desk.widening, step, gain)
    share *= LONGEST_RAD / max(_turn(before, step), LONGEST_RAD)
    if share < 1.0:
        for i in range(size):
            step[i] = before[i] + share * (step[i] - before[i])
    project(estimate.angles, estimate.velocity, estimate.covariance, gain.rows[:gain.used[1]], desk.limits, step)
    displace(estimate, step, desk.trial)
    turn = _turn(before, step)
    before[:] = 0.0
    return turn, _turn(before, step)


@lean
def _turn(one: Array, other: Array) -> float:
    """The largest angle between two steps (N,), rad."""
    turn = 0.0
    for i in range(ROTATION, POSE):
        turn = max(turn, abs(other[i] - one[i]))
    return turn


@njit(cache=True)
def conclude(shared: Share, dt: float) -> None:
    """Take the new mean, shrink the covariance by what was learnt, forget, keep the limits; the size stays."""
    _conclude(shared.of, dt)


@lean
def _conclude(desk: Desk, dt: float) -> None:
    estimate, worn, places, gain, step = desk.estimate, desk.outfit.worn, desk.outfit.places, desk.gain, desk.step
    note_sights(estimate, worn.part, desk.rows, desk.believed)
    note_trend(estimate, step, gain)
    contract(estimate.covariance, gain)
    displace(estimate, step, estimate)
    if gain.used[0] > 0:
        bound_biases(estimate.covariance, estimate.bias_variance)
    place_markers(worn.dh, estimate, places)
    keep_shown(estimate, worn.part, worn.palmar, desk.outfit.cameras.pose, places.points, places.jacobian)
    away = room((FINGERS,))
    fingers_away(estimate, worn.part, away)
    forget(estimate, dt, desk.habits, estimate.bias_variance, places.jacobian, gain, desk.outfit.opening, step, away)
    project(estimate.angles, estimate.velocity, estimate.covariance, gain.rows[:0], desk.limits, step)
    displace(estimate, step, estimate)
    desk.strange[0] = strangeness(estimate.angles, desk.habits)
    if desk.size[1] > 0.0:
        estimate.log_scale[0], estimate.covariance[SCALE, SCALE] = desk.size[0], desk.size[1]
