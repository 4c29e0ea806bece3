"""Scenes of a bare hand: a rig of two cameras, a moving hand, and its pictures."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from pictures import picture, two_cameras, wall
from shipped_markers import RHOT6
from shipped_rig import LEFT_MODEL, RIGHT_HAND, RIGHT_MODEL

from rhot_app.barehand.start import start_pose_file
from rhot_app.barehand.surface import Surface, surface_of
from rhot_app.estimation.se3 import exp_so3, quaternion_from_rotation
from rhot_app.evaluation.contour_tracker import SearchedNodes
from rhot_app.geometry.camera import LENS, CameraModel, rig_intrinsics
from rhot_app.hand.anatomy import HandAnatomy
from rhot_app.hand.model import HandModel
from rhot_app.hand.motion.hand_state import STATE
from rhot_app.hand.skeleton import HandPose
from rhot_app.project import CameraPose, Rig, RigNode, TrackerSettings
from rhot_app.simulator.scene.motion_file import load_motion
from rhot_app.tracking.scene import make_tracker
from rhot_node.detect.foreground import Foreground, learn_background, skin_foreground

DISTANCE_M = 0.55


@lru_cache
def model_and_surface(side: str = "right") -> tuple[HandModel, Surface]:
    model = RIGHT_MODEL if side == "right" else LEFT_MODEL
    return model, surface_of(model)


def rig_of(cameras: list[CameraModel], hand: HandAnatomy = RIGHT_HAND, shown: Sequence[HandPose] = ()) -> Rig:
    """A rig with these cameras and this hand; nobody wears its markers. `shown`: the start poses of its hands."""
    nodes = tuple(
        RigNode(k + 1, f"camera {k + 1}",
                rig_intrinsics((camera.width, camera.height), camera.intrinsics[:LENS]),
                CameraPose(tuple(float(v) for v in quaternion_from_rotation(camera.world_from_camera[:3, :3])),
                           tuple(float(v) for v in camera.centre)))
        for k, camera in enumerate(cameras))
    return Rig("bare", nodes, RHOT6, hand, tracker=TrackerSettings(start_poses=tuple(map(start_pose_file, shown))))


def near(pose: HandPose, seed: int = 0) -> HandPose:
    """A pose about as far from another one as a person's is from a picture of it."""
    rng = np.random.default_rng([seed, 0x57A])
    world = pose.world_from_palm.copy()
    world[:3, 3] += rng.normal(0.0, 0.01, 3)
    world[:3, :3] = exp_so3(rng.normal(0.0, 0.12, 3)) @ world[:3, :3]
    return HandPose(world, pose.angles + rng.normal(0.0, 0.12, len(pose.angles)))


def state_of(pose: HandPose) -> np.ndarray:
    """The estimator's state of a hand at rest."""
    state = np.zeros(STATE.shape.stop)
    state[STATE.palm], state[STATE.angles] = pose.world_from_palm[:3].ravel(), pose.angles
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


def learnt(empty: Sequence[np.ndarray]) -> list[Foreground]:
    """What each camera knows that has learnt the empty scene."""
    return [learn_background(skin_foreground(), [image]) for image in empty]


class ShownNodes(SearchedNodes):
    """Nodes that have learnt the empty scene, and are shown one picture after the other; `number` is the next one's."""

    def __init__(self, rig: Rig, empty: Sequence[np.ndarray], **options: Any) -> None:
        super().__init__(make_tracker(rig), learnt(empty), len(rig.markers.ids), **options)
        self.number = 0

    @property
    def tracked(self) -> bool:
        """Whether the newest state has all hands of the rig."""
        newest = self.states[-1] if self.states else None
        return newest is not None and newest.tracked and (newest.other is None or newest.other.tracked)

    def show(self, images: Sequence[np.ndarray | None], frames: int = 1,
             pixels: Sequence[np.ndarray] | None = None) -> None:
        """The same images in so many frames."""
        for _ in range(frames):
            self.step(self.number, images, pixels)
            self.number += 1

    def show_until(self, done: Callable[[], bool], images: Sequence[np.ndarray | None], frames: int,
                   pixels: Sequence[np.ndarray] | None = None) -> None:
        """The same images until it is `done`, in so many frames at most."""
        last = self.number + frames
        while not done():
            assert self.number < last, f"not within {frames} frames"
            self.show(images, 1, pixels)

    def show_until_tracked(self, images: Sequence[np.ndarray | None], frames: int = 40,
                           pixels: Sequence[np.ndarray] | None = None) -> None:
        """The same images until a hand is followed."""
        self.show_until(lambda: self.tracked, images, frames, pixels)
