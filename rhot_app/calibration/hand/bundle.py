"""One robust adjustment of a hand's shape and of its pose at every instant to where its markers were seen.

Levenberg-Marquardt; the poses are eliminated instant by instant (Schur complement, Triggs et al. 2000), so the matrix
to solve has only the shape's unknowns. Huber's loss on each marker's distance by reweighting.

Neighbouring instants err alike: skin slides over bones in the same way whenever a finger bends, and nobody's joints go
together exactly as the pose prior says. So all instants together count only as much as `independent` ones, and the
pose prior on them as `pose_prior_weight` ones.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.hand.bundle_model import POSE, Linearised, Poses, expected, linearise
from rhot_app.calibration.hand.shape import BONE_COUNT, HandUnknowns
from rhot_app.errors import CalibrationError
from rhot_app.estimation.least_squares import minimise
from rhot_app.hand.kinematics import TWIST
from rhot_app.hand.limits import PERSON_LIMIT_SD_RAD, pose_prior
from rhot_app.progress import Progress, silent

# -- bias by incidental parameters -------------------------------------------------------------------------------------
# Each instant brings 27 unknowns of its own, so there is never more than a handful of markers to average a pose's
# noise. Points go round joints on curves: a pose that is off by its noise puts them beside their curve on average, on
# the outer side, and thousands of instants agree on that. Joints move towards the markers until it fits: a last
# phalanx came out 3 to 8 mm too short at 0.2 mm of noise (incidental parameters, Neyman and Scott 1948). To second
# order the mean of what is left of a marker is half the trace of its second derivative by the pose times the pose's
# covariance: `bend`. Positions corrected by it show the shape with little bias.

Array = NDArray[np.float64]

_FARTHEST = 0.3
"""Radians, m: what is so uncertain is not known to second order; it is taken to be this uncertain only."""

DRAWS = 4
"""Of random poses; every instant draws its own, so few are enough."""

_SEED = 1


def bend(unknowns: HandUnknowns, vector: Array, poses: Poses, covariances: Array) -> Array:
    """(F, M, 3) m, by how much markers are off on average when poses scatter with `covariances` (F, 27, 27)."""
    middle = expected(unknowns, vector, poses)
    roots = _roots(covariances)
    total = np.zeros_like(middle)
    for k in range(POSE):
        for sign in (1.0, -1.0):
            total += expected(unknowns, vector, poses.moved(sign * roots[..., k])) - middle
    return np.asarray(0.5 * total)


def scatter_of(covariances: Array) -> Iterator[Array]:
    """Some draws (F, 27) of poses that scatter with `covariances` (F, 27, 27); by sign only, which has no tails."""
    rng = np.random.default_rng(_SEED)
    roots = _roots(covariances)
    for _ in range(DRAWS):
        yield np.asarray((roots @ rng.choice([-1.0, 1.0], size=(len(roots), POSE, 1)))[..., 0])


def _roots(covariances: Array) -> Array:
    """(F, 27, 27) whose columns are steps of one standard deviation, no longer than what second order holds for."""
    values, axes = np.linalg.eigh(covariances)
    return np.asarray(axes * np.minimum(np.sqrt(np.maximum(values, 0.0)), _FARTHEST)[:, None, :])


# -- robust adjustment of shape and poses ------------------------------------------------------------------------------

HUBER = 3.0
"""Markers farther off than this many standard deviations count less."""

POSE_PRIOR_WEIGHT = 3.0
"""How many independent instants all together count against the pose prior."""

LIMIT_MARGIN_RAD = 2.0 * PERSON_LIMIT_SD_RAD
"""Joints may go this far past the base hand's limits, which nobody measured on this hand, and then pay."""

_STILL = 1e-3  # the step that makes the hand less than this more likely (logarithm) was the last
_INNER_STEPS = 3  # of the poses for each of the shape
_DIAGONAL = np.arange(POSE)


@dataclass(frozen=True, slots=True)
class Weights:
    """How much the terms count: `noise_m` standard deviation of a marker per axis; all instants together as
    `independent` ones, the pose prior in `pose_prior_weight` of them; `fresh`: the part of the markers' variance that
    is noise, anew at every instant."""

    noise_m: float
    independent: float
    pose_prior_weight: float = POSE_PRIOR_WEIGHT
    fresh: float = 1.0


@dataclass(frozen=True, slots=True)
class HandBundle:
    """The adjusted `vector` (G,) and `poses`, what is left (F, M, 3) m, seen minus expected in the world, NaN where
    unseen; `cost` half the sum of squares."""

    vector: Array
    poses: Poses
    residuals: Array
    cost: float


@dataclass(frozen=True, slots=True)
class Reduced:
    """Normal equations of the shape once the poses are eliminated: `matrix` (G, G), `right` (G,); then an instant's
    pose moves by `alone` (F, 27) less `coupled` (F, 27, G) times the shape's step."""

    matrix: Array
    right: Array
    alone: Array
    coupled: Array


class HandAdjustment:
    """The cost of a hand and its poses given marker positions (F, M, 3) m, NaN = missing, and its descent."""

    def __init__(self, unknowns: HandUnknowns, seen: Array, weights: Weights) -> None:
        self._unknowns = unknowns
        self._seen = seen
        self._weights = weights
        self._limits = unknowns.limits + np.array([-LIMIT_MARGIN_RAD, LIMIT_MARGIN_RAD])
        self._pose_prior = pose_prior()
        self._prior_information = np.linalg.inv(unknowns.prior.covariance)
        count = max(len(seen), 1)
        self._data_part = min(1.0, weights.independent / count)
        self._prior_part = min(1.0, weights.pose_prior_weight / count)

    def run(self, vector: Array, poses: Poses, steps: int, *, progress: Progress = silent) -> HandBundle:
        """Descend from a first guess. Raises CalibrationError when the markers do not hold the hand at all.

        Every trial of a shape lets each instant find its own pose first: one stretched finger, whose joints hardly
        show, would else hold up the shape for all.
        """
        found, _ = minimise(_Iterate(self, vector, poses), steps, _STILL,
                            watch=lambda taken: progress("fitting the hand", taken / steps))
        residuals = self._seen - expected(self._unknowns, found.vector, found.poses)
        return HandBundle(found.vector, found.poses, residuals, found.cost)

    def pose_covariances(self, vector: Array, poses: Poses) -> Array:
        """(F, 27, 27), how every pose scatters by the noise of its own instant."""
        at = linearise(self._unknowns, vector, poses, per_shape=False)
        information = self._pose_system(vector, poses, at)[0]
        return np.asarray(self._weights.fresh * self._data_part * np.linalg.inv(information))

    def covariance(self, vector: Array, poses: Poses) -> Array:
        """(G, G) of the shape. Poses that scatter by their noise look like movement, which would show the joints: what
        that adds to the information is taken off again, as far as the prior, which nobody can know less than."""
        information = self.reduced(vector, poses).matrix - self._pretended(vector, poses)
        half = np.linalg.cholesky(self._unknowns.prior.covariance)
        values, axes = np.linalg.eigh(half.T @ information @ half)
        root = half @ axes / np.sqrt(np.maximum(values, 1.0))
        return np.asarray(root @ root.T)

    def settle(self, vector: Array, poses: Poses, steps: int) -> Poses:
        """The poses after so many steps of their own, each instant with its own damping, while the shape stays."""
        damping = np.full(len(self._seen), 1e-4)
        costs = self._instant_costs(vector, poses)
        for _ in range(steps):
            matrix, right = self._pose_system(vector, poses, linearise(self._unknowns, vector, poses, per_shape=False))
            matrix[:, _DIAGONAL, _DIAGONAL] *= 1.0 + damping[:, None]
            trial = poses.moved(_solve(matrix, right[..., None])[..., 0])
            trial_costs = self._instant_costs(vector, trial)
            better = trial_costs <= costs
            gain = float((costs - trial_costs)[better].sum())
            poses, costs = trial.where(better, poses), np.where(better, trial_costs, costs)
            damping = np.where(better, 0.1 * damping, np.maximum(10.0 * damping, 1e-2))
            if gain < _STILL and better.all():
                break
        return poses

    def after_step(self, reduced: Reduced, damping: float, vector: Array, poses: Poses) -> tuple[Array, Poses]:
        """The hand after one damped step."""
        matrix = reduced.matrix.copy()
        matrix[np.diag_indices_from(matrix)] *= 1.0 + damping
        shape_step = _solve(matrix, reduced.right)
        moved = poses.moved(reduced.alone - reduced.coupled @ shape_step)
        vector = vector + shape_step
        if not _possible(vector):
            return vector, poses
        better = self._instant_costs(vector, moved) <= self._instant_costs(vector, poses)
        return vector, self.settle(vector, moved.where(better, poses), _INNER_STEPS)

    def cost(self, vector: Array, poses: Poses) -> float:
        """Half the sum of squares; infinite where no hand is possible."""
        if not _possible(vector):
            return np.inf
        change = vector - self._unknowns.prior.mean
        return float(self._instant_costs(vector, poses).sum() + 0.5 * change @ self._prior_information @ change)

    def _instant_costs(self, vector: Array, poses: Poses) -> Array:
        """(F,) what each instant adds to the cost."""
        distance = np.linalg.norm(self._seen - expected(self._unknowns, vector, poses), axis=2) / self._weights.noise_m
        loss = np.nansum(np.where(distance <= HUBER, distance ** 2, HUBER * (2.0 * distance - HUBER)), axis=1)
        past = self._past_limits(poses.angles)[0]
        off = poses.angles - self._pose_prior.mean
        prior = ((off @ self._pose_prior.information) * off).sum(axis=1) + (past ** 2).sum(axis=1)
        return np.asarray(0.5 * (self._data_part * loss + self._prior_part * prior))

    def _past_limits(self, angles: Array) -> tuple[Array, Array]:
        """How far angles (F, 21) are past their limits, in standard deviations, signed; and where they are."""
        past = np.maximum(angles - self._limits[:, 1], 0.0) + np.minimum(angles - self._limits[:, 0], 0.0)
        return past / PERSON_LIMIT_SD_RAD, past != 0.0

    def reduced(self, vector: Array, poses: Poses) -> Reduced:
        """The normal equations of the shape."""
        at = linearise(self._unknowns, vector, poses)
        root, gap, per_pose = self._weighed(at)
        per_shape = (root[..., None, None] * at.per_shape).reshape(*gap.shape, -1)
        pose_matrix, pose_right = self._pose_system(vector, poses, at)
        between = per_pose.transpose(0, 2, 1) @ per_shape
        solved = _solve(pose_matrix, np.concatenate([between, pose_right[..., None]], axis=2))
        alone, coupled = solved[..., -1], solved[..., :-1]
        flat, tied = per_shape.reshape(-1, self._unknowns.size), between.reshape(-1, self._unknowns.size)
        matrix = flat.T @ flat + self._prior_information - tied.T @ coupled.reshape(tied.shape)
        change = vector - self._unknowns.prior.mean
        right = flat.T @ gap.ravel() - self._prior_information @ change - tied.T @ alone.ravel()
        return Reduced(np.asarray(matrix), np.asarray(right), alone, coupled)

    def _pretended(self, vector: Array, poses: Poses) -> Array:
        """(G, G) of the information, what comes from the scatter of the poses only."""
        at = linearise(self._unknowns, vector, poses, per_shape=False)
        root, _, per_pose = self._weighed(at)
        pose_matrix, _ = self._pose_system(vector, poses, at)
        total = np.zeros((self._unknowns.size, self._unknowns.size))
        for scatter in scatter_of(self.pose_covariances(vector, poses)):
            there, back = (linearise(self._unknowns, vector, poses.moved(sign * scatter)).per_shape
                           for sign in (1.0, -1.0))
            change = (0.5 * root[..., None, None] * (there - back)).reshape(len(root), -1, self._unknowns.size)
            between = per_pose.transpose(0, 2, 1) @ change
            flat, tied = change.reshape(-1, self._unknowns.size), between.reshape(-1, self._unknowns.size)
            total += flat.T @ flat - tied.T @ _solve(pose_matrix, between).reshape(tied.shape)
        return np.asarray(total / DRAWS)

    def _pose_system(self, vector: Array, poses: Poses, at: Linearised) -> tuple[Array, Array]:
        """Normal equations of each pose by itself, (F, 27, 27) and (F, 27)."""
        _, gap, per_pose = self._weighed(at)
        turned = per_pose.transpose(0, 2, 1)
        matrix, right = turned @ per_pose, (turned @ gap[..., None])[..., 0]
        self._add_pose_prior(poses.angles, matrix, right)
        return matrix, right

    def _weighed(self, at: Linearised) -> tuple[Array, Array, Array]:
        """Roots of the weights (F, M), and weighed by them: gaps (F, 3 M) and their change per pose (F, 3 M, 27)."""
        gap = self._seen - at.points
        seen = np.isfinite(gap[..., 0])
        gap = np.where(seen[..., None], gap, 0.0)
        distance = np.linalg.norm(gap, axis=2) / self._weights.noise_m
        weight = np.where(seen, self._data_part * np.minimum(1.0, HUBER / np.maximum(distance, 1e-12)), 0.0)
        root = np.sqrt(weight) / self._weights.noise_m
        count = len(gap)
        return (root, (root[..., None] * gap).reshape(count, -1),
                (root[..., None, None] * at.per_pose).reshape(count, -1, POSE))

    def _add_pose_prior(self, angles: Array, matrix: Array, right: Array) -> None:
        part, information = self._prior_part, self._pose_prior.information
        past, outside = self._past_limits(angles)
        matrix[:, TWIST:, TWIST:] += part * information
        matrix[:, np.arange(TWIST, POSE), np.arange(TWIST, POSE)] += part * outside / PERSON_LIMIT_SD_RAD ** 2
        matrix[:, np.arange(TWIST), np.arange(TWIST)] += 1e-3
        right[:, TWIST:] -= part * ((angles - self._pose_prior.mean) @ information + past / PERSON_LIMIT_SD_RAD)


class _Iterate:
    """Implements `Iterate`: a hand and its poses."""

    def __init__(self, adjustment: HandAdjustment, vector: Array, poses: Poses) -> None:
        self._adjustment, self.vector, self.poses = adjustment, vector, poses
        self.cost = adjustment.cost(vector, poses)

    def moved(self, damping: float) -> _Iterate:
        return _Iterate(self._adjustment, *self._adjustment.after_step(self._reduced, damping, self.vector, self.poses))

    @cached_property
    def _reduced(self) -> Reduced:
        return self._adjustment.reduced(self.vector, self.poses)


def _possible(vector: Array) -> bool:
    return bool(np.isfinite(vector).all() and (vector[:BONE_COUNT] > 1e-3).all())


def _solve(matrix: Array, right: Array) -> Array:
    try:
        return np.asarray(np.linalg.solve(matrix, right), dtype=np.float64)
    except np.linalg.LinAlgError as exc:
        raise CalibrationError("the markers do not hold the hand: too few are seen at the same time.") from exc
