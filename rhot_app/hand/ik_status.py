"""How an inverse kinematics solver ended."""

from __future__ import annotations

from enum import IntEnum

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Status(IntEnum):
    """How the solution of one finger ended. Only REACHED promises a residual within the tolerance."""

    REACHED = 0
    UNREACHABLE = 1
    """The target is farther than the chain is long, or nearer than its longest bone lets it fold."""
    LIMITED = 2
    """No more progress, with a joint at its limit."""
    STALLED = 3
    """No more progress, with no joint at its limit: a singular pose or a local minimum."""
    EXHAUSTED = 4
    """Still under way when the iterations were used up."""
    MISSING = 5
    """There was no target: the start stands."""


REACHED, UNREACHABLE, LIMITED, STALLED, EXHAUSTED, MISSING = (int(status) for status in Status)

AT_LIMIT = 1e-6
"""A joint this near to its limit stands at it, rad."""


@njit(cache=True)
def within_reach(lengths: Array, away: float, tolerance: float) -> bool:
    """Whether a free chain of bones `lengths` (n,) could bring its end within `tolerance` of a point this far `away`
    from its root."""
    total, longest = 0.0, 0.0
    for k in range(lengths.shape[0]):
        total += lengths[k]
        longest = max(longest, lengths[k])
    return 2.0 * longest - total - tolerance <= away <= total + tolerance


@njit(cache=True)
def status_of(angles: Array, lengths: Array, limits: Array, away: float, residual: float, tolerance: float,
              moving: bool) -> int:
    """The status of a finger that ended with `residual`, its target this far `away` from its root; `moving`: it was
    still making progress."""
    if residual <= tolerance:
        return REACHED
    if not within_reach(lengths, away, tolerance):
        return UNREACHABLE
    if moving:
        return EXHAUSTED
    for k in range(angles.shape[0]):
        if angles[k] - limits[k, 0] < AT_LIMIT or limits[k, 1] - angles[k] < AT_LIMIT:
            return LIMITED
    return STALLED
