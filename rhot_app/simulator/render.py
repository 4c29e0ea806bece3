"""One camera of the twin: a moving hand becomes YUV420 frames, with each marker's visible fraction."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rhot_app.geometry.camera import CameraModel, undistort_points
from rhot_app.simulator.body import CAPSULE, PARAMETERS, HandBody
from rhot_app.simulator.sensor import Sensor
from rhot_app.simulator.trace import NODES, Moving, View, area_outside, canvas, outline, trace

Array = NDArray[np.float64]

LIGHT = np.array([-0.42, -0.62, -0.66])  # towards the lamp, rig frame: up and to the left, behind the cameras
_OUTSIDE = 400  # px beyond the border within which a marker's hidden part is counted


class PoseSource(Protocol):
    """Anything that says where the hand is at a time."""

    def sample(self, times_s: Array) -> tuple[Array, Array]:
        """world_from_palm (T, 4, 4) m and angles (T, 21) rad at times (T,) s of the scene."""
        ...


@dataclass(frozen=True, slots=True)
class Shutter:
    """Times of an exposure, s: how long each row collects light, and how much later each row is than the one above."""

    exposure_s: float
    row_time_s: float


@dataclass(frozen=True, slots=True)
class Optics:
    """How the image degrades: PSF sigma px, noise sigma in grey levels at 128 and at 0, share of shading 0..1."""

    psf_sigma_px: float
    noise_mid_grey: float
    noise_read: float
    shading: float


class FrameRenderer:
    """Renders frames of one camera. Holds work space: one thread only, results are valid until the next call."""

    def __init__(self, body: HandBody, camera: CameraModel, background: NDArray[np.float32], optics: Optics,
                 shutter: Shutter, seed: int) -> None:
        """`background` (3, H, W) grey levels 0..255 as `background.background_image` makes it."""
        height, width = camera.height, camera.width
        self.body, self.camera, self.shutter = body, camera, shutter
        self._shading, self._seed = optics.shading, seed
        self._meta = np.stack([body.kind, body.group, body.marker], axis=1)
        self._rays = ray_table(camera)
        self._canvas = canvas(np.ascontiguousarray(background, dtype=np.float32), len(body.kind), body.marker_count)
        self._sensor = Sensor(self._canvas.background, optics.psf_sigma_px, optics.noise_mid_grey, optics.noise_read,
                              seed)
        self._frame = np.empty(height * 3 // 2 * width, np.uint8)
        light = camera.camera_from_world[:3, :3] @ LIGHT
        self._light = light / np.linalg.norm(light)
        self._nodes = np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES)
        self._fit = np.linalg.inv(np.vander(self._nodes, increasing=True))

    def render(self, source: PoseSource, t_row0_s: float, number: int) -> tuple[NDArray[np.uint8], Array]:
        """Packed I420 frame (H * 3 / 2 * W,) whose row 0 is mid-exposed at `t_row0_s`, and visible fractions (M,).

        A fraction is the marker's visible part of its unhidden area, 0 when it is not in front of the camera at all.
        """
        image, box, visible = self.radiance(source, t_row0_s, number)
        self._sensor.expose(image, box, self._frame)
        x0, y0, x1, y1 = box
        image[:, y0:y1, x0:x1] = self._canvas.background[:, y0:y1, x0:x1]
        return self._frame, visible

    def radiance(self, source: PoseSource, t_row0_s: float,
                 number: int) -> tuple[NDArray[np.float32], tuple[int, int, int, int], Array]:
        """The image before lens blur and noise (3, H, W), the box that the hand touches, and visible fractions."""
        body, camera, shutter = self.body, self.camera, self.shutter
        span = (camera.height - 1) * shutter.row_time_s
        half = 0.5 * (span + shutter.exposure_s)
        middle = t_row0_s + 0.5 * span
        series = self._polynomials(source, middle + half * self._nodes)
        sweep = self._sweep(series, shutter.exposure_s / half)
        timing = np.array([-0.5 * span / half, shutter.row_time_s / half, shutter.exposure_s / half])
        moving = Moving(series, self._meta, body.size, body.rgb, body.margin, sweep)
        view = View(self._rays, camera.intrinsics, timing, self._light, self._shading)
        box = trace(moving, view, self._canvas, self._seed * 1_000_003 + number)
        whole = self._canvas.whole + self._outside(series, timing)
        fractions = np.divide(self._canvas.visible, whole, out=np.zeros_like(whole), where=whole > 0.0)
        return self._canvas.image, box, np.clip(fractions, 0.0, 1.0)

    def _polynomials(self, source: PoseSource, times_s: Array) -> Array:
        """(N, 12, NODES) power series in tau of the solids' parameters in the camera's frame."""
        world_from_palm, angles = source.sample(times_s)
        camera_from_palm = self.camera.camera_from_world @ world_from_palm
        values = self.body.place(camera_from_palm, angles)
        powers = self._fit @ values.reshape(NODES, -1)
        return np.ascontiguousarray(powers.reshape(NODES, -1, PARAMETERS).transpose(1, 2, 0))

    def _sweep(self, series: Array, exposure_tau: float) -> Array:
        """(N, 2) px: the farthest that a solid's end travels in x and y during one exposure."""
        fx, fy = self.camera.intrinsics[:2]
        sweep = np.zeros((len(series), 2))
        axis = np.where(self.body.kind == CAPSULE, 0.0, self.body.size[:, 0])[:, None]
        for tau in (-0.8, 0.0, 0.8):
            before, after = ((series @ (tau + offset) ** np.arange(NODES))
                             for offset in (-0.5 * exposure_tau, 0.5 * exposure_tau))
            for first in (0, 3):
                b, a = self._end(before, first, axis), self._end(after, first, axis)
                ahead = (b[:, 2] > 0.05) & (a[:, 2] > 0.05)
                moved = np.abs(a[:, :2] / np.maximum(a[:, 2:], 0.05) - b[:, :2] / np.maximum(b[:, 2:], 0.05))
                sweep = np.maximum(sweep, np.where(ahead[:, None], moved * (fx, fy), 0.0))
        return np.minimum(1.1 * sweep, 60.0)

    def _end(self, parameters: Array, first: int, half_length: Array) -> Array:
        """(N, 3) m: one of the two ends of every solid."""
        cylinder = parameters[:, :3] + (1.0 if first else -1.0) * half_length * parameters[:, 3:6]
        return np.where((self.body.kind == CAPSULE)[:, None], parameters[:, first:first + 3], cylinder)

    def _outside(self, series: Array, timing: Array) -> Array:
        """(M,) px^2 of each marker beyond the image's borders."""
        width, height = self.camera.width, self.camera.height
        outside = np.zeros(self.body.marker_count)
        for n in range(int((self.body.marker >= 0).sum())):  # painted solids come first
            row = series[n, :, 0].copy()
            u0, v0, u1, v1, reach = outline(self.body.kind[n], row, self.body.size, n, self.camera.intrinsics)
            if not reach > 0.0:
                continue
            x0, x1, y0, y1 = min(u0, u1) - reach, max(u0, u1) + reach, min(v0, v1) - reach, max(v0, v1) + reach
            if x0 >= 0 and y0 >= 0 and x1 <= width - 1 and y1 <= height - 1:
                continue
            limits = np.array([max(x0 - 2, -_OUTSIDE), max(y0 - 2, -_OUTSIDE), min(x1 + 3, width + _OUTSIDE),
                               min(y1 + 3, height + _OUTSIDE)]).astype(np.int64)
            outside[self.body.marker[n]] = area_outside(series, n, self.body.kind[n], self.body.size,
                                                        self.camera.intrinsics, timing, width, height, limits)
        return outside


def ray_table(camera: CameraModel) -> Array:
    """(H + 2, W + 2, 2) normalised coordinates of the pixel centres and a border of one pixel around them."""
    y, x = np.mgrid[-1:camera.height + 1, -1:camera.width + 1]
    pixels = np.stack([x.ravel(), y.ravel()], axis=1).astype(np.float64)
    return np.asarray(undistort_points(pixels, camera.intrinsics)).reshape(camera.height + 2, camera.width + 2, 2)
