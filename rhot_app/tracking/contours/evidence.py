"""Slices that are asked for, contours on slices that were recorded, and joints on foreground."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rhot_app.barehand.contour_residual import ContourFrame
from rhot_app.barehand.contours import SILHOUETTE, STEP_M, ContourPoints
from rhot_app.barehand.joints import place_joints
from rhot_app.barehand.observations import EdgeFrame, ForegroundFrame
from rhot_app.barehand.tracker import BareHandTracker
from rhot_app.hand.kinematics import forward
from rhot_app.hand.motion.hand_process import MOTION
from rhot_app.hand.skeleton import HandPose
from rhot_app.state import SeenContour
from rhot_node.detect.edges import Edges
from rhot_node.wire.slices import pack_slices, unpack_slices

Array = NDArray[np.float64]

CONFUSED_M = 0.02
"""Mean distance of two hands' joints, m, from which fingers are taken for each other: neighbouring knuckles are so far
apart in the hand files."""

APART_M = 0.1
"""m: farther apart are two hands: a hand's breadth."""

NEAR_SD = 3.0
"""Standard deviations from the contour within which an edge is shown as the hand's."""

ALIKE = 0.9
"""Cosine of the largest angle between a recorded slice and the normal of the contour on it, 26 degrees."""

BESIDE_PX = 2.0
"""px: a recorded slice crosses the contour if one of its points is no farther beyond the slice's end: the points are
2 mm apart, which is about as many pixels."""


def asked(hand: BareHandTracker, camera: int, state: Array, covariance: Array, step_m: float) -> ContourFrame:
    """The slices across the contours of a hand in `state`, whose centres lie in the image, rounded as they are sent."""
    frame, model = hand.expected(camera, state, covariance, step_m), hand.cameras[camera]
    x, y = frame.slices[:, 0], frame.slices[:, 1]
    kept = (x >= 0.0) & (y >= 0.0) & (x <= model.width - 1) & (y <= model.height - 1)
    return _on(hand, camera, frame, np.flatnonzero(kept), unpack_slices(pack_slices(frame.slices[kept])))


def matched(hand: BareHandTracker, frame: EdgeFrame, state: Array, covariance: Array) -> ContourFrame | None:
    """The contour of a hand in `state` on the slices of a recorded request that cross it, with their edges; the frame
    stays as it is. None without any."""
    expected, slices = hand.expected(frame.camera, state, covariance, 0.5 * STEP_M), frame.request.slices
    if not len(expected.slices) or not len(slices):
        return None
    apart = slices[:, None, :2] - expected.pixel[None]
    distance = np.hypot(*apart.transpose(2, 0, 1))
    distance += np.where(slices[:, 2:4] @ expected.normal.T < ALIKE, 1e6, 0.0)
    nearest = np.argmin(distance, axis=1)
    order = np.argsort(expected.points.capsule[nearest], kind="stable")
    reach = distance[np.arange(len(slices)), nearest]
    order = order[(reach < slices[:, 4] + BESIDE_PX)[order]]
    if not len(order):
        return None
    contour = _on(hand, frame.camera, expected, nearest[order], slices[order])
    contour.observe(Edges(*(column[order] for column in frame.edges)))
    return contour


def _on(hand: BareHandTracker, camera: int, frame: ContourFrame, chosen: NDArray[np.int64],
        slices: Array) -> ContourFrame:
    """The frame with the chosen points on other slices."""
    p = frame.points
    points = ContourPoints(p.capsule[chosen], p.kind[chosen], p.along[chosen], p.behind[chosen], p.pixel[chosen],
                           p.normal[chosen], p.scale[chosen])
    return ContourFrame(hand.surface, points, frame.pose, frame.intrinsics, slices, frame.expected_sd[chosen],
                        frame.late_s[chosen], MOTION, frame.repeated)


def on_foreground(hand: BareHandTracker, frame: ForegroundFrame, state: Array) -> tuple[float, float]:
    """Part of the 21 joints of a hand in `state` that lie in a camera's image, and of these, that lie on foreground."""
    camera = hand.cameras[frame.camera]
    places = camera.project(joints_of(hand, state))
    with np.errstate(invalid="ignore"):
        inside = np.all((places > -0.5) & (places < [camera.width - 0.5, camera.height - 0.5]), axis=1)
    if not inside.any():
        return 0.0, 0.0
    rows, columns = frame.probability.shape
    x, y = (places[inside] // frame.step).astype(int).T
    shown = frame.probability[np.clip(y, 0, rows - 1), np.clip(x, 0, columns - 1)] > 0.5
    return float(np.mean(inside)), float(np.mean(shown))


def same_hand(hand: BareHandTracker, state: Array, pose: HandPose) -> bool:
    """Whether the hand in `state` is the one in `pose`, whose fingers are the same and which is not far away."""
    ours, theirs = joints_of(hand, state), forward(hand.model, pose).joints
    ours_centre, theirs_centre = ours.mean(axis=0), theirs.mean(axis=0)
    shape = np.linalg.norm((ours - ours_centre) - (theirs - theirs_centre), axis=1)
    return bool(np.mean(shape) < CONFUSED_M and np.linalg.norm(ours_centre - theirs_centre) < APART_M)


def joints_of(hand: BareHandTracker, state: Array) -> Array:
    """(21, 3) m of a hand in `state`."""
    points, covariances, motion = np.empty((26, 3)), np.empty((26, 3, 3)), np.empty((2, 21))
    place_joints(state, np.zeros((len(hand.process.stationary),) * 2), hand.model.dh, hand.surface.bone, points,
                 covariances, motion)
    return points[:21]


def seen_contour(camera: str, t_ns: int, frame: ContourFrame, state: Array) -> SeenContour:
    """What one image shows of a hand in `state`."""
    offset, _, good = frame.predict(state)
    centre, normal, half = frame.slices[:, :2], frame.slices[:, 2:4], frame.slices[:, 4:]
    ends = np.hstack([centre - half * normal, centre + half * normal])
    places, near = np.empty((0, 2)), np.empty(0, np.bool_)
    if frame.edges is not None:
        edges = frame.edges
        row, column = np.nonzero((np.arange(edges.offset.shape[1]) < edges.number[:, None]) & good[:, None])
        along = edges.offset[row, column]
        places = centre[row] + along[:, None] * normal[row]
        near = np.abs(along - offset[row]) < NEAR_SD * np.hypot(frame.expected_sd[row], edges.sd[row, column])
    return SeenContour(camera, t_ns, (centre + offset[:, None] * normal)[good], frame.points.behind[good] == SILHOUETTE,
                       ends[good], places, near)
