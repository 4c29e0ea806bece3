"""Corners to a fraction of a pixel: how far to look around each one is decided by the squares next to it.

A window that reaches into neighbouring squares pulls the corner away: 11 pixels around corners that are 22 apart cost
0.2 px of rms and 3 px of focal length on real images. Here the blurred edges around every corner are fitted (`saddle`)
within the free space there is.
"""

from __future__ import annotations

import warnings

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.saddle import FIELDS, fit_saddles

Array = NDArray[np.float64]

REACH = 0.45  # of the free space: the disc's radius
WIDEST_PX, NARROWEST_PX = 12.0, 2.5  # radii of the disc: more only costs time; less does not determine a crossing
_ASTRAY = 0.12  # of the free space: a corner farther than this from where its neighbours expect it is tried again
_ASTRAY_PX = 0.5
_BESIDE = 0.05  # of the free space: how well neighbours predict a corner that was not found
_WORSE = 2.5  # times the misfit of the others
_FAINTER = 0.6  # of the others' contrast, or the reverse: what has less is not the board


def refine(gray: NDArray[np.uint8], grid: Array, *, free: float = 1.0) -> tuple[Array, float]:
    """`grid` (rows, cols, 2) px, NaN where a corner is absent, moved to where the picture has the corners.

    `free` says which part of the way to the next grid line is empty around a corner: less than 1 where squares hold
    markers. Absent corners that the picture shows beside others are added. Returns the grid and the blur of the edges
    (median SD in px, of the blurrier direction). A corner whose edges cannot be fitted becomes NaN.
    """
    fitted = _fit(gray, grid, grid, free)
    expected = _expected(fitted[..., :2])
    astray = _apart(fitted, expected) > np.maximum(_ASTRAY * clearance_px(grid), _ASTRAY_PX)
    again = np.logical_and(astray | np.isnan(fitted[..., 0]), np.isfinite(grid[..., 0])).reshape(*astray.shape, 1)
    fitted = np.where(again, _fit(gray, np.where(again, expected, np.nan), grid, free), fitted)
    for _ in range(max(grid.shape) if np.isnan(grid).any() else 0):
        more = _beside(gray, fitted, free)
        if not np.isfinite(more[..., 0]).any():
            break
        fitted = np.where(np.isfinite(more), more, fitted)
    blurs = fitted[..., 2:4].max(axis=-1)
    return fitted[..., :2], float(np.nanmedian(blurs)) if np.isfinite(blurs).any() else float("nan")


def _fit(gray: NDArray[np.uint8], starts: Array, grid: Array, free: float) -> Array:
    """(rows, cols, 6) of `fit_saddles` from `starts` (rows, cols, 2) px, NaN for none, with the lines of `grid`."""
    space = clearance_px(grid)
    radii = np.where(np.isfinite(space), np.clip(REACH * free * space, NARROWEST_PX, WIDEST_PX), 0.0)
    fitted = fit_saddles(gray, np.ascontiguousarray(starts).reshape(-1, 2), _directions(grid).reshape(-1, 2),
                         radii.reshape(-1))
    return fitted.reshape(*grid.shape[:2], FIELDS)


def _beside(gray: NDArray[np.uint8], fitted: Array, free: float) -> Array:
    """(rows, cols, 6), NaN for most: absent corners that the picture shows where their neighbours expect them.

    They count when they fit like the others, at the place and with the contrast that the board has there: a finger or
    the rim of a sheet does not.
    """
    known = np.isfinite(fitted[..., :1])
    expected = np.where(known, np.nan, _expected(fitted[..., :2]))
    inside = np.all((expected > 0.0) & (expected < np.array(gray.shape[::-1]) - 1.0), axis=-1, keepdims=True)
    expected = np.where(inside, expected, np.nan)
    filled = np.where(known, fitted[..., :2], expected)
    found = _fit(gray, expected, filled, free)
    row, col = np.indices(known.shape[:2])
    sign = (-1.0) ** (row + col)
    contrast = found[..., 4] * sign / np.nanmedian(fitted[..., 4] * sign)
    good = (contrast > _FAINTER) & (contrast < 1.0 / _FAINTER) & (found[..., 5] < _WORSE * np.nanmedian(fitted[..., 5]))
    good &= _apart(found, expected) < np.maximum(_BESIDE * clearance_px(filled), _ASTRAY_PX)
    return np.where(good[..., None], found, np.nan)


def _apart(fitted: Array, places: Array) -> Array:
    """(rows, cols) px."""
    return np.asarray(np.linalg.norm(fitted[..., :2] - places, axis=-1))


def _expected(grid: Array) -> Array:
    """(rows, cols, 2) px, where the corners within two steps along rows and columns expect each one (median)."""
    wide = np.pad(grid, ((2, 2), (2, 2), (0, 0)), constant_values=np.nan)
    rows, cols = grid.shape[:2]

    def at(row: int, col: int) -> Array:
        return wide[2 + row:2 + row + rows, 2 + col:2 + col + cols]

    guesses = [(at(0, -1) + at(0, 1)) / 2, (at(-1, 0) + at(1, 0)) / 2]
    guesses += [2 * at(row, col) - at(2 * row, 2 * col) for row, col in ((0, 1), (0, -1), (1, 0), (-1, 0))]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # a corner without neighbours: NaN is the answer
        return np.asarray(np.nanmedian(np.stack(guesses), axis=0))


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
