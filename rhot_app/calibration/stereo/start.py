"""The start of the bundle adjustment from relative poses of camera pairs, and the world frame on the table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.board.boards import Board
from rhot_app.calibration.board.corners import BoardView
from rhot_app.calibration.board.poses import PosedView, pose_view
from rhot_app.calibration.bundle.model import BundleState, Observations, linearise
from rhot_app.calibration.verdict import Finding, Grade, Verdict, judge
from rhot_app.errors import CalibrationError
from rhot_app.estimation.least_squares import Dense, minimise
from rhot_app.estimation.residual import UNIT, Rows
from rhot_app.estimation.se3 import exp_so3, log_so3
from rhot_app.geometry.transforms import apply, inverse, rigid

# -- relative pose of two cameras by consensus -------------------------------------------------------------------------
# A shot proposes its own answer; the one that most shots agree with wins, and whoever disagrees is named. Nothing
# here is an average over good and bad shots.

Array = NDArray[np.float64]

AGREEMENT = 0.01
"""Of the picture's diagonal: as far as a board carried over from one camera to the other may miss. A pose from one
camera alone carries an error in depth with it; a shot that does not belong misses by many times this."""

_MOST_PROPOSALS = 12  # where most shots belong together, one of a dozen surely does

Pair = tuple[PosedView | None, PosedView | None]


@dataclass(frozen=True, slots=True)
class Link:
    """How two cameras stand to each other.

    `second_from_first` (4, 4) m; `agreeing` and `disagreeing` are indices of shots; `misses_px` of all shots, NaN for
    those that one of the two did not see.
    """

    first: int
    second: int
    second_from_first: Array
    agreeing: tuple[int, ...]
    disagreeing: tuple[int, ...]
    misses_px: Array

    @property
    def shared(self) -> int:
        """How many shots both have seen."""
        return len(self.agreeing) + len(self.disagreeing)

    @property
    def coherent(self) -> bool:
        """Whether this is one rig seen by two cameras that belong together: at least two shots and most of them."""
        return len(self.agreeing) >= min(2, self.shared) and len(self.agreeing) > len(self.disagreeing)


def link(pairs: Sequence[Pair], first: int = 0, second: int = 1) -> Link | None:
    """The link between two cameras from their views of the same shots; None when they share none."""
    shared = [shot for shot, (a, b) in enumerate(pairs) if a is not None and b is not None]
    if not shared:
        return None
    asked = shared[::-(-len(shared) // _MOST_PROPOSALS)]
    proposals = [(pose, _misses(pairs, pose)) for shot in asked for pose in _relative_poses(pairs[shot])]
    best, misses = max(proposals, key=lambda proposal: _support(proposal[1]))
    return _refined(pairs, shared, first, second, best, misses)


def _support(misses: Array) -> tuple[int, float]:
    close = misses[misses < 1.0]
    return len(close), -float(np.sum(close))


def miss(pair: Pair, second_from_first: Array) -> float:
    """How far the second camera's corners are from where the first one's board says, in parts of AGREEMENT."""
    a, b = pair
    if a is None or b is None:
        return float("nan")
    diagonal = float(np.hypot(*b.view.size))
    return min(b.off(second_from_first @ pose) for pose in a.camera_from_board) / (AGREEMENT * diagonal)


def _relative_poses(pair: Pair) -> list[Array]:
    a, b = pair
    if a is None or b is None:
        return []
    return [mine @ inverse(yours) for yours in a.camera_from_board for mine in b.every_pose]


def _misses(pairs: Sequence[Pair], candidate: Array) -> Array:
    return np.array([miss(pair, candidate) for pair in pairs])


def _refined(pairs: Sequence[Pair], shared: list[int], first: int, second: int, candidate: Array,
             misses: Array) -> Link:
    """The link after averaging over the shots that agree."""
    nearest = [_nearest(_relative_poses(pairs[shot]), candidate) for shot in shared if misses[shot] < 1.0]
    if nearest:
        mean = average_pose(np.array(nearest))
        averaged = _misses(pairs, mean)
        if np.count_nonzero(averaged < 1.0) >= np.count_nonzero(misses < 1.0):
            candidate, misses = mean, averaged
    diagonals = np.array([np.hypot(*b.view.size) if b is not None else np.nan for _, b in pairs])
    return Link(first, second, candidate, tuple(s for s in shared if misses[s] < 1.0),
                tuple(s for s in shared if not misses[s] < 1.0), misses * AGREEMENT * diagonals)


def _nearest(poses: list[Array], to: Array) -> Array:
    """The pose nearest in rotation; a plane's two poses differ in it by far more than the noise."""
    return min(poses, key=lambda pose: float(np.linalg.norm(log_so3(pose[:3, :3] @ to[:3, :3].T))))


def average_pose(poses: Array) -> Array:
    """Mean of rigid poses (K, 4, 4): rotations by the nearest to the sum (Horn 1987), translations by the median."""
    left, _, right = np.linalg.svd(poses[:, :3, :3].sum(axis=0))
    mean = np.eye(4)
    mean[:3, :3] = left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right
    mean[:3, 3] = np.median(poses[:, :3, 3], axis=0)
    return mean


# -- start of the bundle adjustment ------------------------------------------------------------------------------------

PosedShots = Sequence[Sequence[PosedView | None]]
"""[shot][camera]"""


def all_links(posed: PosedShots, cameras: int) -> list[Link]:
    """The links of all pairs of cameras that share a shot."""
    found = [link([(shot[a], shot[b]) for shot in posed], a, b) for a in range(cameras) for b in range(a + 1, cameras)]
    return [each for each in found if each is not None]


def spanning_tree(links: Sequence[Link], cameras: int) -> tuple[dict[int, Array], tuple[Link, ...]]:
    """camera_from_first (4, 4) of every camera that coherent links connect with the first, strongest links first, and
    the links used (Prim)."""
    placed, used = {0: np.eye(4)}, []
    while len(placed) < cameras:
        edges = [each for each in links if each.coherent and (each.first in placed) != (each.second in placed)]
        if not edges:
            break
        best = max(edges, key=lambda each: len(each.agreeing))
        if best.first in placed:
            placed[best.second] = best.second_from_first @ placed[best.first]
        else:
            placed[best.first] = inverse(best.second_from_first) @ placed[best.second]
        used.append(best)
    return placed, tuple(used)


@dataclass(frozen=True, slots=True)
class PlacedShot:
    """Where the board was in one shot, `world_from_board` (4, 4) m, and the cameras whose views agree with it."""

    shot: int
    world_from_board: Array
    agreeing: tuple[int, ...]
    disagreeing: tuple[int, ...]


def place_shot(shot: int, views: Sequence[PosedView | None], camera_from_world: dict[int, Array]) -> PlacedShot | None:
    """The board's pose with which most cameras agree, by the least error among equals; None when nobody sees it."""
    seen = [(camera, view) for camera, view in enumerate(views) if view is not None and camera in camera_from_world]
    best, most = None, (-1, 0.0)
    for camera, view in seen:
        for pose in view.camera_from_board:
            world_from_board = inverse(camera_from_world[camera]) @ pose
            misses = {other: its.off(camera_from_world[other] @ world_from_board)
                      / (AGREEMENT * float(np.hypot(*its.view.size))) for other, its in seen}
            agreeing = tuple(other for other, value in misses.items() if value < 1.0)
            score = len(agreeing), -sum(misses[other] for other in agreeing)
            if score > most:
                rest = tuple(other for other, _ in seen if other not in agreeing)
                best, most = PlacedShot(shot, world_from_board, agreeing, rest), score
    return best


# -- world frame from a board on the table -----------------------------------------------------------------------------
# z up, origin at the board's first corner, x along its columns.
# The board's own z points into the paper, away from the viewer; the table's z points up from it, so the table frame
# is the board's, turned by 180 degrees about x. A board can only be seen from its printed side, so whoever sees it
# lying on the table is above the table; what can be wrong is that it stands, lies elsewhere in another camera, or is
# seen too small to tell its tilt.

TABLE_FROM_BOARD: Array = rigid(np.diag([1.0, -1.0, -1.0]), np.zeros(3))

_LEVEL_RAD = np.radians(20.0)  # a camera that is rolled more than this against the table was not mounted by a person
_SIMILAR_POSES = 2.0  # another tilt of the board whose error is below this many times the best one's cannot be excluded
_STEPS, _LEAST_GAIN_SQ_PX = 10, 1e-9  # of all corners' squared distances


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
    world_from_board, rms = _refined_board(posed, state, placed.world_from_board)
    table_from_old = TABLE_FROM_BOARD @ inverse(world_from_board)
    poses = np.array([table_from_old @ inverse(pose) for pose in state.camera_from_world])
    stances = tuple(_stance(name, pose) for name, pose in zip(names, poses, strict=True))
    findings = [*_stance_findings(stances), *_tilt_findings(posed, names)]
    return WorldFrame(poses, table_from_old, stances, rms, judge(_summary(stances, rms), findings))


def _refined_board(posed: Sequence[PosedView | None], state: BundleState, start: Array) -> tuple[Array, float]:
    """The board's pose that fits all cameras best, and the rms of its corners in px; the cameras stay."""
    rows = [(camera, each) for camera, each in enumerate(posed) if each is not None]
    points = [apply(each.half_turn, each.points) if each.half_turn is not None
              and each.turned(state.camera_from_world[camera] @ start) else each.points for camera, each in rows]
    seen = Observations(np.repeat([camera for camera, _ in rows], [len(each) for each in points]),
                        np.zeros(sum(len(each) for each in points), np.intp), np.concatenate(points),
                        np.concatenate([each.view.pixels for _, each in rows]))
    def corners(pose: Array) -> list[Rows]:
        line = linearise(BundleState(state.lenses, state.camera_from_world, pose[None]), seen)
        return [Rows(line.residuals.ravel(), line.by_board.reshape(-1, 6), UNIT)]

    def retract(pose: Array, step: Array) -> Array:
        return rigid(exp_so3(step[:3]) @ pose[:3, :3], pose[:3, 3] + step[3:])
    found, _ = minimise(Dense(start, corners, retract, 6), _STEPS, _LEAST_GAIN_SQ_PX)
    return found.state, float(np.sqrt(found.cost / len(seen)))


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
