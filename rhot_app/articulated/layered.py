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
from scipy.spatial import cKDTree
from scipy.special import ndtr

from rhot_app.articulated.bodies import ANGLES, ROOT_POSE, Bodies, Placed, place
from rhot_app.articulated.templates import Filtered, ImageFilter, Template, noise_gain
from rhot_app.articulated.visibility import NONE, front_layers
from rhot_app.barehand.contour_residual import DEGREES, SHAPE_SD_M
from rhot_app.barehand.contours import STEP_M
from rhot_app.estimation.layout import pose_matrix
from rhot_app.estimation.residual import UNIT, Rows, compressed
from rhot_app.geometry.camera import CameraRecord, project_with_slope, scales_of
from rhot_app.hand.kinematics import chain_row

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

LIGHT_SD = np.array([30.0, 0.3])
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

_OUTLIER = 3.0  # standard deviations


@dataclass(eq=False, slots=True)
class LayeredFrame:
    """Implements `estimation.residual.Residual`: one camera's filtered image and the templates that it should show.

    `order` (L,): the visibility order; empty: every layer is taken for visible. `level`: of the templates' smoothings,
    that of `image` (H, W). `noise`: of a pixel, of 255. `outline`: None for regions only. `background` (H, W): the same
    filter of the scene without the object, None: nothing is known of it. `spread` (P, P): covariance of root and angles
    before the image was looked at, whose errors are no outliers. `used` (L,): template points that were compared, and
    `held` (L,) of them within three standard deviations, when last linearised, none of a template whose contrast the
    image does not have: a plain surface agrees with any template but for that; `reasons`: by layer, why there were
    none.
    """

    bodies: Bodies
    order: Indices
    camera: CameraRecord
    image: Filtered
    templates: list[Template]
    kind: ImageFilter
    sigma_px: float
    level: int
    noise: float
    spread: Array
    outline: np.recarray | None = None
    background: Filtered | None = None
    used: Indices = field(init=False)
    held: Indices = field(init=False)
    reasons: dict[int, str] = field(init=False)

    def linearise(self, state: Array) -> Rows:
        """6 + A rows with the information of all points, and one with the rest of their cost."""
        size, count = len(self.spread), len(self.bodies.layer_row)
        placed = place(self.bodies, pose_matrix(state), state[ANGLES:ANGLES + size - ROOT_POSE])
        frames = np.concatenate([placed.frames, placed.root[None, :3]])[self.bodies.layer_row]
        normal = _Normal(np.zeros((size, size)), np.zeros(size))
        self.used, self.held, shown = np.zeros(count, np.int64), np.zeros(count, np.int64), {}
        if self.templates:
            shown = self._regions(placed, frames, normal)
        self.reasons = {one.layer: "it is hidden, turned away, or outside of the picture" for one in self.templates
                        if not self.used[one.layer]}
        if self.outline is not None and len(self.outline) and shown:
            self._boundary(self.outline, placed, frames, shown, normal)
        error, own = compressed(normal.information, normal.pull, normal.cost, RIDGE)
        jacobian = np.zeros((len(error), len(state) - ANGLES + ROOT_POSE))
        jacobian[:, :size] = own
        return Rows(error, jacobian, UNIT)

    @property
    def _noise(self) -> float:
        """Variance of the difference of image and template."""
        return 2.0 * (self.noise * noise_gain(self.kind, self.sigma_px)) ** 2

    def _regions(self, placed: Placed, frames: Array, normal: _Normal) -> dict[int, tuple[cKDTree, Array]]:
        """Add what the templates say. Returns for each layer the pixels in which its template is seen, and the values
        that its outline is expected to have there."""
        good = [np.isfinite(one.values[self.level]) for one in self.templates]
        points, normals, values = (np.concatenate([column[own] for column, own in zip(columns, good, strict=True)])
                                   for columns in ([one.points for one in self.templates],
                                                   [one.normals for one in self.templates],
                                                   [one.values[self.level] for one in self.templates]))
        number = np.repeat(np.arange(len(good)), [np.count_nonzero(own) for own in good])
        layer = np.array([one.layer for one in self.templates])[number]
        places, normals = _in_world(frames[layer], points, 1.0), _in_world(frames[layer], normals, 0.0)
        rays = places - self.camera.centre
        rays /= np.linalg.norm(rays, axis=1, keepdims=True)
        pixels, slopes = project_with_slope(places, self.camera.pose, self.camera.intrinsics)
        found, gradient = sample(self.image, pixels)
        seen = np.isfinite(found) & (-np.sum(rays * normals, axis=1) > EDGE_ON)
        if len(self.order):
            seen[seen] = front_layers(self.bodies, placed, self.order, self.camera.centre, rays[seen]) == layer[seen]
        # a point that is not seen costs as much as one that errs by one standard deviation
        normal.cost += float(_cost(np.ones(np.count_nonzero(~seen))).sum())
        mean = np.bincount(number, values) / np.maximum(np.bincount(number), 1)
        light = np.zeros((len(values), len(good), 2))  # Jacobian by brightness and contrast of each template
        light[np.arange(len(values)), number] = np.column_stack([np.ones(len(values)), values - mean[number]])
        layer, values, light = layer[seen], values[seen], light.reshape(len(values), -1)[seen]
        rows = chain_rows(self.bodies.dh, placed.root, placed.frames, self.bodies.layer_row[layer], places[seen],
                          (gradient[seen, None] @ slopes[seen])[:, 0])
        error, dense = values - found[seen], np.array([STEP_M / one.spacing_m for one in self.templates])[number[seen]]
        variance = self._noise + np.maximum(1.0, dense**2) * np.sum(gradient[seen]**2, axis=1) * (
            SHAPE_SD_M * scales_of(slopes[seen])) ** 2
        wide = variance + np.sum((rows @ self.spread) * rows, axis=1)
        by_light, prior = light / wide[:, None], np.diag(np.tile(LIGHT_SD**-2.0, len(good)))
        lamp = np.linalg.solve(prior + by_light.T @ light, by_light.T @ error)
        offset = light @ lamp
        square = (error - offset) ** 2 / wide
        self.used += np.bincount(layer, minlength=len(frames))
        lit = np.abs(lamp[1::2]) < _OUTLIER * LIGHT_SD[1]
        self.held += np.bincount(layer[(square < _OUTLIER**2) & lit[number[seen]]], minlength=len(frames))
        normal.add(rows, error, square, variance, light, prior)
        # The sign is opposite to the formula's: a link that seems to have another brightness is misplaced more often.
        # Without the term a finger is lost in one of five films of `benchmarks/templates.py`; with the formula's sign
        # fingers were 8 to 13 degrees off in three of four.
        return {one: (cKDTree(pixels[seen][layer == one]), (values + offset)[layer == one]) for one in np.unique(layer)}

    def _boundary(self, line: np.recarray, placed: Placed, frames: Array, shown: dict[int, tuple[cKDTree, Array]],
                  normal: _Normal) -> None:
        """Add what the outline says."""
        width, (layer, behind, pixel, across) = math.hypot(self.sigma_px, LENS_PX), (
            line[name] for name in ("layer", "behind", "pixel", "across"))
        beside, contrast = pixel + 2.0 * width * across, np.zeros(len(frames) + 1)  # the last: no layer
        for one in self.templates:
            contrast[one.layer] = one.contrast(self.level) ** 2
        inner, outer = np.full((2, len(line)), np.nan)
        for number, seen in shown.items():
            inner[layer == number] = _nearest(seen, pixel[layer == number])
            outer[behind == number] = _nearest(seen, beside[behind == number])
        if self.background is not None:
            outer = np.where(behind == NONE, sample(self.background, beside)[0], outer)
        places = _in_world(frames[layer], line["point"], 1.0)
        pixels, slopes = project_with_slope(places, self.camera.pose, self.camera.intrinsics)
        g = (across[:, None] @ slopes)[:, 0]
        rows = chain_rows(self.bodies.dh, placed.root, placed.frames, self.bodies.layer_row[layer], places, g)
        step, moved = outer - inner, np.sum(across * (pixels - pixel), axis=1)
        reach = width * ACROSS[:, None]  # (4, K) from here on
        value = sample(self.image, (pixel + reach[..., None] * across).reshape(-1, 2))[0].reshape(len(ACROSS), -1)
        t = (reach - moved) / width
        error, slant = value - inner - step * ndtr(t), -step * np.exp(-0.5 * t * t) / (width * math.sqrt(2.0 * math.pi))
        variance = (self._noise + contrast[layer] + contrast[behind]
                    + (slant * SHAPE_SD_M * np.linalg.norm(g, axis=1)) ** 2)
        square = error**2 / (variance + slant**2 * np.sum((rows @ self.spread) * rows, axis=1))
        good = np.isfinite(square)
        normal.add((slant[..., None] * rows)[good], error[good], square[good], variance[good])


@dataclass(slots=True)
class _Normal:
    """Normal equations: `information` (P, P) and gradient `pull` (P,), and the `cost`, -2 log likelihood."""

    information: Array
    pull: Array
    cost: float = 0.0

    def add(self, rows: Array, error: Array, square: Array, variance: Array, nuisance: Array | None = None,
            prior: Array | None = None) -> None:
        """Add observations (K,) with Jacobians `rows` (K, P), weighed as of Student's t by their `square` (K,),
        squared errors in variances. `nuisance` (K, n): Jacobian by numbers with a `prior` information (n, n), which are
        integrated out."""
        self.cost += float(_cost(square).sum())
        weight = (DEGREES + 1.0) / (DEGREES + square) / variance
        weighted = rows * weight[:, None]
        self.information += weighted.T @ rows
        self.pull += weighted.T @ error
        if nuisance is not None and prior is not None:
            common = nuisance.T @ weighted
            solved = np.linalg.solve(prior + (nuisance.T * weight) @ nuisance,
                                     np.column_stack([common, nuisance.T @ (weight * error)]))
            self.information -= common.T @ solved[:, :-1]
            self.pull -= common.T @ solved[:, -1]


def _cost(square: Array) -> Array:
    return np.asarray((DEGREES + 1.0) * np.log1p(square / DEGREES))


def sample(image: Filtered, places: Array) -> tuple[Array, Array]:
    """(K,) bilinear values of an image (H, W) at `places` (K, 2) px, and their derivatives (K, 2) by x and y; NaN
    outside of the image."""
    corner = np.floor(places)
    inside = np.all((corner >= 0) & (corner + 1 < image.shape[::-1]), axis=1)
    x, y = np.where(inside[:, None], corner, 0).astype(int).T
    fx, fy = (places - corner).T
    a, b, c, d = (image[y + j, x + i].astype(np.float64) for j in (0, 1) for i in (0, 1))
    value = (a * (1.0 - fx) + b * fx) * (1.0 - fy) + (c * (1.0 - fx) + d * fx) * fy
    slope = np.column_stack([(b - a) * (1.0 - fy) + (d - c) * fy, (c - a) * (1.0 - fx) + (d - b) * fx])
    return np.where(inside, value, np.nan), slope


def _nearest(seen: tuple[cKDTree, Array], places: Array) -> Array:
    """(K,) the value of the nearest seen template point to `places` (K, 2) px; NaN farther than NEAR_PX."""
    _, index = seen[0].query(places, distance_upper_bound=NEAR_PX)
    return np.asarray(np.append(seen[1], np.nan)[index])


def _in_world(frames: Array, vectors: Array, last: float) -> Array:
    """(K, 3) points (`last` 1) or directions (`last` 0) of frames (K, 3, 4), in the world."""
    return np.asarray((frames @ np.column_stack([vectors, np.full(len(vectors), last)])[:, :, None])[:, :, 0])


@njit(cache=True)
def chain_rows(dh, root, frames, layer_rows, points, gradients):
    """(K, P) gradients (K, 3) times the Jacobian of points (K, 3), world, by root and angles; each rides on its row of
    `layer_rows` (K,) of the table."""
    out = np.zeros((len(points), ROOT_POSE + np.max(dh.angle) + 1))
    for k in range(len(points)):
        chain_row(dh, root, frames, layer_rows[k], points[k, 0], points[k, 1], points[k, 2], gradients[k], out[k])
    return out
