"""Where the hand is in a picture, and how large, by the markers that it wears.

A thing of a marker's colour that is far from the others, or much larger or smaller than they are, is not worn.

All coordinates are chroma pixels.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_node.markers import Shape

Array = NDArray[np.float64]

MARKERS_LEAST = 3
BEYOND = 12.0  # sides of a marker; an open hand's wrist is 9 from the middle of its fingertips
REACH = 5.0  # standard deviation of a marker's distance from the middle of the others, in sides of a marker
FAR = 0.02  # what the merit of a thing beyond all reach is multiplied with
BAND_AREAS = 6.0  # fingertips that a wrist band is as large as
SIZE_SIGMA = 1.2  # of the logarithm of areas: hidden by half, seen from the tip, another finger


@dataclass(frozen=True, slots=True)
class Whereabouts:
    """The middle of the markers, and the side of a square as large as one: how near the hand is."""

    x: float
    y: float
    side: float

    def nearness(self, x: Array, y: Array) -> Array:
        """FAR..1: how well something at (x, y) can be part of this hand."""
        away = np.hypot(x - self.x, y - self.y)
        return np.maximum(np.exp(-0.5 * (away / (REACH * self.side)) ** 2), FAR)

    def likeness(self, area: Array, shape: Shape) -> Array:
        """0..1: how well something of this area (N,) can be a marker of this shape on the hand."""
        usual = self.side**2 * (BAND_AREAS if shape == "band" else 1.0)
        return np.asarray(np.exp(-0.5 * (np.log(area / usual) / SIZE_SIGMA) ** 2))

    def beyond(self, x: float, y: float) -> bool:
        """Whether no hand reaches from its other markers to (x, y)."""
        return bool(np.hypot(x - self.x, y - self.y) > BEYOND * self.side)


def middle_of(markers: Sequence[tuple[float, float, float]]) -> Whereabouts | None:
    """Of markers (x, y, area); None for less than MARKERS_LEAST. A few wrong ones do no harm."""
    if len(markers) < MARKERS_LEAST:
        return None
    x, y, area = np.median(np.array(markers), axis=0)
    return Whereabouts(float(x), float(y), float(np.sqrt(area)))
