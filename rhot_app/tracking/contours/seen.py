"""What was seen of a bare hand in one image, for people to look at: contour, slices, and the edges found on them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class SeenContour:
    """One image of one camera at master time `t_master_ns`; all places px, raw image.

    `contour` (N, 2): where the estimated hand's contour crosses the slices; `outline` (N,): before the background, not
    within the hand. `slices` (N, 4): their ends, x and y twice. `edges` (M, 2), `of_hand` (M,): which are the hand's.
    """

    camera: str
    t_master_ns: int
    contour: Array
    outline: NDArray[np.bool_]
    slices: Array
    edges: Array
    of_hand: NDArray[np.bool_]


@runtime_checkable
class ShowsContours(Protocol):
    """A tracker that can say what it has seen of a bare hand."""

    def seen(self) -> list[SeenContour]:
        """The newest image of each camera; none while there is no hand. Any thread may ask."""
        ...
