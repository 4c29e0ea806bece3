"""The time of one frame: rows start one after the other and each collects light for a while.

A frame's time is tau, -1 at the first light that its first row collects and 1 at the last light of its last row. What
moves is a polynomial in tau, through `NODES` poses at Chebyshev's places.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]

NODES = 5
"""Coefficients of a polynomial over one frame: a hand at full speed strays from it by less than 1 um."""

STILL_PX = 0.02
"""px: what moves less while exposed is taken to stand still."""

_PLACES = np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES)
_FIT = np.linalg.inv(np.vander(_PLACES, increasing=True))


@dataclass(frozen=True, slots=True)
class Shutter:
    """Times of an exposure, s: how long each row collects light, and how much later each row is than the one above."""

    exposure_s: float
    row_time_s: float


@dataclass(frozen=True, slots=True)
class FrameTime:
    """One frame of `height` rows whose row 0 is mid-exposed at `t_row0_s`, scene time."""

    shutter: Shutter
    height: int
    t_row0_s: float

    @property
    def _span_s(self) -> float:
        return (self.height - 1) * self.shutter.row_time_s

    @property
    def half_s(self) -> float:
        """Half the time from first to last light: one unit of tau, s."""
        return 0.5 * (self._span_s + self.shutter.exposure_s)

    @property
    def nodes_s(self) -> Array:
        """(NODES,) scene times at which poses are wanted for `power_series`, s."""
        return np.asarray(self.t_row0_s + 0.5 * self._span_s + self.half_s * _PLACES)

    @property
    def timing(self) -> Array:
        """(3,): tau of row 0's mid-exposure, tau per row, exposure in tau."""
        return np.array([-0.5 * self._span_s, self.shutter.row_time_s, self.shutter.exposure_s]) / self.half_s


def power_series(values: Array) -> Array:
    """(N, P, NODES) coefficients of powers of tau from values (NODES, N, P) at a frame's nodes."""
    _, count, parameters = values.shape
    powers = _FIT @ values.reshape(NODES, -1)
    return np.ascontiguousarray(powers.reshape(NODES, count, parameters).transpose(1, 2, 0))


@njit(cache=True, fastmath=True)
def evaluate(series: Array, n: int, tau: float, row: Array) -> None:
    """The parameters of row `n` of a series at `tau`, into `row`."""
    for k in range(len(row)):
        row[k] = (((series[n, k, 4] * tau + series[n, k, 3]) * tau + series[n, k, 2]) * tau
                  + series[n, k, 1]) * tau + series[n, k, 0]
