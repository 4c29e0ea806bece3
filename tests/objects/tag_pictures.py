"""Rendered tags: a plane with printed tags as a camera sees it, with blur, light and noise, and its exact corners."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_app.geometry.camera import CameraModel
from rhot_app.objects.object_file import ObjectModel
from rhot_node.detect.tags import family_number

Array = NDArray[np.float64]

FINE = 6  # samples of a pixel along each axis
PAPER = 4  # a tag's side is so many times as wide as the white paper around it


def render(model: ObjectModel, world_from_object: Array, camera: CameraModel, rng: np.random.Generator, *,
           noise: float = 2.0, blur_px: float = 0.7, light: tuple[float, float] = (30.0, 190.0)) -> NDArray[np.uint8]:
    """Luma (H, W) of an object's tags before grey; the tags that face away are not drawn, nothing hides another.

    `noise`: sigma, grey levels. `blur_px`: sigma of the lens. `light`: grey levels of black and of white print.
    """
    height, width = camera.height, camera.width
    image = np.full((height, width), 110.0)
    for tag in model.fiducials:
        corners = tag.corners() @ world_from_object[:3, :3].T + world_from_object[:3, 3]
        normal = np.cross(corners[1] - corners[2], corners[3] - corners[2])
        if normal @ (camera.centre - corners.mean(axis=0)) <= 0.0:
            continue
        pixels = camera.project(corners)
        margin = 0.6 * np.abs(pixels - pixels.mean(axis=0)).max() + 4.0
        low = np.maximum(np.floor(pixels.min(axis=0) - margin), 0).astype(int)
        high = np.minimum(np.ceil(pixels.max(axis=0) + margin) + 1, [width, height]).astype(int)
        if (high <= low).any():
            continue
        # The lens bends lines by next to nothing within a pixel: its samples lie between the undistorted centres.
        centres = np.stack(np.meshgrid(*(np.arange(low[k] - 1.0, high[k] + 1.0) for k in (0, 1))), axis=-1)
        rays = camera.undistort(centres.reshape(-1, 2)).reshape(centres.shape)
        rays = cv2.resize(rays, None, fx=FINE, fy=FINE)[FINE:-FINE, FINE:-FINE]
        # (u, v), 0 to 1 over the tag, are ratios of affine functions of the ray.
        right, down, away = corners[1] - corners[0], corners[3] - corners[0], corners[0] - camera.centre
        rows = np.linalg.inv(np.column_stack([right, down, away])) @ camera.world_from_camera[:3, :3]
        u, v, w = (rays @ row[:2] + row[2] for row in rows)
        dictionary = cv2.aruco.getPredefinedDictionary(family_number(tag.family))
        side = dictionary.markerSize + 2
        print_ = cv2.aruco.generateImageMarker(dictionary, tag.id, PAPER * side, borderBits=1)
        levels = np.pad(np.where(print_ > 127, light[1], light[0]), side, constant_values=light[1])
        levels = np.pad(levels, 1, constant_values=np.nan)
        columns, lines = (np.clip(PAPER * side * one / w + side + 1.0, 0, len(levels) - 1).astype(np.intp)
                          for one in (u, v))
        samples = levels[lines, columns]
        paper = np.isfinite(samples)
        coverage, drawn = (cv2.resize(one, None, fx=1.0 / FINE, fy=1.0 / FINE, interpolation=cv2.INTER_AREA)
                           for one in (paper.astype(float), np.where(paper, samples, 0.0)))
        patch = image[low[1]:high[1], low[0]:high[0]]
        patch[:] = patch * (1.0 - coverage) + drawn
    image = cv2.GaussianBlur(image, (0, 0), blur_px) + noise * rng.normal(size=image.shape)
    return np.clip(np.rint(image), 0, 255).astype(np.uint8)
