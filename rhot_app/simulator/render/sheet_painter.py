"""Paints a printed sheet of paper over one camera's background (numba): rolling shutter by row, exposure by samples.

A pixel is looked up once where the paper is even as far as the pixel reaches and the paper moves while it is exposed;
where lines or the paper's edge are near, 16 rays over area and exposure are sent (see `rays.scatter`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.geometry.camera import CameraModel, project_normalised
from rhot_app.simulator.render.exposure_samples import NODES, STILL_PX, FrameTime, evaluate, power_series
from rhot_app.simulator.render.painter import Box, Image, LitImage, PoseSource
from rhot_app.simulator.render.rays import SAMPLES, light_direction, ray_table, scatter
from rhot_app.simulator.render.scanline_bounds import NEAR_M
from rhot_app.simulator.render.sheet import Sheet

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

FRAME = 9
"""Numbers that place a sheet in a camera's frame, m: its origin (3), the unit vectors of its x (3) and y (3)."""

_REACH = 0.55  # of a pixel's extent: what its centre must see of even paper around it
_HIDDEN, _LINES = -1.0, -2.0  # no paper at all; not even


class Print(NamedTuple):
    """The sheet's fields as `Sheet` has them."""

    x_lines: Array
    y_lines: Array
    levels: Image


@njit(cache=True)
def trace_sheet(series: Array, printed: Print, rays: Array, timing: Array, moving: bool, light: Array, shading: float,
                colour: Array, background: Image, image: Image, box: Indices, seed: int) -> None:
    """Paint the sheet into `image` (3, H, W) within `box` (x0, y0, x1, y1).

    `series` (1, FRAME, NODES): where it is in the camera's frame. `timing` (3,): tau of row 0, per row, of the
    exposure. `moving`: whether it moves while exposed. `light` (3,): unit vector towards the lamp. `colour` (3,):
    factors on red, green and blue.
    """
    slots = SAMPLES if moving else 1
    row, maps = np.empty(FRAME), np.empty((slots, 3, 3))
    ray, slot = np.empty((SAMPLES, 2)), np.zeros(SAMPLES, np.int64)
    for y in range(box[1], box[3]):
        shade = 0.0
        for k in range(slots):
            offset = ((k + 0.5) / slots - 0.5) * timing[2]
            evaluate(series, 0, timing[0] + y * timing[1] + offset, row)
            shade = 1.0 - shading * (1.0 - _plane_map(row, light, maps, k))
        for x in range(box[0], box[2]):
            level = _level_around(printed, maps, slots, rays, x, y)
            if level == _LINES:
                scatter(x, y, slots, seed, rays, ray, slot, 0)
                _gather(printed, maps, ray, slot, shade, colour, background, image, x, y)
            elif level != _HIDDEN:
                for c in range(3):
                    image[c, y, x] = shade * level * colour[c]


@njit(cache=True, fastmath=True)
def _plane_map(row: Array, light: Array, maps: Array, k: int) -> float:
    """Fill `maps[k]`: from rays (x, y, 1) to homogeneous coordinates on the sheet. Returns its cosine to the lamp.

    The ray meets the plane at depth t = n.o / n.r; there u = ex.(t r - o). A sheet seen from behind or at its edge gets
    a map that hits nothing.
    """
    ox, oy, oz = row[0], row[1], row[2]
    nx = row[4] * row[8] - row[5] * row[7]
    ny = row[5] * row[6] - row[3] * row[8]
    nz = row[3] * row[7] - row[4] * row[6]
    away = nx * ox + ny * oy + nz * oz  # > 0: the printed side faces the camera, as z points into the paper
    along_x = row[3] * ox + row[4] * oy + row[5] * oz
    along_y = row[6] * ox + row[7] * oy + row[8] * oz
    for i, normal in enumerate((nx, ny, nz)):
        maps[k, 0, i] = away * row[3 + i] - along_x * normal
        maps[k, 1, i] = away * row[6 + i] - along_y * normal
        maps[k, 2, i] = normal if away > 0.0 else 0.0
    return max(0.0, -(nx * light[0] + ny * light[1] + nz * light[2]))


@njit(cache=True, fastmath=True, inline="always")
def _meet(maps: Array, k: int, x: float, y: float) -> tuple[float, float, bool]:
    """Where a ray meets the sheet's plane, m, and whether it does, before the camera."""
    w = maps[k, 2, 0] * x + maps[k, 2, 1] * y + maps[k, 2, 2]
    if w < 1e-6:
        return 0.0, 0.0, False
    u = (maps[k, 0, 0] * x + maps[k, 0, 1] * y + maps[k, 0, 2]) / w
    v = (maps[k, 1, 0] * x + maps[k, 1, 1] * y + maps[k, 1, 2]) / w
    return u, v, True


@njit(cache=True, fastmath=True)
def _level_around(printed: Print, maps: Array, slots: int, rays: Array, x: int, y: int) -> float:
    """The grey level of a pixel that sees even paper only; _HIDDEN where it sees none, _LINES where it sees both."""
    j, i = y + 1, x + 1
    u, v, met = _meet(maps, 0, rays[j, i, 0], rays[j, i, 1])
    ux, vx, met_x = _meet(maps, 0, rays[j, i + 1, 0], rays[j, i + 1, 1])
    uy, vy, met_y = _meet(maps, 0, rays[j + 1, i, 0], rays[j + 1, i, 1])
    if not (met and met_x and met_y):
        return _HIDDEN
    reach_u, reach_v = _REACH * (abs(ux - u) + abs(uy - u)), _REACH * (abs(vx - v) + abs(vy - v))
    low_u, high_u, low_v, high_v = u, u, v, v
    if slots > 1:
        end_u, end_v, met_end = _meet(maps, slots - 1, rays[j, i, 0], rays[j, i, 1])
        if not met_end:
            return _HIDDEN
        low_u, high_u = min(u, end_u), max(u, end_u)
        low_v, high_v = min(v, end_v), max(v, end_v)
    first_u, last_u = _field(printed.x_lines, low_u - reach_u), _field(printed.x_lines, high_u + reach_u)
    first_v, last_v = _field(printed.y_lines, low_v - reach_v), _field(printed.y_lines, high_v + reach_v)
    columns, rows = len(printed.x_lines) - 1, len(printed.y_lines) - 1
    if last_u < 0 or last_v < 0 or first_u >= columns or first_v >= rows:
        return _HIDDEN
    if first_u < 0 or first_v < 0 or last_u >= columns or last_v >= rows:
        return _LINES
    level = printed.levels[first_v, first_u]
    for b in range(first_v, last_v + 1):
        for a in range(first_u, last_u + 1):
            if printed.levels[b, a] != level:
                return _LINES
    return level


@njit(cache=True, fastmath=True)
def _field(lines: Array, value: float) -> int:
    """Index of the field that holds `value`: -1 before the first line, len(lines) - 1 beyond the last."""
    low, high = 0, len(lines)
    while low < high:
        middle = (low + high) // 2
        if lines[middle] <= value:
            low = middle + 1
        else:
            high = middle
    return low - 1


@njit(cache=True, fastmath=True)
def _gather(printed: Print, maps: Array, ray: Array, slot: Indices, shade: float, colour: Array, background: Image,
            image: Image, x: int, y: int) -> None:
    """The mean of the pixel's 16 rays; those that miss the paper see the background."""
    columns, rows = len(printed.x_lines) - 1, len(printed.y_lines) - 1
    total, missed = 0.0, 0
    for k in range(SAMPLES):
        u, v, met = _meet(maps, slot[k], ray[k, 0], ray[k, 1])
        a, b = _field(printed.x_lines, u), _field(printed.y_lines, v)
        if met and 0 <= a < columns and 0 <= b < rows:
            total += printed.levels[b, a]
        else:
            missed += 1
    for c in range(3):
        image[c, y, x] = (shade * total * colour[c] + missed * background[c, y, x]) / SAMPLES


def box_of(corners_px: Array, depths: Array, width: int, height: int) -> Indices:
    """(4,) px, half open: where a sheet may be whose paper's corners appear at (..., 2) px at depths (...,) m.

    The whole picture when a corner is not clearly before the camera or far outside the picture, where a lens bends
    lines; empty when all lie to one side.
    """
    if not (depths > NEAR_M).all():
        return np.array([0, 0, width, height] if (depths > NEAR_M).any() else [0, 0, 0, 0])
    low, high = corners_px.reshape(-1, 2).min(axis=0), corners_px.reshape(-1, 2).max(axis=0)
    bend = 2.0 + 0.05 * (high - low)
    low, high = np.floor(low - bend), np.ceil(high + bend) + 1
    x0, y0 = np.clip(low, 0, (width, height))
    x1, y1 = np.clip(high, 0, (width, height))
    return np.array([x0, y0, x1, y1] if x0 < x1 and y0 < y1 else [0, 0, 0, 0]).astype(np.int64)


_TAUS = np.array([-1.0, 0.0, 1.0])


class SheetPainter:
    """A `Painter` of one sheet; its source's transforms are world_from_sheet. There are no markers on it."""

    def __init__(self, sheet: Sheet, camera: CameraModel, shading: float, seed: int) -> None:
        """`shading`: share of the brightness that depends on how the paper faces the lamp."""
        self._sheet, self._camera, self._shading, self._seed = sheet, camera, shading, seed
        self._print = Print(sheet.x_lines, sheet.y_lines, sheet.levels)
        self._rays = ray_table(camera)
        self._light = light_direction(camera)

    def corners(self, source: PoseSource, t_s: float) -> Array:
        """(4, 2) px where the paper's corners appear at a time."""
        world_from_sheet, _ = source.sample(np.array([t_s]))
        camera_from_sheet = self._camera.camera_from_world @ world_from_sheet[0]
        points = self._sheet.outline @ camera_from_sheet[:3, :3].T + camera_from_sheet[:3, 3]
        flat = points[:, :2] / np.maximum(points[:, 2:], NEAR_M)
        return project_normalised(np.ascontiguousarray(flat), self._camera.intrinsics)

    def paint(self, lit: LitImage, source: PoseSource, time: FrameTime, number: int) -> tuple[Box, Array]:
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
        trace_sheet(series, self._print, self._rays, timing, moving, self._light, self._shading, lit.level,
                    lit.background, lit.image, box, self._seed * 1_000_003 + number)
        return (int(box[0]), int(box[1]), int(box[2]), int(box[3])), np.zeros(0)

    def _corners(self, series: Array, taus: Array) -> tuple[Array, Array]:
        """(T, 4, 2) px and (T, 4) m: where the paper's corners appear and how deep they are."""
        rows = np.stack([series[0] @ tau ** np.arange(NODES) for tau in taus])
        x, y = self._sheet.outline[:, 0], self._sheet.outline[:, 1]
        points = rows[:, None, :3] + x[:, None] * rows[:, None, 3:6] + y[:, None] * rows[:, None, 6:9]
        depths = points[:, :, 2]
        flat = (points[:, :, :2] / np.maximum(depths, NEAR_M)[:, :, None]).reshape(-1, 2)
        return project_normalised(np.ascontiguousarray(flat), self._camera.intrinsics).reshape(-1, 4, 2), depths
