"""How uncertain a place is, as one number: the standard deviation along its worst axis, and how it is written."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.lens.camera_calibration import CalibrationError

UNKNOWN = "?"
"""Stands for a standard deviation that nobody knows, because nobody knows how good the calibration is."""

Array = NDArray[np.float64]


def worst_sd(covariances: Array) -> Array:
    """Standard deviation (...,) along the worst axis of each covariance (..., 3, 3), in the root of its unit.

    NaN where the covariance is not known.
    """
    known = np.asarray(np.isfinite(covariances).all(axis=(-2, -1)))
    values = np.linalg.eigvalsh(np.where(known[..., None, None], covariances, 0.0))[..., -1]
    return np.asarray(np.where(known, np.sqrt(np.maximum(values, 0.0)), np.nan))


def total_sd(covariances: Array, positions: Array, by_calibration: CalibrationError) -> Array:
    """Standard deviation (...,) m of places (..., 3) m along the worst axis, the calibration's own included; NaN where
    either is not known."""
    return np.asarray(np.hypot(worst_sd(covariances), by_calibration.at(positions)))


def sd_number(sd_m: float) -> str:
    """In mm with two significant digits, e.g. "0.31", "2.4", "18"; "" when it is not known."""
    if not math.isfinite(sd_m):
        return ""
    sd_mm = 1e3 * sd_m
    return f"{sd_mm:.2f}" if sd_mm < 0.995 else f"{sd_mm:.1f}" if sd_mm < 9.95 else f"{sd_mm:.0f}"


def sd_text(sd_m: float) -> str:
    """E.g. "± 0.31 mm"; "" when it is not known."""
    number = sd_number(sd_m)
    return f"± {number} mm" if number else ""
