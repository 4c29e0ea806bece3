"""A palm that slides on a plane, as a residual: Rehg's 3-D mouse has one camera, to which this is the other one."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rhot_app.estimation.layout import pose_matrix
from rhot_app.estimation.residual import Rows
from rhot_app.estimation.se3 import exp_so3
from rhot_app.hand.motion.hand_state import tangent_size
from rhot_app.project import PalmPlane

Array = NDArray[np.float64]

HEIGHT_SD_M: Final = 2e-3
"""m: how far a palm that slides on a table comes off its plane. Chosen: the palm's skin gives so much."""

TILT_SD_RAD: Final = math.radians(2.0)
"""rad: how far it tilts, about each axis in the plane: HEIGHT_SD_M over the length from wrist to knuckles, 60 mm."""


class PalmOnPlane:
    """Implements `estimation.residual.Residual`: three rows, the palm's height over the plane and its two tilts. A
    state begins with world_from_palm (3, 4), its tangent space with the palm's translation and rotation, both along the
    world's axes."""

    def __init__(self, plane: PalmPlane) -> None:
        self.normal = np.array(plane.normal) / math.hypot(*plane.normal)
        self.distance_m = plane.distance_m
        seldom = np.eye(3)[int(np.argmin(np.abs(self.normal)))]
        first = np.cross(self.normal, seldom)
        first /= np.linalg.norm(first)
        self._within = np.array([first, np.cross(self.normal, first)])  # (2, 3) axes in the plane

    def linearise(self, state: Array) -> Rows:
        """See `Residual`."""
        world = pose_matrix(state)[:3]
        back = world[:, 2]
        error = np.array([self.distance_m - self.normal @ world[:, 3], *(-self._within @ back)])
        jacobian = np.zeros((3, tangent_size(state)))
        jacobian[0, :3] = self.normal
        jacobian[1:, 3:6] = np.cross(back, self._within)
        return Rows(error, jacobian, np.square([HEIGHT_SD_M, TILT_SD_RAD, TILT_SD_RAD]))

    def narrowed(self, covariance: Array) -> Array:
        """The covariance (n, n) of a tangent space that begins with a palm's pose, once the plane is known, too."""
        rows = np.zeros((3, len(covariance)))
        rows[0, :3] = self.normal / HEIGHT_SD_M
        rows[1:, 3:6] = self._within / TILT_SD_RAD
        return np.asarray(np.linalg.inv(np.linalg.inv(covariance) + rows.T @ rows))

    def met_by(self, centre: Array, place: Array) -> Array | None:
        """(3,) m where the ray from a camera's `centre` (3,) m through `place` (3,) m meets the plane; None: behind it,
        or nowhere."""
        way = place - centre
        along = float(self.normal @ way)
        part = (self.distance_m - self.normal @ centre) / along if abs(along) > 1e-9 else -1.0
        return centre + part * way if part > 0.0 else None

    def facing(self, fingers: Array) -> Array:
        """(3, 3) rotation world_from_palm of a palm that lies on the plane, its fingers along `fingers` (3,) as
        far as they can."""
        along = fingers - (self.normal @ fingers) * self.normal
        length = float(np.linalg.norm(along))
        along = self._within[0] if length < 1e-6 else along / length
        return np.column_stack([along, np.cross(self.normal, along), self.normal])

    def turns(self, count: int) -> Array:
        """(count, 3, 3) rotations world_from_palm of palms that lie on the plane, turned evenly all around."""
        first = np.column_stack([self._within[0], np.cross(self.normal, self._within[0]), self.normal])
        return np.array([exp_so3(2.0 * math.pi * k / count * self.normal) @ first for k in range(count)])
