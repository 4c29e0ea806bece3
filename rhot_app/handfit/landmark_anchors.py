"""Anchors of all joints from the landmark networks, and the poses that they suggest to begin a fit from."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rhot_app.geometry.camera import CameraModel
from rhot_app.hand.kinematics import forward
from rhot_app.hand.model import HandModel, neutral_pose
from rhot_app.hand.skeleton import JOINT_SLICES, HandPose
from rhot_app.hand.solvers.palm_fit import palms_before_camera
from rhot_app.handfit.state import Anchor, Instant
from rhot_app.progress import Progress
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
