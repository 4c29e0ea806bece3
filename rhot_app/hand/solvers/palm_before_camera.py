"""Where a palm is whose points one camera sees."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_app.estimation.se3 import exp_so3
from rhot_app.geometry.transforms import rigid

Array = NDArray[np.float64]


def palms_before_camera(points: Array, rays: Array, camera_from_world: Array) -> list[Array]:
    """world_from_palm (4, 4) of a palm whose `points` (P, 3) m, palm's frame, at least three, a camera of pose
    `camera_from_world` (3, 4) sees along `rays` (P, 2), undistorted, at depth 1. A palm is nearly flat, so each is
    followed by its mirror image along the line of sight, which looks alike (Terzakis and Lourakis 2020: SQPnP).
    None when all rays are one."""
    try:
        _, turns, shifts, _ = cv2.solvePnPGeneric(points, rays, np.eye(3), None, flags=cv2.SOLVEPNP_SQPNP)
    except cv2.error:  # all rays are one
        return []
    rotation, shift = camera_from_world[:, :3], camera_from_world[:, 3]
    places = []
    for vector, away in zip(turns, shifts, strict=True):
        turn, away = exp_so3(vector.ravel()), away.ravel()
        middle = turn @ points.mean(axis=0) + away
        line = middle / np.linalg.norm(middle)
        mirrored = (np.eye(3) - 2.0 * np.outer(line, line)) @ turn @ np.diag([1.0, 1.0, -1.0])
        for one in (turn, mirrored):
            places.append(rigid(rotation.T @ one, rotation.T @ (middle - one @ points.mean(axis=0) - shift)))
    return [place for place in places if np.isfinite(place).all()]
