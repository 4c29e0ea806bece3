"""Which of the markers that a hand wears can be believed: those in company, not every thing of a marker's colour.

A lone thing of a marker's hue is as good a marker as any to a search. What tells a hand from a desk: its markers come
together, are of like size, and move. A worn marker is vouched for while it is tracked, once it was seen with enough
others that have moved, or with so many that no desk shows them by chance, or once it has travelled by
itself. Until then it is ambiguous and has a quality and a covariance to match.

All coordinates are luma pixels.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import msgspec
import numpy as np

from rhot_node.detect.whereabouts import MARKERS_LEAST, Whereabouts, middle_of
from rhot_node.markers import Marker
from rhot_node.wire.messages import MarkerFlag, MarkerObservation

STILL_ENOUGH = 5  # worn markers together that need not have moved
MOVED = 1.0  # px from where a marker was found: neither noise nor a neighbour's shadow
TRAVELLED = 2.0  # diameters: a lone thing that is as far away twice in succession is no part of a desk
TRAVEL_FRAMES = 8  # that it takes at least: what a passing hand uncovers jumps
SAME_SIZE = 0.25  # of the logarithm of the diameter: what is partly hidden seems to move
LEFT_BEHIND = 8.0  # px that the hand may move while a marker of it does not
ALIKE = 0.2  # of the greatest likeness in size (`Whereabouts.likeness`): nine times larger or smaller
STATED_QUALITY, STATED_SPREAD = 0.5, 0.3  # of the quality, and of the diameter as a standard deviation, while in doubt
DOUBTFUL = MarkerFlag.PARTIAL | MarkerFlag.EDGE
UNPROVEN = DOUBTFUL | MarkerFlag.ACQUIRED  # a hand passes things: what joins a known one must be followed and in view


class Company:
    """What is known of each marker's company, from frame to frame."""

    def __init__(self, markers: Iterable[Marker]) -> None:
        self._markers = tuple(markers)
        self._worn = [index for index, marker in enumerate(self._markers) if marker.role is not None]
        self._needed = MARKERS_LEAST if len(self._worn) >= MARKERS_LEAST else 0
        self._enough = min(STILL_ENOUGH, len(self._worn))
        self._origin = np.zeros((len(self._markers), 5))  # where it was found, the hand then, its diameter
        self._frames = np.zeros(len(self._markers))  # since then
        self._moved = np.zeros(len(self._markers), dtype=np.bool_)
        self._afar = np.zeros(len(self._markers), dtype=np.bool_)  # in the last frame it was where it must travel to
        self._vouched = np.zeros(len(self._markers), dtype=np.bool_)
        self._known = np.zeros(len(self._markers), dtype=np.bool_)

    @property
    def complete(self) -> bool:
        """Whether every worn marker is vouched for: nothing needs judging as long as all are followed."""
        return self._needed == 0 or bool(self._vouched[self._worn].all())

    @property
    def vouched(self) -> int:
        """How many worn markers are vouched for."""
        return int(np.count_nonzero(self._vouched))

    def forget(self) -> None:
        """Nothing is known of any marker."""
        self._known[:] = self._moved[:] = self._afar[:] = self._vouched[:] = False

    def judge(self, seen: tuple[MarkerObservation, ...]) -> tuple[MarkerObservation, ...]:
        """The observations of one frame, as they can be believed."""
        if self._needed == 0:
            return seen
        worn = [seen[index] for index in self._worn if seen[index].found]
        hand = middle_of([(mark.x, mark.y, _area(mark)) for mark in worn])
        self._follow(seen, hand)
        together = [mark.index for mark in worn if hand is not None and self._belongs(mark, hand)]
        moving = np.count_nonzero((self._moved | self._vouched)[together])
        if len(together) >= self._enough or (len(together) >= self._needed and moving >= self._needed):
            joined = self.vouched >= self._needed
            self._vouched[[index for index in together if not (joined and seen[index].flags & UNPROVEN)]] = True
        return tuple([mark if not mark.found or self._vouched[mark.index] or self._markers[mark.index].role is None
                      else _in_doubt(mark) for mark in seen])

    def _follow(self, seen: tuple[MarkerObservation, ...], hand: Whereabouts | None) -> None:
        """Note which markers are new, and which have moved since they were."""
        for index in self._worn:
            mark = seen[index]
            if not mark.found:
                self._known[index] = self._vouched[index] = False
            elif not self._known[index] or mark.flags & MarkerFlag.ACQUIRED:
                self._known[index], self._vouched[index] = True, False
                self._set_out(mark, hand)
            elif not mark.flags & DOUBTFUL:
                self._note_way(mark, hand)

    def _set_out(self, mark: MarkerObservation, hand: Whereabouts | None) -> None:
        """Note how far a marker comes from here on."""
        self._moved[mark.index] = self._afar[mark.index] = False
        middle = (hand.x, hand.y) if hand else (math.nan, math.nan)
        self._origin[mark.index] = (mark.x, mark.y, *middle, mark.diameter)
        self._frames[mark.index] = 0.0

    def _note_way(self, mark: MarkerObservation, hand: Whereabouts | None) -> None:
        """Note how far a marker in plain view has come."""
        x, y, _, _, diameter = self._origin[mark.index]
        self._frames[mark.index] += 1.0
        grown = math.log(mark.diameter / diameter)
        if grown > SAME_SIZE:  # only a part of it showed when it was found, and uncovering it has moved its middle
            self._set_out(mark, hand)
        if abs(grown) > SAME_SIZE:
            return
        way = math.hypot(mark.x - x, mark.y - y)
        self._moved[mark.index] |= way > MOVED
        afar = way > TRAVELLED * mark.diameter and self._frames[mark.index] >= TRAVEL_FRAMES
        self._vouched[mark.index] |= afar and self._afar[mark.index]
        self._afar[mark.index] = afar

    def _belongs(self, mark: MarkerObservation, hand: Whereabouts) -> bool:
        """Whether a marker is where the hand's others are, as large as they are, and not left behind by them."""
        shape = self._markers[mark.index].shape
        if hand.beyond(mark.x, mark.y) or hand.likeness(np.array([_area(mark)]), shape)[0] < ALIKE:
            return False
        _, _, x, y, _ = self._origin[mark.index]
        if shape != "band" and not self._moved[mark.index] and math.hypot(hand.x - x, hand.y - y) > LEFT_BEHIND:
            self._vouched[mark.index] = False
            return False
        return True


def _area(mark: MarkerObservation) -> float:
    return 0.25 * math.pi * mark.diameter**2


def _in_doubt(mark: MarkerObservation) -> MarkerObservation:
    more = (STATED_SPREAD * mark.diameter) ** 2
    return msgspec.structs.replace(mark, cov_xx=mark.cov_xx + more, cov_yy=mark.cov_yy + more,
                                   quality=STATED_QUALITY * mark.quality, flags=mark.flags | MarkerFlag.AMBIGUOUS)
