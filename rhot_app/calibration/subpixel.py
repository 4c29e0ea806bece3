"""Corners to a fraction of a pixel: how far to look around each one is decided by the squares next to it.

A window that reaches into the neighbouring corners pulls the corner towards them: 11 pixels around corners that are
22 apart cost 0.2 px of rms and 3 px of focal length on the real images of tests/calibration/test_corners.py.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

REACH = 0.35  # of the shortest neighbouring side: the window's half side
FIRST_REACH = 0.2  # of the first, careful pass
WIDEST_PX = 12
NARROWEST_PX = 2  # less than 5x5 pixels do not determine a corner
_STOP = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_MAX_ITER, 60, 1e-4)


def neighbour_px(grid: Array) -> Array:
    """(rows, cols) px, the distance of every corner to its nearest neighbour in `grid` (rows, cols, 2); NaN = absent.

    inf for a corner without neighbours.
    """
    nearest = np.full(grid.shape[:2], np.inf)
    for axis in (0, 1):
        step = np.linalg.norm(np.diff(grid, axis=axis), axis=-1)
        step = np.where(np.isfinite(step), step, np.inf)
        before, after = [slice(None)] * 2, [slice(None)] * 2
        before[axis], after[axis] = slice(None, -1), slice(1, None)
        nearest[tuple(before)] = np.minimum(nearest[tuple(before)], step)
        nearest[tuple(after)] = np.minimum(nearest[tuple(after)], step)
    return nearest


def refine(gray: NDArray[np.uint8], grid: Array) -> Array:
    """The corners `grid` (rows, cols, 2) px, NaN where absent, moved to where the image has them.

    Two passes: a narrow window first, which cannot be drawn to a neighbour, then the widest that is safe. A corner that
    the second pass carries further than half a narrow window stays where the first one put it.
    """
    first = _pass(gray, grid, FIRST_REACH, neighbour_px(grid))
    sides = neighbour_px(first)
    second = _pass(gray, first, REACH, sides)
    astray = np.linalg.norm(second - first, axis=-1) > np.maximum(0.5, 0.1 * sides)
    return np.where(astray[..., None], first, second)


def _pass(gray: NDArray[np.uint8], grid: Array, reach: float, sides: Array) -> Array:
    found = grid.copy()
    present = np.isfinite(grid).all(axis=-1) & np.isfinite(sides)
    half = np.zeros(sides.shape, int)
    half[present] = np.clip(np.rint(reach * sides[present]), NARROWEST_PX, WIDEST_PX)
    for side in np.unique(half[present]):
        chosen = present & (half == side)
        start = np.ascontiguousarray(grid[chosen], np.float32).reshape(-1, 1, 2)
        cv2.cornerSubPix(gray, start, (int(side), int(side)), (-1, -1), _STOP)
        found[chosen] = start.reshape(-1, 2)
    return found
