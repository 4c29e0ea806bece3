"""Paints a hand, or whatever else is made of solids, over one camera's background."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rhot_app.geometry.camera import CameraModel
from rhot_app.simulator.render.body import CAPSULE
from rhot_app.simulator.render.exposure_samples import NODES, FrameTime, power_series
from rhot_app.simulator.render.painter import Body, Box, LitImage, PoseSource
from rhot_app.simulator.render.rays import light_direction, ray_table
from rhot_app.simulator.render.scanline_bounds import area_outside, outline
from rhot_app.simulator.render.trace import Canvas, Moving, View, canvas, trace

Array = NDArray[np.float64]

_OUTSIDE = 400  # px beyond the border within which a marker's hidden part is counted


class SolidsPainter:
    """A `Painter` of solids. A marker's visible part is that of its unhidden area, 0 when it is not in front of the
    camera at all."""

    def __init__(self, body: Body, camera: CameraModel, shading: float, seed: int) -> None:
        """`shading`: share of the brightness that depends on how a surface faces the lamp."""
        self._body, self._camera, self._shading, self._seed = body, camera, shading, seed
        self._solids = body.solids
        self._rays = ray_table(camera)
        self._light = light_direction(camera)
        self._canvas: Canvas | None = None

    def paint(self, lit: LitImage, source: PoseSource, time: FrameTime, number: int) -> tuple[Box, Array]:
        """Paint the solids as `source` moves them during the frame."""
        if self._canvas is None or self._canvas.image is not lit.image:
            self._canvas = canvas(lit, len(self._solids.kind), self._body.marker_count)
        world_from_palm, angles = source.sample(time.nodes_s)
        series = power_series(self._body.place(self._camera.camera_from_world @ world_from_palm, angles))
        timing = time.timing
        solids = self._solids._replace(rgb=self._solids.rgb * lit.level)
        moving = Moving(series, solids, self._sweep(series, timing[2]))
        view = View(self._rays, self._camera.intrinsics, timing, self._light, self._shading)
        box = trace(moving, view, self._canvas, self._seed * 1_000_003 + number)
        whole = self._canvas.whole + self._outside(series, timing)
        fractions = np.divide(self._canvas.visible, whole, out=np.zeros_like(whole), where=whole > 0.0)
        return box, np.clip(fractions, 0.0, 1.0)

    def _sweep(self, series: Array, exposure_tau: float) -> Array:
        """(N, 2) px: the farthest that a solid's end travels in x and y during one exposure."""
        fx, fy = self._camera.intrinsics[:2]
        sweep = np.zeros((len(series), 2))
        axis = np.where(self._solids.kind == CAPSULE, 0.0, self._solids.size[:, 0])[:, None]
        for tau in (-0.8, 0.0, 0.8):
            before, after = ((series @ (tau + offset) ** np.arange(NODES))
                             for offset in (-0.5 * exposure_tau, 0.5 * exposure_tau))
            for first in (0, 3):
                b, a = self._end(before, first, axis), self._end(after, first, axis)
                ahead = (b[:, 2] > 0.05) & (a[:, 2] > 0.05)
                moved = np.abs(a[:, :2] / np.maximum(a[:, 2:], 0.05) - b[:, :2] / np.maximum(b[:, 2:], 0.05))
                sweep = np.maximum(sweep, np.where(ahead[:, None], moved * (fx, fy), 0.0))
        return np.minimum(1.1 * sweep, 60.0)

    def _end(self, parameters: Array, first: int, half_length: Array) -> Array:
        """(N, 3) m: one of the two ends of every solid."""
        cylinder = parameters[:, :3] + (1.0 if first else -1.0) * half_length * parameters[:, 3:6]
        return np.where((self._solids.kind == CAPSULE)[:, None], parameters[:, first:first + 3], cylinder)

    def _outside(self, series: Array, timing: Array) -> Array:
        """(M,) px^2 of each marker beyond the image's borders."""
        solids, width, height = self._solids, self._camera.width, self._camera.height
        intrinsics = self._camera.intrinsics
        outside = np.zeros(self._body.marker_count)
        for n in range(int((solids.marker >= 0).sum())):  # painted solids come first
            row = series[n, :, 0].copy()
            u0, v0, u1, v1, reach = outline(solids.kind[n], row, solids.size, n, intrinsics)
            if not reach > 0.0:
                continue
            x0, x1, y0, y1 = min(u0, u1) - reach, max(u0, u1) + reach, min(v0, v1) - reach, max(v0, v1) + reach
            if x0 >= 0 and y0 >= 0 and x1 <= width - 1 and y1 <= height - 1:
                continue
            limits = np.array([max(x0 - 2, -_OUTSIDE), max(y0 - 2, -_OUTSIDE), min(x1 + 3, width + _OUTSIDE),
                               min(y1 + 3, height + _OUTSIDE)]).astype(np.int64)
            outside[solids.marker[n]] = area_outside(series, n, solids, intrinsics, timing, width, height, limits)
        return outside
