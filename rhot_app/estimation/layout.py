"""Slices of the named parts of a state, and of its tangent space.

A part is a pose, SE3, with 12 numbers and 6 of tangent space (`estimation.se3`), or a vector, with as many of both.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]

SE3: Final = -1
"""The size of a part that is a pose."""

_NUMBERS, _TWIST = 12, 6


class Layout:
    """The parts of a state in their order. `size`: numbers of a state; `tangent_size`: of its tangent space."""

    def __init__(self, **parts: int) -> None:
        """`parts`: the size of each, or SE3."""
        self.size = self.tangent_size = 0
        self._parts: dict[str, tuple[slice, slice]] = {}
        for name, size in parts.items():
            numbers, tangent = (_NUMBERS, _TWIST) if size == SE3 else (size, size)
            self._parts[name] = (slice(self.size, self.size + numbers),
                                 slice(self.tangent_size, self.tangent_size + tangent))
            self.size += numbers
            self.tangent_size += tangent

    def state(self, first: str, last: str = "") -> slice:
        """Where a part is in a state, or the parts from `first` to `last`."""
        return slice(self._parts[first][0].start, self._parts[last or first][0].stop)

    def tangent(self, first: str, last: str = "") -> slice:
        """Where it is, or they are, in the tangent space."""
        return slice(self._parts[first][1].start, self._parts[last or first][1].stop)


@njit(cache=True)
def pose_matrix(state: Array) -> Array:
    """(4, 4): the pose with which a state begins."""
    out = np.eye(4)
    out[:3] = state[:_NUMBERS].reshape(3, 4)
    return out


@njit(cache=True)
def set_pose(state: Array, pose: Array) -> None:
    """Let a state begin with a pose, (3, 4) or (4, 4)."""
    for i in range(3):
        for j in range(4):
            state[4 * i + j] = pose[i, j]
