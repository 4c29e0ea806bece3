"""How a hand moves: a Gauss-Markov process on the palm's pose and the 21 joint angles.

Angles are a Matérn 5/2 process about the natural pose, with its covariance. The palm's velocity is a Matérn 3/2 process
without a preferred place. Errors that last, of paint and of cameras, are a first-order process. The rates of the
processes follow the hand: the faster it is estimated to move, the shorter is the correlation time.

Before every prediction, the part of pose, velocity and acceleration that the markers do not observe is reset to the
pose prior (`null_space`).
"""

from __future__ import annotations

import copy
import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.estimation.gauss_markov import integrated, integrated_noise, matern52, matern52_noise
from rhot_app.estimation.layout import pose_matrix, set_pose
from rhot_app.estimation.se3 import PoseState, retract
from rhot_app.hand.dh import DhArrays
from rhot_app.hand.motion.hand_state import MOTION, POSE, STATE, state_at
from rhot_app.hand.motion.null_space import most_probable_pose
from rhot_app.hand.skeleton import ANGLES

Array = NDArray[np.float64]

PALM_SPREAD = np.array([0.055, 0.25])
"""m and rad: how far a palm moves and turns within one correlation time, twice as fast as the recorded ones
(`python benchmarks/process_prior.py`)."""

SLOWEST, FASTEST = np.full(3, 3.4), 15.0
"""1/s: rates of a hand at rest (palm translation, palm rotation, angles; `python benchmarks/process_prior.py`), and of
the fastest one."""

BIAS_S = 1.0
"""s: correlation time of the paint biases: hands turn so that other paint shows."""

_COUNT = len(ANGLES)
_GROUPS = np.repeat((0, 1, 2), (3, 3, _COUNT))


class HandProcess(PoseState):
    """Implements `estimation.residual.Process`; L errors that last, three numbers each.

    `dh` has a point for each marker; without points there is no null-space reset. `limits` (21, 2) rad.
    `mean` (21,) rad and `covariance` (21, 21) of the pose prior. `spread` (2,): standard deviations of the palm's
    translation, m, and rotation, rad, over one correlation time.
    `slowest` (3,) and `fastest` 1/s: limits of the rates of translation, rotation and angles. `lasting` (L, 3, 3):
    covariances of errors that last, m^2 of paint, rad^2 of a camera's turn, and `lasting_s`, one for all or (L,), their
    correlation times.
    """

    def __init__(self, dh: DhArrays, limits: Array, mean: Array, covariance: Array, spread: Array, slowest: Array,
                 fastest: float, lasting: Array, lasting_s: float | Array) -> None:
        self.dh, self._limits, self.mean = dh, limits, mean
        self._angles, self._information = covariance, np.linalg.inv(covariance)
        self._spread, self._slowest, self._fastest = spread, slowest, np.full(3, fastest)
        self._lasting_s = np.full(len(lasting), lasting_s, dtype=np.float64)
        self._marked = len(dh.point_row) > 0
        self.size = MOTION + 3 * len(lasting)
        self.stationary = np.zeros((self.size, self.size))
        for order, scale in enumerate((1.0, fastest**2 / 3.0, fastest**4 / 3.0)):  # value, velocity, acceleration
            first = POSE * order
            palm, angles = range(first, first + 6), slice(first + 6, first + POSE)
            self.stationary[palm, palm] = scale * np.repeat(spread, 3) ** 2
            self.stationary[angles, angles] = scale * covariance
        self.set_lasting(lasting)

    def set_lasting(self, lasting: Array) -> None:
        """Change the covariances (L, 3, 3) of the errors that last."""
        self._lasting = lasting
        for m in range(len(lasting)):
            own = slice(MOTION + 3 * m, MOTION + 3 * m + 3)
            self.stationary[own, own] = lasting[m]

    def start(self, world: Array, angles: Array, place_sd: tuple[float, float]) -> tuple[Array, Array]:
        """State and covariance of a hand at `world` (4, 4) with `angles` (21,), everything else as the stationary
        process has it. `place_sd`: standard deviations of translation, m, and rotation, rad."""
        state = state_at(world, angles, len(self.stationary) - MOTION)
        covariance = self.stationary.copy()
        covariance[range(6), range(6)] = np.repeat(place_sd, 3) ** 2
        return state, covariance

    def inflate(self, covariance: Array, chosen: slice, factor: float) -> None:
        """Multiply the covariance of some numbers of the pose and of their motion by `factor`, in place; no variance
        grows beyond the process's own."""
        for first in range(0, MOTION, POSE):
            place = slice(first + chosen.start, first + chosen.stop)
            most = np.diag(self.stationary)[place] / np.maximum(np.diag(covariance)[place], 1e-300)
            grown = np.sqrt(np.maximum(np.minimum(factor, most), 1.0))
            covariance[place] *= grown[:, None]
            covariance[:, place] *= grown

    def predict(self, state: Array, covariance: Array, dt_s: float) -> tuple[Array, Array]:
        """See `Process`. Long times are taken in steps in which the rates change little."""
        state, covariance = state.copy(), covariance.copy()
        if dt_s > 0.0:
            if self._marked:
                projection, null_covariance = _reset_null_space(state, self.dh, self._limits, self.mean,
                                                                self._information)
                _reset_covariance(covariance, projection, null_covariance, self.rates(state)[2])
            _predict(state, covariance, dt_s, self.mean, self._angles, self._information, self._spread,
                     self._slowest, self._fastest, self._lasting, self._lasting_s)
        return state, covariance

    def transition(self, state: Array, dt_s: float) -> Array:
        """See `Process`."""
        out, after = np.eye(self.size), state.copy()
        if dt_s > 0.0:
            if self._marked:
                _project(_reset_null_space(after, self.dh, self._limits, self.mean, self._information)[0], out)
            _transition(after, out, dt_s, self.mean, self._information, self._spread, self._slowest, self._fastest,
                        self._lasting_s)
        return out

    def advance(self, state: Array, dt_s: float) -> Array:
        """The mean of `state` after `dt_s`, without a null-space reset; its errors that last may be left out."""
        after = state.copy()
        if dt_s > 0.0:
            _transition(after, np.empty((self.size, 0)), dt_s, self.mean, self._information, self._spread,
                        self._slowest, self._fastest, self._lasting_s)
        return after

    def process_noise_sd(self, state: Array, dt_s: float) -> Array:
        """(27,) m and rad: standard deviation that the process noise adds to a pose in `dt_s`."""
        noise, rate, out = np.empty((3, 3)), self.rates(state), np.empty(POSE)
        for group, own in enumerate((slice(0, 3), slice(3, 6))):
            integrated_noise(rate[group], dt_s, noise)
            out[own] = self._spread[group] * math.sqrt(noise[0, 0])
        matern52_noise(rate[2], dt_s, noise)
        out[6:] = np.sqrt(noise[0, 0] * np.diag(self._angles))
        return out

    def rates(self, state: Array) -> Array:
        """(3,) 1/s: rates of translation, rotation and angles at the velocity and acceleration of `state`."""
        out = np.empty(3)
        _rates(state, self._information, self._spread, self._slowest, self._fastest, out)
        return out

    def moving_as(self, *states: Array) -> HandProcess:
        """The same process at the greatest rates of these states, whatever state is predicted."""
        out = copy.copy(self)
        out._slowest = out._fastest = np.max([self.rates(state) for state in states], axis=0)
        return out


@njit(cache=True)
def _rates(state, information, spread, slowest, fastest, out):
    """Rates at which the estimated velocity and acceleration are as large as they are on average."""
    v, a = state[STATE.velocity], state[STATE.acceleration]
    for group in range(2):
        speed = acceleration = 0.0
        for i in range(3 * group, 3 * group + 3):
            speed += v[i] ** 2
            acceleration += a[i] ** 2
        total = speed / spread[group] ** 2 + math.sqrt(acceleration / 3.0) / spread[group]
        out[group] = min(math.sqrt(slowest[group] ** 2 + total), fastest[group])
    speed = acceleration = 0.0
    for i in range(_COUNT):
        for j in range(_COUNT):
            speed += v[6 + i] * information[i, j] * v[6 + j]
            acceleration += a[6 + i] * information[i, j] * a[6 + j]
    total = 3.0 * speed / _COUNT + math.sqrt(max(acceleration, 0.0) / _COUNT)
    out[2] = min(math.sqrt(slowest[2] ** 2 + total), fastest[2])


@njit(cache=True)
def _predict(state, covariance, dt, mean, pose_covariance, information, spread, slowest, fastest, lasting, lasting_s):
    blocks, turn, noise, rate = np.empty((3, 3, 3)), np.empty((3, 3)), np.empty((3, 3, 3)), np.empty(3)
    left = dt
    while left > 0.0:
        _rates(state, information, spread, slowest, fastest, rate)
        step = min(left, 0.5 / rate.max())
        left -= step if left - step > 1e-9 else left
        _propagate(state, mean, rate, step, blocks, turn)
        _apply(blocks, turn, covariance)
        _transpose(covariance)
        _apply(blocks, turn, covariance)
        integrated_noise(rate[0], step, noise[0])
        integrated_noise(rate[1], step, noise[1])
        matern52_noise(rate[2], step, noise[2])
        for a in range(3):
            for b in range(3):
                for i in range(6):
                    group = _GROUPS[i]
                    covariance[POSE * a + i, POSE * b + i] += noise[group, a, b] * spread[group] ** 2
                for i in range(_COUNT):
                    for j in range(_COUNT):
                        covariance[POSE * a + 6 + i, POSE * b + 6 + j] += noise[2, a, b] * pose_covariance[i, j]
    _decay_lasting(state, covariance, np.repeat(np.exp(-dt / lasting_s), 3), lasting)


@njit(cache=True)
def _transition(state, out, dt, mean, information, spread, slowest, fastest, lasting_s):
    """Move `state` by `dt` s, and multiply `out` (n, C) by the transition from the left; C may be 0."""
    blocks, turn, rate = np.empty((3, 3, 3)), np.empty((3, 3)), np.empty(3)
    left = dt
    while left > 0.0:
        _rates(state, information, spread, slowest, fastest, rate)
        step = min(left, 0.5 / rate.max())
        left -= step if left - step > 1e-9 else left
        _propagate(state, mean, rate, step, blocks, turn)
        _apply(blocks, turn, out)
    for i in range(3 * lasting_s.shape[0]):
        out[MOTION + i] *= math.exp(-dt / lasting_s[i // 3])


@njit(cache=True)
def _propagate(state, mean, rate, dt, blocks, turn):
    """Move `state`; fill `blocks` (3, 3, 3), the transition of each group, and `turn` (3, 3), the palm's rotation."""
    integrated(rate[0], dt, blocks[0])
    integrated(rate[1], dt, blocks[1])
    matern52(rate[2], dt, blocks[2])
    step, angles, velocities, accelerations = (
        np.empty(POSE), state[STATE.angles], state[STATE.velocity], state[STATE.acceleration])
    for i in range(POSE):
        a = blocks[_GROUPS[i]]
        velocity, acceleration = velocities[i], accelerations[i]
        away = angles[i - 6] - mean[i - 6] if i >= 6 else 0.0
        step[i] = a[0, 1] * velocity + a[0, 2] * acceleration + (a[0, 0] - 1.0) * away
        velocities[i] = a[1, 0] * away + a[1, 1] * velocity + a[1, 2] * acceleration
        accelerations[i] = a[2, 0] * away + a[2, 1] * velocity + a[2, 2] * acceleration
    moved = retract(state[STATE.pose], step)
    world, after = pose_matrix(state), pose_matrix(moved)
    for i in range(3):
        for j in range(3):
            turn[i, j] = after[i, 0] * world[j, 0] + after[i, 1] * world[j, 1] + after[i, 2] * world[j, 2]
    state[STATE.pose] = moved


@njit(cache=True)
def _apply(blocks, turn, matrix):
    """Multiply `matrix` (n, C) by the transition from the left."""
    columns = matrix.shape[1]
    for i in range(POSE):
        a = blocks[_GROUPS[i]]
        p, v, c = matrix[i], matrix[POSE + i], matrix[2 * POSE + i]
        for j in range(columns):
            x, y, z = p[j], v[j], c[j]
            p[j] = a[0, 0] * x + a[0, 1] * y + a[0, 2] * z
            v[j] = a[1, 0] * x + a[1, 1] * y + a[1, 2] * z
            c[j] = a[2, 0] * x + a[2, 1] * y + a[2, 2] * z
    for j in range(columns):  # an error of the rotation turns with the palm
        x, y, z = matrix[3, j], matrix[4, j], matrix[5, j]
        for i in range(3):
            matrix[3 + i, j] = turn[i, 0] * x + turn[i, 1] * y + turn[i, 2] * z


@njit(cache=True)
def _transpose(matrix):
    for i in range(matrix.shape[0]):
        for j in range(i):
            matrix[i, j], matrix[j, i] = matrix[j, i], matrix[i, j]


@njit(cache=True)
def _decay_lasting(state, covariance, decay, lasting):
    size = covariance.shape[0]
    state[STATE.lasting] *= decay
    for i in range(MOTION, size):
        for j in range(size):
            covariance[i, j] *= decay[i - MOTION]
            covariance[j, i] *= decay[i - MOTION]
    for m in range(lasting.shape[0]):
        for i in range(3):
            for j in range(3):
                covariance[MOTION + 3 * m + i, MOTION + 3 * m + j] += (1.0 - decay[3 * m]**2) * lasting[m, i, j]


@njit(cache=True)
def _reset_null_space(state, dh, limits, mean, information):
    """Move `state` to the pose that is most probable by the markers' places and the pose prior. Returns
    `most_probable_pose`'s projection and null-space covariance."""
    world, angles, projection, null_covariance = most_probable_pose(dh, limits, mean, information, pose_matrix(state),
                                                                    state[STATE.angles].copy())
    set_pose(state, world)
    state[STATE.angles] = angles
    state[STATE.velocity] = np.dot(projection, state[STATE.velocity])
    state[STATE.acceleration] = np.dot(projection, state[STATE.acceleration])
    return projection, null_covariance


@njit(cache=True)
def _reset_covariance(covariance, projection, null_covariance, rate):
    """The covariance after a null-space reset. In the null space, pose, velocity and acceleration are those of a
    stationary Matérn 5/2 process."""
    _project(projection, covariance)
    _transpose(covariance)
    _project(projection, covariance)
    square = rate * rate
    for i in range(POSE):
        for j in range(POSE):
            covariance[i, j] += null_covariance[i, j]
            covariance[POSE + i, POSE + j] += square / 3.0 * null_covariance[i, j]
            covariance[2 * POSE + i, 2 * POSE + j] += square * square * null_covariance[i, j]
            covariance[i, 2 * POSE + j] -= square / 3.0 * null_covariance[i, j]
            covariance[2 * POSE + i, j] -= square / 3.0 * null_covariance[i, j]


@njit(cache=True)
def _project(projection, matrix):
    """Multiply pose, velocity and acceleration of `matrix` (n, C) by `projection` (27, 27) from the left."""
    for first in range(0, MOTION, POSE):
        matrix[first:first + POSE] = np.dot(projection, matrix[first:first + POSE])
