"""Where to hold a calibration board so that it teaches most: over all pictures, near and far, tilted every way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rhot_app.errors import SimulatorError
from rhot_app.geometry.camera import CameraModel
from rhot_app.simulator.sheet import Sheet

Array = NDArray[np.float64]

PLACES = 26
SHARED = 16  # of the places: seen whole by all cameras
_CANDIDATES = 400
_MARGIN_PX = 5.0
_WIDTHS = (0.24, 0.6)  # of the picture's width, as wide as the sheet appears
_TILT_RAD, _ROLL_RAD = 0.75, 0.3
_STEEPEST = 0.5  # least cosine between the sheet's normal and the line of sight
_COLUMNS, _ROWS = 12, 9  # fields of a picture that the places should cover
_INSIDE = np.array([[x, y, 0.0] for x in np.linspace(-0.75, 0.75, 9) for y in np.linspace(-0.7, 0.7, 7)])
"""Where a board has its corners, in halves of the paper's size."""

_NOVEL_TILT = 4.0  # what a new way to tilt is worth, in fields

TABLE_PITCH_RAD = np.radians(45.0)
"""The cameras look down on the table by so much."""

_BELOW_M = np.array([0.0, 0.02, 0.0])
_TABLE_YAW_RAD = np.radians(12.0)


@dataclass(frozen=True, slots=True, eq=False)
class _Candidate:
    pose: Array  # (4, 4) world_from_sheet
    whole: tuple[int, ...]  # cameras that see all of it
    fields: frozenset[int]  # of all pictures in which it is whole
    tilt: int  # which way it leans


def board_places(sheet: Sheet, cameras: Sequence[CameraModel], seed: int) -> Array:
    """(PLACES, 4, 4) world_from_sheet: greedily the most new fields of the pictures and ways of leaning, then in an
    order of short ways. Raises SimulatorError when no camera can see such a sheet whole."""
    rng = np.random.default_rng([seed, 0xB0A2D])
    candidates = [_candidate(sheet, cameras, rng) for _ in range(_CANDIDATES)]
    shared = _choose([c for c in candidates if len(c.whole) == len(cameras)], SHARED, [])
    chosen = shared + _choose([c for c in candidates if c.whole], PLACES - len(shared), shared)
    if not chosen:
        raise SimulatorError("no camera of the simulated rig can see a sheet of this shape whole; choose another size.")
    return _short_ways(np.array([c.pose for c in chosen]))


def table_place(sheet: Sheet, scene_centre: Array) -> Array:
    """(4, 4) world_from_sheet of a sheet on a table below the hand's place, onto which the cameras look down at
    TABLE_PITCH_RAD; a little turned, as things lie."""
    down = np.array([0.0, np.cos(TABLE_PITCH_RAD), np.sin(TABLE_PITCH_RAD)])
    right = Rotation.from_rotvec(_TABLE_YAW_RAD * down).apply([1.0, 0.0, 0.0])
    rotation = np.stack([right, np.cross(down, right), down], axis=1)
    return _rigid(rotation, scene_centre + _BELOW_M - rotation @ sheet.middle)


def held_place(sheet: Sheet, scene_centre: Array) -> Array:
    """(4, 4) world_from_sheet of a sheet held before the cameras, slightly turned."""
    rotation = Rotation.from_rotvec([0.12, -0.2, 0.15]).as_matrix()
    return _rigid(rotation, scene_centre - rotation @ sheet.middle)


def _rigid(rotation: Array, translation: Array) -> Array:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation, translation
    return pose


def _candidate(sheet: Sheet, cameras: Sequence[CameraModel], rng: np.random.Generator) -> _Candidate:
    """A random pose that fills part of a random camera's picture about a random pixel."""
    camera = cameras[int(rng.integers(len(cameras)))]
    pixel = rng.uniform((0.1, 0.1), (0.9, 0.9)) * (camera.width, camera.height)
    width_px = rng.uniform(*_WIDTHS) * camera.width
    depth = camera.intrinsics[0] * np.ptp(sheet.x_lines) / width_px
    ray = np.append(camera.undistort(pixel[None])[0], 1.0)
    around = rng.uniform(0.0, 2.0 * np.pi)
    tilt = rng.uniform(0.2, 1.0) * _TILT_RAD * np.array([np.cos(around), np.sin(around), 0.0])
    rotation = (Rotation.from_rotvec(tilt) * Rotation.from_rotvec([0.0, 0.0, rng.uniform(-_ROLL_RAD, _ROLL_RAD)]))
    turned = camera.world_from_camera[:3, :3] @ rotation.as_matrix()
    middle = camera.world_from_camera[:3, :3] @ (depth * ray) + camera.centre
    pose = _rigid(turned, middle - turned @ sheet.middle)
    seen = [_fields(sheet, pose, other) for other in cameras]
    fields = frozenset(index * _COLUMNS * _ROWS + field for index, some in enumerate(seen) for field in some)
    return _Candidate(pose, tuple(k for k, some in enumerate(seen) if some), fields, int(around / (np.pi / 4.0)))


def _fields(sheet: Sheet, pose: Array, camera: CameraModel) -> set[int]:
    """The fields of a picture that the sheet covers; none when it is not whole in it, or seen too steeply."""
    outline = sheet.outline @ pose[:3, :3].T + pose[:3, 3]
    sight = outline.mean(axis=0) - camera.centre
    if pose[:3, 2] @ sight < _STEEPEST * np.linalg.norm(sight):
        return set()
    pixels = camera.project(outline)
    inside = (pixels > _MARGIN_PX) & (pixels < np.array([camera.width, camera.height]) - 1.0 - _MARGIN_PX)
    if not inside.all():
        return set()
    points = sheet.middle + _INSIDE * (sheet.outline - sheet.middle).max(axis=0)
    x, y = camera.project(points @ pose[:3, :3].T + pose[:3, 3]).T
    columns, rows = (x * _COLUMNS / camera.width).astype(int), (y * _ROWS / camera.height).astype(int)
    return set((rows * _COLUMNS + columns).tolist())


def _choose(candidates: list[_Candidate], count: int, before: Sequence[_Candidate]) -> list[_Candidate]:
    """Greedily up to `count` candidates that add most to those chosen `before`."""
    fields = {field for one in before for field in one.fields}
    tilts = [one.tilt for one in before]
    left = [c for c in candidates if c not in before]
    chosen: list[_Candidate] = []
    while left and len(chosen) < count:
        best = max(left, key=lambda c: len(c.fields - fields) + _NOVEL_TILT / (1.0 + tilts.count(c.tilt)))
        left.remove(best)
        chosen.append(best)
        fields |= best.fields
        tilts.append(best.tilt)
    return chosen


def _short_ways(poses: Array) -> Array:
    """The poses in the order of the nearest next, from the one nearest to the rig's axis on."""
    left = list(range(len(poses)))
    order = [min(left, key=lambda k: float(np.abs(poses[k, :2, 3]).sum()))]
    left.remove(order[0])
    while left:
        here = poses[order[-1], :3, 3]
        order.append(min(left, key=lambda k: float(np.linalg.norm(poses[k, :3, 3] - here))))
        left.remove(order[-1])
    return poses[order]
