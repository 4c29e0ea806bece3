"""What a pixel looks at: its ray, the rays of a pixel that is sampled again, and where the lamp stands.

Sampling again takes 16 rays that are a rank-1 lattice in (x, y, time), shifted at random for each pixel: stratified in
every coordinate, and no sub-pixel position prefers a time.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.geometry.camera import CameraModel, undistort_points

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

SAMPLES = 16
_STEP_Y, _STEP_T = 5, 7  # lattice generator (1, 5, 7) / 16: no two samples are close in any pair of coordinates

LIGHT = np.array([-0.42, -0.62, -0.66])  # towards the lamp, rig frame: up and to the left, behind the cameras


def ray_table(camera: CameraModel) -> Array:
    """(H + 2, W + 2, 2) normalised coordinates of the pixel centres and a border of one pixel around them."""
    y, x = np.mgrid[-1:camera.height + 1, -1:camera.width + 1]
    pixels = np.stack([x.ravel(), y.ravel()], axis=1).astype(np.float64)
    return np.asarray(undistort_points(pixels, camera.intrinsics)).reshape(camera.height + 2, camera.width + 2, 2)


def light_direction(camera: CameraModel) -> Array:
    """(3,) unit vector towards the lamp in the camera's frame."""
    light = camera.camera_from_world[:3, :3] @ LIGHT
    return np.asarray(light / np.linalg.norm(light))


@njit(cache=True, fastmath=True)
def scatter(x: int, y: int, slots: int, seed: int, rays: Array, ray: Array, slot: Indices, first: int) -> None:
    """Fill a pixel's 16 rays, from row `first` of `ray` (R, 2) on, and their moments `slot` (R,), 0 .. slots - 1 (a
    power of two up to 16)."""
    random = _hash(x, y, seed)
    shift_x, shift_y = (random & 0xFFFF) / 65536.0, ((random >> 16) & 0xFFFF) / 65536.0
    shift_t = (random >> 32) & (SAMPLES - 1)
    j, i = y + 1, x + 1
    xx, xy = 0.5 * (rays[j, i + 1, 0] - rays[j, i - 1, 0]), 0.5 * (rays[j + 1, i, 0] - rays[j - 1, i, 0])
    yx, yy = 0.5 * (rays[j, i + 1, 1] - rays[j, i - 1, 1]), 0.5 * (rays[j + 1, i, 1] - rays[j - 1, i, 1])
    for k in range(SAMPLES):
        ox = (k + shift_x) / SAMPLES - 0.5
        oy = (((_STEP_Y * k) & (SAMPLES - 1)) + shift_y) / SAMPLES - 0.5
        ray[first + k, 0] = rays[j, i, 0] + ox * xx + oy * xy
        ray[first + k, 1] = rays[j, i, 1] + ox * yx + oy * yy
        slot[first + k] = (_STEP_T * k + shift_t) & (slots - 1)


@njit(cache=True)
def _hash(x: int, y: int, seed: int) -> int:
    """48 well-mixed bits of three integers (a multiply and xor-shift hash)."""
    value = (x * 0x9E3779B1 + y * 0x85EBCA6B + seed * 0xC2B2AE35) & 0xFFFFFFFFFFFF
    value = ((value ^ (value >> 21)) * 0x2545F491) & 0xFFFFFFFFFFFF
    value = ((value ^ (value >> 17)) * 0x27D4EB2F) & 0xFFFFFFFFFFFF
    return value ^ (value >> 23)
