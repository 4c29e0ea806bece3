"""Depth from disparity alone, as the thesis computes it: no calibration, parallel axes, equal cameras."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def depth_from_disparity(disparity_px: ArrayLike, baseline_m: float, width_px: float, view_angle_rad: float) -> Array:
    """Distance in m from the disparity X_L - X_R in px (RHOT eq. 6.12); NaN where it is not positive.

    D = B x0 / (2 tan(phi0 / 2) (X_L - X_R)), with the image width x0 and the horizontal view angle phi0.
    """
    return baseline_m * width_px / (2.0 * math.tan(view_angle_rad / 2.0)) / _positive(disparity_px)


def depth_from_power_law(disparity_px: ArrayLike, k: float, z: float) -> Array:
    """Distance D = k |x|^z of a disparity in px (RHOT eq. 7.4), in the unit in which `k` was fitted.

    The thesis found k = 4543.3 (cm) and z = -1.035. NaN where the disparity is not positive.
    """
    return np.asarray(k * _positive(disparity_px) ** z)


def depth_error(depth_m: ArrayLike, baseline_m: float, angle_error_rad: float) -> Array:
    """Error in m that a viewing angle's error makes at `depth_m`: D^2 / B tan(dphi) (RHOT eq. 7.3)."""
    return np.asarray(np.square(np.asarray(depth_m, dtype=np.float64)) / baseline_m * math.tan(angle_error_rad))


def _positive(disparity_px: ArrayLike) -> Array:
    disparity = np.asarray(disparity_px, dtype=np.float64)
    return np.where(disparity > 0.0, disparity, np.nan)
