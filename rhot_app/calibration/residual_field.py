"""Where in the picture corners are off, and which way: what a lens model does not explain shows as a pattern."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

CELLS = (6, 8)
"""Rows and columns of the means."""

_FEWEST = 4  # corners in a cell that make a mean


@dataclass(frozen=True, slots=True)
class ResidualField:
    """All residuals of a fit and their means over the picture.

    `places` (M, 2) px, where each corner was seen; `residuals` (M, 2) px, seen minus expected; `view` (M,) the index of
    its view. `mean` (rows, cols, 2) px per part of the picture, NaN where too few corners are; `count` (rows, cols).
    """

    places: Array
    residuals: Array
    view: NDArray[np.intp]
    mean: Array
    count: NDArray[np.int64]

    @property
    def pattern_px(self) -> float:
        """Rms of the means, less what the corners' own scatter leaves in them: 0 where the model explains all."""
        known = np.isfinite(self.mean).all(axis=-1)
        if not known.any():
            return 0.0
        scatter = float(np.mean(np.square(self.residuals).sum(axis=1)))
        excess = np.square(self.mean[known]).sum(axis=-1) - scatter / self.count[known]
        return float(np.sqrt(max(float(np.mean(excess)), 0.0)))


def residual_field(places: Array, residuals: Array, view: NDArray[np.intp], size: tuple[int, int]) -> ResidualField:
    """The field over a picture of `size` (width, height) px."""
    rows, cols = CELLS
    scale = np.array([cols / size[0], rows / size[1]])
    col, row = np.clip(((places + 0.5) * scale).astype(int), 0, [cols - 1, rows - 1]).T
    cell = row * cols + col
    count = np.bincount(cell, minlength=rows * cols)
    sums = np.stack([np.bincount(cell, residuals[:, axis], minlength=rows * cols) for axis in (0, 1)], axis=1)
    mean = np.where(count[:, None] >= _FEWEST, sums / np.maximum(count, 1)[:, None], np.nan)
    return ResidualField(places, residuals, view, mean.reshape(rows, cols, 2), count.reshape(rows, cols))
