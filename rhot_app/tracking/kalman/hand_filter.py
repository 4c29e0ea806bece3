"""The filter of one hand: carried to an instant, told what was observed there, asked what it believes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.lean import lean, room
from rhot_app.tracking.kalman.estimate import (
    ANGLES,
    BIAS,
    FINGERS,
    FREE,
    GROUP_OF,
    MOST_NUMBERS,
    POSE,
    ROTATION,
    SCALE,
    TURN_HELD,
    Estimate,
    displace,
    empty_estimate,
    take_size,
)
from rhot_app.tracking.kalman.forgetting import forget
from rhot_app.tracking.kalman.gain import Gain, contract, empty_gain, misfit, solve
from rhot_app.tracking.kalman.holding import TURN_ALONE, hold, hold_size, hold_turn, let_go, rest, strangeness
from rhot_app.tracking.kalman.limits import project
from rhot_app.tracking.kalman.markers import Outfit, place_markers
from rhot_app.tracking.kalman.motion import MOST, Habits, predict
from rhot_app.tracking.kalman.reappearing import loosen, loosen_palm
from rhot_app.tracking.kalman.rows import ROWS_MAX, Outcome, Page, ResidualBlock, Rows, Verdict, empty_rows
from rhot_app.tracking.kalman.share import Share
from rhot_app.tracking.kalman.sighted import fingers_away, keep_shown, note_sights
from rhot_app.tracking.kalman.surprise import UNLIKELY, appraise, note_trend
from rhot_app.tracking.kalman.withholding import Held, bound_biases, empty_held, withhold

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

ITERATIONS = 2
"""Whole steps; more of them go to and fro where an angle is open."""

FITS, CAUTIOUS, CAUTIOUS_STEPS = 25.0, 0.3, 8
"""A finger that is nearly straight is shown as well bent the one way as the other. Where any row is left with a squared
normalised residual beyond the first of these, up to so many more steps go this part of their way; what smaller ones
leave is there again with the next frame."""

_SHORTENED = 0.99
LONGEST_RAD = 0.35
"""A step that turns anything by more is shortened to this and the rows are linearised again: what moves along an arc
would be led off it."""

MOST_STEPS = 12
"""Short ones and whole ones together."""

MISFIT = 50.0
"""Squared normalised residual of one row beyond which it is held no more how fingers bend that one camera sees: what
they cannot explain would be put down to the palm, by each camera in another direction."""

NEAR_RAD = 0.02
"""Steps whose turns are smaller are taken without linearising again: what is left is 0.1 px or less."""

START_SD = (0.03, 0.4, 1.0, 3.0, 6.0)
"""Standard deviations at the start: palm's place m, its rotation rad, velocities m/s, palm rad/s, fingers rad/s."""

START_TURNING = 1.0
"""A palm just found is taken to turn so fast, rad/s: how it is turned, all markers show at first, not habit."""

START_AGITATION = 0.01 * MOST
"""Where nobody knows yet how the hand moves."""

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


class HandFilter:
    """An iterated extended Kalman filter on the hand's pose, velocity and markers' biases, for a hand whose size it is
    told.

    `outfit`: the markers, and the cameras that see them; `habits`: what is believed of a hand without evidence;
    `limits` (21, 2) rad.
    """

    def __init__(self, outfit: Outfit, habits: Habits, limits: Array) -> None:
        shape = len(outfit.cameras.pose), len(outfit.worn.part)
        size = BIAS + 3 * shape[1]
        self.estimate = empty_estimate(*shape)
        self._desk = Desk(self.estimate, empty_estimate(*shape), empty_rows(size), empty_gain(ROWS_MAX, size),
                          empty_held(size), np.empty(size), np.empty(ROWS_MAX, np.bool_), np.empty(ROWS_MAX),
                          np.empty(FINGERS, np.bool_), outfit, habits, limits, np.zeros(2), np.zeros(1))
        self._shared, self._first = Share(self._desk), 0
        self._verdict = Share(Verdict(self._desk.believed, self._desk.widening, self._desk.rows.source))
        self._now, self._tried = (Share(Page(mean, self._desk.rows)) for mean in (self.estimate, self._desk.trial))

    def resize(self, log_scale: float, variance: float) -> None:
        """From the next update on the hand is exp(log_scale) times as large as its file says, with this variance of the
        logarithm. The filter learns nothing about it: what is not known of the size is in what it says of the pose."""
        self._desk.size[:] = log_scale, variance

    def start(self, world_from_palm: Array, angles: Array) -> None:
        """Begin at a pose (4, 4) m and (21,) rad that something rougher has found, knowing little else."""
        estimate, covariance = self.estimate, self.estimate.covariance
        estimate.world[:], estimate.angles[:] = world_from_palm, np.clip(angles, *self._desk.limits.T)
        for array in (estimate.velocity, estimate.acceleration, estimate.bias, estimate.trend, estimate.left_open,
                      estimate.untroubled, covariance):
            array[:] = 0.0
        estimate.placed_angles[:], estimate.log_scale[0] = estimate.angles, self._desk.size[0]
        estimate.agitation[:] = START_AGITATION
        estimate.unseen[:], estimate.unfaded[:], estimate.turning[:], estimate.held[:] = 0.0, 0.0, START_TURNING, FREE
        estimate.bias_variance[:], estimate.looks[:] = self._desk.outfit.made, 0.0
        place, turn, speed, spin, bend = START_SD
        diagonal = np.concatenate([
            np.full(3, place), np.full(3, turn), np.zeros(21), np.full(3, speed), np.full(3, spin), np.full(21, bend),
            np.sqrt(START_AGITATION)[GROUP_OF], [np.sqrt(self._desk.size[1])],
            np.repeat(np.sqrt(self._desk.outfit.made), 3)])
        np.fill_diagonal(covariance, diagonal**2)
        covariance[ANGLES:POSE, ANGLES:POSE] = self._desk.habits.usual[ANGLES:, ANGLES:]

    @property
    def astray(self) -> bool:
        """Whether the estimate is worth nothing any more: nobody's hand is so fast or so lost."""
        return bool(_is_astray(self._shared))

    @property
    def strangeness(self) -> float:
        """How far from habit the last update left the fingers bent, as `holding.strangeness` has it."""
        return float(self._desk.strange[0])

    def update(self, dt: float, blocks: Sequence[ResidualBlock]) -> Outcome:
        """Carry the estimate on by `dt` >= 0 s and weigh what `blocks` observed there; returns what became of the last
        one."""
        self._weigh(dt, blocks)
        return self._conclude(dt)

    def update_gently(self, dt: float, blocks: Sequence[ResidualBlock], most_rad: float) -> Outcome | None:
        """The same, unless anything that is seen is unlikely, or the palm is turned, or any joint bent, by more than
        `most_rad` for it: then None, and the estimate is of no use before it is brought back to what it was."""
        turned, likely = self._weigh(dt, blocks)
        return self._conclude(dt) if likely and turned <= most_rad else None

    def _weigh(self, dt: float, blocks: Sequence[ResidualBlock]) -> tuple[float, bool]:
        """All of an update but its conclusion; returns by how much it is to turn anything, rad, and whether all that is
        seen was likely."""
        _carry_on(self._shared, dt)
        for block in blocks:
            self._first = self._used()
            block.enter(self._now)
        likely, holds, turn, turned = _prepare(self._shared, dt)
        turned = self._settle(blocks, holds, turn, turned)
        if holds and self.estimate.held[0] == TURN_HELD:
            self._linearise(blocks, self._tried)
            if _misfit_of(self._shared) > MISFIT:  # fingers cannot bend as they are held to
                _hold_turn_alone(self._shared)
                self._linearise(blocks, self._now)
                turned = self._settle(blocks, False, *_improve(self._shared, 1.0))
        return turned, likely

    def _conclude(self, dt: float) -> Outcome:
        _conclude(self._shared, dt)
        return Outcome(self._verdict, self._first, self._used())

    def _used(self) -> int:
        """How many observations there are so far."""
        return int(self._desk.rows.used[1])

    def _linearise(self, blocks: Sequence[ResidualBlock], page: Share) -> None:
        self._desk.rows.used[:] = 0
        for block in blocks:
            block.linearise(page)

    def _settle(self, blocks: Sequence[ResidualBlock], holds: bool, turn: float, turned: float) -> float:
        """Iterate to the new mean after a first step, which made one `turn` and was to make all of `turned`, rad;
        returns by how much the steps together turn anything. `holds`: whether more is held than the palm's turn."""
        whole = int(turn < _SHORTENED * LONGEST_RAD)
        for _ in range(1, MOST_STEPS):
            if turn < NEAR_RAD or whole == ITERATIONS + CAUTIOUS_STEPS:
                break
            self._linearise(blocks, self._tried)
            if whole >= ITERATIONS and (holds or _misfit_of(self._shared) <= FITS):
                break
            turn, turned = _improve(self._shared, 1.0 if whole < ITERATIONS else CAUTIOUS)
            whole += turn < _SHORTENED * LONGEST_RAD
        return turned


@njit(cache=True)
def _is_astray(shared: Share) -> bool:
    return is_astray(shared.of.estimate)


@lean
def is_astray(estimate: Estimate) -> bool:
    """As `HandFilter.astray`."""
    variance, speed, spin = 0.0, 0.0, 0.0
    for i in range(ROTATION):
        variance += estimate.covariance[i, i]
        speed += estimate.velocity[i] ** 2
        spin += estimate.velocity[ROTATION + i] ** 2
    return not (variance < ASTRAY_M**2 and speed < FASTEST_M_S**2 and spin < FASTEST_RAD_S**2)


@njit(cache=True)
def _carry_on(shared: Share, dt: float) -> None:
    carry_on(shared.of, dt)


@lean
def carry_on(desk: Desk, dt: float) -> None:
    """Carry the estimate to the instant of what is to be observed; nothing is yet."""
    desk.rows.used[:] = 0
    predict(desk.estimate, dt, desk.outfit.worn.part, desk.habits, desk.estimate.bias_variance)
    if desk.size[1] > 0.0:
        take_size(desk.estimate, desk.size)


@njit(cache=True)
def _prepare(shared: Share, dt: float) -> tuple[bool, bool, float, float]:
    likely, holds = prepare(shared.of, dt)
    turn, turned = improve(shared.of, 1.0)
    return likely, holds, turn, turned


@lean
def prepare(desk: Desk, dt: float) -> tuple[bool, bool]:
    """Decide what is held of the hand and which observations are believed; returns whether they are all likely, and
    whether more is held than how the palm is turned, and the hand's size."""
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
def _misfit_of(shared: Share) -> float:
    desk: Desk = shared.of
    return misfit(desk.rows, desk.believed, desk.widening)


@njit(cache=True)
def _hold_turn_alone(shared: Share) -> None:
    hold_turn_alone(shared.of)


@lean
def hold_turn_alone(desk: Desk) -> None:
    """Let go of all that is held but the palm's turn, and begin anew."""
    desk.step[:] = 0.0
    let_go(desk.held)
    hold_turn(desk.held)
    hold_size(desk.estimate.covariance, desk.held)
    withhold(desk.estimate.covariance, desk.held, desk.gain)


@njit(cache=True)
def _improve(shared: Share, share: float) -> tuple[float, float]:
    return improve(shared.of, share)


@lean
def improve(desk: Desk, share: float) -> tuple[float, float]:
    """One iteration, a `share` of what it wants to be and no longer than `LONGEST_RAD`; the trial becomes the new mean.
    Returns its largest turn and that of the whole step, rad."""
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
def _conclude(shared: Share, dt: float) -> None:
    conclude(shared.of, dt)


@lean
def conclude(desk: Desk, dt: float) -> None:
    """Take the new mean, shrink the covariance by what was learnt, forget, keep the limits; the size stays."""
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
    forget(estimate, dt, desk.habits, estimate.bias_variance, places.jacobian, gain, step, away)
    project(estimate.angles, estimate.velocity, estimate.covariance, gain.rows[:0], desk.limits, step)
    displace(estimate, step, estimate)
    desk.strange[0] = strangeness(estimate.angles, desk.habits)
    if desk.size[1] > 0.0:
        estimate.log_scale[0], estimate.covariance[SCALE, SCALE] = desk.size[0], desk.size[1]
