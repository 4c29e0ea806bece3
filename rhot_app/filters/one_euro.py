"""The 1-euro filter (Casiez, Roussel, Vogel 2012), many channels at once, at irregular times.

A first-order low-pass whose cutoff rises with the signal's own speed: fc = min_cutoff + beta |speed|. A ramp of slope
v lags by v / (2 pi fc) <= 1 / (2 pi beta) however fast it is; docs/tracking.md builds the defaults on that bound.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from rhot_app.project import OneEuroSettings

Array = NDArray[np.float64]

RESET_GAP_S = 0.25
"""A channel without a sample for longer than this starts anew: its old value says nothing about the new one."""


@njit(cache=True)
def _alpha(cutoff_hz: float, dt_s: float) -> float:
    """Weight of the new sample in a first-order low-pass of this cutoff."""
    return dt_s / (dt_s + 1.0 / (2.0 * math.pi * cutoff_hz))


@njit(cache=True)
def step(t_s: float, values: Array, parameters: Array, state: Array, out: Array) -> None:
    """Filter one sample of every channel.

    `values`, `out` (N,). `parameters` (N, 3): min cutoff Hz, beta, derivative cutoff Hz. `state` (N, 3): time of the
    last sample, filtered value, filtered derivative; NaN time means never. A channel that is NaN has no sample: its
    state stays and its output is NaN, because a held value must not pass for a measured one. A sample that is not
    later than the last one changes nothing and gives the last filtered value.
    """
    for i in range(values.shape[0]):
        value = values[i]
        if not math.isfinite(value):
            out[i] = math.nan
            continue
        dt = t_s - state[i, 0]
        if math.isnan(dt) or dt > RESET_GAP_S:
            state[i, 1] = value
            state[i, 2] = 0.0
        elif dt <= 0.0:
            out[i] = state[i, 1]
            continue
        else:
            # The difference to the last filtered value, not to the last raw one, as in the authors' own code.
            derivative = (value - state[i, 1]) / dt
            state[i, 2] += _alpha(parameters[i, 2], dt) * (derivative - state[i, 2])
            cutoff = parameters[i, 0] + parameters[i, 1] * abs(state[i, 2])
            state[i, 1] += _alpha(cutoff, dt) * (value - state[i, 1])
        state[i, 0] = t_s
        out[i] = state[i, 1]


class OneEuroFilter:
    """N channels with their own parameters and a common clock.

    `min_cutoff_hz`, `beta` and `derivative_cutoff_hz` are numbers or (N,) arrays; `channels` is N. Compiled code that
    filters among other things passes `parameters` and `state` to `step` itself.
    """

    def __init__(self, channels: int, min_cutoff_hz: ArrayLike, beta: ArrayLike, derivative_cutoff_hz: ArrayLike = 1.0
                 ) -> None:
        self.parameters = np.empty((channels, 3))
        for column, value in enumerate((min_cutoff_hz, beta, derivative_cutoff_hz)):
            self.parameters[:, column] = value
        self.state = np.full((channels, 3), np.nan)

    @classmethod
    def from_settings(cls, settings: Sequence[OneEuroSettings]) -> OneEuroFilter:
        """One channel per entry of `settings`."""
        return cls(len(settings), [s.min_cutoff_hz for s in settings], [s.beta for s in settings],
                   [s.derivative_cutoff_hz for s in settings])

    def __call__(self, t_s: float, values: Array) -> Array:
        """Filtered values (N,) of the samples `values` (N,) taken at `t_s`; NaN where there is no sample."""
        out = np.empty_like(values)
        step(t_s, values, self.parameters, self.state, out)
        return out

    def reset(self, channels: NDArray[np.bool_] | None = None) -> None:
        """Forget the given channels (mask (N,)), or all."""
        self.state[slice(None) if channels is None else channels] = np.nan
