"""Single balls before a camera, with their images computed another way: outline, area and centroid."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_app.geometry.camera import CameraModel, intrinsics_row
from rhot_app.hand.model import neutral_pose
from rhot_app.simulator.render.body import PALM_GROUP, SKIN
from rhot_app.simulator.render.camera_controls import Controls, Lamp
from rhot_app.simulator.render.exposure_samples import Shutter
from rhot_app.simulator.render.painter import Body
from rhot_app.simulator.render.render import Exposure, FrameRenderer, Optics
from rhot_app.simulator.render.solids_painter import SolidsPainter
from rhot_app.simulator.scene.motion import FACING
from rhot_app.simulator.scene.rigid_target import RigidTarget, capsules

Array = NDArray[np.float64]

FOCAL = 530.5
CAMERA = CameraModel(640, 480, intrinsics_row([FOCAL, FOCAL, 319.5, 239.5, -0.05]), np.eye(4), np.eye(4))
RELAXED = neutral_pose().angles
NEUTRAL, STEADY = Controls(), Lamp()
STILL = Shutter(0.004, 48e-6)
OPTICS = Optics(psf_sigma_px=0.7, noise_mid_grey=3.0, noise_read=1.5)


class Gliding:
    """A palm that glides at constant velocity, unturned."""

    def __init__(self, start: Array, velocity: Array | tuple[float, float, float] = (0.0, 0.0, 0.0)) -> None:
        self._start, self._velocity = np.asarray(start), np.asarray(velocity)

    def sample(self, times_s: Array) -> tuple[Array, Array]:
        transforms = np.tile(np.eye(4), (len(times_s), 1, 1))
        transforms[:, :3, 3] = self._start + times_s[:, None] * self._velocity
        return transforms, np.zeros((len(times_s), 21))


class Shown:
    """A still hand that shows the cameras its palm, or its back."""

    def __init__(self, place_m: tuple[float, float, float] = (0.0, 0.085, 0.6), *, back: bool = False,
                 angles: Array = RELAXED) -> None:
        self._pose, self._angles = np.eye(4), angles
        self._pose[:3, :3] = FACING @ np.diag([1.0, -1.0, -1.0]) if back else FACING
        self._pose[:3, 3] = place_m

    def sample(self, times_s: Array) -> tuple[Array, Array]:
        return np.tile(self._pose, (len(times_s), 1, 1)), np.tile(self._angles, (len(times_s), 1))


def balls(radii: list[float], places: list[tuple[float, float, float]], painted: list[bool]) -> RigidTarget:
    """Balls at fixed places about the prop's origin; painted ones (white) first, the others are black skin."""
    return RigidTarget(
        capsules([k % PALM_GROUP for k in range(len(radii))], [k if paint else SKIN for k, paint in enumerate(painted)],
                 radii, [(255.0, 255.0, 255.0) if paint else (0.0, 0.0, 0.0) for paint in painted]),
        ends=np.array([[place, np.add(place, (0.0, 1e-7, 0.0))] for place in places]),
        centres=np.array([place for place, paint in zip(places, painted, strict=True) if paint]))


def renderer(body: Body, shutter: Shutter = STILL, seed: int = 1, background: NDArray[np.float32] | None = None,
             shading: float = 0.0, lamp: Lamp = STEADY) -> FrameRenderer:
    """A renderer of `body` before black, or another background (3, H, W)."""
    if background is None:
        background = np.zeros((3, CAMERA.height, CAMERA.width), np.float32)
    painter = SolidsPainter(body, CAMERA, shading, seed)
    return FrameRenderer(painter, background, OPTICS, Exposure(shutter, shutter.exposure_s, lamp, NEUTRAL), seed)


def ball_image(centre: Array, radius: float) -> tuple[Array, float]:
    """Centroid (2,) px and area px^2 of a ball's image: its tangent cone, projected by OpenCV, as a polygon."""
    distance = float(np.linalg.norm(centre))
    axis = centre / distance
    side = np.cross(axis, (0.0, 1.0, 0.0))
    side /= np.linalg.norm(side)
    angles = np.linspace(0.0, 2.0 * np.pi, 720, endpoint=False)[:, None]
    around = np.cos(angles) * side + np.sin(angles) * np.cross(axis, side)
    half = np.arcsin(radius / distance)
    rim = np.cos(half) * axis + np.sin(half) * around
    outline, _ = cv2.projectPoints(rim, np.zeros(3), np.zeros(3), CAMERA.matrix, CAMERA.intrinsics[4:12])
    x, y = outline.reshape(-1, 2).T
    cross = x * np.roll(y, -1) - np.roll(x, -1) * y
    area = 0.5 * cross.sum()
    centroid = np.array([((x + np.roll(x, -1)) * cross).sum(), ((y + np.roll(y, -1)) * cross).sum()]) / (6.0 * area)
    return centroid, abs(float(area))


def brightness_centroid(image: NDArray[np.float32]) -> tuple[Array, float]:
    """Centroid (2,) px and area px^2 of what shines in a radiance image."""
    weight = image[0].astype(np.float64) / 255.0
    y, x = np.mgrid[:weight.shape[0], :weight.shape[1]]
    total = float(weight.sum())
    return np.array([(weight * x).sum(), (weight * y).sum()]) / total, total
