"""What a bad network does to datagrams: a seeded decision for each one. No sockets here."""

from __future__ import annotations

import heapq
import itertools
from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True, slots=True)
class Impairment:
    """A network's faults. Probabilities 0..1 per datagram; delays in seconds.

    A datagram is lost with `loss`; otherwise it waits `delay_s` plus an exponential time of mean `jitter_s`, is held
    back `reorder_delay_s` longer with `reorder` (so that later ones overtake it), and comes twice with `duplicate`.
    """

    loss: float = 0.0
    delay_s: float = 0.0
    jitter_s: float = 0.0
    reorder: float = 0.0
    reorder_delay_s: float = 0.03
    duplicate: float = 0.0

    def __post_init__(self) -> None:
        for name in ("loss", "reorder", "duplicate"):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise ValueError(f"{name} is a probability, 0..1, not {getattr(self, name)}")
        if min(self.delay_s, self.jitter_s, self.reorder_delay_s) < 0.0:
            raise ValueError("a delay cannot be negative")

    def arrivals(self, rng: np.random.Generator) -> list[float]:
        """Seconds after which copies of one datagram arrive: none when it is lost, two when it is doubled."""
        lost, held, doubled = rng.random(3) < (self.loss, self.reorder, self.duplicate)
        if lost:
            return []
        waits = self.delay_s + self.jitter_s * rng.standard_exponential(2) + self.reorder_delay_s * held
        return [float(wait) for wait in waits[: 2 if doubled else 1]]


@dataclass
class DelayQueue:
    """Datagrams on their way, by arrival time; equal times keep their order."""

    _heap: list[tuple[float, int, bytes]] = field(default_factory=list)
    _count: itertools.count[int] = field(default_factory=itertools.count)

    def put(self, t_arrival_s: float, datagram: bytes) -> None:
        """Add a datagram that arrives at `t_arrival_s`."""
        heapq.heappush(self._heap, (t_arrival_s, next(self._count), datagram))

    def pop_due(self, now_s: float) -> list[bytes]:
        """All datagrams that have arrived by `now_s`, in order of arrival."""
        due = []
        while self._heap and self._heap[0][0] <= now_s:
            due.append(heapq.heappop(self._heap)[2])
        return due

    @property
    def next_s(self) -> float | None:
        """When the next datagram arrives; None when none is on its way."""
        return self._heap[0][0] if self._heap else None
