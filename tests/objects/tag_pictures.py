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
CELL = 40  # texture px of a tag's side, times its cells
PAPER_M = 0.25  # of a tag's side, white around it


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
        offsets = (np.arange(FINE) + 0.5) / FINE - 0.5
        xs = (np.arange(low[0], high[0])[:, None] + offsets).ravel()
        ys = (np.arange(low[1], high[1])[:, None] + offsets).ravel()
        grid = np.stack(np.meshgrid(xs, ys), axis=-1).reshape(-1, 2)
        rays = np.column_stack([camera.undistort(grid), np.ones(len(grid))]) @ camera.world_from_camera[:3, :3].T
        right, up = (corners[1] - corners[0]), (corners[0] - corners[3])
        along = ((corners[0] - camera.centre) @ normal) / (rays @ normal)
        place = camera.centre + along[:, None] * rays - corners[0]
        u, v = place @ right / (right @ right), -(place @ up) / (up @ up)  # 0 to 1 over the tag
        side = cv2.aruco.getPredefinedDictionary(family_number(tag.family)).markerSize + 2
        texture = cv2.aruco.generateImageMarker(
            cv2.aruco.getPredefinedDictionary(family_number(tag.family)), tag.id, side, borderBits=1) > 127
        inside = (u >= 0) & (u < 1) & (v >= 0) & (v < 1)
        white = ~inside
        white[inside] = texture[(v[inside] * side).astype(int), (u[inside] * side).astype(int)]
        paper = (u > -PAPER_M) & (u < 1 + PAPER_M) & (v > -PAPER_M) & (v < 1 + PAPER_M)
        values = np.where(white, light[1], light[0]).reshape(len(ys), len(xs))
        share = paper.reshape(len(ys), len(xs)).astype(float)
        shape = (high[1] - low[1], FINE, high[0] - low[0], FINE)
        coverage = share.reshape(shape).mean(axis=(1, 3))
        drawn = (values * share).reshape(shape).mean(axis=(1, 3))
        patch = image[low[1]:high[1], low[0]:high[0]]
        patch[:] = patch * (1.0 - coverage) + drawn
    image = cv2.GaussianBlur(image, (0, 0), blur_px) + noise * rng.normal(size=image.shape)
    return np.clip(np.rint(image), 0, 255).astype(np.uint8)
