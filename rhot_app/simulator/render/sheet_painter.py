"""Paints a printed sheet of paper over one camera's background."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rhot_app.geometry.camera import CameraModel, project_normalised
from rhot_app.simulator.render.edges import STILL_PX
from rhot_app.simulator.render.exposure_samples import NODES, FrameTime, power_series
from rhot_app.simulator.render.painter import Box, Image, PoseSource
from rhot_app.simulator.render.rays import light_direction, ray_table
from rhot_app.simulator.render.scanline_bounds import NEAR_M
from rhot_app.simulator.render.sheet import Sheet
from rhot_app.simulator.render.sheet_trace import Print, box_of, trace_sheet

Array = NDArray[np.float64]

_TAUS = np.array([-1.0, 0.0, 1.0])


class SheetPainter:
    """A `Painter` of one sheet; its source's transforms are world_from_sheet. There are no markers on it."""

    def __init__(self, sheet: Sheet, camera: CameraModel, background: Image, shading: float, seed: int) -> None:
        """`shading`: share of the brightness that depends on how the paper faces the lamp."""
        self._sheet, self._camera, self._shading, self._seed = sheet, camera, shading, seed
        self._print = Print(sheet.x_lines, sheet.y_lines, sheet.levels)
        self._rays = ray_table(camera)
        self._light = light_direction(camera)
        self._colour = np.ones(3)
        self._background, self._image = background, background.copy()

    @property
    def image(self) -> Image:
        """(3, H, W): what `paint` painted, the background elsewhere."""
        return self._image

    def relight(self, background: Image, level: Array) -> None:
        """Another light: the `background` as it is lit now, and factors (3,) on the paper's grey levels."""
        self._background, self._image, self._colour = background, background.copy(), np.asarray(level)

    def over(self, background: Image, image: Image) -> None:
        """Paint into `image` from now on, with `background` around the sheet; both (3, H, W)."""
        self._background, self._image = background, image

    def corners(self, source: PoseSource, t_s: float) -> Array:
        """(4, 2) px where the paper's corners appear at a time."""
        world_from_sheet, _ = source.sample(np.array([t_s]))
        camera_from_sheet = self._camera.camera_from_world @ world_from_sheet[0]
        points = self._sheet.outline @ camera_from_sheet[:3, :3].T + camera_from_sheet[:3, 3]
        flat = points[:, :2] / np.maximum(points[:, 2:], NEAR_M)
        return project_normalised(np.ascontiguousarray(flat), self._camera.intrinsics)

    def paint(self, source: PoseSource, time: FrameTime, number: int) -> tuple[Box, Array]:
        """Paint the sheet as `source` moves it during the frame."""
        world_from_sheet, _ = source.sample(time.nodes_s)
        camera_from_sheet = self._camera.camera_from_world @ world_from_sheet
        places = np.concatenate([camera_from_sheet[:, None, :3, 3], camera_from_sheet[:, None, :3, 0],
                                 camera_from_sheet[:, None, :3, 1]], axis=2)
        series, timing = power_series(places), time.timing
        corners, depths = self._corners(series, _TAUS)
        box = box_of(corners, depths, self._camera.width, self._camera.height)
        before, after = (self._corners(series, 0.999 * _TAUS + side * timing[2])[0] for side in (-0.5, 0.5))
        moving = not bool((np.abs(after - before) < STILL_PX).all())
        trace_sheet(series, self._print, self._rays, timing, moving, self._light, self._shading, self._colour,
                    self._background, self._image, box, self._seed * 1_000_003 + number)
        return (int(box[0]), int(box[1]), int(box[2]), int(box[3])), np.zeros(0)

    def _corners(self, series: Array, taus: Array) -> tuple[Array, Array]:
        """(T, 4, 2) px and (T, 4) m: where the paper's corners appear and how deep they are."""
        rows = np.stack([series[0] @ tau ** np.arange(NODES) for tau in taus])
        x, y = self._sheet.outline[:, 0], self._sheet.outline[:, 1]
        points = rows[:, None, :3] + x[:, None] * rows[:, None, 3:6] + y[:, None] * rows[:, None, 6:9]
        depths = points[:, :, 2]
        flat = (points[:, :, :2] / np.maximum(depths, NEAR_M)[:, :, None]).reshape(-1, 2)
        return project_normalised(np.ascontiguousarray(flat), self._camera.intrinsics).reshape(-1, 4, 2), depths
