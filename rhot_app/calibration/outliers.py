"""Which views do not fit the others, and whether views differ enough: the same for one camera and for many."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

MOST_DROPPED = 0.34
"""Of the views; who needs more thrown away has another trouble."""

_OFF_TIMES = 4.0  # a view whose rms is this many times the median view's, and
_OFF_PX = 0.3  # this much more than it, does not fit


def misfit_limit(rms: Array) -> tuple[float, float]:
    """The rms in px above which a view does not fit, and the usual one, from the rms of all views; NaN is no view."""
    usual = float(np.nanmedian(rms))
    return max(_OFF_TIMES * usual, usual + _OFF_PX), usual


def tilt_spread(world_from_board: Array) -> float:
    """Largest angle, rad, between the normals of any two boards (S, 4, 4): without it planes show no focal length."""
    normals = world_from_board[:, :3, 2]
    return float(np.arccos(np.clip(np.min(normals @ normals.T), -1.0, 1.0)))
