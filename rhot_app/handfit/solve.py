"""Solves pose and shape for anchors and contours by least squares with priors; joint limits hold exactly.

Every instant has its own pose; all share the shape. The prior of the shape is centred at the base hand, that of the
angles is `hand.limits.pose_prior`. In a drag it is centred at the pose with which the drag began instead, so that what
the anchors do not determine stays where it was.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rhot_app.barehand.contour_residual import RIDGE, gathered
from rhot_app.barehand.joints import points_in
from rhot_app.barehand.start import START_SD
from rhot_app.barehand.surface import FINGER_SIZE, FOREARM_TURN, HAND_SIZE, LENGTH, RADIUS
from rhot_app.barehand.tracker import FOREARM_SD
from rhot_app.errors import CalibrationError
from rhot_app.estimation.least_squares import Dense, minimise
from rhot_app.estimation.residual import UNIT, Rows, compressed
from rhot_app.estimation.se3 import pose_difference
from rhot_app.geometry.camera import NEAREST_M, CameraModel, project_with_slope
from rhot_app.hand.model import HandModel
from rhot_app.hand.motion.hand_state import POSE, STATE, TANGENT
from rhot_app.hand.skeleton import JOINTS, HandPose
from rhot_app.handfit.hand_shape import ROOTS, SHAPE_LIMIT, SHAPE_SD, SIZE, Shapes
from rhot_app.handfit.state import BEND_LIMIT, OWN, Contour, FitState, Instant, bare_state

Array = NDArray[np.float64]
Freedom = Literal["pose", "lengths", "roots"]
"""What may change beside the pose: nothing, sizes and lengths, or these and the finger roots."""

PIN_SD_PX = 0.1
"""px: how exactly a drag holds anchors; a fifth of what is promised, so that no prior shows."""

ANCHOR_SD_PX = 3.0
"""px: how exactly a person points at a joint, unless the person says otherwise: 3 mm at the hand
(`hand.landmarks.ANATOMY_SD_M`) 0.5 m before a camera of 500 px."""

DRAG_SD = START_SD[0], START_SD[1]
"""m and rad: of the palm in a drag, so that a dragged fingertip bends its finger before it moves the palm."""

FREE_SD = 1.0, np.pi
"""m and rad: of the palm in a fit to anchors: as good as nothing is known."""

DRAG_STEPS, LAST_STEPS, FIT_STEPS = 6, 20, 60
"""Most steps of a solution while the pointer moves, 20 ms on a small computer, where it stops, and of one that has
time. A place that can be reached takes six; anchors that contradict each other take more."""

_LEAST_GAIN = 1e-4  # of a cost in which one standard deviation costs 1
_KEPT = 16  # joints of the newest states, which are asked for twice
_AT_LIMIT = 1e-9  # rad and logarithms


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """What a solution goes by. `reference`: the poses at which the prior is centred; `palm_sd` m, rad, is the palm's;
    `anchor_sd_px`; `contours`: of each instant, None where none were searched."""

    reference: FitState
    palm_sd: tuple[float, float]
    anchor_sd_px: float
    contours: Sequence[Contour | None] = ()


class Solver:
    """Solutions for one base hand and the cameras of a rig."""

    def __init__(self, shapes: Shapes, cameras: Sequence[CameraModel]) -> None:
        self.shapes, self.cameras = shapes, cameras
        model = shapes.model(np.zeros(SIZE))
        self.limits = model.limits
        self._placed: list[tuple[Array, Instant, tuple[Array, Array]]] = []
        self._root = np.linalg.cholesky(model.pose_prior.information).T

    def with_mean_angles(self, state: FitState) -> FitState:
        """The state with the angles at the mean of `pose_prior`: where it is centred when nothing shows them."""
        mean = self.shapes.model(np.zeros(SIZE)).pose_prior.mean
        return replace(state, instants=tuple(
            replace(one, pose=HandPose(one.pose.world_from_palm, mean)) for one in state.instants))

    def solve(self, state: FitState, evidence: Evidence, free: NDArray[np.bool_], steps: int = FIT_STEPS) -> FitState:
        """The most probable state from `state` on; only numbers that are `free` (n,) change. Raises CalibrationError
        where an anchored joint is behind its camera."""
        if not self._visible(state):
            raise CalibrationError("A joint with an anchor is behind its camera. Move the hand before the camera, or "
                                   "free the joint.")
        chosen = np.flatnonzero(free)

        def retract(before: FitState, step: Array) -> FitState:
            whole = np.zeros(before.size)
            whole[chosen] = step
            return before.moved(whole, self.limits)

        here, _ = minimise(Dense(state, lambda s: self._bounded(s, evidence, chosen), retract, len(chosen)), steps,
                           _LEAST_GAIN)
        return here.state

    def covariance(self, state: FitState, evidence: Evidence) -> Array:
        """(n, n) of the state by evidence and priors, all numbers unknown; joint limits tell nothing."""
        found = Dense(state, lambda s: self.rows(s, evidence), lambda s, step: s, state.size).covariance()
        assert found is not None, "every number has a prior"
        return found

    def rows(self, state: FitState, evidence: Evidence, instants: Sequence[int] | None = None) -> list[Rows]:
        """The linearised residuals of priors, anchors and contours, of all `instants` by default."""
        out = [Rows(-state.shape / SHAPE_SD, np.eye(SIZE, state.size) / SHAPE_SD[:, None], UNIT)]
        instants = range(len(state.instants)) if instants is None else instants
        for k in instants:
            one = state.instants[k]
            out.append(self._prior(one, evidence.reference.instants[k], evidence.palm_sd, state, k))
            if one.anchors:
                out.append(self._anchors(one, evidence.anchor_sd_px, state, k))
            contour = evidence.contours[k] if evidence.contours else None
            if contour is not None:
                out.append(_contour_rows(contour, state, k))
        return out

    def places(self, shape: Array, instant: Instant) -> tuple[Array, Array]:
        """(21, 3) m joints, world, and their derivative (21, 3, SIZE + OWN) by the shape and the instant's numbers."""
        for kept_shape, kept, result in self._placed:
            if kept_shape is shape and kept is instant:
                return result
        result = joint_places(self.shapes.model(shape), self.shapes.surface(shape).bone, shape, instant)
        self._placed = [(shape, instant, result), *self._placed[:_KEPT - 1]]
        return result

    def _prior(self, one: Instant, reference: Instant, palm_sd: tuple[float, float], state: FitState, k: int) -> Rows:
        world, before = one.pose.world_from_palm, reference.pose.world_from_palm
        sd = np.repeat(palm_sd, 3)
        error = np.concatenate([-np.array(pose_difference(world, before)) / sd,
                                self._root @ (reference.pose.angles - one.pose.angles), -one.bend / FOREARM_SD[1:]])
        own, jacobian = state.own(k), np.zeros((OWN, state.size))
        block = np.zeros((OWN, OWN))
        block[range(6), range(6)] = 1.0 / sd
        block[TANGENT.angles, TANGENT.angles] = self._root
        block[range(POSE, OWN), range(POSE, OWN)] = 1.0 / np.array(FOREARM_SD[1:])
        jacobian[:, own] = block
        return Rows(error, jacobian, UNIT)

    def _anchors(self, one: Instant, sd_px: float, state: FitState, k: int) -> Rows:
        places, slopes = self.places(state.shape, one)
        error, jacobian = np.zeros(2 * len(one.anchors)), np.zeros((2 * len(one.anchors), state.size))
        for n, anchor in enumerate(one.anchors):
            camera = self.cameras[anchor.camera]
            pixel, slope = project_with_slope(places[None, anchor.joint], camera.camera_from_world, camera.intrinsics)
            if not np.isfinite(pixel).all():
                continue  # behind the camera it says nothing; a solution never leads there (`_bounded`)
            rows, moves = slice(2 * n, 2 * n + 2), slope[0] @ slopes[anchor.joint]
            error[rows] = np.array(anchor.pixel) - pixel[0]
            jacobian[rows, :SIZE], jacobian[rows, state.own(k)] = moves[:, :SIZE], moves[:, SIZE:]
        return Rows(error / sd_px, jacobian / sd_px, UNIT)

    def _visible(self, state: FitState) -> bool:
        """Whether every joint with an anchor is before its camera."""
        for one in state.instants:
            if one.anchors:
                places, _ = self.places(state.shape, one)
                for anchor in one.anchors:
                    ahead = self.cameras[anchor.camera].camera_from_world[2]
                    if not ahead[:3] @ places[anchor.joint] + ahead[3] > NEAREST_M:
                        return False
        return True

    def _bounded(self, state: FitState, evidence: Evidence, chosen: NDArray[np.int64]) -> list[Rows] | None:
        """The rows by the `chosen` numbers; those at a limit and pulled beyond it move nothing. None where an anchor's
        joint is behind its camera."""
        if not self._visible(state):
            return None
        moving = None if chosen.size and chosen[0] < SIZE else sorted({int(k) for k in (chosen - SIZE) // OWN})
        rows = [Rows(one.error, one.jacobian[:, chosen], one.noise) for one in self.rows(state, evidence, moving)]
        pull = np.sum([one.jacobian.T @ one.error for one in rows], axis=0)
        low, high = np.full(state.size, -np.inf), np.full(state.size, np.inf)
        low[:SIZE], high[:SIZE] = -SHAPE_LIMIT - state.shape, SHAPE_LIMIT - state.shape
        for k, one in enumerate(state.instants):
            first = state.own(k).start
            low[first + 6:first + POSE] = self.limits[:, 0] - one.pose.angles
            high[first + 6:first + POSE] = self.limits[:, 1] - one.pose.angles
            low[first + POSE:first + OWN] = -BEND_LIMIT - one.bend
            high[first + POSE:first + OWN] = BEND_LIMIT - one.bend
        stuck = ((low[chosen] > -_AT_LIMIT) & (pull < 0.0)) | ((high[chosen] < _AT_LIMIT) & (pull > 0.0))
        return [Rows(one.error, np.where(stuck, 0.0, one.jacobian), one.noise) for one in rows]


def joint_places(model: HandModel, bone: NDArray[np.int64], shape: Array, instant: Instant) -> tuple[Array, Array]:
    """See `Solver.places`; `bone` (R,): the phalanx of each row of the hand's table (`barehand.surface`)."""
    pose, count = instant.pose, len(JOINTS)
    points, jacobian = points_in(model.dh, bone, bare_state(instant))
    out = np.zeros((count, 3, SIZE + OWN))
    out[:, :, SIZE:SIZE + POSE] = jacobian[:count, :, :POSE]
    out[:, :, :FOREARM_TURN] = jacobian[:count, :, POSE:POSE + FOREARM_TURN]
    roots = np.exp(shape[HAND_SIZE]) * pose.world_from_palm[:3, :3] * np.array([1.0, model.mirror, 1.0])
    for joint in range(1, count):
        finger = (joint - 1) // 4
        out[joint, :, ROOTS + 3 * finger:ROOTS + 3 * finger + 3] = roots
    return points[:count], out


def _contour_rows(contour: Contour, state: FitState, k: int) -> Rows:
    """The rows of one instant's edges: its pose and forearm, and the shape's numbers but the finger roots."""
    one = state.instants[k]
    bare = bare_state(one)
    bare[STATE.shape][:FOREARM_TURN] = (state.shape - contour.shape)[:FOREARM_TURN]
    information, pull, cost = gathered(contour.frames, bare)
    error, rows = compressed(information, pull, cost, RIDGE)
    jacobian, own = np.zeros((len(error), state.size)), state.own(k).start
    jacobian[:, :FOREARM_TURN] = rows[:, POSE:POSE + FOREARM_TURN]
    jacobian[:, own:own + POSE] = rows[:, :POSE]
    jacobian[:, own + POSE:own + OWN] = rows[:, POSE + FOREARM_TURN:]
    return Rows(error, jacobian, UNIT)


def free_numbers(state: FitState, instants: Sequence[int], freedom: Freedom, *, own_lengths: bool = False,
                 surface: bool = False) -> NDArray[np.bool_]:
    """(n,) which numbers may change: the poses of `instants`, and of the shape what `freedom` says. `own_lengths`: each
    phalanx's own length, not the sizes that they have in common; `surface`: thickness, radii and forearms, too."""
    free = np.zeros(state.size, np.bool_)
    for k in instants:
        own = state.own(k)
        free[own] = True
        free[own.stop - 2:own.stop] = surface
    if freedom != "pose":
        free[LENGTH:RADIUS] = True
        free[[HAND_SIZE, FINGER_SIZE]] = not own_lengths
        if surface:
            free[:ROOTS] = True
    if freedom == "roots" and not surface:
        free[ROOTS:] = True
    return free
