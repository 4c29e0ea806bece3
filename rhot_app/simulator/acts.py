"""What a show becomes in a scene: a thing to paint and how it moves."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from rhot_app.errors import SimulatorError
from rhot_app.geometry.camera import CameraModel
from rhot_app.hand.model import build_model
from rhot_app.simulator.board_places import board_places, held_place, table_place
from rhot_app.simulator.body import HandBody, Look, build_body
from rhot_app.simulator.marker_path import MarkerPath, swing_reach
from rhot_app.simulator.motion import BACK_FACING, load_motion
from rhot_app.simulator.painter import Image, Painter, PoseSource
from rhot_app.simulator.prop import BALL_RADIUS_M, Prop, ball_on_stick
from rhot_app.simulator.scene import Scene
from rhot_app.simulator.sheet import Sheet, board_sheet, ruler_sheet
from rhot_app.simulator.sheet_painter import SheetPainter
from rhot_app.simulator.shows import BoardShow, HandShow, MarkerShow, RulerShow, Show
from rhot_app.simulator.solids_painter import SolidsPainter
from rhot_app.simulator.stations import Stations


@dataclass(frozen=True, eq=False)
class Act:
    """Something that moves before the cameras of a scene: `thing` as `source` moves it."""

    name: str
    thing: HandBody | Prop | Sheet
    source: PoseSource

    def painter(self, camera: CameraModel, background: Image, shading: float, seed: int) -> Painter:
        """The painter of this act for one camera."""
        if isinstance(self.thing, Sheet):
            return SheetPainter(self.thing, camera, background, shading, seed)
        return SolidsPainter(self.thing, camera, background, shading, seed)


def make_act(show: Show, scene: Scene, hidden: frozenset[str] = frozenset()) -> Act:
    """Put a show on the scene's stage; `hidden` are ids of markers that the hand leaves unpainted.

    Raises SimulatorError, RigError, CalibrationError when there is no such motion, marker or board.
    """
    match show:
        case HandShow():
            model = build_model(scene.hand)
            motion, settings = load_motion(show.motion, model, scene.centre, scene.seed), scene.settings
            if settings.facing == "back":
                motion = replace(motion, facing=BACK_FACING)
            look = Look(settings.worn_paint, settings.uneven_paint, settings.glove_rgb, scene.seed)
            return Act(motion.name, build_body(model, scene.markers, hidden, look), motion)
        case BoardShow():
            return _board_act(show, scene)
        case RulerShow():
            sheet = ruler_sheet(1e-3 * show.length_mm)
            held = Stations(held_place(sheet, scene.centre)[None], scene.seed)
            return Act(f"ruler of {show.length_mm:g} mm", sheet, held)
        case MarkerShow():
            return _marker_act(show, scene)


def _board_act(show: BoardShow, scene: Scene) -> Act:
    board = show.board()
    sheet = board_sheet(board)
    if show.on_table:
        return Act(f"{board.text}, on the table", sheet,
                   Stations(table_place(sheet, scene.centre)[None], scene.seed, tremor=0.0))
    cameras = [scene.camera(index) for index in range(len(scene.names))]
    return Act(board.text, sheet, Stations(board_places(sheet, cameras, scene.seed), scene.seed))


def _marker_act(show: MarkerShow, scene: Scene) -> Act:
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
    return Act(f"marker {name} at {show.distance_m:g} m", ball_on_stick(scene.markers, ids.index(name)),
               MarkerPath(place, reach, scene.seed))
