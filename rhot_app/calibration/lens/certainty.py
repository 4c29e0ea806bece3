"""How certain a lens is: from the covariance of its parameters to millimetres in front of the camera."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.geometry.camera import undistort_points

Array = NDArray[np.float64]

WORKING_DISTANCE_M = 0.6
"""Where hands are tracked; errors in space are stated there."""

_GRID = (12, 16)  # rows, columns of pixels at which rays are looked at
_PERCENTILE = 95.0
_SMALL_STEP = 1e-3  # of a standard deviation, for the derivatives


def picture_grid(size: tuple[int, int]) -> Array:
    """(N, 2) px, places spread evenly over a picture of `size` (width, height), its rim included."""
    rows, cols = _GRID
    x, y = np.meshgrid(np.linspace(0, size[0] - 1, cols), np.linspace(0, size[1] - 1, rows))
    return np.column_stack([x.ravel(), y.ravel()])


@dataclass(frozen=True, slots=True)
class ExpectedErrors:
    """Standard deviation, m, of where points at the working distance are seen: `typical_m` the median over the picture,
    `worst_m` its 95th percentile, mostly in the corners; `map_m` (rows, cols) over the picture, NaN where the lens has
    no ray."""

    typical_m: float
    worst_m: float
    map_m: Array


def expected_errors(lens: Array, covariance: Array, size: tuple[int, int],
                    distance_m: float = WORKING_DISTANCE_M) -> ExpectedErrors:
    """What the lens's uncertainty does to points `distance_m` in front of the camera.

    `lens` (9,), `covariance` (9, 9), `size` (width, height) px. What a turn of the camera would do as well is left out:
    a wrong principal point and a camera that looks elsewhere are one to everything that follows, because the cameras'
    orientations are found with this lens. NaN when the lens has no ray for most pixels.
    """
    pixels = picture_grid(size)
    rays = undistort_points(pixels, lens)
    change = _derivatives(pixels, lens, covariance)
    usable = np.isfinite(rays).all(axis=1) & np.isfinite(change).all(axis=(1, 2))
    variance = np.full(len(pixels), np.nan)
    if usable.mean() > 0.5:
        turn, change = _turning(rays[usable]), change[usable].reshape(-1, len(lens))
        remaining = change - turn @ np.linalg.lstsq(turn, change, rcond=None)[0]
        variance[usable] = np.einsum("ni,ij,nj->n", remaining, covariance, remaining).reshape(-1, 2).sum(axis=1)
    errors = distance_m * np.sqrt(np.maximum(variance, 0.0))
    known = errors[np.isfinite(errors)] if usable.mean() > 0.5 else np.array([np.nan])
    return ExpectedErrors(float(np.median(known)), float(np.percentile(known, _PERCENTILE)), errors.reshape(_GRID))


def _derivatives(pixels: Array, lens: Array, covariance: Array) -> Array:
    """(N, 2, 9), of the rays at fixed pixels by the lens parameters."""
    steps = _SMALL_STEP * np.sqrt(np.maximum(np.diag(covariance), 1e-24))
    columns = []
    for place, step in enumerate(steps):
        up, down = lens.copy(), lens.copy()
        up[place] += step
        down[place] -= step
        columns.append((undistort_points(pixels, up) - undistort_points(pixels, down)) / (2.0 * step))
    return np.stack(columns, axis=2)


def _turning(rays: Array) -> Array:
    """(2N, 3), of the rays by small turns of the camera about its x, y and z axes."""
    x, y = rays.T
    by_x = np.column_stack([x * y, 1.0 + y * y])
    by_y = np.column_stack([-1.0 - x * x, -x * y])
    by_z = np.column_stack([y, -x])
    return np.stack([by_x, by_y, by_z], axis=2).reshape(-1, 3)


def blind_share(lens: Array, size: tuple[int, int]) -> float:
    """Share of a picture's places that no ray belongs to: there the distortion has turned over."""
    return float(np.mean(~np.isfinite(undistort_points(picture_grid(size), lens)).all(axis=1)))
