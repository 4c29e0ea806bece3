"""Sequence numbers of one stream: what is new, what is doubled, what came late, and what never came."""

from __future__ import annotations

import enum


class SequenceVerdict(enum.Enum):
    """What one sequence number says about its datagram."""

    FRESH = 0  # newer than all before
    LATE = 1  # overtaken, but seen for the first time
    DUPLICATE = 2
    STALE = 3  # older than the window
    JUMP = 4  # further ahead than any loss explains


class SequenceWindow:
    """Remembers the last `size` numbers. `lost` counts those that have not come (a late one is taken off again)."""

    def __init__(self, size: int = 512, longest_jump: int = 100_000) -> None:
        self._size = size
        self._mask = (1 << size) - 1
        self._longest_jump = longest_jump
        self._newest: int | None = None
        self._seen = 0  # bit k: number newest - k has come
        self.lost = 0

    def judge(self, sequence: int) -> SequenceVerdict:
        """What `sequence` says, without taking it in: a datagram refused for another reason must leave no trace."""
        newest = self._newest
        if newest is None:
            return SequenceVerdict.FRESH
        ahead = sequence - newest
        if ahead > 0:
            return SequenceVerdict.FRESH if ahead <= self._longest_jump else SequenceVerdict.JUMP
        if -ahead >= self._size:
            return SequenceVerdict.STALE
        return SequenceVerdict.DUPLICATE if self._seen >> -ahead & 1 else SequenceVerdict.LATE

    def take(self, sequence: int) -> None:
        """Take in a number that was judged FRESH or LATE."""
        newest = self._newest
        if newest is None:
            self._newest, self._seen = sequence, self._mask  # what was before the first one is not missing
        elif sequence > newest:
            ahead = sequence - newest
            self._seen = (self._seen << ahead | 1) & self._mask if ahead < self._size else 1
            self._newest = sequence
            self.lost += ahead - 1
        else:
            self._seen |= 1 << newest - sequence
            self.lost -= 1

    def restart(self) -> None:
        """The sender counts from new; the losses so far stay counted."""
        self._newest = None
        self._seen = 0
