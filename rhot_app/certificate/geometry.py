"""How lengths and distances are taken of a rig: from the line between its lenses, straight ahead, and upwards."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.geometry.camera import CameraModel
from rhot_app.project import Rig

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class RigAxes:
    """`centre` (3,) m: the middle of all lenses. `ahead` (3,): the mean of the optical axes, at right angles to the
    line between the first and the last lens. `axes` (3, 3), rows: right, up and away of the rig frame."""

    centre: Array
    ahead: Array
    axes: Array

    def depth(self, places: Array) -> Array:
        """(N,) m: how far (N, 3) m lie before the line between the lenses, straight ahead, as a ruler is laid."""
        return np.asarray((places - self.centre) @ self.ahead)

    def distance(self, places: Array) -> Array:
        """(N,) m from the middle of the lenses."""
        return np.asarray(np.linalg.norm(places - self.centre, axis=1))

    def rig_axes(self, vectors: Array) -> Array:
        """(N, 3): right, up and away."""
        return np.asarray(vectors @ self.axes.T)


def axes_of(rig: Rig) -> RigAxes:
    """The axes of a rig; in disparity mode those of the two parallel cameras that it assumes."""
    if rig.depth.mode == "disparity":
        centre, ahead, along = np.array([0.5 * rig.depth.baseline_m, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]), np.eye(3)[0]
    else:
        cameras = [CameraModel.from_rig(node.intrinsics, node.pose) for node in rig.nodes]
        centres = np.array([camera.world_from_camera[:3, 3] for camera in cameras])
        ahead = np.mean([camera.world_from_camera[:3, 2] for camera in cameras], axis=0)
        centre, along = centres.mean(axis=0), centres[-1] - centres[0]
        length = float(np.linalg.norm(along))
        along = along / length if length > 0.0 else cameras[0].world_from_camera[:3, 0]
        ahead = ahead - (ahead @ along) * along
        ahead = ahead / np.linalg.norm(ahead)
    up = np.array([0.0, 0.0, 1.0] if rig.up == "z" else [0.0, -1.0, 0.0])
    away = ahead - (ahead @ up) * up
    size = float(np.linalg.norm(away))
    away = away / size if size > 1e-6 else np.cross(along, up)
    return RigAxes(centre, ahead, np.stack([np.cross(away, up), up, away]))
