"""Occlusion of one hand by another in a camera's image: of its contour, and of its foreground."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.barehand.contour_residual import ContourFrame
from rhot_app.barehand.contours import INNER, JUMP_M, OUTSIDE_M
from rhot_app.barehand.silhouette import FOREARM_M, FOREARM_SPREAD, rasterise
from rhot_app.barehand.surface import FOREARM, posed_in, ray_to_capsule
from rhot_app.barehand.tracker import BareHandTracker
from rhot_app.geometry.camera import CameraModel

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Capsules = tuple[Array, Array]
"""`centres` (N, 2, 3) m and `radii` (N, 2) m of a hand and its forearm."""


def capsules_in(hand: BareHandTracker, state: Array) -> Capsules:
    """The capsules of a hand in `state`, with the forearm to the elbow."""
    posed = posed_in(hand.surface, state)
    centres, radii = posed.centres, posed.radii
    for k in np.flatnonzero(hand.surface.group == FOREARM):
        along = centres[k, 1] - centres[k, 0]
        centres[k, 1] = centres[k, 0] + FOREARM_M / np.linalg.norm(along) * along
        radii[k, 1] = radii[k, 0] + FOREARM_SPREAD * FOREARM_M
    return centres, radii


def visible(hand: BareHandTracker, frame: ContourFrame, camera: CameraModel, state: Array, other: Capsules) -> Mask:
    """Which points (K,) of a hand's contour in `state` the `other` hand does not occlude. Sets `frame.points.behind` to
    INNER where the other hand lies behind the contour: there is skin on both sides."""
    points = frame.points
    posed = posed_in(hand.surface, state)
    along = points.along[:, None]
    ends, r = posed.centres[points.capsule], posed.radii[points.capsule]
    axis = (1.0 - along) * ends[:, 0] + along * ends[:, 1] - camera.centre
    r_there = (1.0 - points.along) * r[:, 0] + points.along * r[:, 1]
    far = np.sqrt(np.maximum(np.sum(axis * axis, axis=1) - r_there**2, 0.0))
    outside = points.pixel + (OUTSIDE_M * points.scale)[:, None] * points.normal
    met = _nearest(camera.centre, _rays(camera, outside), *other)
    points.behind[np.isfinite(met)] = INNER
    return np.asarray(met > far + JUMP_M)


def occluded_pixels(camera: CameraModel, other: Capsules, shape: tuple[int, int], step: int) -> Mask:
    """Which of every `step`-th pixel, an array of `shape`, the `other` hand occludes. Includes a margin of one such
    pixel, the accuracy of its contour."""
    mask = np.zeros(shape, np.uint8)
    rasterise(*other, np.ascontiguousarray(camera.camera_from_world[:3]), camera.intrinsics, step, 1.0, mask)
    return mask > 0


def _rays(camera: CameraModel, pixels: Array) -> Array:
    """(K, 3) unit directions, world, of pixels (K, 2)."""
    rays = np.column_stack([camera.undistort(pixels), np.ones(len(pixels))]) @ camera.world_from_camera[:3, :3].T
    return np.asarray(rays / np.linalg.norm(rays, axis=1, keepdims=True))


@njit(cache=True)
def _nearest(o, rays, centres, radii):
    """(K,) m: distance along each ray (K, 3) from `o` (3,) to the nearest capsule; inf without any."""
    found = np.full(rays.shape[0], np.inf)
    for i in range(rays.shape[0]):
        for k in range(centres.shape[0]):
            t = ray_to_capsule(o, rays[i], centres, radii, k)
            if 0.0 < t < found[i]:
                found[i] = t
    return found
