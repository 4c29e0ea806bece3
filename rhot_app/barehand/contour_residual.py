"""The residual of one camera's edges: contour points of the hand against the edges that were found near them.

On a slice, the hand's edge is one of the edges found, or none of them (Isard and Blake 1998). Clutter is a Poisson
process along the slice. An edge is weighted by the probability, at the present state, that it is the hand's. So a slice
without edges, or with edges of other objects only, changes nothing.

The lengths and radii of the phalanges are uncertain parts of the state (`tracker.PHALANGES`). Two opposite edges then
determine the axis, and one edge alone is less certain. The rest of the surface's error is partly common to one side of
a capsule, in all cameras: that nuisance parameter is marginalised. The error persists while the hand shows the same
side, so images within that time count as one.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.barehand.contours import COLUMNS, INNER, ContourPoints, contour_on_slices
from rhot_app.barehand.surface import FOREARM, PALM, SHAPE, Surface
from rhot_app.estimation import residual
from rhot_app.estimation.residual import UNIT, Rows
from rhot_app.hand.limits import LIMIT_SD_RAD
from rhot_app.hand.motion.hand_process import ACCELERATION, ANGLES, BIAS, MOTION, POSE, VELOCITY
from rhot_node.detect.edges import Edges

Array = NDArray[np.float64]

SHAPE_SD_M = 0.7e-3
"""m: standard deviation of a finger's skin about the model's surface: creases, joints, nails and pads."""

FLESHY = 2.0
"""Factor on SHAPE_SD_M for palm and forearm, whose flesh has no capsules of its own. Measured between the twin's hand
and the tracker's: 1.0 to 1.4 mm, and 0.7 mm on fingers."""

COMMON = 0.5
"""Part of the variance that is common to one side of a capsule. Measured in the same way: 0.5 mm between the sides of
the fingers, and 0.5 mm within one side."""

MISSED = np.array([0.1, 0.4])
"""Probabilities of a missed detection: that a silhouette, and an edge within the hand, is no edge of the image."""

GROUPS = FOREARM + 1
"""Number of groups of capsules: five fingers, palm and forearm."""

DEGREES = 4.0
"""Degrees of freedom of Student's t distribution of edges about the contour (Lange, Little and Taylor 1989)."""

UNSURE = 0.02
"""Probability that a foreground probability of 0 or 1 is wrong."""

SAME_TIME_S = 1e-3
"""s: images nearer in time count as simultaneous: a hand at 2 m/s moves by 2 mm."""

SIDES = 4
"""Kinds of contour points of a capsule (`contours.SIDE` and the others)."""

_STUDENT_4 = 0.375  # density at 0 of Student's t of 4 degrees of freedom
_LEAST_CLUTTER = 1e-3  # edges per px
_RIDGE = 1e-3  # 1/m^2 and 1/rad^2: negligible, but keeps the matrix regular

Predicted = tuple[Array, Array, NDArray[np.bool_]]


class ContourFrame:
    """Implements `estimation.residual.Residual`: one camera's slices, the edges on them, and where the contour is.

    `slices` (K, 5) as `find_edges` takes them; `expected_sd` (K,) px: of the contour along each slice.
    `slice_counts` (GROUPS, 2): of each finger, the palm and the forearm, the slices on which the contour was found, and
    all, when last linearised. `repeated`: number of correlated images that count as one. `confusable`: part of the
    slices on which the contour may be confused with its neighbour's, as it was predicted so uncertainly.
    """

    def __init__(self, surface: Surface, points: ContourPoints, pose: Array, intrinsics: Array, slices: Array,
                 expected_sd: Array, late_s: Array, size_column: int, repeated: float = 1.0) -> None:
        self.surface, self.points, self.pose, self.intrinsics = surface, points, pose, intrinsics
        self.slices, self.expected_sd, self.late_s, self.size_column = slices, expected_sd, late_s, size_column
        self.pixel, self.normal = slices[:, :2].copy(), slices[:, 2:4].copy()
        fleshy = np.where(surface.group[points.capsule] < PALM, 1.0, FLESHY)
        variance = repeated * (SHAPE_SD_M * fleshy * points.scale) ** 2
        self.repeated = repeated
        self.shape_variance, self.side_sd = (1.0 - COMMON) * variance, np.sqrt(COMMON * variance)
        self.edges: Edges | None = None
        self.clutter = np.empty((0, 0))
        self.slice_counts = np.zeros((GROUPS, 2))
        self.confusable = 0.0

    def observe(self, edges: Edges) -> None:
        """Set the edges of the slices. The clutter density at an edge is that of the edges at least as strong."""
        self.edges = edges
        length = float(np.sum(2.0 * self.slices[:, 4] + 1.0))
        valid = np.arange(edges.offset.shape[1]) < edges.number[:, None]
        strength = np.abs(edges.strength)
        stronger = len(strength[valid]) - np.searchsorted(np.sort(strength[valid]), strength)
        self.clutter = np.maximum(stronger / max(length, 1.0), _LEAST_CLUTTER)

    def predict(self, state: Array) -> Predicted:
        """The contour on each slice: (K,) px from the slice's centre, its derivative (K, COLUMNS), and whether it
        exists."""
        count = len(self.slices)
        offset, rows = np.zeros(count), np.zeros((count, COLUMNS))
        good = np.zeros(count, np.bool_)
        p = self.points
        contour_on_slices(self.surface, state, self._size(state), self.pose, self.intrinsics, self.late_s, p.capsule,
                          p.kind, p.along, self.pixel, self.normal, offset, rows, good)
        return offset, rows, good

    def _size(self, state: Array) -> Array:
        first = BIAS - MOTION + self.size_column
        return np.ascontiguousarray(state[first:first + SHAPE])

    def weights(self, state: Array) -> tuple[Array, Array]:
        """(K, EDGES_MAX) probabilities that each edge is the hand's, and (K,) px from the contour to their mean."""
        assert self.edges is not None
        offset, _, good = self.predict(state)
        found = np.zeros(self.edges.offset.shape)
        error = np.full(len(offset), np.nan)
        for s in range(len(offset)):
            if good[s]:
                _, weight, mean, _ = _mix(self.edges.number[s], self.edges.offset[s], self.edges.sd[s],
                                          self.edges.inside[s], self.edges.outside[s], self.points.behind[s],
                                          offset[s], self.shape_variance[s], self.expected_sd[s] ** 2,
                                          self.clutter[s], found[s])
                if weight > 0.0:
                    error[s] = mean
        return found, error

    def linearise(self, state: Array) -> Rows:
        """COLUMNS rows with the information of all slices, and one with the rest of their cost."""
        return Contours([self]).linearise(state)

    def add_sides(self, state: Array, sides: Array) -> Predicted:
        """Add the gradient and the information of the surface's offset along each side, in standard deviations, to the
        last two columns of `sides` (S, N + 2). Returns the predicted contours (`predict`)."""
        assert self.edges is not None, "the edges of the slices have not been observed"
        count, p, e = len(self.slices), self.points, self.edges
        offset, rows, good = np.zeros(count), np.zeros((count, COLUMNS)), np.zeros(count, np.bool_)
        _add_sides(self.surface, state, self._size(state), self.pose, self.intrinsics, self.late_s, p.capsule,
                   p.kind, p.along, p.behind, self.shape_variance, self.side_sd, self.pixel, self.normal, e.number,
                   e.offset, e.sd, e.inside, e.outside, self.expected_sd, self.clutter, offset, rows, good, sides)
        return offset, rows, good

    def gather(self, predicted: Predicted, nuisance: Array, information: Array, pull: Array, sides: Array) -> float:
        """Add the lower triangle of the slices' `information` (N, N), their gradient to `pull` (N,), and to `sides`
        (S, N + 2) the terms for `_marginalise`; returns their cost. The derivatives in `predicted` have N columns."""
        assert self.edges is not None, "the edges of the slices have not been observed"
        p, e = self.points, self.edges
        self.slice_counts = np.zeros((GROUPS, 2))
        return float(_gather(
            self.surface, *predicted, p.capsule, p.kind, p.behind, self.shape_variance, self.side_sd, e.number,
            e.offset, e.sd, e.inside, e.outside, self.expected_sd, self.clutter, nuisance, information, pull,
            self.slice_counts, sides))


def in_a_fit(frame: ContourFrame) -> ContourFrame:
    """The frame for a fit of one shape to several instants, which are too far apart to be correlated. All variance of a
    slice is its own: an offset of each side that is free at every instant would absorb the bend of a finger."""
    out = copy.copy(frame)
    out.shape_variance = (frame.shape_variance + frame.side_sd**2) / frame.repeated
    out.side_sd, out.repeated = np.zeros_like(frame.side_sd), 1.0
    return out


class Contours:
    """Implements `Residual`: the frames of some cameras, each at its own time.

    A given `velocity` (POSE,), with its covariance, moves the frames to the state's instant. The frames do not update
    it: cameras disagree by a fraction of a millimetre of surface or calibration, which within milliseconds would be a
    high speed. The velocity's error counts as independent of the frames', even after a pass over the same frames.
    Without it, the state's own velocity moves them. No row has a derivative by a velocity.
    """

    def __init__(self, frames: Sequence[ContourFrame], velocity: tuple[Array, Array] | None = None) -> None:
        self.frames = [frame for frame in frames if len(frame.slices)]
        self._velocity: tuple[Array, Array] | None = None
        if velocity is not None:
            self.move_by(velocity)

    def move_by(self, velocity: tuple[Array, Array]) -> None:
        """Move the frames by another velocity (POSE,), with its covariance."""
        self._velocity = velocity[0], _root(velocity[1])

    def linearise(self, state: Array) -> Rows:
        """COLUMNS whitened rows of the information of all slices, and one of the remaining cost."""
        size = len(state) - BIAS + MOTION
        if not self.frames:
            return Rows(np.empty(0), np.empty((0, size)), UNIT)
        root, late_s = None, max(abs(float(frame.late_s.mean())) for frame in self.frames)
        if self._velocity is not None:
            state, root = state.copy(), self._velocity[1] if late_s > SAME_TIME_S else None
            state[VELOCITY:ACCELERATION] = self._velocity[0]
        return compressed(*gathered(self.frames, state, root), size, self.frames[0].size_column)


def velocity_of(estimate: tuple[Array, Array]) -> tuple[Array, Array]:
    """The velocity (POSE,) in a state with its covariance, and its own."""
    own = slice(POSE, 2 * POSE)
    return estimate[0][VELOCITY:ACCELERATION].copy(), estimate[1][own, own].copy()


def _root(covariance: Array) -> Array:
    """A square root R of a covariance of any rank: R R^T is the covariance."""
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


def gathered(frames: Sequence[ContourFrame], state: Array, velocity_root: Array | None = None
             ) -> tuple[Array, Array, float]:
    """Information (COLUMNS, COLUMNS), its lower triangle only, gradient (COLUMNS,) and cost of all slices of some
    cameras.

    The surface's offset along each side is marginalised, linearised at a Gauss-Newton step from 0. So is the velocity's
    error in frames of other instants. `velocity_root` (POSE, POSE): a square root of its covariance.
    """
    count = COLUMNS + (0 if velocity_root is None else POSE)
    information, pull = np.zeros((count, count)), np.zeros(count)
    sides = np.zeros((SIDES * len(frames[0].surface.row), count + 2))
    predicted = [frame.add_sides(state, sides) for frame in frames]
    nuisance = sides[:, -2] / (1.0 + sides[:, -1])
    sides[:] = 0.0
    cost = float(nuisance @ nuisance)
    for frame, (offset, rows, good) in zip(frames, predicted, strict=True):
        if velocity_root is not None:
            rows = np.hstack([rows, frame.late_s.mean() * (rows[:, :POSE] @ velocity_root)])
        cost += frame.gather((offset, rows, good), nuisance, information, pull, sides)
    _marginalise(sides, information, pull)
    if velocity_root is not None:
        own, cross = information[COLUMNS:, COLUMNS:], information[COLUMNS:, :COLUMNS]
        own = np.tril(own) + np.tril(own, -1).T + np.eye(POSE)
        solved = np.linalg.solve(own, np.column_stack([cross, pull[COLUMNS:]]))
        cost -= float(pull[COLUMNS:] @ solved[:, -1])
        information, pull = (information[:COLUMNS, :COLUMNS] - cross.T @ solved[:, :-1],
                             pull[:COLUMNS] - cross.T @ solved[:, -1])
    return information, pull, cost


def compressed(information: Array, pull: Array, cost: float, size: int, size_column: int) -> Rows:
    """COLUMNS rows of whitened errors with this information (COLUMNS, COLUMNS), lower triangle, and gradient
    (COLUMNS,), and one row with the rest of the `cost`."""
    error, own = residual.compressed(information, pull, cost, _RIDGE)
    jacobian = np.zeros((COLUMNS + 1, size))
    jacobian[:, :POSE], jacobian[:, size_column:size_column + SHAPE] = own[:, :POSE], own[:, POSE:]
    return Rows(error, jacobian, UNIT)


class JointLimits:
    """Implements `Residual`: a penalty on angles beyond their limits (A, 2) rad. A state begins with the root's pose
    and the A angles, its tangent space with six numbers of the pose and the A angles."""

    def __init__(self, limits: Array) -> None:
        self.limits = limits

    def linearise(self, state: Array) -> Rows:
        """One row for each angle beyond its limits."""
        angles = state[ANGLES:ANGLES + len(self.limits)]
        excess = np.minimum(self.limits[:, 1] - angles, 0.0) + np.maximum(self.limits[:, 0] - angles, 0.0)
        beyond = np.flatnonzero(excess)
        jacobian = np.zeros((len(beyond), len(state) - BIAS + MOTION))
        jacobian[np.arange(len(beyond)), 6 + beyond] = 1.0 / LIMIT_SD_RAD
        return Rows(excess[beyond] / LIMIT_SD_RAD, jacobian, UNIT)


def slices_of(surface: Surface, state: Array, covariance: Array, pose: Array, intrinsics: Array,
              points: ContourPoints, size_column: int, row_s: float, reach: float, longest_px: float,
              repeated: float = 1.0, late_s: float = 0.0) -> ContourFrame:
    """The slices at the contour `points` that are expected of a hand in `state` with `covariance` (n, n). They reach
    `reach` standard deviations to both sides, at most `longest_px`. `row_s`: time between rows, s; `late_s`: the
    image's time less the state's, s."""
    count = len(points.along)
    late = np.full(count, late_s)
    if count and row_s:
        late += row_s * (points.pixel[:, 1] - points.pixel[:, 1].mean())
    slices = np.column_stack([points.pixel, points.normal, np.ones(count)])
    frame = ContourFrame(surface, points, pose, intrinsics, slices, np.zeros(count), late, size_column, repeated)
    _, rows, _ = frame.predict(state)
    own = np.r_[0:POSE, size_column:size_column + SHAPE]
    if abs(late_s) > SAME_TIME_S:
        own, rows = np.r_[own, POSE:2 * POSE], np.hstack([rows, late_s * rows[:, :POSE]])
    variance = np.sum((rows @ covariance[np.ix_(own, own)]) * rows, axis=1)
    frame.expected_sd = np.sqrt(np.maximum(variance, 0.0))
    spread = np.sqrt(variance + 4.0 * (frame.shape_variance + frame.side_sd**2))
    slices[:, 4] = np.clip(reach * spread + 1.0, 3.0, longest_px)
    return frame


@njit(cache=True)
def _mix(count, offsets, sds, inside, outside, behind, expected, shape_variance, spread_variance, clutter, found):
    """Probabilistic data association on one slice (Bar-Shalom and Tse 1975): fill `found` with the probability that
    each edge is the hand's. Returns -2 log likelihood above its minimum, the weight 1/px^2, the weighted mean error px,
    and the probability that any edge is the hand's. The weight includes the spread of the means of several edges."""
    missed = MISSED[behind]
    total, peak = missed, missed
    for k in range(count):
        variance = sds[k] * sds[k] + shape_variance + spread_variance
        error = offsets[k] - expected
        ours = UNSURE + (1.0 - 2.0 * UNSURE) * inside[k]
        theirs = UNSURE + (1.0 - 2.0 * UNSURE) * outside[k]
        odds = 4.0 * ours * (theirs if behind == INNER else 1.0 - theirs)
        top = (1.0 - missed) * odds * _STUDENT_4 / (np.sqrt(variance) * clutter[k])
        found[k] = top * (1.0 + error * error / (DEGREES * variance)) ** (-0.5 * (DEGREES + 1.0))
        total += found[k]
        peak = max(peak, missed + top)
    weight = mean = square = 0.0
    for k in range(count):
        found[k] /= total
        variance = sds[k] * sds[k] + shape_variance
        wide = variance + spread_variance
        error = offsets[k] - expected
        one = found[k] * (DEGREES + 1.0) / (DEGREES + error * error / wide) / variance
        weight += one
        mean += one * error
        square += one * error * error
    if weight > 0.0:
        mean /= weight
        weight /= 1.0 + max(square - weight * mean * mean, 0.0)  # the spread of the means
    return 2.0 * np.log(max(peak / total, 1.0)), weight, mean, 1.0 - missed / total


@njit(cache=True)
def _add_sides(surface, state, size, pose, intrinsics, late_s, capsule, kind, along, behind, shape_variance, side_sd,
               pixel, normal, count, offsets, sds, inside, outside, expected_sd, clutter, offset, rows, good,
               sides):
    """Fill `offset` (K,), `rows` (K, COLUMNS) and `good` (K,) as `contour_on_slices` does. Add gradient and
    information to `sides` (S, N + 2), of the surface's offset along each side."""
    contour_on_slices(surface, state, size, pose, intrinsics, late_s, capsule, kind, along, pixel, normal, offset, rows,
                      good)
    found = np.empty(offsets.shape[1])
    for s in range(capsule.shape[0]):
        if good[s]:
            _, weight, error, _ = _mix(count[s], offsets[s], sds[s], inside[s], outside[s], behind[s], offset[s],
                                       shape_variance[s], expected_sd[s] ** 2, clutter[s], found)
            side = SIDES * capsule[s] + kind[s]
            sides[side, -2] += weight * side_sd[s] * error
            sides[side, -1] += weight * side_sd[s] ** 2


@njit(cache=True)
def _gather(surface, offset, rows, good, capsule, kind, behind, shape_variance, side_sd, count, offsets, sds, inside,
            outside, expected_sd, clutter, nuisance, information, pull, slice_counts, sides):
    """Add the slices' information to the lower triangle of `information` (N, N) and their gradient to `pull` (N,);
    returns their cost."""
    found, cost, own = np.empty(offsets.shape[1]), 0.0, np.empty(rows.shape[1], np.int64)
    for s in range(capsule.shape[0]):
        if not good[s]:
            continue
        side = SIDES * capsule[s] + kind[s]
        shift = nuisance[side] * side_sd[s]
        one, weight, error, present = _mix(count[s], offsets[s], sds[s], inside[s], outside[s], behind[s],
                                           offset[s] + shift, shape_variance[s], expected_sd[s] ** 2, clutter[s], found)
        error += shift
        cost += one
        slice_counts[surface.group[capsule[s]], 0] += present
        slice_counts[surface.group[capsule[s]], 1] += 1.0
        sides[side, -2] += weight * side_sd[s] * error
        sides[side, -1] += weight * side_sd[s] ** 2
        used = _nonzero(rows[s], own)
        for p in range(used):
            a = weight * rows[s, own[p]]
            sides[side, own[p]] += side_sd[s] * a
            pull[own[p]] += a * error
            for q in range(p + 1):
                information[own[p], own[q]] += a * rows[s, own[q]]
    return cost


@njit(cache=True)
def _marginalise(sides, information, pull):
    """Marginalise the surface's offset along each side (Schur complement): subtract it from the lower triangle of
    `information` (N, N) and from the gradient `pull` (N,). A row of `sides` (S, N + 2) sums the residuals' derivatives
    by the state, their error, and their derivative by the offset, each times the weight and the last."""
    own = np.empty(len(pull), np.int64)
    for s in range(sides.shape[0]):
        if sides[s, -1] == 0.0:
            continue
        used, part = _nonzero(sides[s, :-2], own), 1.0 / (1.0 + sides[s, -1])
        for p in range(used):
            a = part * sides[s, own[p]]
            pull[own[p]] -= a * sides[s, -2]
            for q in range(p + 1):
                information[own[p], own[q]] -= a * sides[s, own[q]]


@njit(cache=True)
def _nonzero(row, own):
    """Fill `own` with the indices of the nonzero elements of `row`; return their number."""
    used = 0
    for i in range(row.shape[0]):
        if row[i] != 0.0:
            own[used] = i
            used += 1
    return used
