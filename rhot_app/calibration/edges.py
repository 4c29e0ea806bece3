"""How sharp a board is in a picture: the width of its edges between black and white."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_SAMPLES = 41
_REACH = 0.4  # of the neighbouring side, to each side of the edge


def edge_width_px(gray: NDArray[np.uint8], grid: Array) -> float:
    """Width of the board's edges in pixels: contrast over steepest slope, of the blurrier of the two directions.

    `grid` (rows, cols, 2) px, NaN where a corner is absent. An ideal step sampled by pixels has 1, a sharp camera
    about 2; motion along one direction widens the edges across it, which is why the two are kept apart. NaN when no
    edge has both its ends.
    """
    widths = []
    for lattice in (grid, grid.transpose(1, 0, 2)):
        along = lattice[:, 1:] - lattice[:, :-1]  # an edge between two corners of a row
        across = lattice[1:, :-1] - lattice[:-1, :-1]
        middle, step = (lattice[:-1, 1:] + lattice[:-1, :-1]) / 2, across
        normal = np.stack([-along[:-1, :, 1], along[:-1, :, 0]], axis=-1)
        usable = np.isfinite(middle).all(axis=-1) & np.isfinite(step).all(axis=-1)
        if usable.any():
            widths.append(_median_width(gray, middle[usable], normal[usable], step[usable]))
    return float(max(widths)) if widths else float("nan")


def _median_width(gray: NDArray[np.uint8], middle: Array, normal: Array, step: Array) -> float:
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    unit = normal / np.maximum(length, 1e-9)
    reach = _REACH * np.abs((unit * step).sum(axis=1, keepdims=True))
    places = middle[:, None] + np.linspace(-1, 1, _SAMPLES)[None, :, None] * (reach * unit)[:, None]
    profile = cv2.remap(gray, places[..., 0].astype(np.float32), places[..., 1].astype(np.float32),
                        cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE).astype(float)
    spacing = 2 * reach[:, 0] / (_SAMPLES - 1)
    slope = np.abs(np.diff(profile, axis=1)).max(axis=1) / np.maximum(spacing, 1e-9)
    contrast = np.abs(profile[:, -4:].mean(axis=1) - profile[:, :4].mean(axis=1))
    return float(np.median(contrast / np.maximum(slope, 1e-9)))
