"""The residual of layered templates in one camera's image (Rehg 1995, 2.4 and 3.3).

Region: a template point of a link is seen in the image where the deformation function takes it (eq. 2.9), unless a
layer before its own hides it there: the window functions (eq. 3.6). Its error is the difference of the filtered values
(eq. 2.10), its Jacobian the image's gradient times that of the deformation (eq. 3.10 and 2.16).

Boundary: across the outline of a link, the image changes from the link's values to those of what lies behind, over the
width of the smoothing. The outline's motion moves that step (eq. 3.12).

A link's brightness and contrast in this image are nuisances, integrated out: lamps and shadows change them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.articulated.bodies import ANGLES, ROOT_POSE, Bodies, Placed, place, root_of
from rhot_app.articulated.outline import Outline
from rhot_app.articulated.templates import Filtered, Kind, Template, noise_gain
from rhot_app.articulated.visibility import NONE, front_layer
from rhot_app.barehand.contour_residual import DEGREES, SHAPE_SD_M
from rhot_app.barehand.contours import STEP_M, camera_centre, project
from rhot_app.estimation.residual import UNIT, Rows, compressed
from rhot_app.geometry.camera import pixels_per_metre

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

BRIGHTNESS_SD, CONTRAST_SD = 30.0, 0.3
"""Grey levels, of 255, and part of 1: how much a link's brightness and contrast change as it turns before a lamp.
Chosen: in half shade skin of 120 loses 60 levels and half of its contrast, about two standard deviations."""

ACROSS = np.array([-1.5, -0.5, 0.5, 1.5])
"""Samples across an outline, in widths of the smoothing: on both slopes of the step and at its feet."""

LENS_PX = 0.7
"""px: smoothing of the camera itself, as a standard deviation. Chosen: lenses in focus and demosaicing spread an edge
over two pixels."""

EDGE_ON = 0.25
"""Cosine of the steepest view of a surface in which a template point is compared, 75 degrees: four pixels of its
template are one there. Chosen: the bodies' own surface is not known so steeply."""

NEAR_PX = 8.0
"""px: a template's value farther from an outline says nothing of it: half of a finger at 0.5 m."""

RIDGE = 1e-6
"""1/m^2 and 1/rad^2: information of what no point shows, as good as nothing. Chosen: a Cholesky factor needs some."""


@dataclass(eq=False, slots=True)
class LayeredFrame:
    """Implements `estimation.residual.Residual`: one camera's filtered image and the templates that it should show.

    `order` (L,): the visibility order; empty: every layer is taken for visible. `pose` (3, 4), `intrinsics` (13,).
    `level`: of the templates' smoothings, that of `image` (H, W). `noise`: of a pixel, of 255. `outline`: None for
    regions only. `background` (H, W): the same filter of the scene without the object, None: nothing is known of it.
    `spread` (P, P): covariance of root and angles before the image was looked at, whose errors are no outliers.
    `used` (L,): template points that were compared, and `held` (L,) of them within three
    standard deviations, when last linearised; `reasons`: by layer, why there were none.
    """

    bodies: Bodies
    order: Indices
    pose: Array
    intrinsics: Array
    image: Filtered
    templates: list[Template]
    kind: Kind
    sigma_px: float
    level: int
    noise: float
    spread: Array
    outline: Outline | None = None
    background: Filtered | None = None
    used: Indices = field(default_factory=lambda: np.empty(0, np.int64))
    held: Indices = field(default_factory=lambda: np.empty(0, np.int64))
    reasons: dict[int, str] = field(default_factory=dict)

    def linearise(self, state: Array) -> Rows:
        """6 + A rows with the information of all points, and one with the rest of their cost."""
        count = len(self.bodies.dh.angle)
        angles = int(self.bodies.dh.angle.max()) + 1 if count else 0
        pose_size = ROOT_POSE + angles
        placed = place(self.bodies, root_of(state), state[ANGLES:ANGLES + angles])
        information, pull = np.zeros((pose_size, pose_size)), np.zeros(pose_size)
        layers = len(self.bodies.layer_row)
        self.used, self.held, self.reasons = np.zeros(layers, np.int64), np.zeros(layers, np.int64), {}
        noise = 2.0 * (self.noise * noise_gain(self.kind, self.sigma_px)) ** 2  # of image and template
        light = np.array([BRIGHTNESS_SD, CONTRAST_SD])
        shown, offset, cost = [], np.zeros((layers, 2)), 0.0
        for one in self.templates:
            values = one.values[self.level]
            chosen = np.isfinite(values)
            points, normals = one.points[chosen], one.normals[chosen]
            seen = np.zeros((len(points), 3))  # px, px, and 0: not seen, 1: seen, 2: within 3 sd
            cost += _region(self.bodies, placed, self.order, self.pose, self.intrinsics, self.image, one.layer, points,
                            normals, values[chosen], noise, light, one.spacing_m, self.spread, information, pull, seen,
                            offset[one.layer])
            self.used[one.layer] += np.count_nonzero(seen[:, 2])
            self.held[one.layer] += np.count_nonzero(seen[:, 2] > 1.0)
            shown.append(np.column_stack([np.full(len(points), one.layer), seen, values[chosen]]))
            if not seen[:, 2].any():
                self.reasons[one.layer] = "it is hidden, turned away, or outside of the picture"
        if self.outline is not None and shown:
            cost += self._boundary(placed, np.vstack(shown), offset, noise, information, pull)
        error, own = compressed(information, pull, cost, RIDGE)
        jacobian = np.zeros((len(error), len(state) - ANGLES + ROOT_POSE))
        jacobian[:, :pose_size] = own
        return Rows(error, jacobian, UNIT)

    def _boundary(self, placed: Placed, shown: Array, offset: Array, noise: float, information: Array,
                  pull: Array) -> float:
        assert self.outline is not None
        spread = np.zeros(len(self.bodies.layer_row))
        for one in self.templates:
            spread[one.layer] = one.contrast(self.level) ** 2
        return float(_boundary(self.bodies, placed, self.pose, self.intrinsics, self.image,
                               np.empty((0, 0), np.float32) if self.background is None else self.background,
                               *self.outline, shown, offset, spread, noise, math.hypot(self.sigma_px, LENS_PX),
                               self.spread, information, pull))


@njit(cache=True)
def sample(image, x, y, out):
    """Fill `out` (3,): the bilinear value at (x, y) px and its derivatives by x and y. False outside of the image."""
    column, row = math.floor(x), math.floor(y)
    if column < 0 or row < 0 or column + 1 >= image.shape[1] or row + 1 >= image.shape[0]:
        return False
    fx, fy = x - column, y - row
    a, b = float(image[row, column]), float(image[row, column + 1])
    c, d = float(image[row + 1, column]), float(image[row + 1, column + 1])
    out[0] = (a * (1.0 - fx) + b * fx) * (1.0 - fy) + (c * (1.0 - fx) + d * fx) * fy
    out[1] = (b - a) * (1.0 - fy) + (d - c) * fy
    out[2] = (c - a) * (1.0 - fx) + (d - b) * fx
    return True


@njit(cache=True)
def point_row(bodies, placed, layer, px, py, pz, g, row):
    """Fill `row` (P,): `g` (3,) times the derivative of a point of a layer at p, world, by the tangent space."""
    row[:] = 0.0
    root = placed.root
    lx, ly, lz = px - root[0, 3], py - root[1, 3], pz - root[2, 3]
    row[0], row[1], row[2] = g[0], g[1], g[2]
    row[3], row[4], row[5] = ly * g[2] - lz * g[1], lz * g[0] - lx * g[2], lx * g[1] - ly * g[0]
    at = bodies.layer_row[layer]
    while at >= 0:
        parent = bodies.dh.parent[at]
        if bodies.dh.angle[at] >= 0:
            base = root[:3] if parent < 0 else placed.frames[parent]
            sign = bodies.dh.sign[at]
            ax, ay, az = sign * base[0, 2], sign * base[1, 2], sign * base[2, 2]
            rx, ry, rz = px - base[0, 3], py - base[1, 3], pz - base[2, 3]
            row[ROOT_POSE + bodies.dh.angle[at]] += (g[0] * (ay * rz - az * ry) + g[1] * (az * rx - ax * rz)
                                                + g[2] * (ax * ry - ay * rx))
        at = parent


def layer_covariance(bodies: Bodies, placed: Placed, layer: int, point: Array, covariance: Array) -> Array:
    """(3, 3) m^2, world: of a `point` (3,) of a layer, world, by that of root and angles (P, P)."""
    rows = np.empty((3, len(covariance)))
    for axis, direction in enumerate(np.eye(3)):
        point_row(bodies, placed, layer, point[0], point[1], point[2], direction, rows[axis])
    return np.asarray(rows @ covariance @ rows.T)


@njit(cache=True)
def _form(matrix, row):
    """Of a `row` (P,): row matrix row^T."""
    total = 0.0
    for i in range(row.shape[0]):
        if row[i] != 0.0:
            for j in range(row.shape[0]):
                total += row[i] * matrix[i, j] * row[j]
    return total


@njit(cache=True)
def _region(bodies, placed, order, pose, intrinsics, image, layer, points, normals, values, noise, light, spacing_m,
            expected, information, pull, seen, offset):
    """Add the information of a template; fill `seen` (K, 3) px, px, 0 to 2 as above, and `offset` (2,):
    brightness and contrast in this image. Returns the cost."""
    count, size = points.shape[0], pull.shape[0]
    base = placed.root[:3] if bodies.layer_row[layer] < 0 else placed.frames[bodies.layer_row[layer]]
    rows, error, variance, wide = np.zeros((count, size)), np.zeros(count), np.ones(count), np.ones(count)
    o, pixel, slope, g, value = np.empty(3), np.empty(2), np.empty((2, 3)), np.empty(3), np.empty(3)
    camera_centre(pose, o)
    mean, used = 0.0, 0
    for k in range(count):
        mean += values[k] / count
    lit = np.zeros((3, 3))  # normal matrix of brightness and contrast, and their right side
    lit[0, 0], lit[1, 1] = 1.0 / light[0] ** 2, 1.0 / light[1] ** 2
    for k in range(count):
        p, n = points[k], normals[k]
        x = base[0, 3] + base[0, 0] * p[0] + base[0, 1] * p[1] + base[0, 2] * p[2]
        y = base[1, 3] + base[1, 0] * p[0] + base[1, 1] * p[1] + base[1, 2] * p[2]
        z = base[2, 3] + base[2, 0] * p[0] + base[2, 1] * p[1] + base[2, 2] * p[2]
        ux, uy, uz = x - o[0], y - o[1], z - o[2]
        far = math.sqrt(ux * ux + uy * uy + uz * uz)
        facing = -(ux * (base[0, 0] * n[0] + base[0, 1] * n[1] + base[0, 2] * n[2])
                   + uy * (base[1, 0] * n[0] + base[1, 1] * n[1] + base[1, 2] * n[2])
                   + uz * (base[2, 0] * n[0] + base[2, 1] * n[1] + base[2, 2] * n[2])) / far
        if not facing > EDGE_ON or not project(x, y, z, pose, intrinsics, pixel, slope):
            continue
        if not sample(image, pixel[0], pixel[1], value):
            continue
        if order.shape[0] and layer != front_layer(bodies, placed, order, o[0], o[1], o[2], ux / far, uy / far,
                                                   uz / far):
            continue
        seen[k, 0], seen[k, 1], seen[k, 2] = pixel[0], pixel[1], 1.0
        for i in range(3):
            g[i] = value[1] * slope[0, i] + value[2] * slope[1, i]
        point_row(bodies, placed, layer, x, y, z, g, rows[k])
        error[k] = values[k] - value[0]
        scale = pixels_per_metre(slope)
        dense = max(1.0, (STEP_M / spacing_m) ** 2)
        variance[k] = noise + dense * (value[1] ** 2 + value[2] ** 2) * (SHAPE_SD_M * scale) ** 2
        wide[k] = variance[k] + _form(expected, rows[k])
        used += 1
        w, v = 1.0 / wide[k], values[k] - mean
        lit[0, 0] += w
        lit[0, 1] += w * v
        lit[1, 1] += w * v * v
        lit[0, 2] -= w * error[k]
        lit[1, 2] -= w * v * error[k]
    cost = 1.116 * (count - used)  # 5 log(1 + 1/4): of a point that errs by one standard deviation
    if used == 0:
        return cost
    determinant = lit[0, 0] * lit[1, 1] - lit[0, 1] ** 2
    offset[0] = (lit[1, 1] * lit[0, 2] - lit[0, 1] * lit[1, 2]) / determinant
    offset[1] = (lit[0, 0] * lit[1, 2] - lit[0, 1] * lit[0, 2]) / determinant
    common, drawn = np.zeros((2, size)), np.zeros(2)
    a00, a01, a11 = 1.0 / light[0] ** 2, 0.0, 1.0 / light[1] ** 2
    for k in range(count):
        if seen[k, 2] == 0.0:
            continue
        v = values[k] - mean
        left = error[k] + offset[0] + offset[1] * v
        square = left * left / wide[k]
        cost += (DEGREES + 1.0) * math.log(1.0 + square / DEGREES)
        if square < 9.0:
            seen[k, 2] = 2.0
        w = (DEGREES + 1.0) / (DEGREES + square) / variance[k]
        a00 += w
        a01 += w * v
        a11 += w * v * v
        drawn[0] += w * error[k]
        drawn[1] += w * v * error[k]
        for i in range(size):
            if rows[k, i] != 0.0:
                wi = w * rows[k, i]
                pull[i] += wi * error[k]
                common[0, i] += wi
                common[1, i] += wi * v
                for j in range(i + 1):
                    information[i, j] += wi * rows[k, j]
    determinant = a00 * a11 - a01 * a01
    b00, b01, b11 = a11 / determinant, -a01 / determinant, a00 / determinant
    for i in range(size):  # brightness and contrast are integrated out
        p, q = b00 * common[0, i] + b01 * common[1, i], b01 * common[0, i] + b11 * common[1, i]
        pull[i] -= p * drawn[0] + q * drawn[1]
        for j in range(i + 1):
            information[i, j] -= p * common[0, j] + q * common[1, j]
    for i in range(size):
        for j in range(i):
            information[j, i] = information[i, j]
    return cost


@njit(cache=True)
def _nearest(shown, layer, x, y, offset, means):
    """The value of the nearest seen template point of a layer, in this image's light; NaN farther than NEAR_PX."""
    best, value = NEAR_PX * NEAR_PX, math.nan
    for k in range(shown.shape[0]):
        if shown[k, 0] == layer and shown[k, 3] > 0.0:
            square = (shown[k, 1] - x) ** 2 + (shown[k, 2] - y) ** 2
            if square < best:
                best = square
                value = shown[k, 4] - offset[layer, 0] - offset[layer, 1] * (shown[k, 4] - means[layer])
    return value


@njit(cache=True)
def _boundary(bodies, placed, pose, intrinsics, image, background, layers, behind, points, pixels, across, shown,
              offset, spread, noise, width, expected, information, pull):
    """Add the information of the outline; see `Outline` for `layers` to `across`. Returns the cost."""
    size, cost = pull.shape[0], 0.0
    means, number = np.zeros(offset.shape[0]), np.zeros(offset.shape[0])
    for k in range(shown.shape[0]):
        means[int(shown[k, 0])] += shown[k, 4]
        number[int(shown[k, 0])] += 1.0
    for i in range(means.shape[0]):
        means[i] /= max(number[i], 1.0)
    pixel, slope, g, row, value = np.empty(2), np.empty((2, 3)), np.empty(3), np.empty(size), np.empty(3)
    for k in range(layers.shape[0]):
        layer = layers[k]
        nx, ny = across[k, 0], across[k, 1]
        inner = _nearest(shown, layer, pixels[k, 0], pixels[k, 1], offset, means)
        if math.isnan(inner):
            continue
        reach = 2.0 * width
        variance = noise + spread[layer]
        if behind[k] == NONE:
            if background.shape[0] == 0 or not sample(background, pixels[k, 0] + reach * nx, pixels[k, 1] + reach * ny,
                                                      value):
                continue
            outer = value[0]
        else:
            outer = _nearest(shown, behind[k], pixels[k, 0] + reach * nx, pixels[k, 1] + reach * ny, offset, means)
            variance += spread[behind[k]]
        if math.isnan(outer):
            continue
        base = placed.root[:3] if bodies.layer_row[layer] < 0 else placed.frames[bodies.layer_row[layer]]
        p = points[k]
        x = base[0, 3] + base[0, 0] * p[0] + base[0, 1] * p[1] + base[0, 2] * p[2]
        y = base[1, 3] + base[1, 0] * p[0] + base[1, 1] * p[1] + base[1, 2] * p[2]
        z = base[2, 3] + base[2, 0] * p[0] + base[2, 1] * p[1] + base[2, 2] * p[2]
        if not project(x, y, z, pose, intrinsics, pixel, slope):
            continue
        moved = nx * (pixel[0] - pixels[k, 0]) + ny * (pixel[1] - pixels[k, 1])
        for i in range(3):
            g[i] = nx * slope[0, i] + ny * slope[1, i]
        point_row(bodies, placed, layer, x, y, z, g, row)
        scale = math.sqrt(g[0] ** 2 + g[1] ** 2 + g[2] ** 2)
        step, motion = outer - inner, _form(expected, row)
        for s in range(ACROSS.shape[0]):
            e = ACROSS[s] * width
            if not sample(image, pixels[k, 0] + e * nx, pixels[k, 1] + e * ny, value):
                continue
            t = (e - moved) / width
            predicted = inner + step * 0.5 * (1.0 + math.erf(t / math.sqrt(2.0)))
            slant = -step * math.exp(-0.5 * t * t) / (width * math.sqrt(2.0 * math.pi))
            whole = variance + (slant * SHAPE_SD_M * scale) ** 2
            error = value[0] - predicted
            square = error * error / (whole + slant * slant * motion)
            cost += (DEGREES + 1.0) * math.log(1.0 + square / DEGREES)
            w = (DEGREES + 1.0) / (DEGREES + square) / whole
            for i in range(size):
                if row[i] != 0.0:
                    wi = w * slant * row[i]
                    pull[i] += wi * error
                    for j in range(size):
                        information[i, j] += wi * slant * row[j]
    return cost
