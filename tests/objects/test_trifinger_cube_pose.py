"""A real coloured cube in three calibrated cameras: its pose from the quadrilaterals of its colour masks.

The images have no tags. Each face counts as a tag of 65 mm; which of its corners is which follows from the other faces.
"""

from __future__ import annotations

from itertools import product
from pathlib import Path

import cv2
import numpy as np
import pytest

from rhot_app.geometry.camera import CameraModel, intrinsics_row
from rhot_app.geometry.transforms import inverse
from rhot_app.objects.motion import CameraArrays
from rhot_app.objects.object_file import cube
from rhot_app.objects.observations import FiducialFrame, ObjectPoints
from rhot_app.objects.pose import ObjectPose, estimate_pose

FOLDERS = [Path(__file__).resolve().parents[3] / "shared" / "data" / "trifinger_cube",
           Path("/work/shared/data/trifinger_cube")]
FOLDER = next((one for one in FOLDERS if one.is_dir()), FOLDERS[0])
ANGLES = 60, 180, 300
SIZE_MM, CORNER_PX = 65.0, 1.5  # the size of the cube; standard deviation of a mask's corner
FACES = {"y": 0, "c": 1, "b": 3, "m": 4, "g": 5}  # in the order of `cube`: +z, +x, -z, -x, +y, -y; as the images show
CUBE = cube("cube", SIZE_MM, SIZE_MM, "DICT_4X4_50")
POINTS = ObjectPoints(CUBE)

pytestmark = pytest.mark.skipif(not FOLDER.is_dir(), reason=f"real images are not there ({FOLDER})")


def load_camera(angle: int) -> CameraModel:
    """Of plain YAML, which cv2.FileStorage does not read."""
    text = (FOLDER / f"camera_calib_{angle}.yml").read_text()

    def numbers(name: str) -> np.ndarray:
        part = text.split(f"\n{name}:")[1].split("data:")[1].split("rows:")[0]
        return np.array([float(value) for value in part.replace("- ", "").split()])

    matrix, transform = numbers("camera_matrix").reshape(3, 3), numbers("tf_world_to_camera").reshape(4, 4)
    lens = [matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2], *numbers("distortion_coefficients")]
    return CameraModel(540, 540, intrinsics_row(lens), inverse(transform), transform)


def quadrilateral(path: Path) -> np.ndarray:
    """(4, 2) px: the corners of a mask's convex hull, clockwise as the image shows them."""
    alpha = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    assert alpha is not None
    contours, _ = cv2.findContours((alpha[:, :, 3] > 127).astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    hull = cv2.convexHull(max(contours, key=cv2.contourArea))
    for share in np.arange(0.01, 0.15, 0.005):
        corners = cv2.approxPolyDP(hull, share * cv2.arcLength(hull, True), True)[:, 0].astype(np.float64)
        if len(corners) == 4:
            (ax, ay), (bx, by) = corners[2] - corners[0], corners[3] - corners[1]
            return corners if ax * by > ay * bx else corners[::-1].copy()
    raise AssertionError(f"{path} is no quadrilateral")


Quads = dict[tuple[int, str], np.ndarray]


def pose_of(quads: Quads, arrays: CameraArrays) -> ObjectPose | None:
    views = []
    for camera in range(len(ANGLES)):
        own = [(FACES[name], quad) for (seen, name), quad in quads.items() if seen == camera]
        if own:
            corners = np.array([quad for _, quad in own])
            frame = FiducialFrame(camera, 0, 0, np.array([CUBE.fiducials[face].key for face, _ in own], np.int64),
                                  corners, np.broadcast_to(CORNER_PX**2 * np.eye(2), (*corners.shape, 2)).copy())
            view = POINTS.view(frame)
            assert view is not None
            views.append(view)
    return estimate_pose(POINTS, arrays, views)


def aligned(quads: Quads, cameras: list[CameraModel], world_from_object: np.ndarray) -> tuple[float, Quads]:
    """The quadrilaterals, each begun at the corner nearest to the pose's top left one, and their distance from it."""
    total, found = 0.0, {}
    for (camera, name), quad in quads.items():
        corners = CUBE.fiducials[FACES[name]].corners() @ world_from_object[:3, :3].T + world_from_object[:3, 3]
        pixels = cameras[camera].project(corners)
        best = min(range(4), key=lambda k: float(np.linalg.norm(np.roll(quad, k, axis=0) - pixels)))
        found[camera, name] = np.roll(quad, best, axis=0)
        total += float(np.linalg.norm(found[camera, name] - pixels, axis=1).sum())
    return total, found


def test_the_cube_is_where_it_lies() -> None:
    cameras = [load_camera(angle) for angle in ANGLES]
    arrays = CameraArrays.of(cameras)
    quads = {(camera, name): quadrilateral(path) for camera, angle in enumerate(ANGLES) for name in FACES
             if (path := FOLDER / f"{name}{angle}.png").exists()}
    assert len(quads) == 9
    trials = []
    for key, turn in product(quads, range(4)):
        alone = pose_of({key: np.roll(quads[key], turn, axis=0)}, arrays)
        if alone is not None:
            trials += [aligned(quads, cameras, one) for one in (alone.world_from_object, alone.second)
                       if one is not None]
    found = pose_of(min(trials, key=lambda pair: pair[0])[1], arrays)
    assert found is not None
    centre, up = found.world_from_object[:3, 3], found.world_from_object[2, 2]
    expected = np.array([-0.014, -0.024, np.clip(centre[2], 0.028, 0.0325)])
    assert np.linalg.norm(centre - expected) < 0.010
    assert up > np.cos(np.radians(8.0)), "the yellow face is the upper one"
    assert found.rms_px < 6.0
