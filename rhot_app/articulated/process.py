"""How an articulated object moves: constant velocity, with white acceleration of its root and its angles.

A state of an object with A angles has 12 + A + 6 + A numbers: world_from_root (3, 4) row by row, the angles, rad, and
the velocities of the tangent space. The tangent space has the root's translation, m, and rotation, rad, along world
axes, the angles, and the velocities of all these. What the file does not set free never moves.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rhot_app.articulated.bodies import ANGLES, ROOT_POSE
from rhot_app.estimation.se3 import PoseState, retract
from rhot_app.hand.articulated_model import STATE_ROOT, ArticulatedModel, root_arrays

Array = NDArray[np.float64]

AMPLITUDE, PACE_HZ = (0.1, 0.8, 0.9), 1.5
"""m, rad and rad of the root's translation and rotation and of the angles, and 1/s: the harmonic motion that is
expected, whose speeds and accelerations the process has. Chosen: a hand that waves by 0.1 m, turns by 45 degrees and
closes by 50, three times in two seconds."""

START_SD = 1e-3, 0.01, 0.02
"""m, rad and rad: how well a start is known from which templates are taken. They show it no better."""


class ConstantVelocity(PoseState):
    """Implements `estimation.residual.Process`. `free` (6 + A,): what moves. `density` (6 + A,): of the white
    acceleration, squared units of the tangent space per s^3; `speed` (6 + A,): standard deviation of velocities."""

    def __init__(self, free: NDArray[np.bool_], amplitude: tuple[float, float, float] = AMPLITUDE,
                 pace_hz: float = PACE_HZ) -> None:
        """`amplitude` m, rad, rad and `pace_hz`: of the harmonic motion that is expected. Its acceleration lasts a
        quarter of a period."""
        self.free = free
        self.pose = len(free)
        self.size = 2 * self.pose
        self.speed = 2.0 * np.pi * pace_hz * self._each(amplitude) / np.sqrt(2.0)
        self.density = (2.0 * np.pi * pace_hz * self.speed) ** 2 / (4.0 * pace_hz)

    def _each(self, values: tuple[float, float, float]) -> Array:
        """(6 + A,): values of translation, rotation and angles, 0 where nothing moves."""
        return np.repeat(values, [3, 3, self.pose - ROOT_POSE]) * self.free

    def start(self, root: Array, angles: Array, sd: tuple[float, float, float] = START_SD) -> tuple[Array, Array]:
        """State and covariance at `root` (4, 4) and `angles` (A,), known to `sd`: m, rad and rad."""
        state = np.concatenate([root[:3].ravel(), angles, np.zeros(self.pose)])
        return state, np.diag(np.concatenate([self._each(sd), self.speed]) ** 2)

    def predict(self, state: Array, covariance: Array, dt_s: float) -> tuple[Array, Array]:
        """See `Process`."""
        if dt_s <= 0.0:
            return state.copy(), covariance.copy()
        step = np.zeros(self.size)
        step[:self.pose] = dt_s * state[ANGLES + self.pose - ROOT_POSE:]
        along = self.transition(state, dt_s)
        out = along @ covariance @ along.T
        pose, velocity = np.arange(self.pose), np.arange(self.pose, self.size)
        out[pose, pose] += self.density * dt_s**3 / 3.0
        out[pose, velocity] += self.density * dt_s**2 / 2.0
        out[velocity, pose] += self.density * dt_s**2 / 2.0
        out[velocity, velocity] += self.density * dt_s
        return retract(state, step), out

    def transition(self, state: Array, dt_s: float) -> Array:
        """See `Process`. The turn within a step is small: its effect on the axes of later turns is left out."""
        out = np.eye(self.size)
        out[np.arange(self.pose), np.arange(self.pose, self.size)] = dt_s
        return out


def free_of(model: ArticulatedModel) -> NDArray[np.bool_]:
    """(6 + A,) what the object's file sets free."""
    root = model.document.root.free
    return np.array([root != "none"] * 3 + [root == "pose"] * 3 + [angle.free for angle in model.document.angles])


def rest_of(model: ArticulatedModel) -> tuple[Array, Array]:
    """world_from_root (4, 4) and angles (A,) rad of the object at rest, as its file shows it."""
    root = np.empty((4, 4))
    root_arrays(model.rest, root)
    return root, model.rest[STATE_ROOT:].copy()
