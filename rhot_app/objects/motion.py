"""How a tracked object moves, and where its points are seen: a constant-velocity process on SE(3) and its residuals.

A state is 18 numbers: world_from_object (3, 4) row by row, then the velocity of the object's origin, m/s, and its
angular velocity, rad/s, both along the world's axes; then the turns of all cameras but one (`geometry.turns`). Its
tangent space begins with 12: translation and rotation about the object's origin, world axes, then the changes of the
two velocities.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.estimation.gauss_markov import white_acceleration
from rhot_app.estimation.layout import SE3, Layout, pose_matrix
from rhot_app.estimation.residual import UNIT, Rows, student
from rhot_app.estimation.se3 import PoseState, difference, exponential, pose_difference, retract
from rhot_app.geometry.camera import CameraModel, project_point
from rhot_app.geometry.turns import HELD_SD_RAD, TURN_S, fill_by_turn, turn_of, turned_pose, turns_covariance

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

_LAYOUT = Layout(pose=SE3, velocity=6)
POSE, VELOCITY = _LAYOUT.state("pose"), _LAYOUT.state("velocity")
POSE_ERROR, VELOCITY_ERROR = _LAYOUT.tangent("pose"), _LAYOUT.tangent("velocity")
"""Where pose and velocity lie in a state and in its tangent space."""

SIZE, TWIST = _LAYOUT.tangent_size, POSE_ERROR.stop
"""Numbers of a motion's tangent space, and of a pose's."""

TURNS = slice(VELOCITY.stop, None)
"""Where the cameras' turns lie in a state; in its tangent space they begin at SIZE."""

_TO_STATE = VELOCITY.stop - SIZE  # numbers of a state before the same one of its tangent space

REST_ACCELERATION = 0.3, 5.0
"""m/s^2 and rad/s^2 rms: accelerations of a held object at rest (`python benchmarks/object_motion.py`)."""

RATE = 20.0
"""1/s: rms acceleration over speed of a moving object. The twin's motion `fast` reaches 37 m/s^2 at 2 m/s; recorded
objects have 11 to 20 1/s at their highest speeds (`python benchmarks/object_motion.py`)."""

START_SPEED = 1.0, 5.0
"""m/s and rad/s: standard deviations of an object's velocity as it is first seen, half of the speed of the fastest hand
(the twin's motion `fast`)."""

CORNER_KERNEL = student(4.0)
"""Corners have heavy tails: fingers cut them. 4 degrees of freedom (Lange, Little and Taylor 1989)."""


@dataclass(frozen=True, slots=True)
class CameraArrays:
    """C cameras: `poses` (C, 3, 4) camera_from_world, m; `intrinsics` (C, 13) as `CameraModel`; `centres` (C, 3) m.
    They may be turned against the `reference` by standard deviations `turn_sd` (C,) rad."""

    poses: Array
    intrinsics: Array
    centres: Array
    reference: int
    turn_sd: Array

    @classmethod
    def of(cls, cameras: list[CameraModel], reference: int = 0, turn_sd: Array | None = None) -> CameraArrays:
        """The arrays of camera models; without `turn_sd` of an exact calibration."""
        return cls(np.array([one.camera_from_world[:3] for one in cameras]),
                   np.array([one.intrinsics for one in cameras]), np.array([one.centre for one in cameras]),
                   reference, np.full(len(cameras), HELD_SD_RAD) if turn_sd is None else turn_sd)

    @property
    def turns(self) -> int:
        """Numbers of the cameras' turns."""
        return 3 * (len(self.poses) - 1)

    def turn_at(self, camera: int) -> int:
        """Where this camera's turn begins in a state's tangent space, -1 for the reference."""
        return -1 if camera == self.reference else SIZE + 3 * int(turn_of(camera, self.reference))

    def turns_covariance(self, place: Array, *, sized: bool) -> Array:
        """(T, T) rad^2 of the turns of cameras that see an object at `place` (3,) m. `sized`: its own lengths are known
        so well that it shows every turn."""
        if sized:
            return np.diag(np.repeat(np.square(np.delete(self.turn_sd, self.reference)), 3))
        return turns_covariance(place, self.poses, self.reference, self.turn_sd)


def state_of(world_from_object: Array, turns: int = 0) -> Array:
    """(18 + T,) the state at a pose (4, 4), at rest, and T zeros."""
    return np.concatenate([world_from_object[:3].ravel(), np.zeros(6 + turns)])


class ObjectProcess(PoseState):
    """Implements `estimation.residual.Process`: white acceleration that is the stronger, the faster the object moves.

    An acceleration of variance s^2 along each axis and correlation time 1 / RATE is white noise of spectral density
    2 s^2 / RATE at longer times (Singer 1970). Its mean square is that at rest plus RATE^2 times the expected square of
    the speed, whose variance counts up to START_SPEED's. Turns of `cameras` change by what they are in TURN_S.
    """

    def __init__(self, cameras: CameraArrays | None = None, *, sized: bool = True) -> None:
        self._cameras, self._sized = cameras, sized
        self.size = SIZE + (0 if cameras is None else cameras.turns)

    def predict(self, state: Array, covariance: Array, dt_s: float) -> tuple[Array, Array]:
        """State and covariance (12 + T, 12 + T) after `dt_s`."""
        move, density = self.transition(state, dt_s), np.empty(TWIST)
        for first, rest, start in zip((0, 3), REST_ACCELERATION, START_SPEED, strict=True):
            own = slice(first, first + 3)
            speed = state[VELOCITY][own]
            spread = np.trace(covariance[VELOCITY_ERROR, VELOCITY_ERROR][own, own])
            square = rest**2 + RATE**2 * (speed @ speed + min(spread, 3.0 * start**2))
            density[own] = 2.0 / RATE * square / 3.0
        noise = np.zeros((self.size, self.size))
        noise[:SIZE, :SIZE], noise[SIZE:, SIZE:] = (white_acceleration(density, dt_s),
                                                    dt_s / TURN_S * self.turns_covariance(state))
        moved = retract(state, np.concatenate([dt_s * state[VELOCITY], np.zeros(self.size - TWIST)]))
        return moved, move @ covariance @ move.T + noise

    def turns_covariance(self, state: Array) -> Array:
        """(T, T) rad^2 of the turns before anything is seen of an object at `state`."""
        if self._cameras is None:
            return np.zeros((0, 0))
        return self._cameras.turns_covariance(pose_matrix(state)[:3, 3], sized=self._sized)

    def with_turns(self, state: Array, covariance: Array) -> tuple[Array, Array]:
        """A state and its covariance with turns of which nothing has been seen, if they have none."""
        missing = self.size - len(covariance)
        if missing == 0:
            return state, covariance
        out = np.zeros((self.size, self.size))
        out[:-missing, :-missing], out[-missing:, -missing:] = covariance, self.turns_covariance(state)
        return np.concatenate([state, np.zeros(missing)]), out

    def transition(self, state: Array, dt_s: float) -> Array:
        """(12 + T, 12 + T) Jacobian of `predict`'s state by `state`."""
        turn, left = np.empty((3, 3)), np.empty((3, 3))
        x, y, z = dt_s * state[VELOCITY][3:]
        exponential(x, y, z, turn, left)
        move = np.eye(self.size)
        move[POSE_ERROR, VELOCITY_ERROR] = dt_s * np.eye(6)
        move[POSE_ERROR, POSE_ERROR][3:, 3:] = turn
        move[POSE_ERROR, VELOCITY_ERROR][3:, 3:] = dt_s * left
        return move


class PointResidual:
    """Image points of an object in one camera; implements `estimation.residual.Residual`.

    `points` (K, 3) m, object frame, with `pixels` (K, 2), `covariances` (K, 2, 2) px^2 and `late_s` (K,), each point's
    time less the state's. `pose` (3, 4) camera_from_world, `intrinsics` (13,). `turn_at`: where the camera's turn
    begins in a state's tangent space, -1 for one that has none.
    """

    def __init__(self, points: Array, pixels: Array, covariances: Array, late_s: Array, pose: Array, intrinsics: Array,
                 turn_at: int = -1) -> None:
        self.points, self.pixels, self.covariances, self.late_s = points, pixels, covariances, late_s
        self.pose, self.intrinsics, self.turn_at = pose, intrinsics, turn_at
        self.whitening = np.linalg.inv(np.linalg.cholesky(covariances))

    def predict(self, state: Array) -> tuple[Array, Array]:
        """Pixels (K, 2), NaN behind the camera, and their Jacobians (K, 2, 12 + T)."""
        pixels = np.empty((len(self.points), 2))
        jacobian = np.zeros((len(self.points), 2, len(state) - _TO_STATE))
        _project(state, self.points, self.late_s, self.pose, self.intrinsics, self.turn_at, pixels, jacobian)
        return pixels, jacobian

    def linearise(self, state: Array) -> Rows:
        """Two rows for each point before the camera, by standard deviations."""
        pixels, jacobian = self.predict(state)
        ahead = np.isfinite(pixels[:, 0])
        whitening = self.whitening[ahead]
        error = (whitening @ (self.pixels - pixels)[ahead, :, None]).ravel()
        return Rows(error, (whitening @ jacobian[ahead]).reshape(-1, jacobian.shape[2]), UNIT, CORNER_KERNEL,
                    np.arange(0, len(error), 2))

    def only(self, chosen: NDArray[np.bool_]) -> PointResidual:
        """With the chosen points only."""
        return PointResidual(self.points[chosen], self.pixels[chosen], self.covariances[chosen], self.late_s[chosen],
                             self.pose, self.intrinsics, self.turn_at)


class VelocityPrior:
    """An object that is first seen moves by START_SPEED; implements `estimation.residual.Residual`."""

    def linearise(self, state: Array) -> Rows:
        """Six rows, by standard deviations."""
        scale = 1.0 / np.repeat(START_SPEED, 3)
        jacobian = np.zeros((TWIST, len(state) - _TO_STATE))
        jacobian[:, VELOCITY_ERROR] = np.diag(scale)
        return Rows(-scale * state[VELOCITY], jacobian, UNIT, first=np.zeros(1, np.int64))


@dataclass(frozen=True, slots=True)
class TurnsPrior:
    """The cameras' turns are none, with a `covariance` (T, T) rad^2; implements `estimation.residual.Residual`."""

    covariance: Array

    def linearise(self, state: Array) -> Rows:
        """T rows, rad."""
        turns = state[TURNS]
        return Rows(-turns, np.eye(len(turns), SIZE + len(turns), SIZE), self.covariance, first=np.zeros(1, np.int64))


@dataclass(frozen=True, slots=True)
class StatePrior:
    """A prediction: `state` (18 + T,) with `covariance` (12 + T, 12 + T); implements `estimation.residual.Residual`."""

    state: Array
    covariance: Array

    def linearise(self, state: Array) -> Rows:
        """A row for each number; their Jacobian is 1 to first order in the deviation."""
        return Rows(difference(self.state, state), np.eye(len(self.covariance)), self.covariance,
                    first=np.zeros(1, np.int64))


@dataclass(frozen=True, slots=True)
class PoseResidual:
    """A pose that another tracker measured; implements `estimation.residual.Residual`.

    `world_from_object` (4, 4); `covariance` (6, 6) m^2 and rad^2, translation, then rotation, world axes.
    """

    world_from_object: Array
    covariance: Array

    def linearise(self, state: Array) -> Rows:
        """Six rows: translation, m, and rotation, rad.

        The rotation's error is log(R_measured R^T); its Jacobian by the state is the inverse right one, 1 to first
        order in an error that a gate keeps small.
        """
        error = np.array(pose_difference(self.world_from_object, pose_matrix(state)))
        return Rows(error, np.eye(TWIST, len(state) - _TO_STATE), self.covariance, first=np.zeros(1, np.int64))


@njit(cache=True)
def _project(state: Array, points: Array, late_s: Array, pose: Array, intrinsics: Array, turn_at: int, pixels: Array,
             jacobian: Array) -> None:
    """Fill `pixels` (K, 2) and `jacobian` (K, 2, 12 + T), which is zero, of points seen `late_s` (K,) after the state's
    instant."""
    turn, left, by_world, by_place = np.empty((3, 3)), np.empty((3, 3)), np.empty((2, 3)), np.empty((3, 12))
    arm, here, y = np.empty(3), np.empty(3), np.empty(3)
    world, velocity = pose_matrix(state), state[VELOCITY]
    given = np.zeros(3)
    if turn_at >= 0:
        given[:] = state[TURNS][turn_at - SIZE:turn_at - SIZE + 3]
    camera, of_turn = turned_pose(pose, given)
    for n in range(points.shape[0]):
        late = late_s[n]
        exponential(late * velocity[3], late * velocity[4], late * velocity[5], turn, left)
        for i in range(3):
            y[i] = world[i, 0] * points[n, 0] + world[i, 1] * points[n, 1] + world[i, 2] * points[n, 2]
        for i in range(3):
            arm[i] = turn[i, 0] * y[0] + turn[i, 1] * y[1] + turn[i, 2] * y[2]
            here[i] = world[i, 3] + late * velocity[i] + arm[i]
        if not project_point(here[0], here[1], here[2], camera, intrinsics, pixels[n], by_world):
            pixels[n, :] = math.nan
            jacobian[n, :, :] = math.nan
            continue
        for k in range(3):  # the place's change: translation, -[arm]x turn, velocity, -[arm]x left late
            for i in range(3):
                by_place[i, k] = 1.0 if i == k else 0.0
                by_place[i, 6 + k] = late if i == k else 0.0
            tx, ty, tz = turn[0, k], turn[1, k], turn[2, k]
            by_place[0, 3 + k] = ty * arm[2] - tz * arm[1]
            by_place[1, 3 + k] = tz * arm[0] - tx * arm[2]
            by_place[2, 3 + k] = tx * arm[1] - ty * arm[0]
            lx, ly, lz = late * left[0, k], late * left[1, k], late * left[2, k]
            by_place[0, 9 + k] = ly * arm[2] - lz * arm[1]
            by_place[1, 9 + k] = lz * arm[0] - lx * arm[2]
            by_place[2, 9 + k] = lx * arm[1] - ly * arm[0]
        for axis in range(2):
            for k in range(12):
                jacobian[n, axis, k] = (by_world[axis, 0] * by_place[0, k] + by_world[axis, 1] * by_place[1, k]
                                        + by_world[axis, 2] * by_place[2, k])
            if turn_at >= 0:
                fill_by_turn(here, camera, of_turn, by_world[axis], jacobian[n, axis, turn_at:turn_at + 3])
