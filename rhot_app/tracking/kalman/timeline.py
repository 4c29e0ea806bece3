"""The filter's recent past: so that a frame that arrives late is weighed where it belongs, not where it arrived, and
one that turns the hand, or shows what is unlikely, is weighed together with the one before.

What a camera saw is kept as a covariance, linearised where the hand was then. A frame of another camera that turns the
palm, and bends its fingers to match, keeps to that along straight lines where fingertips go along arcs: 10 degrees
move them by 3 mm towards the cameras or away. Weighed together, both are linearised where the hand comes to be, and
what neither expected is put where both see it, not along one's line of sight.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import Protocol

from rhot_app.tracking.kalman.estimate import ROTATION, Estimate, copy_estimate, empty_estimate
from rhot_app.tracking.kalman.hand_filter import HandFilter
from rhot_app.tracking.kalman.rows import Outcome, ResidualBlock

LENGTH = 12
"""Updates remembered: 150 ms of two cameras at 40 fps. What is older came too late."""

TURNS_RAD = 0.05
"""A frame that turns anything by more, or shows what is unlikely, is weighed together with the one before."""

BESIDE_NS = 15_000_000
"""This is of another camera, and not older than that,"""

WAY_M = 0.006
"""and the palm has moved on by less since then: ways are straightened when they are told of as of another instant."""


class TimedBlock(ResidualBlock, Protocol):
    """A residual block that knows when and by whom it was observed."""

    @property
    def t_ns(self) -> int:
        """The instant of the observation, master ns."""
        ...

    @property
    def camera(self) -> int:
        """Which camera saw it, -1 for none."""
        ...

    def as_of(self, t_ns: int) -> ResidualBlock:
        """The same observations, told of as of another instant, master ns."""
        ...


@dataclass(slots=True)
class _Moment:
    """One update: the estimate before it, at `before_ns`, and what was observed at `t_ns`."""

    t_ns: int
    before_ns: int
    before: Estimate
    block: TimedBlock


_INSTANT = attrgetter("t_ns")


class Timeline:
    """Feeds a filter in the order of time, whatever the order of arrival."""

    def __init__(self, hand: HandFilter) -> None:
        self._hand = hand
        self._moments: list[_Moment] = []
        self._spare: list[Estimate] = []
        self.t_ns = 0
        self.dropped = 0  # blocks that came too late to be of use

    def begin(self, t_ns: int) -> None:
        """The filter has been started at `t_ns`, or changed from outside: what was before does not count."""
        self._spare += [moment.before for moment in self._moments]
        self._moments.clear()
        self.t_ns = t_ns

    def add(self, block: TimedBlock) -> Iterator[tuple[TimedBlock, Outcome]]:
        """Weigh a block, and once more all that are later than it. Yields what became of each before the next one is
        weighed, which overwrites it; nothing when it came too late."""
        place = bisect_right(self._moments, block.t_ns, key=_INSTANT)
        if block.t_ns < (self._moments[0].before_ns if self._moments else self.t_ns):
            self.dropped += 1
            return
        again: Sequence[_Moment] = self._moments[place:]
        if again:
            copy_estimate(again[0].before, self._hand.estimate)
            self.t_ns = again[0].before_ns
            del self._moments[place:]
        yield block, self._weigh(block)
        for moment in again:
            self._spare.append(moment.before)
            yield moment.block, self._weigh(moment.block)

    def _weigh(self, block: TimedBlock) -> Outcome:
        estimate, beside = self._hand.estimate, self._beside(block)
        before = self._spare.pop() if self._spare else empty_estimate(*estimate.unseen.shape)
        copy_estimate(estimate, before)
        self._moments.append(_Moment(block.t_ns, self.t_ns, before, block))
        if len(self._moments) > LENGTH:
            self._spare.append(self._moments.pop(0).before)
        since_s, self.t_ns = 1e-9 * (block.t_ns - self.t_ns), block.t_ns
        if beside is None:
            return self._hand.update(since_s, [block])
        outcome = self._hand.update_gently(since_s, [block], TURNS_RAD)
        if outcome is not None:
            return outcome
        copy_estimate(beside.before, estimate)
        return self._hand.update(1e-9 * (block.t_ns - beside.before_ns), [beside.block.as_of(block.t_ns), block])

    def _beside(self, block: TimedBlock) -> _Moment | None:
        """The last moment, if it can be told of as of this block's instant."""
        if not self._moments:
            return None
        beside = self._moments[-1]
        since_ns = block.t_ns - beside.t_ns
        way_m = 1e-9 * since_ns * math.hypot(*self._hand.estimate.velocity[:ROTATION].tolist())
        return beside if beside.block.camera != block.camera and since_ns < BESIDE_NS and way_m < WAY_M else None
