"""The residual of one camera's edges: contour points of the hand against the edges that were found near them.

On a slice, the hand's edge is one of the edges found, or none of them (Isard and Blake 1998). Clutter is a Poisson
process along the slice. An edge is weighted by the probability, at the present state, that it is the hand's. So a slice
without edges, or with edges of other objects only, changes nothing. The Jacobian of a contour point is filled where the
point is found: `contours.contour_on_slices`.

The lengths and radii of the phalanges are uncertain parts of the state (`tracker.PHALANGES`). Two opposite edges then
determine the axis, and one edge alone is less certain. The surface's error persists while the hand shows the same side,
so images within that time count as one.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.barehand.contours import COLUMNS, INNER, SHORTEST_PX, SILHOUETTE, contour_on_slices
from rhot_app.barehand.joints import POSE_AND_SHAPE
from rhot_app.barehand.surface import FOREARM, PALM, Surface
from rhot_app.estimation.residual import UNIT, Rows, compressed
from rhot_app.geometry.camera import CameraRecord
from rhot_app.hand.limits import LIMIT_SD_RAD
from rhot_app.hand.motion.hand_state import POSE, STATE, TANGENT, tangent_size
from rhot_app.state import SeenContour
from rhot_node.detect.edges import Edges

Array = NDArray[np.float64]

SHAPE_SD_M = 0.7e-3
"""m: standard deviation of a finger's skin about the model's surface: creases, joints, nails and pads."""

FLESHY = 2.0
"""Factor on SHAPE_SD_M for palm and forearm, whose flesh has no capsules of its own. Measured between the twin's hand
and the tracker's: 1.0 to 1.4 mm, and 0.7 mm on fingers."""

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

AMBIGUOUS_PX = 6.0
"""px: largest standard deviation of a contour that cannot be confused with its neighbour's: half a finger at 0.5 m."""

REACH = 3.0
"""Half of a slice in standard deviations of the prediction: 99.7 % of contours lie on it."""

LONGEST_PX = (REACH + 1.0) * AMBIGUOUS_PX
"""px: half of the longest slice. Farther away, the edges of other fingers are as probable."""

_STUDENT_4 = 0.375  # density at 0 of Student's t of 4 degrees of freedom
_LEAST_CLUTTER = 1e-3  # edges per px
RIDGE = 1e-3  # 1/m^2 and 1/rad^2: negligible, but keeps the matrix regular

Predicted = tuple[Array, Array, NDArray[np.bool_]]


class ContourFrame:
    """Implements `estimation.residual.Residual`: one camera's slices, the edges on them, and where the contour is.

    `slices` (K, 5) as `find_edges` takes them; `expected_sd` (K,) px: of the contour along each slice.
    `slice_counts` (GROUPS, 2): of each finger, the palm and the forearm, the slices on which the contour was found, and
    all, when last linearised. `repeated`: number of correlated images that count as one. `ambiguous`: part of the
    slices on which the contour may be confused with its neighbour's, as it was predicted so uncertainly.
    """

    def __init__(self, surface: Surface, camera: CameraRecord, points: np.recarray, slices: Array, expected_sd: Array,
                 late_s: Array, repeated: float = 1.0) -> None:
        self.surface, self.camera, self.points = surface, camera, points
        self.slices, self.expected_sd, self.late_s, self.repeated = slices, expected_sd, late_s, repeated
        fleshy = np.where(surface.group[points.capsule] < PALM, 1.0, FLESHY)
        self.shape_variance = repeated * (SHAPE_SD_M * fleshy * points.scale) ** 2
        self.edges: Edges | None = None
        self.clutter = np.empty((0, 0))
        self.slice_counts = np.zeros((GROUPS, 2))
        self.ambiguous = 0.0

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
        offset, rows, good = contour_on_slices(self.surface, state, self.camera, self.points, self.slices, self.late_s)
        return offset, rows, good

    def linearise(self, state: Array) -> Rows:
        """COLUMNS rows with the information of all slices, and one with the rest of their cost."""
        return Contours([self]).linearise(state)

    def gather(self, predicted: Predicted, information: Array, pull: Array) -> float:
        """Add the lower triangle of the slices' `information` (N, N) and their gradient to `pull` (N,); returns their
        cost. The derivatives in `predicted` have N columns."""
        assert self.edges is not None, "the edges of the slices have not been observed"
        self.slice_counts = np.zeros((GROUPS, 2))
        slices = _Slices(self.points, self.surface.group[self.points.capsule], self.edges, self.clutter,
                         self.shape_variance, self.expected_sd**2)
        return float(_gather(slices, *predicted, information, pull, self.slice_counts))


def seen_contour(camera: str, t_ns: int, frame: ContourFrame, state: Array, t_node_ns: int = 0,
                 shown: bool = False) -> SeenContour:
    """The contour of a hand in `state` in the image of `t_ns`, `t_node_ns` by its node's clock, with slices and edges,
    for display. `shown`: see `SeenContour`."""
    offset, _, good = frame.predict(state)
    centre, normal, half = frame.slices[:, :2], frame.slices[:, 2:4], frame.slices[:, 4:]
    ends = np.hstack([centre - half * normal, centre + half * normal])
    places, near = np.empty((0, 2)), np.empty(0, np.bool_)
    if frame.edges is not None:
        edges = frame.edges
        row, column = np.nonzero((np.arange(edges.offset.shape[1]) < edges.number[:, None]) & good[:, None])
        along = edges.offset[row, column]
        places = centre[row] + along[:, None] * normal[row]
        near = np.abs(along - offset[row]) < REACH * np.hypot(frame.expected_sd[row], edges.sd[row, column])
    return SeenContour(camera, t_ns, (centre + offset[:, None] * normal)[good],
                       frame.points.behind[good] == SILHOUETTE, ends[good] if not shown else np.empty((0, 4)), places,
                       near, t_node_ns, shown=shown)


def in_a_fit(frame: ContourFrame) -> ContourFrame:
    """The frame for a fit of one shape to several instants, which are too far apart to be correlated."""
    out = copy.copy(frame)
    out.shape_variance, out.repeated = frame.shape_variance / frame.repeated, 1.0
    return out


class Contours:
    """Implements `Residual`: the frames of some cameras, each at its own time.

    A given `velocity` (POSE,), with its covariance, moves the frames to the state's instant. The frames do not update
    it: cameras disagree by a fraction of a millimetre of surface or calibration, which within milliseconds would be a
    high speed. The velocity's error counts as independent of the frames', even after a pass over the same frames.
    Without it, the state's own velocity moves them. No row has a derivative by a velocity.
    """

    def __init__(self, frames: Sequence[ContourFrame], velocity: tuple[Array, Array] | None = None) -> None:
        self.frames, self._velocity = [frame for frame in frames if len(frame.slices)], velocity
        self._root: Array | None = None  # of the velocity's covariance, of any rank
        if velocity is not None and any(abs(float(frame.late_s.mean())) > SAME_TIME_S for frame in self.frames):
            values, vectors = np.linalg.eigh(velocity[1])
            self._root = np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))

    def linearise(self, state: Array) -> Rows:
        """COLUMNS whitened rows of the information of all slices, and one of the remaining cost."""
        size = tangent_size(state)
        if not self.frames:
            return Rows(np.empty(0), np.empty((0, size)), UNIT)
        if self._velocity is not None:
            state = state.copy()
            state[STATE.velocity] = self._velocity[0]
        error, own = compressed(*gathered(self.frames, state, self._root), RIDGE)
        jacobian = np.zeros((COLUMNS + 1, size))
        jacobian[:, :POSE], jacobian[:, TANGENT.shape] = own[:, :POSE], own[:, POSE:]
        return Rows(error, jacobian, UNIT)


def velocity_of(estimate: tuple[Array, Array]) -> tuple[Array, Array]:
    """The velocity (POSE,) in a state with its covariance, and its own."""
    own = TANGENT.velocity
    return estimate[0][STATE.velocity].copy(), estimate[1][own, own].copy()


def gathered(frames: Sequence[ContourFrame], state: Array, velocity_root: Array | None = None
             ) -> tuple[Array, Array, float]:
    """Information (COLUMNS, COLUMNS), its lower triangle only, gradient (COLUMNS,) and cost of all slices of some
    cameras. The velocity's error in frames of other instants is marginalised. `velocity_root` (POSE, POSE): a square
    root of its covariance."""
    count = COLUMNS + (0 if velocity_root is None else POSE)
    information, pull, cost = np.zeros((count, count)), np.zeros(count), 0.0
    for frame in frames:
        offset, rows, good = frame.predict(state)
        if velocity_root is not None:
            rows = np.hstack([rows, frame.late_s.mean() * (rows[:, :POSE] @ velocity_root)])
        cost += frame.gather((offset, rows, good), information, pull)
    if velocity_root is not None:
        own, cross = information[COLUMNS:, COLUMNS:], information[COLUMNS:, :COLUMNS]
        own = np.tril(own) + np.tril(own, -1).T + np.eye(POSE)
        solved = np.linalg.solve(own, np.column_stack([cross, pull[COLUMNS:]]))
        cost -= float(pull[COLUMNS:] @ solved[:, -1])
        information, pull = (information[:COLUMNS, :COLUMNS] - cross.T @ solved[:, :-1],
                             pull[:COLUMNS] - cross.T @ solved[:, -1])
    return information, pull, cost


class JointLimits:
    """Implements `Residual`: a penalty on angles beyond their limits (A, 2) rad. A state begins with the root's pose
    and the A angles, its tangent space with six numbers of the pose and the A angles."""

    def __init__(self, limits: Array) -> None:
        self.limits = limits

    def linearise(self, state: Array) -> Rows:
        """One row for each angle beyond its limits."""
        angles = state[STATE.angles][:len(self.limits)]
        excess = np.minimum(self.limits[:, 1] - angles, 0.0) + np.maximum(self.limits[:, 0] - angles, 0.0)
        beyond = np.flatnonzero(excess)
        jacobian = np.zeros((len(beyond), tangent_size(state)))
        jacobian[np.arange(len(beyond)), 6 + beyond] = 1.0 / LIMIT_SD_RAD
        return Rows(excess[beyond] / LIMIT_SD_RAD, jacobian, UNIT)


def slices_of(surface: Surface, state: Array, covariance: Array, camera: CameraRecord, points: np.recarray,
              row_s: float, repeated: float = 1.0, late_s: float = 0.0) -> ContourFrame:
    """The slices at the contour `points` that are expected of a hand in `state` with `covariance` (n, n). They reach
    REACH standard deviations to both sides, at most LONGEST_PX. `row_s`: time between rows, s; `late_s`: the image's
    time less the state's, s."""
    count = len(points)
    late = np.full(count, late_s)
    if count and row_s:
        late += row_s * (points.pixel[:, 1] - points.pixel[:, 1].mean())
    slices = np.column_stack([points.pixel, points.normal, np.ones(count)])
    frame = ContourFrame(surface, camera, points, slices, np.zeros(count), late, repeated)
    _, rows, _ = frame.predict(state)
    own = POSE_AND_SHAPE
    if abs(late_s) > SAME_TIME_S:
        own, rows = np.r_[own, POSE:2 * POSE], np.hstack([rows, late_s * rows[:, :POSE]])
    variance = np.sum((rows @ covariance[np.ix_(own, own)]) * rows, axis=1)
    expected_sd = np.sqrt(np.maximum(variance, 0.0))
    frame.ambiguous = float(np.mean(expected_sd > AMBIGUOUS_PX)) if count else 0.0
    frame.expected_sd = np.minimum(expected_sd, AMBIGUOUS_PX)
    spread = np.sqrt(variance + 4.0 * frame.shape_variance)
    slices[:, 4] = np.clip(REACH * spread + 1.0, SHORTEST_PX, LONGEST_PX)
    return frame


class _Slices(NamedTuple):
    """What is known on K slices, see `ContourFrame`; `group` (K,) of their capsules."""

    points: np.recarray
    group: NDArray[np.int64]
    edges: Edges
    clutter: Array
    shape_variance: Array
    expected_variance: Array


@njit(cache=True)
def _mix(slices, s, expected, found):
    """Probabilistic data association on slice `s` (Bar-Shalom and Tse 1975): fill `found` with the probability that
    each edge is the hand's, whose contour is `expected` at that offset, px. Returns -2 log likelihood above its
    minimum, the weight 1/px^2, the weighted mean error px, and the probability that any edge is the hand's. The weight
    includes the spread of the means of several edges."""
    edges, behind, count = slices.edges, slices.points[s].behind, slices.edges.number[s]
    total = peak = missed = MISSED[behind]
    for k in range(count):
        variance = edges.sd[s, k] * edges.sd[s, k] + slices.shape_variance[s] + slices.expected_variance[s]
        error = edges.offset[s, k] - expected
        ours = UNSURE + (1.0 - 2.0 * UNSURE) * edges.inside[s, k]
        theirs = UNSURE + (1.0 - 2.0 * UNSURE) * edges.outside[s, k]
        odds = ours * (theirs if behind == INNER else 1.0 - theirs) / 0.25  # by even ones, a half each
        top = (1.0 - missed) * odds * _STUDENT_4 / (np.sqrt(variance) * slices.clutter[s, k])
        found[k] = top * (1.0 + error * error / (DEGREES * variance)) ** (-0.5 * (DEGREES + 1.0))
        total += found[k]
        peak = max(peak, missed + top)
    weight = mean = square = 0.0
    for k in range(count):
        found[k] /= total
        variance = edges.sd[s, k] * edges.sd[s, k] + slices.shape_variance[s]
        error = edges.offset[s, k] - expected
        one = found[k] * (DEGREES + 1.0) / (DEGREES + error * error / (variance + slices.expected_variance[s]))
        weight += one / variance
        mean += one / variance * error
        square += one / variance * error * error
    if weight > 0.0:
        mean /= weight
        weight /= 1.0 + max(square - weight * mean * mean, 0.0)  # the spread of the means
    return 2.0 * np.log(max(peak / total, 1.0)), weight, mean, 1.0 - missed / total


@njit(cache=True)
def _gather(slices, offset, rows, good, information, pull, slice_counts):
    """Add the slices' information to the lower triangle of `information` (N, N) and their gradient to `pull` (N,);
    returns their cost. `offset` (K,), `rows` (K, N) and `good` (K,): as `contour_on_slices` predicts them."""
    found, cost = np.empty(slices.clutter.shape[1]), 0.0
    for s in range(len(offset)):
        if not good[s]:
            continue
        one, weight, error, present = _mix(slices, s, offset[s], found)
        cost += one
        slice_counts[slices.group[s], 0] += present
        slice_counts[slices.group[s], 1] += 1.0
        own = np.flatnonzero(rows[s])
        for i in own:
            a = weight * rows[s, i]
            pull[i] += a * error
            for j in own:
                if j > i:
                    break
                information[i, j] += a * rows[s, j]
    return cost
