"""The filter's recent past: so that a frame that arrives late is weighed where it belongs, not where it arrived."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import Protocol

from rhot_app.tracking.kalman.estimate import Estimate, copy_estimate, empty_estimate
from rhot_app.tracking.kalman.hand_filter import HandFilter, Outcome
from rhot_app.tracking.kalman.rows import ResidualBlock

LENGTH = 12
"""Updates remembered: 150 ms of two cameras at 40 fps. What is older came too late."""


class TimedBlock(ResidualBlock, Protocol):
    """A residual block that knows when it was observed."""

    @property
    def t_ns(self) -> int:
        """The instant of the observation, master ns."""
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
        """The filter has been started at `t_ns`: what was before does not count."""
        self._spare += [moment.before for moment in self._moments]
        self._moments.clear()
        self.t_ns = t_ns

    def add(self, block: TimedBlock) -> list[tuple[TimedBlock, Outcome]]:
        """Weigh a block, and once more all that are later than it. Returns what became of each; empty: too late."""
        place = bisect_right(self._moments, block.t_ns, key=_INSTANT)
        if block.t_ns < (self._moments[0].before_ns if self._moments else self.t_ns):
            self.dropped += 1
            return []
        again: Sequence[_Moment] = self._moments[place:]
        if again:
            copy_estimate(again[0].before, self._hand.estimate)
            self.t_ns = again[0].before_ns
            del self._moments[place:]
        outcomes = [(block, self._weigh(block))]
        for moment in again:
            self._spare.append(moment.before)
            outcomes.append((moment.block, self._weigh(moment.block)))
        return outcomes

    def _weigh(self, block: TimedBlock) -> Outcome:
        estimate = self._hand.estimate
        before = self._spare.pop() if self._spare else empty_estimate(*estimate.unseen.shape)
        copy_estimate(estimate, before)
        self._moments.append(_Moment(block.t_ns, self.t_ns, before, block))
        if len(self._moments) > LENGTH:
            self._spare.append(self._moments.pop(0).before)
        dt = 1e-9 * (block.t_ns - self.t_ns)
        self.t_ns = block.t_ns
        return self._hand.update(dt, [block])
