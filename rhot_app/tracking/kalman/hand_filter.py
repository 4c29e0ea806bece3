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
    POSE,
    ROTATION,
    Estimate,
    displace,
    empty_estimate,
)
from rhot_app.tracking.kalman.forgetting import forget
from rhot_app.tracking.kalman.gain import contract, solve
from rhot_app.tracking.kalman.limits import project
from rhot_app.tracking.kalman.markers import Worn, place_markers
from rhot_app.tracking.kalman.motion import MOST, Habits, predict
from rhot_app.tracking.kalman.one_eye import Cameras, hold_back, single_eye
from rhot_app.tracking.kalman.rows import ResidualBlock, Rows, clear, empty_rows
from rhot_app.tracking.kalman.surprise import appraise, note_trend

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

ITERATIONS = 6
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
    """What became of an update's L observations, in the order of the blocks: `believed` (L,), and `source` (L, 2) as in
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
        self._gains = np.empty((ROWS_MAX, size))
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
        estimate.unseeing[:] = np.inf
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
        estimate, trial, rows, step = self.estimate, self._trial, self._rows, self._step
        predict(estimate, dt, self._cameras, self._habits, self._bias_variance)
        clear(rows)
        for block in blocks:
            block.associate(estimate)
            block.linearise(estimate, rows)
        appraise(rows, estimate, self._habits.together, self._believed, self._widening)
        step[:] = 0.0
        for _ in range(ITERATIONS):
            count, near = _improve(estimate, rows, self._believed, self._widening, step, self._gains, self._limits,
                                   trial)
            if near:
                break
            clear(rows)
            for block in blocks:
                block.linearise(trial, rows)
        _conclude(estimate, rows, self._believed, self._gains, count, dt, self._worn, self._cameras,
                  self._habits, self._bias_variance, self._limits, step)
        observations = int(rows.used[1])
        return Outcome(self._believed[:observations], rows.source[:observations])


@njit(cache=True)
def _improve(estimate: Estimate, rows: Rows, believed: Mask, widening: Array, step: Array, gains: Array,
             limits: Array, trial: Estimate) -> tuple[int, bool]:
    """One iteration; `trial` becomes the new mean. Returns the rows used and whether it moved only little."""
    before = step.copy()
    count = solve(rows, estimate.covariance, believed, widening, step, gains)
    project(estimate.angles, estimate.velocity, estimate.covariance, gains, count, limits, step)
    displace(estimate, step, trial)
    turn = 0.0
    for i in range(ROTATION, POSE):
        turn = max(turn, abs(step[i] - before[i]))
    return count, turn < NEAR_RAD


@njit(cache=True)
def _conclude(estimate: Estimate, rows: Rows, believed: Mask, gains: Array, count: int, dt: float,
              worn: Worn, cameras: Cameras, habits: Habits, bias_variance: Array, limits: Array, step: Array) -> None:
    """Take the new mean, shrink the covariance by what was learnt, forget, keep the limits."""
    for observation in range(rows.used[1]):
        if believed[observation] and rows.source[observation, 0] >= 0:
            estimate.unseeing[rows.source[observation, 0]] = 0.0
    note_trend(estimate, step, gains, count)
    contract(estimate.covariance, gains, count)
    eye = single_eye(estimate)
    if eye >= 0:
        hold_back(estimate.covariance, gains, count, cameras.pose[eye], step)
    displace(estimate, step, estimate)
    points, jacobian = np.empty((worn.part.shape[0], 3)), np.empty((worn.part.shape[0], 3, POSE))
    place_markers(worn, estimate, points, jacobian)
    forget(estimate, dt, habits, bias_variance, jacobian, step)
    project(estimate.angles, estimate.velocity, estimate.covariance, gains, 0, limits, step)
    displace(estimate, step, estimate)
