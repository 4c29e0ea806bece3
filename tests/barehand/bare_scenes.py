"""Scenes of a bare hand: a rig of two cameras, a moving hand, and its pictures."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from pictures import picture, two_cameras, wall

from rhot_app.barehand.surface import SHAPE, Surface, surface_of
from rhot_app.geometry.camera import CameraModel
from rhot_app.geometry.transforms import quaternion_from_rotation
from rhot_app.hand.anatomy import HandAnatomy, load_hand
from rhot_app.hand.model import HandModel, build_model
from rhot_app.hand.motion.hand_process import ANGLES, BIAS, VELOCITY
from rhot_app.hand.skeleton import HandPose
from rhot_app.project import CameraPose, Intrinsics, Rig, RigNode
from rhot_app.simulator.scene.motion import load_motion
from rhot_node.files import resource_path
from rhot_node.markers import load_markers

DISTANCE_M = 0.55


def right_hand() -> HandAnatomy:
    return load_hand(resource_path("hands", "right.json"))


def left_hand() -> HandAnatomy:
    return load_hand(resource_path("hands", "left.json"))


@lru_cache
def model_and_surface(side: str = "right") -> tuple[HandModel, Surface]:
    model = build_model(right_hand() if side == "right" else left_hand())
    return model, surface_of(model)


def rig_of(cameras: list[CameraModel], hand: HandAnatomy) -> Rig:
    """A rig with these cameras and this hand; nobody wears its markers."""
    nodes = tuple(
        RigNode(k + 1, f"camera {k + 1}",
                Intrinsics(camera.width, camera.height, *(float(v) for v in camera.intrinsics[:4]),
                           tuple(float(v) for v in camera.intrinsics[4:])),
                CameraPose(tuple(float(v) for v in quaternion_from_rotation(camera.world_from_camera[:3, :3])),
                           tuple(float(v) for v in camera.centre)))
        for k, camera in enumerate(cameras))
    return Rig("bare", nodes, load_markers(resource_path("markers", "rhot6.json")), hand)


def state_of(pose: HandPose) -> np.ndarray:
    """The estimator's state of a hand at rest."""
    state = np.zeros(BIAS + SHAPE)
    state[:ANGLES], state[ANGLES:VELOCITY] = pose.world_from_palm[:3].ravel(), pose.angles
    return state


@lru_cache
def poses(motion: str, seconds: tuple[float, ...], side: str = "right") -> tuple[HandPose, ...]:
    model, _ = model_and_surface(side)
    moving = load_motion(motion, model, np.array([0.0, 0.0, DISTANCE_M]), 1)
    return tuple(moving.pose(t) for t in seconds)


def scene(pose: HandPose, seed: int = 0, clutter: bool = False, radii: float = 1.0,
          side: str = "right") -> tuple[list[CameraModel], list[np.ndarray], list[np.ndarray]]:
    """Two cameras, their pictures of the hand, and of the empty scene."""
    _, surface = model_and_surface(side)
    drawn = surface._replace(radii=radii * surface.radii)
    cameras = two_cameras(distance=DISTANCE_M)
    walls = [wall(camera, 10 * k + 1, clutter) for k, camera in enumerate(cameras)]
    images = [picture(drawn, pose.world_from_palm, pose.angles, camera, walls[k], seed)
              for k, camera in enumerate(cameras)]
    return cameras, images, [np.clip(one, 0, 255).astype(np.uint8) for one in walls]
