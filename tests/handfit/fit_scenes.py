"""A hand before two calibrated cameras, its drawn pictures, and a fit of it."""

from __future__ import annotations

from functools import lru_cache

import msgspec
import numpy as np
from bare_scenes import poses, rig_of, scene
from shipped_rig import LEFT_HAND, RIGHT_HAND

from rhot_app.geometry.camera import CameraModel
from rhot_app.hand.anatomy import HandAnatomy
from rhot_app.hand.kinematics import forward
from rhot_app.hand.model import build_model
from rhot_app.hand.skeleton import HandPose
from rhot_app.handfit.hand_shape import SHAPE_SD, SIZE, anatomy_of
from rhot_app.handfit.session import HandFit
from rhot_app.handfit.state import Image
from rhot_app.project import CameraCalibration, Rig


@lru_cache
def drawn(motion: str = "still", seconds: float = 0.2, side: str = "right") \
        -> tuple[Rig, HandPose, tuple[Image, ...]]:
    """A rig, the pose of its hand, and a picture of each camera."""
    (pose,) = poses(motion, (seconds,), side)
    cameras, images, _ = scene(pose, side=side)
    rig = rig_of(cameras, RIGHT_HAND if side == "right" else LEFT_HAND)
    return msgspec.structs.replace(rig, calibration=CameraCalibration("exact")), pose, tuple(images)


def begun(motion: str = "still", seconds: float = 0.2, side: str = "right", true_pose: bool = False) -> HandFit:
    """A fit with one instant, from where a hand is put of which nothing is known, or from the true pose."""
    rig, pose, images = drawn(motion, seconds, side)
    fit = HandFit(rig)
    fit.add_pictures(dict(enumerate(images)), pose if true_pose else None)
    return fit


def another_hand(base: HandAnatomy, seed: int, *, only: slice = slice(0, SIZE)) -> HandAnatomy:
    """A person's hand: the numbers of `only` drawn as they vary in adults."""
    shape = np.zeros(SIZE)
    shape[only] = (SHAPE_SD * np.random.default_rng(seed).standard_normal(SIZE))[only]
    return anatomy_of(base, shape)


def seen(hand: HandAnatomy, pose: HandPose, cameras: list[CameraModel]) -> list[np.ndarray]:
    """(21, 2) px of the joints of a hand, for each camera."""
    joints = forward(build_model(hand), pose).joints
    return [camera.project(joints) for camera in cameras]
