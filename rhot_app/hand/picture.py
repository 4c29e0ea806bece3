"""A plain picture of an articulated object, to look at what a file describes: no perspective, lit from the eye.

The painter's algorithm: bodies from far to near, a capsule as nested outlines of its two balls, a box as its faces.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_app.estimation.se3 import exp_so3
from rhot_app.hand.articulated import Box, Capsule
from rhot_app.hand.articulated_model import ArticulatedModel, Body, PosedObject, forward_state

Array = NDArray[np.float64]
Image = NDArray[np.uint8]

SIZE_PX = 480
MARGIN = 1.4
"""Of the picture, over the extent of the object's joints: bodies are thicker than their axes."""

BACKGROUND = 246
SKIN_RGB = np.array([214.0, 164.0, 140.0])
TURN_DEG = 55.0
"""From the view in which the object looks broadest to that beside it, about the object's length."""

_OUTLINES, _CORNERS = 8, 24  # of a capsule, and points of a circle
_SUBPIXEL_BITS = 4


def draw(model: ArticulatedModel, state: Array | None = None) -> Image:
    """(SIZE_PX, 2 SIZE_PX, 3) RGB: the object in `state`, or as its file has it at rest, from two sides."""
    posed = forward_state(model, model.rest if state is None else state)
    face = _broadest_view(posed)
    turn = exp_so3([0.0, math.radians(TURN_DEG), 0.0])
    return np.hstack([_view(model, posed, view) for view in (face, turn @ face)])


def _places(posed: PosedObject) -> Array:
    return np.vstack([posed.root[:3, 3], posed.frames[:, :, 3], posed.points])


def _broadest_view(posed: PosedObject) -> Array:
    """(3, 3) view_from_world, rows right, up and to the eye: up from the root to what hangs on it, and towards the eye
    the direction in which the object is thinnest."""
    places = _places(posed)
    _, _, axes = np.linalg.svd(places - places.mean(axis=0))
    to_eye = axes[2] * math.copysign(1.0, axes[2][np.argmax(np.abs(axes[2]))])
    along = places.mean(axis=0) - posed.root[:3, 3]
    if np.linalg.norm(np.cross(along, to_eye)) < 1e-9:
        along = axes[0]
    up = along - to_eye * (along @ to_eye)
    up /= np.linalg.norm(up)
    return np.array([np.cross(up, to_eye), up, to_eye])


def _view(model: ArticulatedModel, posed: PosedObject, view: Array) -> Image:
    flat = _places(posed) @ view.T
    low, high = flat.min(axis=0), flat.max(axis=0)
    scale = SIZE_PX / (MARGIN * max(*(high - low)[:2], 1e-3))  # px/m
    image: Image = np.full((SIZE_PX, SIZE_PX, 3), BACKGROUND, np.uint8)
    bodies = [list(_outlines(body, view @ posed.world_from(body))) for body in model.bodies if body.shape is not None]
    for outlines in sorted(bodies, key=lambda one: float(one[0][0][:, 2].mean())):
        for points, light in outlines:
            pixels = 0.5 * SIZE_PX + scale * (points - 0.5 * (low + high))[:, :2] * [1.0, -1.0]
            hull = cv2.convexHull(np.rint(pixels * (1 << _SUBPIXEL_BITS)).astype(np.int32))
            cv2.fillConvexPoly(image, hull, (0.5 * (1.0 + light) * SKIN_RGB).tolist(), cv2.LINE_8, _SUBPIXEL_BITS)
    return image


def _outlines(body: Body, pose: Array) -> Iterator[tuple[Array, float]]:
    """Points (N, 3) m, view frame, of each outline of a body at view_from_body `pose` (3, 4), and its light, 0 to 1."""
    origin = pose[:, 3]
    if isinstance(body.shape, Capsule):
        radii = 1e-3 * np.array([body.shape.radius_mm, body.shape.end_radius_mm or body.shape.radius_mm])
        turns = 2.0 * math.pi * np.arange(_CORNERS) / _CORNERS
        circle = np.column_stack([np.cos(turns), np.sin(turns), np.zeros(_CORNERS)])
        ends = np.array([origin - body.link * pose[:, 0], origin])
        for part in np.linspace(1.0, 0.0, _OUTLINES, endpoint=False):
            yield (ends[:, None] + part * radii[:, None, None] * circle).reshape(-1, 3), math.sqrt(1.0 - part**2)
    elif isinstance(body.shape, Box):
        axes = pose[:, :3] @ exp_so3([-body.twist, 0.0, 0.0])
        half = 0.5e-3 * np.array(body.shape.size_mm) * axes
        centre = origin - 0.5 * body.link * pose[:, 0] + axes @ (1e-3 * np.array(body.shape.centre_mm))
        for axis in np.argsort(np.abs(axes[2])):  # of each two faces the one towards the eye, the steepest first
            side = math.copysign(1.0, axes[2, axis])
            a, b = (half[:, other] for other in range(3) if other != axis)
            corners = [i * a + j * b for i in (-1.0, 1.0) for j in (-1.0, 1.0)]
            yield centre + side * half[:, axis] + np.array(corners), abs(float(axes[2, axis]))
