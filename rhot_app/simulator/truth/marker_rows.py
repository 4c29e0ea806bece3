"""Where a rolling shutter sees a moving marker: at the time at which the row that it is on is exposed."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

MARGIN_PX = 4.0
"""A marker nearer to the image's border is cut by it."""

_ROUNDS = 4  # a contraction: markers move far fewer rows per second than the shutter


def at_own_rows(way: Callable[[Array], Array], see: Callable[[Array], Array], times_s: Array, row_time_s: float,
                size: tuple[int, int]) -> tuple[Array, Array]:
    """A marker's places (F, 3) m and pixels (F, 2) in frames whose row 0 is exposed at `times_s` (F,).

    `way`: places (F, 3) at times (F,); `see`: pixels (F, 2) of places; `size`: width and height, px. Pixels are NaN
    where the marker is not in the picture.
    """
    rows = np.full(len(times_s), 0.5 * size[1])
    places, pixels = np.empty((len(times_s), 3)), np.empty((len(times_s), 2))
    for _ in range(_ROUNDS):
        places = way(times_s + rows * row_time_s)
        pixels = see(places)
        rows = np.clip(np.nan_to_num(pixels[:, 1]), 0.0, size[1])
    inside = ((pixels > MARGIN_PX) & (pixels < np.array(size) - 1.0 - MARGIN_PX)).all(axis=1, keepdims=True)
    return places, np.where(inside, pixels, np.nan)
