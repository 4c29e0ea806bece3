"""Draws the expected contours of a hand, the slices across them and the edges on these over an image."""

from __future__ import annotations

from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_app.barehand.contour_residual import ContourFrame, seen_contour

Array = NDArray[np.float64]
Image = NDArray[np.uint8]

SILHOUETTE_RGB, INNER_RGB, BONE_RGB = (40, 230, 80), (60, 140, 255), (255, 255, 255)
FOUND_RGB, OTHER_RGB, SLICE_RGB = (255, 40, 40), (255, 220, 0), (110, 110, 110)

_SUB = 4  # bits of a pixel's fraction in OpenCV's drawing


def overlay(image: Image, frame: ContourFrame, state: Array, joints: Array | None = None) -> Image:
    """A copy of `image` (H, W, 3) RGB with the contour of the hand in `state`: green before the background, blue before
    another part of the hand. Slices are thin and grey. Edges are red where they are the hand's,
    otherwise yellow. `joints` (21, 2) px are drawn as a skeleton."""
    seen = seen_contour("", 0, frame, state)
    out = image.copy()
    for ends in seen.slices:
        cv2.line(out, _fixed(ends[:2]), _fixed(ends[2:]), SLICE_RGB, 1, cv2.LINE_AA, _SUB)
    for point, outline in zip(seen.contour, seen.outline, strict=True):
        cv2.circle(out, _fixed(point), 1 << _SUB, SILHOUETTE_RGB if outline else INNER_RGB, -1, cv2.LINE_AA, _SUB)
    for point, ours in zip(seen.edges, seen.of_hand, strict=True):
        cv2.circle(out, _fixed(point), 1 << _SUB, FOUND_RGB if ours else OTHER_RGB, -1, cv2.LINE_AA, _SUB)
    if joints is not None:
        draw_skeleton(out, joints)
    return out


def draw_skeleton(picture: Image, joints: Array, thickness: int = 1) -> None:
    """Draw the bones between `joints` (21, 2) px into `picture` (H, W, 3) RGB; those that are not finite are left
    out."""
    places = [_fixed(place) if np.isfinite(place).all() else None for place in np.clip(joints, -1e6, 1e6)]
    for finger in range(5):
        for a, b in pairwise([0, *range(1 + 4 * finger, 5 + 4 * finger)]):
            one, other = places[a], places[b]
            if one is not None and other is not None:
                cv2.line(picture, one, other, BONE_RGB, thickness, cv2.LINE_AA, _SUB)


def _fixed(place: Array) -> tuple[int, int]:
    """A place (2,) px as OpenCV draws it, with _SUB bits of fraction."""
    return round(float(place[0]) * 2**_SUB), round(float(place[1]) * 2**_SUB)
