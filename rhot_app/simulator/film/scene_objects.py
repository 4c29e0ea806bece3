"""What a show becomes in a scene: a thing to paint and how it moves."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rhot_app.barehand.start import start_pose_file
from rhot_app.errors import SimulatorError
from rhot_app.geometry.camera import CameraModel
from rhot_app.geometry.transforms import rigid
from rhot_app.hand.model import HandModel, build_model
from rhot_app.hand.skeleton import HandPose
from rhot_app.objects.object_file import ObjectModel, save_object
from rhot_app.project import Rig, RigObject
from rhot_app.simulator.bare_hand.painter import BareHand, BareHandPainter
from rhot_app.simulator.bare_hand.sequence import BareHandOptions, drawn_hand
from rhot_app.simulator.render.body import Appearance, HandBody, build_body
from rhot_app.simulator.render.held_painter import HeldPainter, held_cube
from rhot_app.simulator.render.painter import Painter, PoseSource
from rhot_app.simulator.render.sheet import Sheet, board_sheet, ruler_sheet
from rhot_app.simulator.render.sheet_painter import SheetPainter
from rhot_app.simulator.render.solids_painter import SolidsPainter
from rhot_app.simulator.scene.motion import BACK_FACING, Motion
from rhot_app.simulator.scene.motion_file import load_motion
from rhot_app.simulator.scene.rigid_target import BALL_RADIUS_M, BoardPoses, RigidTarget, ball_on_stick
from rhot_app.simulator.scene.scene import Scene
from rhot_app.simulator.scene.scene_description import (
    BareHandShow,
    BoardShow,
    EmptyShow,
    HandShow,
    MarkerShow,
    RulerShow,
    Show,
)


@dataclass(frozen=True, eq=False)
class SceneObject:
    """Something that moves before the cameras of a scene: `thing` as `source` moves it."""

    name: str
    thing: HandBody | BareHand | RigidTarget | Sheet
    source: PoseSource
    held: ObjectModel | None = None  # an object in the hand, at PALM_FROM_OBJECT

    def painter(self, camera: CameraModel, shading: float, seed: int) -> Painter:
        """The painter of this thing for one camera."""
        if isinstance(self.thing, Sheet):
            return SheetPainter(self.thing, camera, shading, seed)
        if isinstance(self.thing, BareHand):
            return BareHandPainter(self.thing, camera)
        if self.held is not None:
            return HeldPainter(self.thing, self.held, camera, shading, seed)
        return SolidsPainter(self.thing, camera, shading, seed)


def make_object(show: Show, scene: Scene, hidden: frozenset[str] = frozenset()) -> SceneObject:
    """Put a show on the scene's stage; `hidden` are ids of markers that the hand leaves unpainted.

    Raises SimulatorError, RigError, CalibrationError when there is no such motion, marker or board.
    """
    if hidden and not isinstance(show, HandShow):
        raise SimulatorError("only a hand with markers can leave some unpainted; leave out --hide, or show one.")
    match show:
        case HandShow():
            model, motion, settings = *_moved_hand(show.motion, scene), scene.settings
            look = Appearance(settings.worn_paint, settings.uneven_paint, settings.glove_rgb, scene.seed)
            return SceneObject(motion.name, build_body(model, scene.markers, hidden, look), motion,
                               held_cube() if show.cube else None)
        case BareHandShow():
            model, motion = _moved_hand(show.motion, scene)
            options = BareHandOptions(tone=show.tone, sleeve=show.sleeve)
            hand = drawn_hand(model, motion, options, scene.seed, len(scene.markers.ids))
            return SceneObject(f"{motion.name}, bare hand", hand, motion)
        case BoardShow():
            return _board_act(show, scene)
        case EmptyShow():
            return SceneObject("nothing", ball_on_stick(scene.markers, 0), MarkerPath(_OUT_OF_VIEW_M, (0.0, 0.0),
                                                                                      scene.seed))
        case RulerShow():
            sheet = ruler_sheet(1e-3 * show.length_mm)
            held = BoardPoses(held_place(sheet, scene.centre)[None], scene.seed)
            return SceneObject(f"ruler of {show.length_mm:g} mm", sheet, held)
        case MarkerShow():
            return _marker_act(show, scene)


def _moved_hand(motion: str, scene: Scene) -> tuple[HandModel, Motion]:
    """The scene's hand and a motion of it that shows the wanted side."""
    model = build_model(scene.hand)
    moved = load_motion(motion, model, scene.centre, scene.seed)
    return model, replace(moved, facing=BACK_FACING) if scene.settings.facing == "back" else moved


def with_start_pose(rig: Rig, scene_object: SceneObject) -> Rig:
    """The rig with the pose in which a bare hand begins, as the person is told who moves it."""
    if not isinstance(scene_object.thing, BareHand):
        return rig
    worlds, angles = scene_object.source.sample(np.zeros(1))
    poses = (start_pose_file(HandPose(worlds[0], angles[0])),)
    return msgspec.structs.replace(rig, tracker=msgspec.structs.replace(rig.tracker, start_poses=poses))


def write_held(scene_object: SceneObject, folder: Path) -> tuple[RigObject, ...]:
    """Write the file of what the hand holds to `folder`; the entry of a rig there."""
    held = scene_object.held
    if held is None:
        return ()
    path = folder.resolve() / f"{held.name}.json"
    save_object(path, held)
    return (RigObject(str(path), None, held),)


def _board_act(show: BoardShow, scene: Scene) -> SceneObject:
    board = show.board()
    sheet = board_sheet(board)
    if show.on_table:
        return SceneObject(f"{board.text}, on the table", sheet,
                   BoardPoses(table_place(sheet, scene.centre)[None], scene.seed, tremor=0.0))
    cameras = [scene.camera(index) for index in range(len(scene.names))]
    return SceneObject(board.text, sheet, BoardPoses(board_places(sheet, cameras, scene.seed), scene.seed))


def _marker_act(show: MarkerShow, scene: Scene) -> SceneObject:
    ids = scene.markers.ids
    name = ids[0] if show.marker is None else show.marker
    if name not in ids:
        raise SimulatorError(f"there is no marker {name!r} to hold up: the marker set has {', '.join(ids)}.")
    place = np.array([scene.centre[0], 0.0, show.distance_m])
    half_width = show.distance_m * math.tan(0.5 * math.radians(scene.preset.horizontal_fov_deg))
    half_height = half_width * scene.preset.height / scene.preset.width
    reach = (0.0, 0.0)
    if show.moving:
        reach = swing_reach(half_width - BALL_RADIUS_M, half_height - BALL_RADIUS_M, 1e-3 * scene.settings.baseline_mm)
    return SceneObject(f"marker {name} at {show.distance_m:g} m", ball_on_stick(scene.markers, ids.index(name)),
               MarkerPath(place, reach, scene.seed))


Array = NDArray[np.float64]

_OUT_OF_VIEW_M = np.array([0.0, 50.0, 1.0])  # far below: nothing is painted

_SWING_HZ = (1.3, 0.83)  # right and left, up and down: the path repeats after a hundred seconds only
_TREMOR_HZ, _TREMOR_M = np.array([1.1, 2.7, 8.9]), 0.08e-3


@dataclass(frozen=True)
class MarkerPath:
    """A `PoseSource` of something held at `place` (3,) m and swung by `reach` (2,) m to both sides, right and down; 0:
    held as still as a hand can."""

    place: Array
    reach: tuple[float, float]
    seed: int

    def sample(self, times_s: Array) -> tuple[Array, Array]:
        """world_from_prop (T, 4, 4) at scene times (T,) s; and no angles, (T, 0)."""
        times_s = np.asarray(times_s, dtype=np.float64)
        rng = np.random.default_rng([self.seed, 0x3A2])
        phases = rng.uniform(0.0, 2.0 * np.pi, (len(_TREMOR_HZ), 3))
        tremor = np.sin(2.0 * np.pi * times_s[:, None, None] * _TREMOR_HZ[:, None] + phases)
        out = np.tile(np.eye(4), (len(times_s), 1, 1))
        out[:, :3, 3] = self.place + _TREMOR_M * np.sqrt(2.0 / len(_TREMOR_HZ)) * tremor.sum(axis=1)
        for axis in range(2):
            phase = rng.uniform(0.0, 2.0 * np.pi)
            out[:, axis, 3] += self.reach[axis] * np.sin(2.0 * np.pi * _SWING_HZ[axis] * times_s + phase)
        return out, np.zeros((len(times_s), 0))


def swing_reach(half_width_m: float, half_height_m: float, baseline_m: float) -> tuple[float, float]:
    """(2,) m: as far as a marker may swing so that both cameras, whose pictures reach so far to every side at the
    marker's distance, see it all the time."""
    return 0.7 * max(half_width_m - 0.5 * baseline_m, 0.01), 0.7 * half_height_m


PLACES = 26
SHARED = 16  # of the places: seen whole by all cameras
_CANDIDATES = 800
_MARGIN_PX = 5.0
_WIDTHS = (0.24, 0.7)  # of the picture's width, as wide as the sheet appears: the widest fills the size bar of a lens
_TILT_RAD, _ROLL_RAD = 0.95, 0.3
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
class _Candidates:
    """C poses (C, 4, 4) world_from_sheet; `whole` (C, cameras): seen whole and not too steeply; `fields` (C, F): the
    fields of all those pictures that they cover; `tilts` (C,): which way they lean, 0..7."""

    poses: Array
    whole: NDArray[np.bool_]
    fields: NDArray[np.bool_]
    tilts: NDArray[np.int64]


def board_places(sheet: Sheet, cameras: Sequence[CameraModel], seed: int) -> Array:
    """(PLACES, 4, 4) world_from_sheet: greedily the most new fields of the pictures and ways of leaning, and the place
    that fills most of each picture; then in an order of short ways. Raises SimulatorError when no camera can see such a
    sheet whole."""
    found = _candidates(sheet, cameras, np.random.default_rng([seed, 0xB0A2D]))
    chosen = _choose(found, np.asarray(found.whole.all(axis=1)), SHARED, [])
    covered = found.fields.reshape(len(found.poses), len(cameras), -1).sum(axis=2) * found.whole
    chosen = list(dict.fromkeys([*chosen, *(int(best) for best in covered.argmax(axis=0) if covered[best].any())]))
    chosen = _choose(found, np.asarray(found.whole.any(axis=1)), PLACES, chosen)
    if not chosen:
        raise SimulatorError("no camera of the simulated rig can see a sheet of this shape whole; choose another size.")
    return _short_ways(found.poses[chosen])


def table_place(sheet: Sheet, scene_centre: Array) -> Array:
    """(4, 4) world_from_sheet of a sheet on a table below the hand's place, onto which the cameras look down at
    TABLE_PITCH_RAD; a little turned, as things lie."""
    down = np.array([0.0, np.cos(TABLE_PITCH_RAD), np.sin(TABLE_PITCH_RAD)])
    right = Rotation.from_rotvec(_TABLE_YAW_RAD * down).apply([1.0, 0.0, 0.0])
    rotation = np.stack([right, np.cross(down, right), down], axis=1)
    return rigid(rotation, scene_centre + _BELOW_M - rotation @ sheet.middle)


def held_place(sheet: Sheet, scene_centre: Array) -> Array:
    """(4, 4) world_from_sheet of a sheet held before the cameras, slightly turned."""
    rotation = Rotation.from_rotvec([0.12, -0.2, 0.15]).as_matrix()
    return rigid(rotation, scene_centre - rotation @ sheet.middle)


def _candidates(sheet: Sheet, cameras: Sequence[CameraModel], rng: np.random.Generator) -> _Candidates:
    """Random poses, each of which fills part of a random camera's picture about a random pixel."""
    count = _CANDIDATES // len(cameras)
    around = rng.uniform(0.0, 2.0 * np.pi, (len(cameras), count))
    lean = rng.uniform(0.2, 1.0, (len(cameras), count)) * _TILT_RAD
    roll = rng.uniform(-_ROLL_RAD, _ROLL_RAD, (len(cameras), count))
    poses = []
    for index, camera in enumerate(cameras):
        pixels = rng.uniform((0.1, 0.1), (0.9, 0.9), (count, 2)) * (camera.width, camera.height)
        depths = camera.intrinsics[0] * np.ptp(sheet.x_lines) / (rng.uniform(*_WIDTHS, count) * camera.width)
        zeros = np.zeros(count)
        tilt = np.column_stack([np.cos(around[index]), np.sin(around[index]), zeros]) * lean[index, :, None]
        turn = Rotation.from_rotvec(tilt) * Rotation.from_rotvec(np.column_stack([zeros, zeros, roll[index]]))
        local = np.tile(np.eye(4), (count, 1, 1))
        local[:, :3, :3] = turn.as_matrix()
        rays = np.column_stack([camera.undistort(pixels), np.ones(count)])
        local[:, :3, 3] = depths[:, None] * rays - local[:, :3, :3] @ sheet.middle
        poses.append(camera.world_from_camera @ local)
    every = np.concatenate(poses)
    seen = [_fields(sheet, every, camera) for camera in cameras]
    return _Candidates(every, np.stack([fields.any(axis=1) for fields in seen], axis=1), np.hstack(seen),
                       (around.ravel() / (np.pi / 4.0)).astype(np.int64))


def _fields(sheet: Sheet, poses: Array, camera: CameraModel) -> NDArray[np.bool_]:
    """(C, fields) the fields of a picture that the sheet covers; none when it is not whole in it, or too steep."""
    line_of_sight = poses[:, :3, :3] @ sheet.middle + poses[:, :3, 3] - camera.centre
    facing = np.einsum("ci,ci->c", poses[:, :3, 2], line_of_sight) > _STEEPEST * np.linalg.norm(line_of_sight, axis=1)
    size = np.array([camera.width, camera.height])
    outline = _project(camera, poses, sheet.outline)
    whole = facing & ((outline > _MARGIN_PX) & (outline < size - 1.0 - _MARGIN_PX)).all(axis=(1, 2))
    pixels = _project(camera, poses, sheet.middle + _INSIDE * (sheet.outline - sheet.middle).max(axis=0))
    columns, rows = np.moveaxis(np.floor(np.nan_to_num(pixels) * (_COLUMNS, _ROWS) / size).astype(np.int64), 2, 0)
    covered = np.zeros((len(poses), _COLUMNS * _ROWS), dtype=bool)
    here = np.flatnonzero(whole)
    covered[here[:, None], (rows * _COLUMNS + columns)[here]] = True
    return covered


def _project(camera: CameraModel, poses: Array, points: Array) -> Array:
    """(C, N, 2) px of points (N, 3) m of a sheet at each of its poses."""
    world = np.einsum("cij,nj->cni", poses[:, :3, :3], points) + poses[:, None, :3, 3]
    return camera.project(world.reshape(-1, 3)).reshape(len(poses), -1, 2)


def _choose(found: _Candidates, allowed: NDArray[np.bool_], count: int, before: Sequence[int]) -> list[int]:
    """`before` and, greedily, those of the `allowed` that add most to them, up to `count` in all."""
    chosen, left = list(before), allowed.copy()
    left[chosen] = False
    covered = found.fields[chosen].any(axis=0)
    leans = np.bincount(found.tilts[chosen], minlength=9)
    while left.any() and len(chosen) < count:
        worth = (found.fields & ~covered).sum(axis=1) + _NOVEL_TILT / (1.0 + leans[found.tilts])
        best = int(np.argmax(np.where(left, worth, -1.0)))
        left[best] = False
        chosen.append(best)
        covered |= found.fields[best]
        leans[found.tilts[best]] += 1
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
