"""The filter of one hand: carried to an instant, told what was observed there, asked what it believes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rhot_app.tracking.kalman.estimate import ANGLES, FREE, GROUP_OF, POSE, TURN_HELD
from rhot_app.tracking.kalman.habits import Habits
from rhot_app.tracking.kalman.markers import Outfit
from rhot_app.tracking.kalman.motion import MOST
from rhot_app.tracking.kalman.rows import Outcome, Page, ResidualBlock, Verdict
from rhot_app.tracking.kalman.share import Share
from rhot_app.tracking.kalman.update import (
    LONGEST_RAD,
    carry_on,
    conclude,
    hold_turn_alone,
    improve,
    is_astray,
    misfit_of,
    prepare,
    set_desk,
)

Array = NDArray[np.float64]

ITERATIONS = 2
"""Whole steps; more of them go to and fro where an angle is open."""

FITS, CAUTIOUS, CAUTIOUS_STEPS = 25.0, 0.3, 8
"""A finger that is nearly straight is shown as well bent the one way as the other. Where any row is left with a squared
normalised residual beyond the first of these, up to so many more steps go this part of their way; what smaller ones
leave is there again with the next frame."""

WHOLE_RAD = 0.99 * LONGEST_RAD
"""A step that turns everything by less was not shortened."""

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


class HandFilter:
    """An iterated extended Kalman filter on the hand's pose, velocity and markers' biases, for a hand whose size it is
    told.

    `outfit`: the markers, and the cameras that see them; `habits`: what is believed of a hand without evidence;
    `limits` (21, 2) rad.
    """

    def __init__(self, outfit: Outfit, habits: Habits, limits: Array) -> None:
        self._desk = set_desk(outfit, habits, limits)
        self.estimate = self._desk.estimate
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
        return bool(is_astray(self._shared))

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
        carry_on(self._shared, dt)
        for block in blocks:
            self._first = self._used()
            block.enter(self._now)
        if len(blocks) > 1:  # each may have taught the hand something that the ones before are to be expected by
            self._linearise(blocks, self._now)
        likely, holds, turn, turned = prepare(self._shared, dt)
        turned = self._settle(blocks, holds, turn, turned)
        if holds and self.estimate.held[0] == TURN_HELD:
            self._linearise(blocks, self._tried)
            if misfit_of(self._shared) > MISFIT:  # fingers cannot bend as they are held to
                hold_turn_alone(self._shared)
                self._linearise(blocks, self._now)
                turned = self._settle(blocks, False, *improve(self._shared, 1.0))
        return turned, likely

    def _conclude(self, dt: float) -> Outcome:
        conclude(self._shared, dt)
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
        whole = int(turn < WHOLE_RAD)
        for _ in range(1, MOST_STEPS):
            if turn < NEAR_RAD or whole == ITERATIONS + CAUTIOUS_STEPS:
                break
            self._linearise(blocks, self._tried)
            if whole >= ITERATIONS and (holds or misfit_of(self._shared) <= FITS):
                break
            turn, turned = improve(self._shared, 1.0 if whole < ITERATIONS else CAUTIOUS)
            whole += turn < WHOLE_RAD
        return turned
