"""Stationary Gauss-Markov processes in state-space form (Hartikainen and Särkkä 2010).

A Matérn process of smoothness 5/2 with rate `rate` (1/s) and variance s^2 is the solution of a third-order stochastic
differential equation: value, velocity and acceleration. `matern52` is its transition. `integrated` is the transition of
a value without a mean whose velocity is a Matérn process of smoothness 3/2: a position that may go anywhere.
`white_acceleration` is the noise of a value whose velocity is constant but for that.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]

_POINTS = 0.5 + 0.5 * np.array([-math.sqrt(0.6), 0.0, math.sqrt(0.6)])  # Gauss-Legendre on 0..1
_WEIGHTS = np.array([5.0, 8.0, 5.0]) / 18.0


def white_acceleration(density: Array, dt: float) -> Array:
    """(2 n, 2 n) covariance of n values and of their n velocities after `dt` s by white accelerations of spectral
    `density` (n,), squared units per s^3."""
    count, out = len(density), np.zeros((2 * len(density), 2 * len(density)))
    value, rate = np.arange(count), np.arange(count, 2 * count)
    out[value, value], out[rate, rate] = density * dt**3 / 3.0, density * dt
    out[value, rate] = out[rate, value] = density * dt**2 / 2.0
    return out


@njit(cache=True)
def matern52(rate: float, dt: float, out: Array) -> None:
    """Fill `out` (3, 3) with the transition of (value, velocity, acceleration) over `dt` s."""
    x, e = rate * dt, math.exp(-rate * dt)
    out[0, 0], out[0, 1], out[0, 2] = e * (1.0 + x + 0.5 * x * x), e * dt * (1.0 + x), e * 0.5 * dt * dt
    out[1, 0], out[1, 1] = -e * 0.5 * rate * x * x, e * (1.0 + x - x * x)
    out[1, 2] = e * dt * (1.0 - 0.5 * x)
    out[2, 0], out[2, 1] = e * rate * rate * x * (0.5 * x - 1.0), e * rate * x * (x - 3.0)
    out[2, 2] = e * (1.0 - 2.0 * x + 0.5 * x * x)


@njit(cache=True)
def integrated(rate: float, dt: float, out: Array) -> None:
    """Fill `out` (3, 3) with the transition of (value, velocity, acceleration) over `dt` s."""
    x, e = rate * dt, math.exp(-rate * dt)
    out[0, 0], out[1, 0], out[2, 0] = 1.0, 0.0, 0.0
    out[0, 1], out[0, 2] = (2.0 - e * (2.0 + x)) / rate, (1.0 - e * (1.0 + x)) / (rate * rate)
    out[1, 1], out[1, 2] = e * (1.0 + x), e * dt
    out[2, 1], out[2, 2] = -e * rate * x, e * (1.0 - x)


@njit(cache=True)
def jerk_density(rate: float) -> float:
    """Spectral density of the white jerk, 1/s^5, that gives a Matérn 5/2 process of variance 1."""
    return 16.0 / 3.0 * rate**5


@njit(cache=True)
def matern52_noise(rate: float, dt: float, out: Array) -> None:
    """Fill `out` (3, 3) with the covariance that `dt` s of white jerk add to a Matérn 5/2 process of variance 1."""
    transition = np.empty((3, 3))
    out[:] = 0.0
    for point in range(3):
        matern52(rate, dt * _POINTS[point], transition)
        _add_square(transition[:, 2], jerk_density(rate) * dt * _WEIGHTS[point], out)


@njit(cache=True)
def integrated_noise(rate: float, dt: float, out: Array) -> None:
    """The same of a value whose velocity is a Matérn 3/2 process of variance 4/3 `rate`^2: the same white jerk."""
    transition = np.empty((3, 3))
    out[:] = 0.0
    for point in range(3):
        integrated(rate, dt * _POINTS[point], transition)
        _add_square(transition[:, 2], jerk_density(rate) * dt * _WEIGHTS[point], out)


@njit(cache=True)
def _add_square(column: Array, factor: float, out: Array) -> None:
    for i in range(3):
        for j in range(3):
            out[i, j] += factor * column[i] * column[j]
