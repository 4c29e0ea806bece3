"""One robust adjustment of a hand's shape and of its pose at every instant to where its markers were seen.

Levenberg-Marquardt; the poses are eliminated instant by instant (Schur complement, Triggs et al. 2000), so the matrix
to solve has only the shape's unknowns. Huber's loss on each marker's distance by reweighting.

Neighbouring instants err alike: skin slides over bones in the same way whenever a finger bends, and nobody's joints go
together exactly as the natural pose says. So all instants together count only as much as `independent` ones, and what
the natural pose says of them as `habits` ones.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.hand_bundle_model import POSE, Linearised, Poses, expected, linearise
from rhot_app.calibration.hand_shape import HandUnknowns
from rhot_app.errors import CalibrationError
from rhot_app.hand.kinematics import TWIST
from rhot_app.hand.limits import natural_pose
from rhot_app.progress import Progress, silent

Array = NDArray[np.float64]

HUBER = 3.0
"""Markers farther off than this many standard deviations count less."""

HABITS = 3.0

LIMIT_SD = np.radians(5.0)
LIMIT_MARGIN = np.radians(10.0)
"""Joints may go this far past the base hand's limits, which nobody measured on this hand, and then pay."""

_STILL = 1e-3  # the step that makes the hand less than this more likely (logarithm) was the last
_DAMPING_MAX = 1e8


@dataclass(frozen=True, slots=True)
class Weights:
    """How much the terms count: `noise_m` standard deviation of a marker per axis; all instants together as
    `independent` ones, the natural pose in `habits` of them; `free_shape` False moves the poses only."""

    noise_m: float
    independent: float
    habits: float = HABITS
    free_shape: bool = True


@dataclass(frozen=True, slots=True)
class HandBundle:
    """The adjusted `vector` (G,) and `poses`, what is left (F, M, 3) m, seen minus expected in the world, NaN where
    unseen; `covariance` (G, G) of the vector; `cost` half the sum of squares; `steps` taken."""

    vector: Array
    poses: Poses
    residuals: Array
    covariance: Array
    cost: float
    steps: int


class HandAdjustment:
    """The cost of a hand and its poses given sights (F, M, 3) m, NaN = missing, and its descent."""

    def __init__(self, unknowns: HandUnknowns, seen: Array, weights: Weights) -> None:
        self._unknowns = unknowns
        self._seen = seen
        self._weights = weights
        self._limits = unknowns.limits + np.array([-LIMIT_MARGIN, LIMIT_MARGIN])
        self._natural = natural_pose()
        self._prior_information = np.linalg.inv(unknowns.prior.covariance)
        count = max(len(seen), 1)
        self._data_part = min(1.0, weights.independent / count)
        self._habit_part = min(1.0, weights.habits / count)

    def run(self, vector: Array, poses: Poses, steps: int, *, progress: Progress = silent) -> HandBundle:
        """Descend from a first guess. Raises CalibrationError when the sights do not hold the hand at all."""
        cost, damping, taken = self._cost(vector, poses), 1e-3, 0
        for taken in range(1, steps + 1):
            progress("fitting the hand", (taken - 1) / steps)
            system = self._system(vector, poses)
            accepted = False
            while damping < _DAMPING_MAX:
                shape_step, pose_steps = self._solve(*system, damping)
                trial_vector, trial_poses = vector + shape_step, poses.moved(pose_steps)
                trial = self._cost(trial_vector, trial_poses)
                if trial <= cost:
                    accepted = True
                    break
                damping = max(10.0 * damping, 1e-6)
            if not accepted:
                break
            gain, cost, vector, poses = cost - trial, trial, trial_vector, trial_poses
            damping = max(0.1 * damping, 1e-9)
            if gain < _STILL:
                break
        residuals = self._seen - expected(self._unknowns, vector, poses)
        return HandBundle(vector, poses, residuals, self._covariance(vector, poses), cost, taken)

    def _cost(self, vector: Array, poses: Poses) -> float:
        if not np.isfinite(vector).all() or (vector[:15] <= 1e-3).any():
            return np.inf
        distance = np.linalg.norm(self._seen - expected(self._unknowns, vector, poses), axis=2) / self._weights.noise_m
        distance = distance[np.isfinite(distance)]
        loss = np.where(distance <= HUBER, distance ** 2, HUBER * (2.0 * distance - HUBER)).sum()
        past = self._past_limits(poses.angles)[0]
        off = poses.angles - self._natural.mean
        habits = np.einsum("fi,ij,fj->", off, self._natural.information, off) + (past ** 2).sum()
        change = vector - self._unknowns.prior.mean
        return 0.5 * float(self._data_part * loss + self._habit_part * habits
                           + change @ self._prior_information @ change)

    def _past_limits(self, angles: Array) -> tuple[Array, Array]:
        """How far angles (F, 21) are past their limits, in standard deviations, signed; and where they are."""
        past = (np.maximum(angles - self._limits[:, 1], 0.0) + np.minimum(angles - self._limits[:, 0], 0.0)) / LIMIT_SD
        return past, past != 0.0

    def _system(self, vector: Array, poses: Poses) -> tuple[Array, Array, Array, Array, Array]:
        """Normal equations: per pose (F, 27, 27), between (F, 27, G), shape (G, G), and both right sides."""
        at: Linearised = linearise(self._unknowns, vector, poses)
        gap = self._seen - at.points
        seen = np.isfinite(gap[..., 0])
        gap = np.where(seen[..., None], gap, 0.0)
        distance = np.linalg.norm(gap, axis=2) / self._weights.noise_m
        weight = np.where(seen, self._data_part * np.minimum(1.0, HUBER / np.maximum(distance, 1e-12)), 0.0)
        root = np.sqrt(weight) / self._weights.noise_m
        count = len(gap)
        gap = (root[..., None] * gap).reshape(count, -1)
        per_pose = (root[..., None, None] * at.per_pose).reshape(count, -1, POSE)
        per_shape = (root[..., None, None] * at.per_shape).reshape(count, gap.shape[1], -1)
        turned = per_pose.transpose(0, 2, 1)
        pose_matrix, between = turned @ per_pose, turned @ per_shape
        pose_right = (turned @ gap[..., None])[..., 0]
        self._add_habits(poses.angles, pose_matrix, pose_right)
        flat = per_shape.reshape(-1, self._unknowns.size)
        shape_matrix = flat.T @ flat + self._prior_information
        shape_right = flat.T @ gap.ravel() - self._prior_information @ (vector - self._unknowns.prior.mean)
        return pose_matrix, between, shape_matrix, pose_right, shape_right

    def _add_habits(self, angles: Array, matrix: Array, right: Array) -> None:
        part, information = self._habit_part, self._natural.information
        past, outside = self._past_limits(angles)
        matrix[:, TWIST:, TWIST:] += part * information
        matrix[:, np.arange(TWIST, POSE), np.arange(TWIST, POSE)] += part * outside / LIMIT_SD ** 2
        matrix[:, np.arange(TWIST), np.arange(TWIST)] += 1e-3
        right[:, TWIST:] -= part * ((angles - self._natural.mean) @ information + past / LIMIT_SD)

    def _solve(self, pose_matrix: Array, between: Array, shape_matrix: Array, pose_right: Array, shape_right: Array,
               damping: float) -> tuple[Array, Array]:
        diagonal = np.arange(POSE)
        damped = pose_matrix.copy()
        damped[:, diagonal, diagonal] *= 1.0 + damping
        try:
            solved = np.linalg.solve(damped, np.concatenate([between, pose_right[..., None]], axis=2))
            if not self._weights.free_shape:
                return np.zeros(self._unknowns.size), solved[..., -1]
            flat = between.reshape(-1, self._unknowns.size)
            reduced = shape_matrix - flat.T @ solved[..., :-1].reshape(flat.shape)
            right = shape_right - flat.T @ solved[..., -1].ravel()
            reduced[np.diag_indices_from(reduced)] *= 1.0 + damping
            shape_step = np.asarray(np.linalg.solve(reduced, right), dtype=np.float64)
        except np.linalg.LinAlgError as exc:
            raise CalibrationError("the markers do not hold the hand: too few are seen at the same time.") from exc
        return shape_step, np.asarray(solved[..., -1] - solved[..., :-1] @ shape_step)

    def _covariance(self, vector: Array, poses: Poses) -> Array:
        pose_matrix, between, shape_matrix, *_ = self._system(vector, poses)
        flat = between.reshape(-1, self._unknowns.size)
        reduced = shape_matrix - flat.T @ np.linalg.solve(pose_matrix, between).reshape(flat.shape)
        return np.asarray(np.linalg.inv(reduced))
