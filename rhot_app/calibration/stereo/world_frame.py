"""The world frame, placed by a board that lies on the table: z up, origin at its first corner, x along its columns.

The board's own z points into the paper, away from the viewer; the table's z points up from it, so the table frame is
the board's, turned by 180 degrees about x. A board can only be seen from its printed side, so whoever sees it lying on
the table is above the table; what can be wrong is that it stands, lies elsewhere in another camera, or is seen too
small to tell its tilt.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.board.boards import Board
from rhot_app.calibration.board.corners import BoardView
from rhot_app.calibration.board.poses import PosedView, pose_view
from rhot_app.calibration.stereo.bundle_model import BundleState, Observations, linearise
from rhot_app.calibration.stereo.start import place_shot
from rhot_app.calibration.verdict import Finding, Grade, Verdict, judge
from rhot_app.errors import CalibrationError
from rhot_app.geometry.transforms import apply, exp_so3, inverse, rigid

Array = NDArray[np.float64]

TABLE_FROM_BOARD: Array = rigid(np.diag([1.0, -1.0, -1.0]), np.zeros(3))

_LEVEL_RAD = np.radians(20.0)  # a camera that is rolled more than this against the table was not mounted by a person
_SIMILAR_POSES = 2.0  # another tilt of the board whose error is below this many times the best one's cannot be excluded
_STEPS = 10


@dataclass(frozen=True, slots=True)
class CameraStance:
    """How a camera stands over the table: `height_m` of its centre, `down_rad` how far it looks below the horizon,
    `roll_rad` how far its picture's horizontal is from level."""

    name: str
    height_m: float
    down_rad: float
    roll_rad: float


@dataclass(frozen=True, slots=True)
class WorldFrame:
    """The rig in the table's frame.

    `world_from_camera` (C, 4, 4) m, new; `table_from_old` (4, 4) what it was turned by; `stances` of the cameras;
    `rms_px` of the board's corners; `verdict`.
    """

    world_from_camera: Array
    table_from_old: Array
    stances: tuple[CameraStance, ...]
    rms_px: float
    verdict: Verdict


def place_world(views: Sequence[BoardView | None], board: Board, state: BundleState,
                names: Sequence[str]) -> WorldFrame:
    """Put the world on the table on which `board` lies in `views`, one per camera, None where it is not seen.

    `state` holds lenses and camera_from_world; its boards are not looked at. Raises CalibrationError when no camera
    sees the board, or cameras see it at different places.
    """
    posed = [None if view is None else pose_view(view, board, lens)
             for view, lens in zip(views, state.lenses, strict=True)]
    placed = place_shot(0, posed, dict(enumerate(state.camera_from_world)))
    if placed is None:
        raise CalibrationError("The board on the table is in no picture. Lay it flat where a camera sees it whole.")
    if placed.disagreeing:
        apart = " and ".join(names[camera] for camera in (*placed.agreeing, *placed.disagreeing))
        raise CalibrationError(f"{apart} see the board on the table at different places: it was moved between the "
                               "pictures, a picture is mirrored, or the cameras have moved since the calibration.")
    world_from_board, rms = _refined(posed, state, placed.world_from_board)
    table_from_old = TABLE_FROM_BOARD @ inverse(world_from_board)
    poses = np.array([table_from_old @ inverse(pose) for pose in state.camera_from_world])
    stances = tuple(_stance(name, pose) for name, pose in zip(names, poses, strict=True))
    findings = [*_stance_findings(stances), *_tilt_findings(posed, names)]
    return WorldFrame(poses, table_from_old, stances, rms, judge(_summary(stances, rms), findings))


def _refined(posed: Sequence[PosedView | None], state: BundleState, start: Array) -> tuple[Array, float]:
    """The board's pose that fits all cameras best, and the rms of its corners in px; the cameras stay."""
    rows = [(camera, each) for camera, each in enumerate(posed) if each is not None]
    points = [apply(each.half_turn, each.points) if each.half_turn is not None
              and each.turned(state.camera_from_world[camera] @ start) else each.points for camera, each in rows]
    seen = Observations(np.repeat([camera for camera, _ in rows], [len(each) for each in points]),
                        np.zeros(sum(len(each) for each in points), np.intp), np.concatenate(points),
                        np.concatenate([each.view.pixels for _, each in rows]))
    pose = start.copy()
    for _ in range(_STEPS):
        line = linearise(BundleState(state.lenses, state.camera_from_world, pose[None]), seen)
        step = np.linalg.lstsq(line.by_board.reshape(-1, 6), line.residuals.ravel(), rcond=None)[0]
        pose[:3, :3] = exp_so3(step[:3]) @ pose[:3, :3]
        pose[:3, 3] += step[3:]
    return pose, float(np.sqrt(np.mean(np.sum(np.square(line.residuals), axis=1))))


def _stance(name: str, world_from_camera: Array) -> CameraStance:
    right, _, forward = world_from_camera[2, :3]
    return CameraStance(name, float(world_from_camera[2, 3]), float(np.arcsin(np.clip(-forward, -1, 1))),
                        float(np.arcsin(np.clip(right, -1, 1))))


def _stance_findings(stances: Sequence[CameraStance]) -> list[Finding]:
    found = []
    for each in stances:
        if each.down_rad < 0.0:
            found.append(Finding("gravity", Grade.FAIR, f"{each.name.capitalize()} looks up from the table by "
                                 f"{-np.degrees(each.down_rad):.0f} degrees.",
                                 "The board may stand, or lie on something that is not level.",
                                 "If the camera does not look up, lay the board flat on the table and take the picture "
                                 "again."))
        if abs(each.roll_rad) > _LEVEL_RAD:
            found.append(Finding("roll", Grade.FAIR, f"{each.name.capitalize()} is rolled by "
                                 f"{np.degrees(each.roll_rad):.0f} degrees against the table.",
                                 "The board does not lie level, or the camera is mounted askew.",
                                 "If the camera stands upright, lay the board flat on the table and take the picture "
                                 "again."))
    return found


def _tilt_findings(posed: Sequence[PosedView | None], names: Sequence[str]) -> list[Finding]:
    """A single camera that sees the board small and nearly face on cannot tell its two tilts apart."""
    seen = [(name, each) for name, each in zip(names, posed, strict=True) if each is not None]
    if len(seen) > 1:
        return []
    name, only = seen[0]
    if len(only.rms_px) < 2 or only.rms_px[1] > _SIMILAR_POSES * only.rms_px[0]:
        return []
    return [Finding("tilt", Grade.POOR, f"Only {name} sees the board, and two tilts of it fit nearly as well "
                    f"({only.rms_px[0]:.2f} and {only.rms_px[1]:.2f} px).",
                    "A plane seen small or face on looks the same tilted either way.",
                    "Lay the board where two cameras see it, or nearer.")]


def _summary(stances: Sequence[CameraStance], rms: float) -> str:
    places = ", ".join(f"{each.name} {each.height_m * 1e3:.0f} mm above the table, looking down by "
                       f"{np.degrees(each.down_rad):.0f} degrees" for each in stances)
    return f"{places} (corners {rms:.2f} px off)."
