"""The Cramer-Rao bound of a disc's place in one frame's chroma planes: no unbiased estimate can jitter less.

From the very pictures that the benchmark shows, drawn without noise: derivatives by differences, the noise of red,
green and blue carried to U and V, plus that of rounding. Unknown besides the place: radius, colours of paint and
surroundings, strength and direction of the shading.
"""

from __future__ import annotations

from collections.abc import Callable

import marker_rendering
import numpy as np
from marker_rendering import Canvas
from numpy.typing import NDArray

Array = NDArray[np.float64]

CHROMA_FROM_RGB = np.array([[-0.168736, -0.331264, 0.5], [0.5, -0.418688, -0.081312]])
FINE = 40  # samples per pixel along each axis
STEPS = np.array([0.2, 0.2, 0.2, 4.0, 4.0, 4.0, 0.05, 0.05, 4.0, 4.0, 4.0])
"""Of x, y and radius, px; paint's red, green and blue; shading and its direction; the surroundings' three."""


def place_bound(draw: Callable[[Array], Canvas], at: Array, noise: float) -> Array:
    """(2,) px: least standard deviations of x and y. `draw` makes a picture of parameters as in STEPS, true `at`."""
    before, marker_rendering.SUPERSAMPLING = marker_rendering.SUPERSAMPLING, FINE
    try:
        columns = []
        for k, step in enumerate(STEPS):
            shift = step * (np.arange(len(STEPS)) == k)
            columns.append((_chroma(draw(at + shift)) - _chroma(draw(at - shift))) / (2.0 * step))
    finally:
        marker_rendering.SUPERSAMPLING = before
    covariance = 0.25 * noise**2 * CHROMA_FROM_RGB @ CHROMA_FROM_RGB.T + np.eye(2) / 12.0
    slopes = np.stack(columns, axis=-1)  # (pixels, 2, parameters)
    information = np.einsum("nik,ij,njl->kl", slopes, np.linalg.inv(covariance), slopes)
    others = np.linalg.pinv(information[2:, 2:], rcond=1e-9)  # two of three colour channels show in chroma
    place = information[:2, :2] - information[:2, 2:] @ others @ information[2:, :2]
    return np.asarray(np.sqrt(np.diag(np.linalg.inv(place))))


def _chroma(canvas: Canvas) -> Array:
    """(N, 2) U and V of a picture through the lens, not rounded."""
    rgb = canvas.seen()
    height, width, _ = rgb.shape
    mean = rgb.reshape(height // 2, 2, width // 2, 2, 3).mean(axis=(1, 3))
    return np.asarray((mean @ CHROMA_FROM_RGB.T).reshape(-1, 2))
