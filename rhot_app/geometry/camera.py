"""The camera model: a pinhole with OpenCV's distortion (k1, k2, p1, p2, k3) at a known place in the world.

Points are undistorted, never images. Normalised coordinates are x/z, y/z in the camera's frame.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.geometry.transforms import rigid, rotation_from_quaternion
from rhot_app.project import CameraPose, Intrinsics

Array = NDArray[np.float64]

_ITERATIONS = 30
_TOLERANCE = 1e-12  # normalised units: 1e-9 px at any focal length in use


@njit(cache=True)
def distort(x: float, y: float, distortion: Array) -> tuple[float, float, float, float, float, float]:
    """Distorted normalised coordinates and their derivatives: (xd, yd, dxd/dx, dxd/dy, dyd/dx, dyd/dy)."""
    k1, k2, p1, p2, k3 = distortion[0], distortion[1], distortion[2], distortion[3], distortion[4]
    r2 = x * x + y * y
    radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    slope = 2.0 * (k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3))  # d radial / dx = slope * x
    xd = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x)
    yd = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y
    cross = slope * x * y + 2.0 * p1 * x + 2.0 * p2 * y
    xx = radial + slope * x * x + 2.0 * p1 * y + 6.0 * p2 * x
    yy = radial + slope * y * y + 6.0 * p1 * y + 2.0 * p2 * x
    return xd, yd, xx, cross, cross, yy


@njit(cache=True)
def undistort_point(u: float, v: float, intrinsics: Array) -> tuple[float, float, float, float, float, float]:
    """One raw pixel to normalised coordinates: (x, y) and d(x, y)/d(u, v) row by row; NaN where there is no answer.

    Newton's iteration with halved steps when a step does not help. Beyond the radius where the distortion polynomial
    turns over no ray belongs to a pixel: the result is NaN, never a point on the far branch.
    """
    fx, fy, cx, cy = intrinsics[0], intrinsics[1], intrinsics[2], intrinsics[3]
    distortion = intrinsics[4:9]
    xd, yd = (u - cx) / fx, (v - cy) / fy
    x, y = xd, yd
    px, py, xx, xy, yx, yy = distort(x, y, distortion)
    error = math.hypot(px - xd, py - yd)
    for _ in range(_ITERATIONS):
        if not error > _TOLERANCE:
            break
        determinant = xx * yy - xy * yx
        if not determinant > 0.0:
            break
        ex, ey = px - xd, py - yd
        sx, sy = (yy * ex - xy * ey) / determinant, (xx * ey - yx * ex) / determinant
        scale = 1.0
        for _ in range(6):
            nx, ny = x - scale * sx, y - scale * sy
            px, py, xx, xy, yx, yy = distort(nx, ny, distortion)
            if math.hypot(px - xd, py - yd) < error:
                break
            scale *= 0.5
        x, y = nx, ny
        error = math.hypot(px - xd, py - yd)
    determinant = xx * yy - xy * yx
    if not error < 1e-9 or not determinant > 0.0 or not _before_turn(x, y, distortion):
        return math.nan, math.nan, math.nan, math.nan, math.nan, math.nan
    return x, y, yy / determinant / fx, -xy / determinant / fy, -yx / determinant / fx, xx / determinant / fy


@njit(cache=True)
def _before_turn(x: float, y: float, distortion: Array) -> bool:
    """Whether the radial polynomial still rises everywhere between the optical axis and (x, y)."""
    k1, k2, k3 = distortion[0], distortion[1], distortion[4]
    limit = x * x + y * y
    for step in range(1, 9):
        r2 = limit * step / 8.0
        if 1.0 + r2 * (3.0 * k1 + r2 * (5.0 * k2 + r2 * 7.0 * k3)) <= 0.0:
            return False
    return True


@njit(cache=True)
def undistort_points(pixels: Array, intrinsics: Array) -> Array:
    """Raw pixels (N, 2) to normalised coordinates (N, 2); NaN in, or beyond the lens, gives NaN out.

    `intrinsics` (9,): fx, fy, cx, cy, k1, k2, p1, p2, k3.
    """
    result = np.empty((pixels.shape[0], 2))
    for i in range(pixels.shape[0]):
        x, y, _, _, _, _ = undistort_point(pixels[i, 0], pixels[i, 1], intrinsics)
        result[i, 0] = x
        result[i, 1] = y
    return result


@njit(cache=True)
def project_normalised(points: Array, intrinsics: Array) -> Array:
    """Normalised coordinates (N, 2) to raw pixels (N, 2)."""
    result = np.empty((points.shape[0], 2))
    for i in range(points.shape[0]):
        xd, yd, _, _, _, _ = distort(points[i, 0], points[i, 1], intrinsics[4:9])
        result[i, 0] = intrinsics[0] * xd + intrinsics[2]
        result[i, 1] = intrinsics[1] * yd + intrinsics[3]
    return result


@dataclass(frozen=True, slots=True)
class CameraModel:
    """One calibrated camera.

    `width`, `height` px. `intrinsics` (9,): fx, fy, cx, cy, k1, k2, p1, p2, k3. `world_from_camera` and
    `camera_from_world` (4, 4), m.
    """

    width: int
    height: int
    intrinsics: Array
    world_from_camera: Array
    camera_from_world: Array

    @classmethod
    def from_rig(cls, intrinsics: Intrinsics, pose: CameraPose) -> CameraModel:
        """The model of a rig's camera."""
        i = intrinsics
        rotation = rotation_from_quaternion(pose.rotation_wxyz)
        translation = np.array(pose.translation_m)
        return cls(i.width, i.height, np.array([i.fx, i.fy, i.cx, i.cy, *i.distortion]),
                   rigid(rotation, translation), rigid(rotation.T, -rotation.T @ translation))

    @property
    def matrix(self) -> Array:
        """(3, 3) camera matrix, as OpenCV's functions take it."""
        fx, fy, cx, cy = self.intrinsics[:4]
        return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])

    @property
    def centre(self) -> Array:
        """(3,) the camera's centre in the world, m."""
        return self.world_from_camera[:3, 3]

    def project(self, points: Array) -> Array:
        """World points (N, 3) m to raw pixels (N, 2); a point at or behind the camera's plane gives NaN."""
        local = np.atleast_2d(points) @ self.camera_from_world[:3, :3].T + self.camera_from_world[:3, 3]
        ahead = local[:, 2] > 0.0
        normalised = local[:, :2] / np.where(ahead, local[:, 2], np.nan)[:, None]
        return np.asarray(project_normalised(np.ascontiguousarray(normalised), self.intrinsics))

    def undistort(self, pixels: Array) -> Array:
        """Raw pixels (N, 2) to normalised coordinates (N, 2)."""
        return np.asarray(undistort_points(np.ascontiguousarray(np.atleast_2d(pixels)), self.intrinsics))


# -- centre of the silhouette of a marker with a body ------------------------------------------------------------------
# A sphere of radius r whose centre stands at the angle phi from the optical axis, at distance D, is seen between
# tan(phi - alpha) and tan(phi + alpha) with sin(alpha) = r / D. The middle of the two is
#
#     sin(phi) cos(phi) / (cos(phi)^2 - sin(alpha)^2) = tan(phi) / (1 - r^2 / Z^2),    Z = D cos(phi),
#
# exactly as if the centre stood at Z - r^2 / Z: every camera sees it too near, and so does triangulation. A cylinder,
# and a capsule or band, does the same across its axis. 26 mm of wrist at 0.6 m make 1.1 mm of depth.
#
# An ellipsoid with centre c and shape matrix A (x^T A^-1 x = 1 on its surface) is seen as the conic with the dual
# matrix A - c c^T (Hartley and Zisserman 2004, 8.3), whose centre is
#
#     x = (X Z - A_xz) / (Z^2 - A_zz),    y alike,
#
# which for a sphere, A = r^2 I, is the formula above.

@njit(cache=True)
def point_rays(rays: Array, cameras: Array, shape: Array, position: Array, out: Array) -> None:
    """Normalised coordinates of a marker's centre from those of its silhouette's centroid.

    `rays` (C, 2) as seen; `cameras` (C, 3, 4) camera_from_world; `shape` (3, 3) m^2, the marker's ellipsoid in the
    world's axes (r^2 I for a sphere); `position` (3,) m where the rays as they are meet, at Z' = Z - A_zz / Z.
    Writes `out` (C, 2); unchanged rays for a point inside the body or unknown.
    """
    for c in range(rays.shape[0]):
        out[c] = rays[c]
        near = cameras[c, 2, 3]
        for k in range(3):
            near += cameras[c, 2, k] * position[k]
        xz, yz, zz = 0.0, 0.0, 0.0
        for i in range(3):
            for j in range(3):
                half = shape[i, j] * cameras[c, 2, j]
                xz += cameras[c, 0, i] * half
                yz += cameras[c, 1, i] * half
                zz += cameras[c, 2, i] * half
        if not (math.isfinite(near) and near > 2.0 * math.sqrt(max(zz, 0.0))):
            continue
        z = 0.5 * (near + math.sqrt(near * near + 4.0 * zz))
        out[c, 0] = rays[c, 0] * (1.0 - zz / (z * z)) + xz / (z * z)
        out[c, 1] = rays[c, 1] * (1.0 - zz / (z * z)) + yz / (z * z)


def ball(radius: float) -> Array:
    """Shape matrix (3, 3) m^2 of a sphere; of a point for radius 0."""
    return radius**2 * np.eye(3)


def ellipsoid(rotation: Array, half_axes: Array) -> Array:
    """Shape matrix (3, 3) m^2 of an ellipsoid whose `half_axes` (3,) m lie along the columns of `rotation` (3, 3)."""
    return np.asarray((rotation * np.square(half_axes)) @ rotation.T)
