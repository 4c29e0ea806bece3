"""The median of a few numbers, without memory."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rhot_app.lean import lean

Array = NDArray[np.float64]


@lean
def median(values: Array) -> float:
    """The median of `values` (K,), one or more, which are put in order."""
    count = values.shape[0]
    for i in range(1, count):
        value, k = values[i], i
        while k > 0 and values[k - 1] > value:
            values[k] = values[k - 1]
            k -= 1
        values[k] = value
    half = count // 2
    return float(values[half] if count % 2 == 1 else 0.5 * (values[half - 1] + values[half]))
