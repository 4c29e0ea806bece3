"""A depth buffer of articulated bodies: the oracle of visibility orders."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.articulated.bodies import Bodies, Placed, hit_layer
from rhot_app.articulated.visibility import NONE
from rhot_app.geometry.camera import CameraModel

Array = NDArray[np.float64]


def depth_labels(bodies: Bodies, placed: Placed, camera: CameraModel, rays: Array,
                 where: NDArray[np.bool_] | None = None) -> tuple[NDArray[np.int64], Array]:
    """(H, W) the nearest layer of every pixel, NONE without any, and (H, W, L) m how far each is, infinite where not
    met. `rays`: `camera_rays`. `where` (H, W): the pixels that are looked at."""
    depth = np.full((*rays.shape[:2], len(bodies.layer_row)), np.inf)
    where = np.ones(depth.shape[:2], np.bool_) if where is None else where
    _fill(bodies, placed, camera.centre.copy(), rays @ camera.camera_from_world[:3, :3], where, depth)
    return np.where(np.isfinite(depth.min(axis=2)), np.argmin(depth, axis=2), NONE), depth


@njit(cache=True)
def _fill(bodies, placed, o, rays, where, depth):
    for y in range(rays.shape[0]):
        for x in range(rays.shape[1]):
            if not where[y, x]:
                continue
            u = rays[y, x]
            for layer in range(depth.shape[2]):
                t = hit_layer(bodies, placed, layer, o[0], o[1], o[2], u[0], u[1], u[2], 0.0)
                if t > 0.0:
                    depth[y, x, layer] = t
