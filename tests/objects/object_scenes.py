"""What the tests of objects share: the twin's two cameras, a cube in a hand, and the corners that cameras observe."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from rhot_app.estimation.se3 import exp_so3
from rhot_app.geometry.camera import CameraModel
from rhot_app.geometry.transforms import rigid
from rhot_app.hand.anatomy import load_hand
from rhot_app.hand.model import build_model
from rhot_app.objects.object_file import ObjectModel, cube, plate
from rhot_app.objects.observations import FiducialFrame
from rhot_app.objects.state import ObjectState
from rhot_app.objects.track import ObjectTracker
from rhot_app.simulator.scene.motion import Motion
from rhot_app.simulator.scene.motion_file import load_motion
from rhot_app.simulator.scene.scene import make_scene, twin_defaults
from rhot_node.files import resource_path

Array = NDArray[np.float64]

NOISE_PX = 0.1
PERIOD_NS, ROW_NS = 25_000_000, 48_000
PALM_FROM_OBJECT = rigid(exp_so3([0.4, 0.3, 0.2]), [0.09, 0.0, -0.05])
"""Before the palm of a hand that holds the object towards the cameras."""

CUBE = cube("cube", 60.0, 45.0, "DICT_APRILTAG_36h11")
TAG = plate("tag", 1, 1, 45.0, 0.0, "DICT_APRILTAG_36h11", 10)


def wide_cameras() -> list[CameraModel]:
    """The twin's two cameras, 75 mm apart, in preset wide."""
    scene = make_scene(twin_defaults(), 1)
    return [CameraModel.from_rig(scene.intrinsics, pose) for pose in scene.poses]


def hand_poses(motion: str, times_s: Array) -> Array:
    """(N, 4, 4) world_from_object of an object in the twin's hand, 0.6 m before the cameras."""
    return np.asarray(_motion(motion).sample(times_s)[0] @ PALM_FROM_OBJECT)


@cache
def _motion(name: str) -> Motion:
    model = build_model(load_hand(resource_path("hands", "right.json")))
    return load_motion(name, model, np.array([0.0375, 0.0, 0.6]), 1)


def facing_tags(model: ObjectModel, world_from_object: Array, camera: CameraModel, most_deg: float = 75.0) -> list[int]:
    """The tags that a camera can read: they face it within `most_deg` degrees."""
    found = []
    for number, tag in enumerate(model.fiducials):
        corners = tag.corners() @ world_from_object[:3, :3].T + world_from_object[:3, 3]
        normal = np.cross(corners[1] - corners[2], corners[3] - corners[2])
        sight = camera.centre - corners.mean(axis=0)
        if normal @ sight > np.cos(np.radians(most_deg)) * np.linalg.norm(normal) * np.linalg.norm(sight):
            found.append(number)
    return found


def observe(model: ObjectModel, poses, cameras: list[CameraModel], camera: int, t_row0_ns: int, row_ns: int,
            rng: np.random.Generator, noise_px: float = NOISE_PX, hidden: float = 0.0,
            tags: list[int] | None = None) -> FiducialFrame:
    """The corners in one frame, each at its own row's time, with noise. `poses(t_s)` is world_from_object; of the
    readable tags `tags` (None: all), a share `hidden` of the corners is not observed."""
    lens = cameras[camera]
    seen = facing_tags(model, poses(1e-9 * t_row0_ns), lens)
    chosen = seen if tags is None else [number for number in seen if number in tags]
    corners = np.empty((len(chosen), 4, 2))
    for n, number in enumerate(chosen):
        for k, corner in enumerate(model.fiducials[number].corners()):
            row = 240.0
            for _ in range(3):
                pose = poses(1e-9 * (t_row0_ns + row * row_ns))
                pixel = lens.project(pose[:3, :3] @ corner + pose[:3, 3])[0]
                row = pixel[1]
            corners[n, k] = pixel
    inside = ((corners > 0) & (corners < [lens.width - 1, lens.height - 1])).all(axis=(1, 2))
    corners = corners[inside] + noise_px * rng.normal(size=corners[inside].shape)
    corners[rng.random(corners.shape[:2]) < hidden] = np.nan
    keys = np.array([model.fiducials[number].key for number, kept in zip(chosen, inside, strict=True) if kept],
                    np.int64).reshape(-1, 2)
    covariances = np.broadcast_to(noise_px**2 * np.eye(2), (*corners.shape, 2)).copy()
    return FiducialFrame(camera, t_row0_ns, row_ns, keys, corners, covariances)


def taken(tracker: ObjectTracker, frame: FiducialFrame) -> list[ObjectState]:
    """The state of every object after one frame, at the time of what the frame shows of it, or of row 0."""
    tracker.take(frame)
    newest = [track.estimate() for track in tracker.tracks]
    return [track.state(max(frame.t_row0_master_ns, 0 if found is None else found[0]))
            for track, found in zip(tracker.tracks, newest, strict=True)]
