"""The pose of one object from all its image points in all cameras, and how sure its choice among several is.

A planar tag has two poses that explain its corners (Schweighofer and Pinz 2006). Every start is refined on all points
of all cameras together, and the refined modes are weighed by their posterior probability.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_app.estimation.layout import pose_matrix
from rhot_app.estimation.least_squares import Dense, minimise
from rhot_app.estimation.residual import Residual, Rows
from rhot_app.estimation.se3 import difference, exp_so3, retract
from rhot_app.geometry.camera import undistort_points
from rhot_app.geometry.transforms import fit_rigid, inverse, rigid
from rhot_app.geometry.triangulate import Outcome, cast, empty_rays, triangulate
from rhot_app.objects.motion import (
    SIZE,
    TURNS,
    TWIST,
    VELOCITY,
    CameraArrays,
    PointResidual,
    TurnsPrior,
    VelocityPrior,
    state_of,
)
from rhot_app.objects.object_file import spans_plane
from rhot_app.objects.observations import NO_TAG, ObjectPoints, ObjectView
from rhot_app.objects.state import Validity

Array = NDArray[np.float64]

AMBIGUOUS = 0.01
"""Probability of the second mode from which on a pose is ambiguous."""

SAME_POSE = 1.0
"""Standard deviations within which two minima are one."""

FLOOR_PX = 0.02
"""px: no corner is better, whatever a node states (`marker_residual.FLOOR_PX`)."""

STEPS, CONVERGED = 30, 1e-4
"""Levenberg-Marquardt steps at most; standard deviations of the last one, whose square is its gain."""

_STARTS = 4  # refined of all, the best by the cost of all points


@dataclass(frozen=True, slots=True)
class Mode:
    """A state that explains the observations: a local minimum of the cost.

    `state` and `covariance` (n, n) in its tangent space, of a rigid object as in `motion`: n is 6, the pose alone, or
    all of it. `cost`:
    -2 log posterior of `points` image points, up to a constant. `rms_px`: reprojection error. `probability` among all
    modes.
    """

    state: Array
    covariance: Array
    cost: float
    points: int
    rms_px: float
    probability: float = 1.0

    @property
    def world_from_object(self) -> Array:
        """(4, 4)."""
        return pose_matrix(self.state)


@dataclass(frozen=True, slots=True)
class ObjectPose:
    """The most probable pose of an object at rest.

    `world_from_object` (4, 4). `covariance` (6, 6) m^2 and rad^2: translation, then rotation about the object's origin,
    world axes. `rms_px`: reprojection error of `points` image points. `second`: the next mode's pose, None without one.
    """

    name: str
    t_ns: int
    validity: Validity
    world_from_object: Array
    covariance: Array
    rms_px: float
    points: int
    second: Array | None
    second_probability: float


def estimate_pose(points: ObjectPoints, cameras: CameraArrays, views: Sequence[ObjectView]) -> ObjectPose | None:
    """The pose of an object at rest that explains all views; None when they determine none."""
    modes = find_modes(points, cameras, views)
    if not modes:
        return None
    best, second = modes[0], modes[1] if len(modes) > 1 else None
    probability = 0.0 if second is None else second.probability
    return ObjectPose(points.name, round(np.mean([view.t_ns for view in views])),
                      Validity.AMBIGUOUS if probability >= AMBIGUOUS else Validity.TRACKED, best.world_from_object,
                      best.covariance, best.rms_px, best.points, None if second is None else second.world_from_object,
                      probability)


def find_modes(points: ObjectPoints, cameras: CameraArrays, views: Sequence[ObjectView],
               moving: bool = False) -> list[Mode]:
    """The distinct states that explain all views, the most probable first; none when the views determine none.

    At rest all views count as taken at one instant. A moving object's state is that at the first view's time, and each
    point has its own time.
    """
    residuals = [point_residual(points, cameras, view, views[0].t_ns if moving else None) for view in views]
    starts = [start for view in views for start in _tag_starts(points, cameras, view)]
    starts += _triangulated_starts(points, cameras, views)
    turns = cameras.turns if moving else 0
    size, priors = TWIST, list[Residual]()
    if moving and starts:
        size = SIZE + turns
        expected = cameras.turns_covariance(starts[0][:3, 3], sized=points.sized)
        priors = [VelocityPrior(), *([TurnsPrior(expected)] if turns else [])]
    states = [state_of(start, turns) for start in starts]
    ranked = sorted((_start(residuals, priors, state, size).cost, number) for number, state in enumerate(states))
    modes: list[Mode] = []
    for _, number in ranked[:_STARTS]:
        _add(modes, refine(residuals, priors, states[number], size))
    modes.sort(key=lambda mode: mode.cost)
    if modes:
        best = modes[0].state
        for view in views:
            _add(modes, refine(residuals, priors, reversed_state(points, cameras, view, best), size))
    possible = [mode for mode in modes if all(faces_camera(points, cameras, view, mode.world_from_object).all()
                                              for view in views)]
    return _weighed(possible)


def point_residual(points: ObjectPoints, cameras: CameraArrays, view: ObjectView, t_ns: int | None) -> PointResidual:
    """The residual of a view by the state at `t_ns`; None: of an object at rest, before cameras that are as said."""
    late_s = np.zeros_like(view.late_s) if t_ns is None else view.late_s + 1e-9 * (view.t_ns - t_ns)
    return PointResidual(points.points[view.rows], view.pixels, view.covariances + FLOOR_PX**2 * np.eye(2), late_s,
                         cameras.poses[view.camera], cameras.intrinsics[view.camera],
                         -1 if t_ns is None else cameras.turn_at(view.camera))


def faces_camera(points: ObjectPoints, cameras: CameraArrays, view: ObjectView, world_from_object: Array) -> Array:
    """(K,) whether each point's tag shows its face; true for markers."""
    places = points.points[view.rows] @ world_from_object[:3, :3].T + world_from_object[:3, 3]
    normals = points.normals[view.rows] @ world_from_object[:3, :3].T
    return np.asarray(~(np.einsum("ki,ki->k", normals, cameras.centres[view.camera] - places) <= 0.0))


def _tag_starts(points: ObjectPoints, cameras: CameraArrays, view: ObjectView) -> list[Array]:
    """Both poses of every tag with all its corners (IPPE; Collins and Bartoli 2014)."""
    starts = []
    tags = points.tags[view.rows]
    world_from_camera = inverse(np.vstack([cameras.poses[view.camera], np.eye(4)[3]]))
    for tag in np.unique(tags[tags != NO_TAG]):
        own = np.flatnonzero(tags == tag)
        if len(own) < 4:
            continue
        normalised = np.asarray(undistort_points(np.ascontiguousarray(view.pixels[own]),
                                                 cameras.intrinsics[view.camera]))
        if not np.isfinite(normalised).all():
            continue
        half = 0.5 * points.sizes[view.rows[own[0]]]
        square = half * np.array([[-1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [1.0, -1.0, 0.0], [-1.0, -1.0, 0.0]])
        tag_from_object = fit_rigid(points.points[view.rows[own]], square)
        _, rotations, translations, _ = cv2.solvePnPGeneric(square, normalised[:, None], np.eye(3), np.zeros(0),
                                                            flags=cv2.SOLVEPNP_IPPE_SQUARE)
        for rotation, translation in zip(rotations, translations, strict=True):
            camera_from_tag = rigid(exp_so3(rotation.ravel()), translation[:, 0])
            if np.isfinite(camera_from_tag).all():
                starts.append(world_from_camera @ camera_from_tag @ tag_from_object)
    return starts


def _triangulated_starts(points: ObjectPoints, cameras: CameraArrays, views: Sequence[ObjectView]) -> list[Array]:
    """The rigid fit to all points that two cameras see, if they determine one."""
    count, found, rays = len(cameras.poses), {}, empty_rays(len(cameras.poses))
    for row in sorted({int(row) for view in views for row in view.rows}):
        pixels, covariances, used = np.full((count, 2), np.nan), np.zeros((count, 2, 2)), np.zeros(count, bool)
        for view in views:
            for place in np.flatnonzero(view.rows == row):
                pixels[view.camera], covariances[view.camera] = view.pixels[place], view.covariances[place]
                used[view.camera] = True
        cast(pixels, covariances, cameras.intrinsics, used, rays)
        position, covariance = np.empty(3), np.empty((3, 3))
        if triangulate(rays, cameras.poses, used, position, covariance)[1] == Outcome.OK:
            found[row] = position
    source = points.points[list(found)]
    if not spans_plane(1e3 * source):
        return []
    return [fit_rigid(source, np.array(list(found.values())))]


def reversed_state(points: ObjectPoints, cameras: CameraArrays, view: ObjectView, state: Array) -> Array:
    """The state whose points in a view, if they lie in a plane, look nearly the same: the plane turned by half a turn
    about its normal, then about the line of sight (Necker's reversal)."""
    world_from_object, seen = pose_matrix(state), points.points[view.rows]
    middle = seen.mean(axis=0)
    normal = np.linalg.svd(seen - middle)[2][2]
    line_of_sight = world_from_object[:3, :3] @ middle + world_from_object[:3, 3] - cameras.centres[view.camera]
    half_turns = [2.0 * np.outer(axis, axis) / (axis @ axis) - np.eye(3) for axis in (line_of_sight, normal)]
    rotation = half_turns[0] @ world_from_object[:3, :3] @ half_turns[1]
    translation = world_from_object[:3, :3] @ middle + world_from_object[:3, 3] - rotation @ middle
    out = np.concatenate([state_of(rigid(rotation, translation)), state[TURNS]])
    out[VELOCITY][:3], out[VELOCITY][3:] = state[VELOCITY][:3], half_turns[0] @ state[VELOCITY][3:]
    return out


def _start(residuals: Sequence[PointResidual], priors: Sequence[Residual], state: Array, size: int) -> Dense[Array]:
    """The state over the first `size` numbers of its tangent space; impossible with a point behind the camera that sees
    it."""
    def rows(state: Array) -> list[Rows] | None:
        points = [residual.linearise(state) for residual in residuals]
        if sum(len(one.error) for one in points) < sum(2 * len(one.pixels) for one in residuals):
            return None
        return [replace(one, jacobian=one.jacobian[:, :size])
                for one in (*points, *(prior.linearise(state) for prior in priors))]

    def moved(state: Array, step: Array) -> Array:
        return np.asarray(retract(state, np.concatenate([step, np.zeros(len(state) - TWIST - size)])))
    return Dense(state, rows, moved, size)


def refine(residuals: Sequence[PointResidual], priors: Sequence[Residual], state: Array, size: int) -> Mode | None:
    """The nearest minimum of the robust cost over the first `size` numbers of the tangent space; None where it is not
    determined."""
    start = _start(residuals, priors, state, size)
    if not np.isfinite(start.cost):
        return None
    found, _ = minimise(start, STEPS, CONVERGED**2)
    covariance = found.covariance()
    if covariance is None:
        return None
    pixels = np.concatenate([one.pixels - one.predict(found.state)[0] for one in residuals])
    return Mode(found.state, covariance, found.cost, len(pixels), float(np.sqrt(np.mean(np.sum(pixels**2, axis=1)))))


def _add(modes: list[Mode], mode: Mode | None) -> None:
    """Add a mode that is none of those before; of two that are one, the better is kept."""
    if mode is None:
        return
    for number, other in enumerate(modes):
        if same_pose(mode.state, mode.covariance, other.state, other.covariance):
            if mode.cost < other.cost:
                modes[number] = mode
            return
    modes.append(mode)


def same_pose(state: Array, covariance: Array, other: Array, other_covariance: Array) -> bool:
    """Whether two minima are one: nearer than SAME_POSE standard deviations of either."""
    step = difference(state, other)[:TWIST]
    return bool(min(step @ np.linalg.solve(one[:TWIST, :TWIST], step)
                    for one in (covariance, other_covariance)) < SAME_POSE**2)


def log_mass(mode: Mode) -> float:
    """Logarithm of a mode's posterior mass, up to a constant: that of its Gaussian (Laplace's approximation)."""
    return float(-0.5 * mode.cost + 0.5 * np.linalg.slogdet(mode.covariance)[1])


def _weighed(modes: Sequence[Mode]) -> list[Mode]:
    """With their probabilities, the greatest first."""
    if not modes:
        return []
    logs = np.array([log_mass(mode) for mode in modes])
    shares = np.exp(logs - logs.max())
    shares /= shares.sum()
    weighed = [replace(mode, probability=float(share)) for mode, share in zip(modes, shares, strict=True)]
    return sorted(weighed, key=lambda mode: -mode.probability)
