"""Corners to a fraction of a pixel: how far to look around each one is decided by the squares next to it.

A window that reaches into neighbouring squares pulls the corner away: 11 pixels around corners that are 22 apart cost
0.2 px of rms and 3 px of focal length on real images. Here a careful pass of cornerSubPix finds the crossing, and a
fit of the blurred edges (`saddle`) within the free space around it gives the last digits.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.saddle import fit_saddles

Array = NDArray[np.float64]

REACH = 0.45  # of the free space: the disc's radius
FIRST_REACH = 0.2  # of the first pass
WIDEST_PX, NARROWEST_PX = 12.0, 2.5  # radii of the disc: more only costs time; less does not determine a crossing
_FIRST_WIDEST, _FIRST_NARROWEST = 5, 2
_STOP = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_MAX_ITER, 40, 1e-2)


def refine(gray: NDArray[np.uint8], grid: Array, *, free: float = 1.0) -> tuple[Array, float]:
    """`grid` (rows, cols, 2) px, NaN where a corner is absent, moved to where the picture has the corners.

    `free` says which part of the way to the next grid line is empty around a corner: less than 1 where squares hold
    markers. Returns the grid and the blur of the edges (median SD in px, of the blurrier direction). A corner whose
    edges cannot be fitted keeps its first, careful place.
    """
    first = _careful(gray, grid, free)
    space, directions = clearance_px(first), _directions(first)
    radii = np.clip(REACH * free * space, NARROWEST_PX, WIDEST_PX)
    radii = np.where(np.isfinite(space), radii, 0.0)
    fitted = fit_saddles(gray, first.reshape(-1, 2), directions.reshape(-1, 2), radii.reshape(-1))
    places = fitted[:, :2].reshape(grid.shape)
    blurs = fitted[np.isfinite(fitted).all(axis=1), 2:].max(axis=1)
    return np.where(np.isfinite(places), places, first), float(np.median(blurs)) if len(blurs) else float("nan")


def side_px(grid: Array) -> Array:
    """Lengths in px of all sides of squares between corners of `grid` (rows, cols, 2) that were found."""
    sides = np.concatenate([np.linalg.norm(np.diff(grid, axis=axis), axis=-1).ravel() for axis in (0, 1)])
    return sides[np.isfinite(sides)]


def clearance_px(grid: Array) -> Array:
    """(rows, cols) px, how far the nearest parallel grid line is from each corner of `grid` (rows, cols, 2).

    inf for a corner that is absent (NaN) or has no whole square beside it.
    """
    along, down = np.diff(grid, axis=1), np.diff(grid, axis=0)
    nearest = np.full(grid.shape[:2], np.inf)
    first, last = slice(1, None), slice(None, -1)
    for rows in (first, last):  # the four squares that meet in a corner
        for cols in (first, last):
            a, d = along[rows], down[:, cols]
            area = np.abs(a[..., 0] * d[..., 1] - a[..., 1] * d[..., 0])
            longest = np.maximum(np.linalg.norm(a, axis=-1), np.linalg.norm(d, axis=-1))
            nearest[rows, cols] = np.fmin(nearest[rows, cols], area / np.maximum(longest, 1e-9))
    return np.where(np.isfinite(grid).all(axis=-1), nearest, np.inf)


def _directions(grid: Array) -> Array:
    """(rows, cols, 2) rad, of the grid lines through each corner along x and y, from the neighbours there are."""
    found = np.zeros(grid.shape)
    for which, axis in ((0, 1), (1, 0)):
        step = np.diff(grid, axis=axis)
        pad = [(0, 0), (0, 0), (0, 0)]
        pad[axis] = (1, 1)
        padded = np.pad(step, pad, constant_values=np.nan)
        count = padded.shape[axis]
        both = np.stack([np.take(padded, range(count - 1), axis), np.take(padded, range(1, count), axis)])
        there = np.isfinite(both).all(axis=-1, keepdims=True)
        mean = np.where(there, both, 0.0).sum(axis=0)
        found[..., which] = np.arctan2(mean[..., 1], mean[..., 0])
    return found


def _careful(gray: NDArray[np.uint8], grid: Array, free: float) -> Array:
    """A pass with windows so narrow that no other corner can draw them."""
    found = grid.copy()
    space = clearance_px(grid)
    present = np.isfinite(space)
    half = np.zeros(space.shape, int)
    half[present] = np.clip(np.rint(FIRST_REACH * free * space[present]), _FIRST_NARROWEST, _FIRST_WIDEST)
    for side in np.unique(half[present]):
        chosen = present & (half == side)
        start = np.ascontiguousarray(grid[chosen], np.float32).reshape(-1, 1, 2)
        cv2.cornerSubPix(gray, start, (int(side), int(side)), (-1, -1), _STOP)
        found[chosen] = start.reshape(-1, 2)
    return found
