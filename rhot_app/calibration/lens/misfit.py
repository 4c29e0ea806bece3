"""What the residuals say about the lens model: their pattern over the image, and whether the lens is wider than it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.verdict import Finding, Grade
from rhot_app.geometry.camera import FARTHEST_DEG, lens_rays

Array = NDArray[np.float64]

CELLS = (6, 8)
"""Rows and columns of the means."""

_FEWEST = 4  # corners in a cell that make a mean
GRID = (12, 16)
"""Rows and columns of pixels at which rays are looked at."""

# -- residual pattern over the image -----------------------------------------------------------------------------------


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
    def rms_px(self) -> float:
        """Rms distance of a corner from where it should be."""
        return float(np.sqrt(np.mean(np.square(self.residuals).sum(axis=1))))

    @property
    def pattern_px(self) -> float:
        """Rms of the means, less what the corners' own scatter leaves in them: 0 where the model explains all."""
        known = np.isfinite(self.mean).all(axis=-1)
        if not known.any():
            return 0.0
        excess = np.square(self.mean[known]).sum(axis=-1) - self.rms_px**2 / self.count[known]
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


# -- where the lens ends -----------------------------------------------------------------------------------------------

_WIDE_RAD = np.radians(100.0)  # plain lenses are narrower; of the picture's width, were a pixel the same angle anywhere
_BLIND = 0.1  # of the picture without rays
_PATTERN = 0.1  # of the corners' squared distances, that the pattern explains
_FAR_OFF_PX = 0.5  # rms, of a picture 1000 px wide or less: twice what is usual


def picture_grid(size: tuple[int, int]) -> Array:
    """(N, 2) px, places spread evenly over a picture of `size` (width, height), its rim included."""
    rows, cols = GRID
    x, y = np.meshgrid(np.linspace(0, size[0] - 1, cols), np.linspace(0, size[1] - 1, rows))
    return np.column_stack([x.ravel(), y.ravel()])


def blind_share(lens: Array, size: tuple[int, int]) -> float:
    """Share of a picture's places that no ray belongs to: there the distortion has turned over."""
    return float(np.mean(~np.isfinite(lens_rays(picture_grid(size), lens)).all(axis=1)))


def wider_than_model(lens: Array, size: tuple[int, int], field: ResidualField,
                     name: str = "the lens") -> Finding | None:
    """The finding that a lens (12,) is wider than the model, by what residuals and the picture's rim say."""
    across = size[0] / float(lens[0])
    blind = blind_share(lens, size)
    coarse = max(1.0, size[0] / 1000.0)
    off = field.rms_px > _FAR_OFF_PX * coarse and field.pattern_px**2 > _PATTERN * field.rms_px**2
    if not across > _WIDE_RAD or not (off or blind > _BLIND):
        return None
    what = f"no ray belongs to {100 * blind:.0f} % of the picture" if blind > _BLIND else ""
    residual = f"its corners are {field.rms_px:.2f} px off, {field.pattern_px:.2f} px of it in a pattern" if off else ""
    return Finding("too_wide", Grade.POOR, f"{name[0].upper()}{name[1:]} is wider than the model of a lens: "
                   f"{' and '.join(each for each in (residual, what) if each)}.",
                   f"The model ends {FARTHEST_DEG:.0f} degrees from the lens's axis.",
                   "Use a lens of less than 150 degrees, or a mode of the camera that shows less.")
