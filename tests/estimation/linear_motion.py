"""A linear process and residuals whose estimates textbooks give in closed form."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rhot_app.estimation.residual import GAUSSIAN, Kernel, Rows


class ConstantVelocity:
    """A place and its velocity, driven by white acceleration; implements `Process`."""

    size = 2

    def __init__(self, density=0.5):
        self.density = density

    def retract(self, state, step):
        return state + step

    def difference(self, state, origin):
        return state - origin

    def predict(self, state, covariance, dt_s):
        move = self.transition(state, dt_s)
        return move @ state, move @ covariance @ move.T + self.noise(dt_s)

    def transition(self, state, dt_s):
        return np.array([[1.0, dt_s], [0.0, 1.0]])

    def noise(self, dt_s):
        return self.density * np.array([[dt_s**3 / 3.0, dt_s**2 / 2.0], [dt_s**2 / 2.0, dt_s]])


@dataclass
class Linear:
    """`values` (K,) of matrix (K, 2) times the state."""

    values: np.ndarray
    matrix: np.ndarray
    noise: np.ndarray
    kernel: Kernel = GAUSSIAN
    first: np.ndarray | None = None

    def linearise(self, state):
        return Rows(self.values - self.matrix @ state, self.matrix, self.noise, self.kernel, self.first)


def place(value, variance=0.04, kernel=GAUSSIAN):
    """A measurement of the place."""
    return Linear(np.array([value]), np.array([[1.0, 0.0]]), np.array([variance]), kernel)


def kalman_update(state, covariance, matrix, values, noise):
    """The textbook's measurement update."""
    gain = covariance @ matrix.T @ np.linalg.inv(matrix @ covariance @ matrix.T + noise)
    return state + gain @ (values - matrix @ state), (np.eye(len(state)) - gain @ matrix) @ covariance
