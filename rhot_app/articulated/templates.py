"""Templates of links: image values at points of a link's surface, seen from one side (Rehg 1995, 2.4.1).

The thesis paints a template on a plane in the link. Here every pixel of the reference image lies where its line of
sight meets the link's surface: of a box that is the plane of a face, of a capsule its round side. Values never change
after they are taken, so that errors do not add up (Matthews, Ishikawa and Baker 2004). A link that turns gets further
views.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_app.articulated.bodies import Bodies, Placed, frame_of, layer_distances, normals_at
from rhot_app.geometry.camera import CameraRecord

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Image = NDArray[np.uint8]
Filtered = NDArray[np.float32]

ImageFilter = Literal["raw", "log"]

SIGMAS_PX = (4.0, 2.0, 1.0)
"""px: smoothing of images and templates, one after the other: the first widens the range of convergence, the last is
what lenses and demosaicing smooth anyway."""

SPACING_PX, SPACING_M = 2, 2e-3
"""px and m between template points, at least: twice the least smoothing, where noise is nearly independent, and half of
the length over which a surface errs alike (`contours.STEP_M`)."""

FACING = 0.5
"""Cosine of the steepest view of a surface at which a template point is taken, 60 degrees: there a pixel is two."""

VIEW_COSINE = 0.9
"""Views of a link are farther apart than this angle, 26 degrees: foreshortening changes by a tenth."""

LEAST_POINTS = 12
"""Fewer template points than twice a rigid body's freedoms are no template."""

CONTRAST = 3.0
"""Standard deviations of noise that a template's texture must have: less would be noise in 1 of 400."""


def filtered(image: Image, kind: ImageFilter, sigma_px: float) -> Filtered:
    """(H, W) the luma of an image (H, W, 3) RGB, smoothed; ``log``: its Laplacian of Gaussian times sigma squared,
    which brightness does not change."""
    luma = cv2.cvtColor(image, cv2.COLOR_RGB2GRAY).astype(np.float32)
    return _apply(luma, kind, sigma_px)


def _apply(luma: Filtered, kind: ImageFilter, sigma_px: float) -> Filtered:
    smooth = cv2.GaussianBlur(luma, (0, 0), sigma_px, borderType=cv2.BORDER_REPLICATE)
    if kind == "raw":
        return np.asarray(smooth, np.float32)
    return np.asarray(-sigma_px**2 * cv2.Laplacian(smooth, cv2.CV_32F, borderType=cv2.BORDER_REPLICATE), np.float32)


@lru_cache
def noise_gain(kind: ImageFilter, sigma_px: float) -> float:
    """Standard deviation of filtered noise, of that of the pixels."""
    size = 2 * int(6.0 * sigma_px) + 3
    impulse = np.zeros((size, size), np.float32)
    impulse[size // 2, size // 2] = 1.0
    return float(np.linalg.norm(_apply(impulse, kind, sigma_px)))


@dataclass(frozen=True, eq=False, slots=True)
class Template:
    """One view of a layer. `points` (K, 3) m and `normals` (K, 3) in the frame of the layer's row; `values`
    (S, K) of every smoothing, NaN where that reached beyond the layer; `view` (3,): unit, from the layer to the
    camera, same frame; `spacing_m` between points. `anchor`: taken where the state was known, not estimated."""

    layer: int
    points: Array
    normals: Array
    values: Array
    view: Array
    spacing_m: float
    anchor: bool

    def contrast(self, level: int) -> float:
        """Standard deviation of the values of a smoothing."""
        values = self.values[level]
        return float(np.std(values[np.isfinite(values)])) if np.isfinite(values).any() else 0.0


@dataclass(slots=True)
class TemplateSet:
    """All templates of an object. `kind` and `sigmas_px`: how images are filtered. `refused`: by layer, why its last
    view gave no template."""

    kind: ImageFilter = "raw"
    sigmas_px: tuple[float, ...] = SIGMAS_PX
    templates: list[Template] = field(default_factory=list)
    refused: dict[int, str] = field(default_factory=dict)

    def choose(self, layer: int, view: Array) -> Template | None:
        """The template of a layer that was taken from nearest to the direction `view` (3,), None where all were taken
        from directions in which its surface is too steep now."""
        own = [(float(one.view @ view), one) for one in self.templates if one.layer == layer]
        if not own:
            return None
        cosine, best = max(own, key=lambda pair: pair[0])
        return best if cosine > FACING else None

    def wants(self, layer: int, view: Array) -> bool:
        """Whether no template of the layer was taken from near the direction `view` (3,)."""
        return all(float(one.view @ view) < VIEW_COSINE for one in self.templates if one.layer == layer)

    def images(self, image: Image) -> list[Filtered]:
        """The image with every smoothing."""
        return [filtered(image, self.kind, sigma) for sigma in self.sigmas_px]

    def take(self, layer: int, images: list[Filtered], labels: Indices, bodies: Bodies, placed: Placed,
             camera: CameraRecord, rays: Array, noise: float, anchor: bool) -> bool:
        """Take a template of a layer from the filtered images of a camera with `rays` (H, W, 3), in which `labels`
        (H, W) says where the layer is seen. `noise`: of a pixel, of 255. False: `refused` says why."""
        mask = (labels == layer).astype(np.uint8)
        if mask.sum() < LEAST_POINTS * SPACING_PX**2:
            self.refused[layer] = "it is hidden, or outside of the picture"
            return False
        base, centre = frame_of(placed, bodies.layer_row[layer]), camera.centre
        row, column = (int(np.median(one)) for one in np.nonzero(mask))
        steep = float(np.linalg.norm(rays[row, column] - rays[row, column - 1 if column else 1]))  # rad per px
        spacing = max(SPACING_PX, round(SPACING_M / (steep * float(np.linalg.norm(centre - base[:3, 3])))))
        rows, columns = np.nonzero(mask[::spacing, ::spacing])
        rows, columns = spacing * rows, spacing * columns
        lines = rays[rows, columns] @ camera.pose[:, :3]
        far = layer_distances(bodies, placed, layer, centre, lines, 0.0)
        points = centre + far[:, None] * lines
        normals = normals_at(bodies, placed, layer, points)
        good = (far > 0.0) & (-np.sum(normals * lines, axis=1) > FACING)
        rows, columns, points, normals = rows[good], columns[good], points[good], normals[good]
        if len(rows) < LEAST_POINTS:
            self.refused[layer] = "it is seen too steeply"
            return False
        inside = cv2.distanceTransform(np.pad(mask, 1), cv2.DIST_L2, 5)[1:-1, 1:-1][rows, columns]
        values = np.array([np.where(inside > sigma + 0.5, image[rows, columns], np.nan)
                           for image, sigma in zip(images, self.sigmas_px, strict=True)], np.float64)
        view = centre - points.mean(axis=0)
        depth = float(np.linalg.norm(view))
        turn = base[:3, :3]
        made = Template(layer, (points - base[:3, 3]) @ turn, normals @ turn, values, turn.T @ view / depth,
                        spacing * depth * steep, anchor)
        if np.isfinite(values[-1]).sum() < LEAST_POINTS:
            self.refused[layer] = "too little of it is seen"
            return False
        least = CONTRAST * noise * noise_gain(self.kind, self.sigmas_px[-1])
        if made.contrast(len(images) - 1) < least:
            self.refused[layer] = f"its texture has no contrast: less than {least:.1f} grey levels"
            return False
        self.refused.pop(layer, None)
        self.templates.append(made)
        return True
