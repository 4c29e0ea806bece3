"""Rolling-shutter time: every row of an image is exposed a little later than the one above it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def row_times_ns(t_row0_ns: int, row_time_ns: int, rows: NDArray[np.float64]) -> NDArray[np.int64]:
    """Mid-exposure times of image rows (...,) px, ns on the clock of `t_row0_ns`: t_row0 + y * row_time.

    Raw (distorted) rows: the sensor knows no lens. NaN rows (lost markers) get the time of row 0.
    """
    offsets = np.where(np.isfinite(rows), rows, 0.0) * row_time_ns
    return np.asarray(t_row0_ns + np.rint(offsets).astype(np.int64), dtype=np.int64)
