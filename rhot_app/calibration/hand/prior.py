"""What is known of a hand before it is measured: how bone lengths of adults scatter, and how they go together.

Means and standard deviations: Buryanov and Kotiuk 2010, Int. J. Morphol. 28(3):755-758, table I (X-rays of 66 adults;
the last bone is the distal phalanx and the soft tip). A part of the scatter is size: big hands have all bones longer.
Hand length is 194 +- 10 mm for men and 181 +- 10 mm for women (Gordon et al. 1989, ANSUR), 6.3 % over both. What is
left of each bone's scatter is its proportion.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SIZE_SD = 0.063
"""Standard deviation of the size of adult hands, as a part of it."""

BONES_M = 1e-3 * np.array([[46.22, 31.57, 27.34], [39.78, 22.38, 19.66], [44.63, 26.33, 21.35], [41.37, 25.65, 21.25],
                           [32.74, 18.11, 19.69]])
"""(5, 3) m, mean bones as in `skeleton.BONES`."""

_BONE_SD_M = 1e-3 * np.array([[3.94, 3.13, 1.71], [4.94, 2.51, 2.34], [3.81, 3.00, 1.95], [3.87, 3.29, 2.25],
                              [2.77, 2.54, 2.53]])  # distal and soft tip added as independent
_METACARPAL_SD = np.array([0.0852, 0.0920, 0.0833, 0.0872, 0.0812])  # as a part of the mean, same table
_LEAST_PROPORTION_SD = 0.03

BASE_SD_M = 3e-3
"""Of a finger root's place in the palm across the hand and up, and of the carpus behind the metacarpals; nobody
published it, the layout of the shipped hands is ours."""

BASE_TURN_SD = np.radians([[12.0, 12.0, 12.0], *[[8.0, 6.0, 6.0]] * 4])
"""(5, 3) rad, of each finger's neutral frame about the palm's x (roll), y (flexion) and z (abduction): ours."""

TIP_PART = (0.75, 0.12)
PAINT_PART = (0.5, 0.01)
"""Where a tip's marker sits along the last bone and its scatter, as parts of it: a dot on the nail, paint all over."""


def proportion_sd() -> Array:
    """(5, 3) standard deviation of each bone as a part of its length, in hands of the same size."""
    return _without_size(_BONE_SD_M / BONES_M)


def root_proportion_sd() -> Array:
    """(5,) the same for the distance of each finger's root from the wrist."""
    return _without_size(_METACARPAL_SD)


def _without_size(whole: Array) -> Array:
    return np.maximum(np.sqrt(np.maximum(whole ** 2 - SIZE_SD ** 2, 0.0)), _LEAST_PROPORTION_SD)


@dataclass(frozen=True, slots=True)
class Prior:
    """Gaussian over a parameter vector: `mean` (G,), `covariance` (G, G), and `fixed_size` (G, G), the covariance among
    hands of one size: what is known of each bone once the size of the hand is."""

    mean: Array
    covariance: Array
    fixed_size: Array
