"""A depth buffer of articulated bodies: the oracle of visibility orders."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rhot_app.articulated.bodies import Bodies, Placed, layer_distances
from rhot_app.articulated.visibility import NONE
from rhot_app.geometry.camera import CameraModel

Array = NDArray[np.float64]


def depth_labels(bodies: Bodies, placed: Placed, camera: CameraModel, rays: Array,
                 where: NDArray[np.bool_] | None = None) -> tuple[NDArray[np.int64], Array]:
    """(H, W) the nearest layer of every pixel, NONE without any, and (H, W, L) m how far each is, infinite where not
    met. `rays`: `camera_rays`. `where` (H, W): the pixels that are looked at."""
    depth = np.full((*rays.shape[:2], len(bodies.layer_row)), np.inf)
    where = np.ones(depth.shape[:2], np.bool_) if where is None else where
    lines = rays[where] @ camera.camera_from_world[:3, :3]
    for layer in range(depth.shape[2]):
        found = layer_distances(bodies, placed, layer, camera.centre, lines, 0.0)
        depth[where, layer] = np.where(found > 0.0, found, np.inf)
    return np.where(np.isfinite(depth.min(axis=2)), np.argmin(depth, axis=2), NONE), depth
