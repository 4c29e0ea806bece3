"""The filter of one hand: carried to an instant, told what was observed there, asked what it believes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.tracking.kalman.estimate import (
    ANGLES,
    BIAS,
    GROUP_OF,
    PALM_HELD,
    POSE,
    ROTATION,
    Estimate,
    displace,
    empty_estimate,
)
from rhot_app.tracking.kalman.forgetting import forget
from rhot_app.tracking.kalman.gain import Gain, contract, empty_gain, misfit, solve
from rhot_app.tracking.kalman.holding import hold, hold_turn, rest
from rhot_app.tracking.kalman.limits import project
from rhot_app.tracking.kalman.markers import Cameras, Worn, place_markers
from rhot_app.tracking.kalman.motion import MOST, Habits, predict
from rhot_app.tracking.kalman.reappearing import loosen
from rhot_app.tracking.kalman.rows import ResidualBlock, Rows, clear, empty_rows
from rhot_app.tracking.kalman.sighted import keep_shown, note_sights
from rhot_app.tracking.kalman.surprise import appraise, note_trend
from rhot_app.tracking.kalman.withholding import Held, empty_held, release, restore, withhold

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

ITERATIONS = 2
"""More of them go to and fro where an angle is open: what is left is there again with the next frame."""

MISFIT = 1000.0
"""Squared normalised residual of one row beyond which what held the hand is let go."""

NEAR_RAD = 0.02
"""Steps whose turns are smaller are taken without linearising again: what is left is 0.1 px or less."""

ROWS_MAX = 128

START_SD = (0.03, 0.4, 1.0, 3.0, 6.0)
"""Standard deviations at the start: palm's place m, its rotation rad, velocities m/s, palm rad/s, fingers rad/s."""

START_AGITATION = 0.01 * MOST
"""Where nobody knows yet how the hand moves."""

ASTRAY_M = 0.3
"""Standard deviation of a palm's place beyond which it must be looked for."""

FASTEST = 12.0
"""No palm is faster, m/s: a boxer's fist peaks near 10."""

SCALE_SD = 0.1
"""Of the hand's size at the start, when it may float."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of an update's L observations, in the order of the blocks: `believed` (L,), and `source` (L, 3) as in
    `Rows`. Views that the next update overwrites."""

    believed: Mask
    source: NDArray[np.int64]


class HandFilter:
    """An iterated extended Kalman filter on the hand's pose, velocity, size and markers' biases.

    `worn`: the markers; `habits`: what is believed of a hand without evidence; `limits` (21, 2) rad; `bias_variance`
    (M,) m^2.
    """

    def __init__(self, worn: Worn, cameras: Cameras, habits: Habits, limits: Array, bias_variance: Array, *,
                 float_scale: bool = False) -> None:
        markers = len(worn.part)
        size = BIAS + 3 * markers
        self.estimate = empty_estimate(len(cameras.pose), markers)
        self._worn, self._cameras, self._habits = worn, cameras, habits
        self._limits, self._bias_variance = limits, bias_variance
        self._float_scale = float_scale
        self._trial = empty_estimate(len(cameras.pose), markers)
        self._rows = empty_rows(ROWS_MAX, size)
        self._gain, self._held = empty_gain(ROWS_MAX, size), empty_held(size)
        self._step = np.empty(size)
        self._believed = np.empty(ROWS_MAX, np.bool_)
        self._widening = np.empty(ROWS_MAX)

    def start(self, world_from_palm: Array, angles: Array) -> None:
        """Begin at a pose (4, 4) m and (21,) rad that something rougher has found, knowing little else."""
        estimate, covariance = self.estimate, self.estimate.covariance
        estimate.world[:], estimate.angles[:] = world_from_palm, np.clip(angles, *self._limits.T)
        for array in (estimate.velocity, estimate.acceleration, estimate.log_scale, estimate.bias, estimate.trend,
                      covariance):
            array[:] = 0.0
        estimate.agitation[:] = START_AGITATION
        estimate.unseen[:] = 0.0
        place, turn, speed, spin, bend = START_SD
        diagonal = np.concatenate([
            np.full(3, place), np.full(3, turn), np.zeros(21), np.full(3, speed), np.full(3, spin), np.full(21, bend),
            np.sqrt(START_AGITATION)[GROUP_OF], [SCALE_SD if self._float_scale else 0.0],
            np.repeat(np.sqrt(self._bias_variance), 3)])
        np.fill_diagonal(covariance, diagonal**2)
        covariance[ANGLES:POSE, ANGLES:POSE] = self._habits.usual[ANGLES:, ANGLES:]

    @property
    def astray(self) -> bool:
        """Whether the estimate is worth nothing any more: nobody's hand is so fast or so lost."""
        covariance, velocity = self.estimate.covariance, self.estimate.velocity
        return not (float(covariance[0, 0] + covariance[1, 1] + covariance[2, 2]) < ASTRAY_M**2
                    and float(velocity[:3] @ velocity[:3]) < FASTEST**2)

    def update(self, dt: float, blocks: Sequence[ResidualBlock]) -> Outcome:
        """Carry the estimate on by `dt` >= 0 s and weigh what `blocks` observed there."""
        estimate, rows = self.estimate, self._rows
        predict(estimate, dt, self._worn.part, self._habits, self._bias_variance)
        for block in blocks:
            block.associate(estimate)
        self._linearise(blocks, estimate)
        _prepare(estimate, rows, dt, self._worn, self._cameras, self._habits, self._held, self._believed,
                 self._widening)
        self._settle(blocks)
        if estimate.held[0] == PALM_HELD and self._misfits(blocks):
            release(estimate.covariance, self._held)
            hold_turn(self._held)
            withhold(estimate.covariance, self._held)
            self._linearise(blocks, estimate)
            self._settle(blocks)
        _conclude(estimate, rows, self._believed, self._gain, self._held, dt, self._worn, self._cameras, self._habits,
                  self._bias_variance, self._limits, self._step)
        observations = int(rows.used[1])
        return Outcome(self._believed[:observations], rows.source[:observations])

    def _linearise(self, blocks: Sequence[ResidualBlock], estimate: Estimate) -> None:
        clear(self._rows)
        for block in blocks:
            block.linearise(estimate, self._rows)

    def _settle(self, blocks: Sequence[ResidualBlock]) -> None:
        """Iterate to the new mean, a `_step` from the old one."""
        self._step[:] = 0.0
        for iteration in range(ITERATIONS):
            if iteration > 0:
                self._linearise(blocks, self._trial)
            if _improve(self.estimate, self._rows, self._believed, self._widening, self._step, self._gain,
                        self._limits, self._trial):
                return

    def _misfits(self, blocks: Sequence[ResidualBlock]) -> bool:
        """Whether the hand as it is held cannot be where it is seen."""
        self._linearise(blocks, self._trial)
        return bool(misfit(self._rows, self._believed, self._widening) > MISFIT)


@njit(cache=True)
def _prepare(estimate: Estimate, rows: Rows, dt: float, worn: Worn, cameras: Cameras, habits: Habits, held: Held,
             believed: Mask, widening: Array) -> None:
    """Decide what is held of the hand and which observations are believed."""
    hold(estimate, rows, worn.part, cameras.pose, habits.stiff, held)
    rest(estimate, dt)
    loosen(estimate, worn.part, rows, habits.usual)
    appraise(rows, estimate, habits.together, believed, widening)
    withhold(estimate.covariance, held)


@njit(cache=True)
def _improve(estimate: Estimate, rows: Rows, believed: Mask, widening: Array, step: Array, gain: Gain, limits: Array,
             trial: Estimate) -> bool:
    """One iteration; `trial` becomes the new mean. Returns whether it moved only little."""
    before = step.copy()
    solve(rows, estimate.covariance, believed, widening, step, gain)
    project(estimate.angles, estimate.velocity, estimate.covariance, gain.rows[:gain.used[0]], limits, step)
    displace(estimate, step, trial)
    turn = 0.0
    for i in range(ROTATION, POSE):
        turn = max(turn, abs(step[i] - before[i]))
    return turn < NEAR_RAD


@njit(cache=True)
def _conclude(estimate: Estimate, rows: Rows, believed: Mask, gain: Gain, held: Held, dt: float, worn: Worn,
              cameras: Cameras, habits: Habits, bias_variance: Array, limits: Array, step: Array) -> None:
    """Take the new mean, shrink the covariance by what was learnt, forget, keep the limits."""
    note_sights(estimate, worn.part, rows, believed)
    note_trend(estimate, step, gain)
    contract(estimate.covariance, gain)
    displace(estimate, step, estimate)
    restore(estimate.covariance, held, gain, bias_variance)
    points, jacobian = np.empty((worn.part.shape[0], 3)), np.empty((worn.part.shape[0], 3, POSE))
    place_markers(worn, estimate, points, jacobian)
    keep_shown(estimate, worn.part, cameras.pose, points, jacobian)
    forget(estimate, dt, habits, bias_variance, jacobian, gain, step)
    project(estimate.angles, estimate.velocity, estimate.covariance, gain.rows[:0], limits, step)
    displace(estimate, step, estimate)
