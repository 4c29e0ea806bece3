"""The camera model: a pinhole with OpenCV's distortion at a known place in the world.

Points are undistorted, never images. Normalised coordinates are x/z, y/z in the camera's frame.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.polynomial import Polynomial
from numpy.typing import ArrayLike, NDArray

from rhot_app.estimation.se3 import rotation_from_quaternion
from rhot_app.geometry.transforms import rigid
from rhot_app.project import CameraPose, Intrinsics

Array = NDArray[np.float64]

_ITERATIONS = 30
_TOLERANCE_PX, _CLOSE_PX = 1e-9, 1e-6


# -- lens --------------------------------------------------------------------------------------------------------------
# A pinhole with OpenCV's rational distortion. With r2 = x^2 + y^2 in normalised coordinates,
#
#     xd = x (1 + k1 r2 + k2 r2^2 + k3 r2^3) / (1 + k4 r2 + k5 r2^2 + k6 r2^3) + 2 p1 x y + p2 (r2 + 2 x^2),   yd alike.
#
# Lenses of the usual kind have k4 = k5 = k6 = 0; wide ones need them, because their pixels grow with the angle from the
# axis while x and y grow with its tangent.

PARAMETERS = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")
"""Names of a lens's parameters in their order; the distortion in OpenCV's."""
LENS = len(PARAMETERS)
"""How many parameters a lens has."""
PLAIN = PARAMETERS.index("k4")
"""How many of them a lens of the usual kind has: those of a wide one follow."""
TANGENTIAL = PARAMETERS.index("p1"), PARAMETERS.index("p2")
"""Where p1 and p2 stand."""
_RADIAL = tuple((PARAMETERS.index(above), PARAMETERS.index(below))
                for above, below in (("k1", "k4"), ("k2", "k5"), ("k3", "k6")))  # by their power of r2
REACH = LENS
"""In a row of intrinsics, after the parameters: the squared radius x^2 + y^2 up to which the lens is invertible."""

FARTHEST_DEG = 88.0
"""From the axis: farther rays belong to no lens here, because x and y then grow without bound."""
_FARTHEST = math.tan(math.radians(FARTHEST_DEG)) ** 2

NEAREST_M = 0.02
"""m: nearer to a camera's plane than its housing, nothing is seen."""


@njit(cache=True, inline="always")
def is_wide(lens: Array) -> bool:
    """Whether a lens (12,), or a row of intrinsics, has the coefficients of a wide one."""
    return lens[9] != 0.0 or lens[10] != 0.0 or lens[11] != 0.0


def own_parameters(lens: Array) -> NDArray[np.bool_]:
    """(12,) which parameters a lens of this kind has."""
    return np.arange(LENS) < (LENS if is_wide(lens) else PLAIN)


def lens_parameters(intrinsics: Intrinsics) -> Array:
    """(12,) the lens of a rig's camera, in the order of `PARAMETERS`."""
    i = intrinsics
    return full_lens([i.fx, i.fy, i.cx, i.cy, *i.distortion])


def rig_intrinsics(size: tuple[int, int], lens: Array) -> Intrinsics:
    """A lens (12,) for images of `size` (width, height) px as rigs hold it: five coefficients unless it is wide."""
    fx, fy, cx, cy, *distortion = map(float, lens if is_wide(lens) else lens[:PLAIN])
    return Intrinsics(*size, fx, fy, cx, cy, tuple(distortion))


def full_lens(parameters: ArrayLike) -> Array:
    """(12,) a lens from its first parameters, in the order of `PARAMETERS`; the rest is zero."""
    given = np.asarray(parameters, float)
    return np.concatenate([given, np.zeros(LENS - len(given))])


def intrinsics_row(parameters: ArrayLike) -> Array:
    """(13,) a lens (see `full_lens`) and where it ends, as everything that projects or undistorts takes it."""
    lens = full_lens(parameters)
    return np.append(lens, _reach(lens[4:]))


def _reach(distortion: Array) -> float:
    """Squared radius up to which the radial distortion r N(r2) / D(r2) rises and has no pole.

    Its slope is (N D + 2 r2 (N' D - N D')) / D^2.
    """
    k1, k2, _, _, k3, k4, k5, k6 = distortion
    if not np.isfinite(distortion).all():
        return 0.0
    above, below = Polynomial([1.0, k1, k2, k3]), Polynomial([1.0, k4, k5, k6])
    slope = above * below + Polynomial([0.0, 2.0]) * (above.deriv() * below - above * below.deriv())
    ends = np.concatenate([_roots(np.asarray(slope.coef, float)), _roots(np.asarray(below.coef, float))])
    ahead = ends.real[(np.abs(ends.imag) <= 1e-9 * np.abs(ends)) & (ends.real > 0.0)]
    return float(ahead.min(initial=_FARTHEST))


def _roots(coefficients: Array) -> Array:
    """Roots of a polynomial without the highest powers that matter nowhere up to the farthest ray."""
    share = np.abs(coefficients) * _FARTHEST ** np.arange(len(coefficients))
    matters = np.flatnonzero(share > 1e-12 * share.max())
    return np.asarray(Polynomial(coefficients[:matters[-1] + 1]).roots())


@njit(cache=True, inline="always")
def project_ray(x: float, y: float, intrinsics: Array) -> tuple[float, float, float, float, float, float]:
    """The pixel of a ray (x, y, 1) and its derivatives: (u, v, du/dx, du/dy, dv/dx, dv/dy).

    `intrinsics` (13,). NaN beyond the lens's reach: what the formula gives there is the pixel of another ray.
    """
    if not x * x + y * y <= intrinsics[REACH]:
        return math.nan, math.nan, math.nan, math.nan, math.nan, math.nan
    return _formula(x, y, intrinsics)


@njit(cache=True, inline="always")
def _formula(x: float, y: float, intrinsics: Array) -> tuple[float, float, float, float, float, float]:
    k1, k2, p1, p2, k3 = intrinsics[4], intrinsics[5], intrinsics[6], intrinsics[7], intrinsics[8]
    r2 = x * x + y * y
    radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    slope = 2.0 * (k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3))  # d radial / dx = slope * x
    if is_wide(intrinsics):
        k4, k5, k6 = intrinsics[9], intrinsics[10], intrinsics[11]
        below = 1.0 / (1.0 + r2 * (k4 + r2 * (k5 + r2 * k6)))
        radial *= below
        slope = below * (slope - 2.0 * radial * (k4 + r2 * (2.0 * k5 + r2 * 3.0 * k6)))
    fx, fy = intrinsics[0], intrinsics[1]
    u = fx * (x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x)) + intrinsics[2]
    v = fy * (y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y) + intrinsics[3]
    cross = slope * x * y + 2.0 * p1 * x + 2.0 * p2 * y
    xx = radial + slope * x * x + 2.0 * p1 * y + 6.0 * p2 * x
    yy = radial + slope * y * y + 6.0 * p1 * y + 2.0 * p2 * x
    return u, v, fx * xx, fx * cross, fy * cross, fy * yy


@njit(cache=True)
def undistort_point(u: float, v: float, intrinsics: Array) -> tuple[float, float, float, float, float, float]:
    """One raw pixel to normalised coordinates: (x, y) and d(x, y)/d(u, v) row by row; NaN where there is no answer.

    `intrinsics` (13,). Newton's iteration with halved steps when a step does not help. Beyond the lens's reach no ray
    belongs to a pixel: the result is NaN, never a point on the far branch.
    """
    x, y = (u - intrinsics[2]) / intrinsics[0], (v - intrinsics[3]) / intrinsics[1]
    r2 = x * x + y * y
    if r2 > intrinsics[REACH]:
        inside = 0.99 * math.sqrt(intrinsics[REACH] / r2)
        x, y = inside * x, inside * y
    px, py, xx, xy, yx, yy = project_ray(x, y, intrinsics)
    error = math.hypot(px - u, py - v)
    for _ in range(_ITERATIONS):
        if not error > _TOLERANCE_PX:
            break
        determinant = xx * yy - xy * yx
        if not determinant > 0.0:
            break
        ex, ey = px - u, py - v
        sx, sy = (yy * ex - xy * ey) / determinant, (xx * ey - yx * ex) / determinant
        scale = 1.0
        for _ in range(6):
            nx, ny = x - scale * sx, y - scale * sy
            px, py, xx, xy, yx, yy = project_ray(nx, ny, intrinsics)
            if math.hypot(px - u, py - v) < error:
                break
            scale *= 0.5
        x, y = nx, ny
        error = math.hypot(px - u, py - v)
    determinant = xx * yy - xy * yx
    if not error < _CLOSE_PX or not determinant > 0.0:
        return math.nan, math.nan, math.nan, math.nan, math.nan, math.nan
    return x, y, yy / determinant, -xy / determinant, -yx / determinant, xx / determinant


@njit(cache=True)
def undistort_with_slope(pixels: Array, intrinsics: Array) -> tuple[Array, Array]:
    """Raw pixels (N, 2) to normalised coordinates (N, 2), and their change with the pixel (N, 2, 2); NaN as below."""
    rays, by_pixel = np.empty((len(pixels), 2)), np.empty((len(pixels), 2, 2))
    for i in range(len(pixels)):
        x, y, xu, xv, yu, yv = undistort_point(pixels[i, 0], pixels[i, 1], intrinsics)
        rays[i, 0], rays[i, 1] = x, y
        by_pixel[i, 0, 0], by_pixel[i, 0, 1], by_pixel[i, 1, 0], by_pixel[i, 1, 1] = xu, xv, yu, yv
    return rays, by_pixel


@njit(cache=True)
def undistort_points(pixels: Array, intrinsics: Array) -> Array:
    """Raw pixels (N, 2) to normalised coordinates (N, 2); NaN in, or beyond the lens, gives NaN out.

    `intrinsics` (13,), see `intrinsics_row`.
    """
    return undistort_with_slope(pixels, intrinsics)[0]


@njit(cache=True)
def project_normalised(points: Array, intrinsics: Array) -> Array:
    """Normalised coordinates (N, 2) to raw pixels (N, 2); NaN beyond the lens. `intrinsics` (13,)."""
    result = np.empty((points.shape[0], 2))
    for i in range(points.shape[0]):
        result[i, 0], result[i, 1], _, _, _, _ = project_ray(points[i, 0], points[i, 1], intrinsics)
    return result


@njit(cache=True)
def linearise_lenses(rays: Array, lenses: Array) -> tuple[Array, Array, Array]:
    """Pixels (N, 2) of rays (N, 2), each by its own lens (N, 12), and their derivatives by the ray (N, 2, 2) and by the
    lens (N, 2, 12): for an adjustment, so beyond a lens's reach, too."""
    count = len(rays)
    pixels, by_ray, by_lens = np.empty((count, 2)), np.empty((count, 2, 2)), np.zeros((count, 2, LENS))
    for i in range(count):
        x, y, lens = rays[i, 0], rays[i, 1], lenses[i]
        pixels[i, 0], pixels[i, 1], by_ray[i, 0, 0], by_ray[i, 0, 1], by_ray[i, 1, 0], by_ray[i, 1, 1] = _formula(
            x, y, lens)
        fx, fy, r2 = lens[0], lens[1], x * x + y * y
        above = 1.0 + r2 * (lens[4] + r2 * (lens[5] + r2 * lens[8]))
        below = 1.0 / (1.0 + r2 * (lens[9] + r2 * (lens[10] + r2 * lens[11])))
        by_lens[i, 0, 0], by_lens[i, 1, 1] = (pixels[i, 0] - lens[2]) / fx, (pixels[i, 1] - lens[3]) / fy
        by_lens[i, 0, 2] = by_lens[i, 1, 3] = 1.0
        by_lens[i, 0, 6], by_lens[i, 1, 6] = fx * 2.0 * x * y, fy * (r2 + 2.0 * y * y)
        by_lens[i, 0, 7], by_lens[i, 1, 7] = fx * (r2 + 2.0 * x * x), fy * 2.0 * x * y
        power = below
        for above_at, below_at in _RADIAL:
            power *= r2
            by_lens[i, 0, above_at], by_lens[i, 1, above_at] = fx * x * power, fy * y * power
            by_lens[i, 0, below_at] = -fx * x * power * above * below
            by_lens[i, 1, below_at] = -fy * y * power * above * below
    return pixels, by_ray, by_lens


@njit(cache=True)
def pixels_per_metre(slope: Array) -> float:
    """Side of a square at a point, in px per m, as a ball there covers it, by a projection's `slope` (2, 3) px/m."""
    u, v = slope[0], slope[1]
    x, y, z = u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]
    return math.sqrt(math.sqrt(x * x + y * y + z * z))


@njit(cache=True)
def scales_of(slopes: Array) -> Array:
    """(N,) `pixels_per_metre` of slopes (N, 2, 3)."""
    scales = np.empty(len(slopes))
    for n in range(len(slopes)):
        scales[n] = pixels_per_metre(slopes[n])
    return scales


@njit(cache=True)
def pixels_per_metre_facing(slope: Array, camera_from_world: Array) -> float:
    """The same of a square that faces along the camera's axis: the focal length by the depth, for a plain lens."""
    a, b, c, d = 0.0, 0.0, 0.0, 0.0
    for k in range(3):
        a += slope[0, k] * camera_from_world[0, k]
        b += slope[0, k] * camera_from_world[1, k]
        c += slope[1, k] * camera_from_world[0, k]
        d += slope[1, k] * camera_from_world[1, k]
    return math.sqrt(abs(a * d - b * c))


@njit(cache=True, inline="always")
def camera_coordinates(camera: Array, x: float, y: float, z: float) -> tuple[float, float, float]:
    """A world point, m, along a camera's axes; `camera` (3, 4) camera_from_world."""
    return (camera[0, 3] + camera[0, 0] * x + camera[0, 1] * y + camera[0, 2] * z,
            camera[1, 3] + camera[1, 0] * x + camera[1, 1] * y + camera[1, 2] * z,
            camera[2, 3] + camera[2, 0] * x + camera[2, 1] * y + camera[2, 2] * z)


@njit(cache=True, inline="always")
def project_ray_with_slope(x: float, y: float, depth: float, camera: Array, intrinsics: Array, pixel: Array,
                           slope: Array) -> bool:
    """pixel = f(x, y), slope = f'(x, y) (R_xy - (x, y) R_z) / depth: f the lens, R the rows of `camera` (3, 4).

    Fills `pixel` (2,) px of the ray (x, y, 1), and `slope` (2, 3) px/m by the world point that lies on it at `depth` m.
    False, with nothing filled, beyond the lens's reach.
    """
    if not x * x + y * y <= intrinsics[REACH]:
        return False
    pixel[0], pixel[1], ux, uy, vx, vy = project_ray(x, y, intrinsics)
    for k in range(3):
        dx, dy = (camera[0, k] - x * camera[2, k]) / depth, (camera[1, k] - y * camera[2, k]) / depth
        slope[0, k], slope[1, k] = ux * dx + uy * dy, vx * dx + vy * dy
    return True


@njit(cache=True, inline="always")
def project_point(x: float, y: float, z: float, camera: Array, intrinsics: Array, pixel: Array, slope: Array) -> bool:
    """The projection of a world point (x, y, z) m, for all compiled code: fills `pixel` (2,) px and its Jacobian
    `slope` (2, 3) px/m; False, with nothing filled, where the camera cannot see it.

    `camera` (3, 4) or (4, 4) camera_from_world, m; `intrinsics` (13,). A residual of a point p on a moving body has the
    Jacobian slope @ dp.
    """
    a, b, depth = camera_coordinates(camera, x, y, z)
    if not depth > NEAREST_M:
        return False
    return project_ray_with_slope(a / depth, b / depth, depth, camera, intrinsics, pixel, slope)


@njit(cache=True)
def project_with_slope(points: Array, camera_from_world: Array, intrinsics: Array) -> tuple[Array, Array]:
    """Raw pixels (N, 2) of world points (N, 3) m and their slopes (N, 2, 3) px/m; NaN where the camera sees nothing."""
    pixels, slopes = np.empty((len(points), 2)), np.empty((len(points), 2, 3))
    for n in range(len(points)):
        if not project_point(points[n, 0], points[n, 1], points[n, 2], camera_from_world, intrinsics, pixels[n],
                             slopes[n]):
            pixels[n], slopes[n] = math.nan, math.nan
    return pixels, slopes


def lens_rays(pixels: Array, lens: Array) -> Array:
    """Normalised coordinates (N, 2) of raw pixels (N, 2) by a lens (12,); NaN beyond it."""
    return np.asarray(undistort_points(np.ascontiguousarray(pixels), intrinsics_row(lens)))


class CameraRecord(NamedTuple):
    """A camera as compiled functions take it: `pose` (3, 4) camera_from_world and `centre` (3,), m; `intrinsics` (13,);
    `size` (2,), width and height, px."""

    pose: Array
    centre: Array
    intrinsics: Array
    size: Array


@dataclass(frozen=True, slots=True)
class CameraModel:
    """One calibrated camera.

    `width`, `height` px. `intrinsics` (13,), see `intrinsics_row`. `world_from_camera` and `camera_from_world` (4, 4),
    m.
    """

    width: int
    height: int
    intrinsics: Array
    world_from_camera: Array
    camera_from_world: Array

    def __post_init__(self) -> None:
        if self.intrinsics.shape != (LENS + 1,):
            raise ValueError(f"intrinsics of shape {self.intrinsics.shape}, not {(LENS + 1,)}: see intrinsics_row")

    @classmethod
    def from_rig(cls, intrinsics: Intrinsics, pose: CameraPose) -> CameraModel:
        """The model of a rig's camera."""
        rotation = rotation_from_quaternion(pose.rotation_wxyz)
        translation = np.array(pose.translation_m)
        return cls(intrinsics.width, intrinsics.height, intrinsics_row(lens_parameters(intrinsics)),
                   rigid(rotation, translation), rigid(rotation.T, -rotation.T @ translation))

    @property
    def record(self) -> CameraRecord:
        """The model for compiled functions."""
        return CameraRecord(np.ascontiguousarray(self.camera_from_world[:3]), self.centre.copy(), self.intrinsics,
                            np.array([self.width, self.height], float))

    @property
    def matrix(self) -> Array:
        """(3, 3) camera matrix, as OpenCV's functions take it."""
        fx, fy, cx, cy = self.intrinsics[:4]
        return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])

    @property
    def field_of_view(self) -> tuple[float, float]:
        """Angles across and down the image through the principal point, rad; as of a pinhole where it has no ray."""
        fx, fy, cx, cy = self.intrinsics[:4]
        left, right, top, low = -0.5, self.width - 0.5, -0.5, self.height - 0.5
        ends = np.array([[left, cy], [right, cy], [cx, top], [cx, low]])
        rays = self.undistort(ends)
        slopes = np.where(np.isfinite(rays), rays, (ends - (cx, cy)) / (fx, fy))
        angles = np.arctan([slopes[0, 0], slopes[1, 0], slopes[2, 1], slopes[3, 1]])
        return float(angles[1] - angles[0]), float(angles[3] - angles[2])

    @property
    def centre(self) -> Array:
        """(3,) the camera's centre in the world, m."""
        return self.world_from_camera[:3, 3]

    def project(self, points: Array) -> Array:
        """World points (N, 3) m to raw pixels (N, 2); NaN behind the camera's plane, and beyond the lens."""
        local = np.atleast_2d(points) @ self.camera_from_world[:3, :3].T + self.camera_from_world[:3, 3]
        ahead = local[:, 2] > 0.0
        normalised = local[:, :2] / np.where(ahead, local[:, 2], np.nan)[:, None]
        return np.asarray(project_normalised(np.ascontiguousarray(normalised), self.intrinsics))

    def pixels_per_metre(self, points: Array) -> Array:
        """(N,) px per m across the line of sight at world points (N, 3) m; NaN where the camera sees nothing."""
        _, slopes = project_with_slope(np.ascontiguousarray(np.atleast_2d(points)), self.camera_from_world,
                                       self.intrinsics)
        return np.asarray(scales_of(slopes))

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
