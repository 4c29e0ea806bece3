"""Residual rows: the one form in which anything that is observed tells the filter what it saw.

The filter knows neither markers nor cameras, only rows with their Jacobians and noise, gathered into observations
that are believed or not believed as a whole.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from rhot_app.tracking.kalman.estimate import MOST_MARKERS, Estimate
from rhot_app.tracking.kalman.share import Share

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Mask = NDArray[np.bool_]

ROWS_MAX = 4 * MOST_MARKERS
"""Rows of an update: two of each marker in two frames."""

PALM_PART = -1
"""The part of the hand that an observation is attached to: the palm, or the index of a finger."""


class Rows(NamedTuple):
    """Room for K rows in up to L observations.

    `used` (2,): rows and observations in use. `residual` (K,): seen minus expected, in any unit; `jacobian` (K, N):
    change of what is expected per error state; `noise` (K, 2): of each row, its variance and its covariance with the
    row before or after it in the same observation of two. `first` (L + 1,): the rows of observation l are
    first[l] .. first[l + 1] - 1, one or two of them; `part` (L,): PALM_PART or the finger; `source` (L, 3): camera,
    which of its sights, and of which marker it is taken to be, or -1.
    """

    used: Indices
    residual: Array
    jacobian: Array
    noise: Array
    first: Indices
    part: Indices
    source: Indices


class Page(NamedTuple):
    """The hand as it is believed to be, and the rows of what is observed of it."""

    estimate: Estimate
    rows: Rows


class ResidualBlock(Protocol):
    """Something that was observed at an instant: a frame's markers, an edge, an object in the hand. A `Share` carries a
    `Page`."""

    def enter(self, page: Share) -> None:
        """Decide what the observations are of, given the hand at that instant, and append them as `linearise` does; the
        first thing in an update."""
        ...

    def linearise(self, page: Share) -> None:
        """Append this block's observations to the page's rows, expected and linearised at the mean of its estimate.

        Called as often as the update needs; every time it must append the same observations in the same order.
        """
        ...


class Verdict(NamedTuple):
    """What became of L observations: `believed` (L,), `widening` (L,) the factor on their noise, above 1 for what was
    unlikely, `source` (L, 3) as in `Rows`."""

    believed: Mask
    widening: Array
    source: Indices


class Outcome:
    """What became of a block's observations: those from `first` to `last` - 1 of a shared `Verdict`, which the next
    update overwrites."""

    __slots__ = ("first", "last", "shared")

    def __init__(self, shared: Share, first: int, last: int) -> None:
        self.shared, self.first, self.last = shared, first, last

    @property
    def verdict(self) -> Verdict:
        """Views of this block's part."""
        whole, part = self.shared.lent, slice(self.first, self.last)
        return Verdict(whole.believed[part], whole.widening[part], whole.source[part])


def empty_rows(size: int) -> Rows:
    """Room for the rows of an update of a state with `size` numbers."""
    rows = ROWS_MAX
    return Rows(np.zeros(2, np.int64), np.zeros(rows), np.zeros((rows, size)), np.zeros((rows, 2)),
                np.zeros(rows + 1, np.int64), np.zeros(rows, np.int64), np.zeros((rows, 3), np.int64))
