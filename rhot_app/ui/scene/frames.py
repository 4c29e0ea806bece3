"""From the rig frame to the screen's world (z up).

Meshes take the rig frame as the left camera's: x right, y down, z away. A rig whose world lies on a table (`up` is z)
is brought into such axes at the scene's door, with the table on the floor grid.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rhot_app.project import CameraPose, Intrinsics
from rhot_app.tracking.state import HandState
from rhot_app.ui.scene.floor import TABLE_ORIGIN

Array = NDArray[np.float64]

DISPLAY_FROM_RIG: Array = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""Rotation: right stays right, away from the camera becomes +y, up becomes +z."""


Up = Literal["-y", "z"]
"""Which axis of the rig frame points up, as the rig says."""


def camera_like(points: Array, up: Up) -> Array:
    """Rig-frame points (..., 3) m in axes like the left camera's."""
    return points if up == "-y" else (points + np.array(TABLE_ORIGIN)) @ DISPLAY_FROM_RIG


def camera_like_state(state: HandState, up: Up) -> HandState:
    """What the scene draws of `state` and of its other hand, in axes like the left camera's."""
    if up == "-y":
        return state
    turn = DISPLAY_FROM_RIG.T
    palm = state.world_from_palm.copy()
    palm[:3, :3] = turn @ palm[:3, :3]
    palm[:3, 3] = camera_like(palm[:3, 3], up)
    return replace(state, marker_positions=camera_like(state.marker_positions, up), world_from_palm=palm,
                   joint_positions=camera_like(state.joint_positions, up),
                   fingertip_positions=camera_like(state.fingertip_positions, up),
                   marker_covariances=turn @ state.marker_covariances @ turn.T,
                   joint_covariances=turn @ state.joint_covariances @ turn.T,
                   fingertip_covariances=turn @ state.fingertip_covariances @ turn.T,
                   other=None if state.other is None else camera_like_state(state.other, up))


def to_display(points: Array) -> Array:
    """Rig-frame points or directions (..., 3) in the scene's frame, same unit."""
    return np.asarray(points @ DISPLAY_FROM_RIG.T)


def rotation_of(wxyz: tuple[float, float, float, float]) -> Array:
    """(3, 3) rotation of a unit quaternion wxyz."""
    w, x, y, z = np.asarray(wxyz, dtype=np.float64) / np.linalg.norm(wxyz)
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])


def frustum_lines(intrinsics: Intrinsics, pose: CameraPose, depth_m: float, up: Up = "-y") -> Array:
    """A camera's field of view up to `depth_m` as line segments (20, 3), pairs of ends, scene frame, m.

    Four edges from the centre to the corners, the far rectangle, and a small roof over its top edge that says where
    the picture's up is. Distortion is left out: at this size it cannot be seen.
    """
    u = np.array([-0.5, intrinsics.width - 0.5, intrinsics.width - 0.5, -0.5])
    v = np.array([-0.5, -0.5, intrinsics.height - 0.5, intrinsics.height - 0.5])
    corners = depth_m * np.stack([(u - intrinsics.cx) / intrinsics.fx, (v - intrinsics.cy) / intrinsics.fy,
                                  np.ones(4)], axis=1)
    roof = 0.5 * (corners[0] + corners[1]) + np.array([0.0, -0.18 * np.ptp(corners[:, 1]), 0.0])
    centre = np.zeros(3)
    segments = [end for corner in corners for end in (centre, corner)]
    segments += [end for k in range(4) for end in (corners[k], corners[(k + 1) % 4])]
    segments += [corners[0], roof, roof, corners[1]]
    in_rig = np.array(segments) @ rotation_of(pose.rotation_wxyz).T + np.asarray(pose.translation_m)
    return to_display(camera_like(in_rig, up))
