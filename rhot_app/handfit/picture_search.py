"""Searches pictures of an instant for the hand: for its joints by the landmark networks, whose anchors suggest poses to
begin a fit from, and for its contours, as the bare hand's tracker does.

Images of one instant are weighed once. Each pass halves how far from the contour an edge may be.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import msgspec
import numpy as np
from numpy.typing import NDArray

from rhot_app.barehand.contour_residual import in_a_fit
from rhot_app.barehand.contours import STEP_M
from rhot_app.barehand.start import START_SD
from rhot_app.barehand.surface import FOREARM_TURN
from rhot_app.barehand.tracker import START_PASSES, BareHandTracker
from rhot_app.errors import CalibrationError
from rhot_app.geometry.camera import CameraModel
from rhot_app.hand.anatomy import HandAnatomy
from rhot_app.hand.kinematics import forward
from rhot_app.hand.model import HandModel, neutral_pose
from rhot_app.hand.motion.hand_state import MOTION, POSE, SHAPE
from rhot_app.hand.skeleton import JOINT_SLICES, HandPose
from rhot_app.hand.solvers.palm_fit import palms_before_camera
from rhot_app.handfit.solve import Evidence, Freedom, Solver, free_numbers
from rhot_app.handfit.state import Anchor, Contour, FitState, Instant, bare_state
from rhot_app.progress import Progress
from rhot_app.project import Rig
from rhot_node.detect.edges import find_edges, noise_of
from rhot_node.detect.foreground import Foreground, learn_skin
from rhot_node.landmarks.networks import open_hand_networks

Array = NDArray[np.float64]

_PALM = [0, *(joints.start for joints in JOINT_SLICES)]  # the wrist and each digit's root


def landmark_anchors(instant: Instant, right: bool, progress: Progress) -> tuple[Anchor, ...]:
    """Where each picture of an instant shows the joints of a right or left hand; those of pictures with such a hand.
    Raises KeypointError without networks."""
    networks, found = open_hand_networks(), []
    for number, (camera, image) in enumerate(sorted(instant.images.items())):
        progress("looking for the hand", number / len(instant.images))
        hands = [hand for hand in networks.find(np.ascontiguousarray(image[..., ::-1])) if (hand.right >= 0.5) == right]
        if hands:
            places = max(hands, key=lambda hand: hand.presence).landmarks
            height, width = image.shape[:2]
            found += [Anchor(camera, joint, (float(x), float(y))) for joint, (x, y) in enumerate(places)
                      if 0.0 <= x <= width - 1 and 0.0 <= y <= height - 1]
    return tuple(found)


def poses_of(anchors: Sequence[Anchor], model: HandModel, cameras: Sequence[CameraModel]) -> list[HandPose]:
    """Open hands whose palm lies where the anchors of one camera show it."""
    own, found = forward(model, neutral_pose(np.eye(4))).joints, []
    for camera in sorted({one.camera for one in anchors}):
        seen = {one.joint: one.pixel for one in anchors if one.camera == camera and one.joint in _PALM}
        if len(seen) > 3:
            rays = cameras[camera].undistort(np.array(list(seen.values())))
            found += [neutral_pose(place) for place in palms_before_camera(
                own[list(seen)], rays, cameras[camera].camera_from_world[:3])]
    return found


def fit_to_contours(solver: Solver, rig: Rig, state: FitState, instants: Sequence[int], freedom: Freedom,
                    anchor_sd_px: float) -> FitState:
    """The state after the contours of some instants were searched and fitted, from where the hand is now; anchors and
    priors count, too. Raises CalibrationError when an instant has no picture, or when no edge of the hand is found."""
    reference = state
    evidence = Evidence(reference, START_SD[:2], anchor_sd_px)
    free = free_numbers(state, instants, freedom, surface=True)
    contours: list[Contour | None] = [None] * len(state.instants)
    learnt = {k: [(learn_skin(image), noise_of(image)) for _, image in sorted(state.instants[k].images.items())]
              for k in instants}
    spread = solver.covariance(state, evidence) * np.outer(free, free)
    for number in range(START_PASSES):
        step_m = STEP_M if number == START_PASSES - 1 else 2.0 * STEP_M
        surface = solver.shapes.anatomy(state.shape)
        for k in instants:
            contours[k] = _search(surface, rig, state, k, 0.25**number * spread, step_m, learnt[k])
        state = solver.solve(state, replace(evidence, contours=contours), free)
    for k in instants:
        contour = contours[k]
        if contour is None or contour.found == 0.0:
            raise CalibrationError(f"No edge of the hand was found in {state.instants[k].name}. Bring the outline near "
                                   "the hand first: drag the wrist, the knuckles and the fingertips there.")
        state = state.change(k, replace(state.instants[k], contour=contour))
    return state


def _tracker(rig: Rig, hand: HandAnatomy, instant: Instant) -> BareHandTracker:
    """A tracker of the cameras that have a picture, in the rig's order. Raises CalibrationError when none has."""
    if not instant.images:
        raise CalibrationError(f"{instant.name} has no picture yet. Take pictures, or open picture files.")
    nodes = tuple(rig.nodes[camera] for camera in sorted(instant.images))
    return BareHandTracker(msgspec.structs.replace(rig, nodes=nodes, hand=hand, depth=type(rig.depth)()),
                           known_size=False)


def _search(hand: HandAnatomy, rig: Rig, state: FitState, k: int, spread: Array, step_m: float,
            learnt: Sequence[tuple[Foreground, float]]) -> Contour:
    """The edges near the contours of the hand at one instant; `spread` (n, n): the state's covariance; `learnt`: of
    each picture, the colours of skin and the noise."""
    instant = state.instants[k]
    tracker = _tracker(rig, hand, instant)
    bare, covariance = bare_state(instant), np.zeros((MOTION + SHAPE, MOTION + SHAPE))
    first = state.own(k).start
    ours = np.concatenate([np.arange(first, first + POSE), np.arange(FOREARM_TURN), first + POSE + np.arange(2)])
    theirs = np.concatenate([np.arange(POSE), MOTION + np.arange(SHAPE)])
    covariance[np.ix_(theirs, theirs)] = spread[np.ix_(ours, ours)]
    frames = []
    for number, (_, image) in enumerate(sorted(instant.images.items())):
        frame = in_a_fit(tracker.expected_contour(number, bare, covariance, step_m))
        frame.observe(find_edges(image, frame.slices, *learnt[number]))
        frames.append(frame)
    return Contour(state.shape, tuple(frames))
