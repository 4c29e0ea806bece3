"""A plain picture of an articulated object, to look at what a file describes: no perspective, one lamp, no window.

Capsules are painted as rows of balls into a depth buffer, boxes by the slabs that a line of sight passes.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rhot_app.hand.articulated import Box, Capsule
from rhot_app.hand.articulated_model import ArticulatedModel, Body, PosedObject, forward_state

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Image = NDArray[np.uint8]

SIZE_PX = 480
MARGIN = 1.12
BACKGROUND = 246
STEP_PX = 2.0
"""From one ball of a capsule to the next: the dent between them is less than a tenth of a pixel."""

LAMP = np.array([-0.35, 0.5, 0.79])
TURNS_DEG = (0.0, 55.0)
"""The views beside each other: from where the object looks broadest, and turned about its length."""

_HUES = np.array([[214, 164, 140], [196, 132, 108], [226, 186, 160]], dtype=np.float64)  # RGB, one body to the next


def draw(model: ArticulatedModel, state: Array | None = None) -> Image:
    """(SIZE_PX, 2 SIZE_PX, 3) RGB: the object in `state`, or as its file has it at rest, from two sides."""
    posed = forward_state(model, model.rest if state is None else state)
    face = _broadest_view(posed)
    return np.hstack([_view(model, posed, _turned(turn_deg) @ face) for turn_deg in TURNS_DEG])


def _broadest_view(posed: PosedObject) -> Array:
    """(3, 3) view_from_world, rows right, up and to the eye: up from the root to what hangs on it, and towards the eye
    the direction in which the object is thinnest."""
    seen = np.vstack([posed.root[:3, 3], posed.frames[:, :, 3], posed.points])
    _, _, axes = np.linalg.svd(seen - seen.mean(axis=0))
    to_eye = axes[2] * math.copysign(1.0, axes[2][np.argmax(np.abs(axes[2]))])
    along = seen.mean(axis=0) - posed.root[:3, 3]
    if np.linalg.norm(np.cross(along, to_eye)) < 1e-9:
        along = axes[0]
    up = along - to_eye * (along @ to_eye)
    up /= np.linalg.norm(up)
    return np.array([np.cross(up, to_eye), up, to_eye])


def _turned(degrees: float) -> Array:
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def _view(model: ArticulatedModel, posed: PosedObject, view: Array) -> Image:
    canvas = _Canvas(view, np.vstack([posed.frames[:, :, 3], posed.points, posed.root[None, :3, 3]]))
    for index, body in enumerate(model.bodies):
        pose, hue = posed.world_from(body), _HUES[index % len(_HUES)]
        if isinstance(body.shape, Capsule):
            start = 1e-3 * body.shape.radius_mm
            end = start if body.shape.end_radius_mm is None else 1e-3 * body.shape.end_radius_mm
            canvas.capsule(pose[:, 3] - body.link * pose[:, 0], pose[:, 3], start, end, hue)
        elif body.shape is not None:
            canvas.box(*_placed(body, body.shape, pose), hue)
    return canvas.image


def _placed(body: Body, box: Box, pose: Array) -> tuple[Array, Array, Array]:
    """Centre (3,) m, axes (3, 3) as columns, and half sizes (3,) m of a body's box in the world."""
    c, s = math.cos(body.twist), math.sin(body.twist)
    shape = pose[:, :3] @ np.array([[1.0, 0.0, 0.0], [0.0, c, s], [0.0, -s, c]])
    centre = pose[:, 3] - 0.5 * body.link * pose[:, 0] + shape @ (1e-3 * np.array(box.centre_mm))
    return centre, shape, 0.5e-3 * np.array(box.size_mm)


class _Canvas:
    """A square picture with a depth buffer; `view` (3, 3) view_from_world, fitted to what is to be `seen` (N, 3) m."""

    def __init__(self, view: Array, seen: Array) -> None:
        self.view = view
        flat = seen @ view.T
        self.middle = 0.5 * (flat.min(axis=0) + flat.max(axis=0))
        extent = float(np.max((flat.max(axis=0) - flat.min(axis=0))[:2]))
        self.scale = SIZE_PX / (MARGIN * max(1.25 * extent, 1e-3))  # px/m; bodies are thicker than their axes
        self.depth = np.full((SIZE_PX, SIZE_PX), -np.inf)
        self.image: Image = np.full((SIZE_PX, SIZE_PX, 3), BACKGROUND, dtype=np.uint8)

    def capsule(self, start: Array, end: Array, start_radius: float, end_radius: float, hue: Array) -> None:
        length = float(np.linalg.norm(end - start))
        axis = self.view @ (end - start) / max(length, 1e-12)
        count = max(2, math.ceil(length * self.scale / STEP_PX))
        for part in np.linspace(0.0, 1.0, count):
            self._ball(start + part * (end - start), start_radius + part * (end_radius - start_radius), hue,
                       axis if 0.0 < part < 1.0 else np.zeros(3))

    def _ball(self, centre: Array, radius: float, hue: Array, along: Array) -> None:
        """A ball; between a capsule's ends lit as its side: without what its normals have `along` the axis."""
        z = self._pixels(centre)[2]
        reach = radius * self.scale
        rows, columns, right, up = self._around(centre, reach)
        across, above = right / reach, up / reach
        height = 1.0 - across ** 2 - above ** 2
        normal = np.stack([across, above, np.sqrt(np.maximum(height, 0.0))], axis=-1)
        depth = np.where(height > 0, z + reach * normal[..., 2], -np.inf)
        normal -= (normal @ along)[..., None] * along
        normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-9)
        self._paint(rows, columns, depth, normal, hue)

    def box(self, centre: Array, axes: Array, half: Array, hue: Array) -> None:
        z = self._pixels(centre)[2]
        rows, columns, right, up = self._around(centre, float(np.linalg.norm(half)) * self.scale)
        turned = self.view @ axes  # its columns: the box's axes seen from the eye
        at = np.stack([right, up, np.zeros_like(right)], axis=-1) @ turned
        slope = np.where(np.abs(turned[2]) < 1e-9, 1e-9, turned[2])
        ends = np.stack([(-half * self.scale - at) / slope, (half * self.scale - at) / slope])
        leave, enter = ends.max(axis=0), ends.min(axis=0).max(axis=-1)
        nearest = np.min(leave, axis=-1)
        normal = (turned * np.sign(slope)).T[np.argmin(leave, axis=-1)]
        self._paint(rows, columns, np.where(nearest >= enter, z + nearest, -np.inf), normal, hue)

    def _around(self, centre: Array, reach: float) -> tuple[Indices, Indices, Array, Array]:
        """Rows and columns within `reach` px of a point, and how far right and up of it their pixels are."""
        x, y, _ = self._pixels(centre)
        rows = np.arange(max(0, math.floor(y - reach)), min(SIZE_PX, math.ceil(y + reach) + 1))
        columns = np.arange(max(0, math.floor(x - reach)), min(SIZE_PX, math.ceil(x + reach) + 1))
        right, up = np.meshgrid(columns - x, y - rows)
        return rows, columns, right, up

    def _pixels(self, point: Array) -> tuple[float, float, float]:
        x, y, z = (self.view @ point - self.middle) * self.scale
        return 0.5 * SIZE_PX + float(x), 0.5 * SIZE_PX - float(y), float(z)

    def _paint(self, rows: Indices, columns: Indices, depth: Array, normal: Array, hue: Array) -> None:
        place = np.ix_(rows, columns)
        nearer = depth > self.depth[place]
        shade = 0.35 + 0.65 * np.maximum(normal @ LAMP, 0.0)
        self.depth[place] = np.where(nearer, depth, self.depth[place])
        self.image[place] = np.where(nearer[..., None], np.minimum(shade[..., None] * hue, 255.0),
                                     self.image[place]).astype(np.uint8)
