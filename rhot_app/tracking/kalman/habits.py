"""What is believed of a hand without evidence, as arrays for compiled functions."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Habits(NamedTuple):
    """What is known of a hand that is not seen.

    `rows` (K, 21) of factors and `values` (K,): beliefs about the angles, in standard deviations; `mean` (21,) and
    `information` (21, 21): the same as one Gaussian; `usual` (27, 27): the covariance of a pose that follows from it,
    with a palm that may be anywhere. `together` (27, 27): how the pose's numbers accelerate together, 1 for the
    liveliest of a group: fingers bend all their joints at once. `stiff` (R, 27): rows of what a finger does least, all
    but its abduction and its bending at all joints at once.
    """

    rows: Array
    values: Array
    mean: Array
    information: Array
    usual: Array
    together: Array
    stiff: Array
