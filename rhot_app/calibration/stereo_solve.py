"""Putting cameras together: links, one start, one bundle adjustment, and again without the shots that do not fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.board import Board
from rhot_app.calibration.board_poses import PosedView, pose_view
from rhot_app.calibration.bundle import Bundle, adjust
from rhot_app.calibration.bundle_model import BundleState, Observations
from rhot_app.calibration.corners import BoardView
from rhot_app.calibration.lens_start import LensStart
from rhot_app.calibration.stereo_doubts import Doubtful, explain, explain_shot
from rhot_app.calibration.stereo_links import Link
from rhot_app.calibration.stereo_start import PlacedShot, all_links, place_shot, spanning_tree
from rhot_app.calibration.stereo_views import Dropped, SharedViews
from rhot_app.calibration.verdict import Finding
from rhot_app.errors import CalibrationError
from rhot_app.progress import Progress, silent

Array = NDArray[np.float64]

FEWEST_SHOTS = 3

_OFF_TIMES = 4.0  # a view whose rms is this many times the median view's, and
_OFF_PX = 0.3  # this much more than it, does not fit
_MOST_ROUNDS = 3
_MOST_DROPPED = 0.34  # of the shots; a rig that needs more thrown away has another trouble


@dataclass(frozen=True, slots=True)
class StereoSolution:
    """The adjusted rig.

    `shots` are indices into the views' shots, one per board of the `bundle`; `views` [shot][camera] what was used, with
    the corners counted from the same end in all cameras; `seen` those corners as the bundle takes them; `dropped` the
    shots that did not fit, with reasons.
    """

    cameras: tuple[str, ...]
    board: Board
    bundle: Bundle
    seen: Observations
    shots: tuple[int, ...]
    views: tuple[tuple[BoardView | None, ...], ...]
    dropped: tuple[Dropped, ...]


def solve(views: SharedViews, lenses: Sequence[LensStart], *, refine: bool = False,
          progress: Progress = silent) -> StereoSolution | Finding:
    """All cameras in the first one's frame; or the finding that says why they cannot be put together.

    `lenses` one per camera; `refine` lets given ones change within their standard deviations. Raises CalibrationError
    when cameras share no shot, or too few.
    """
    _check(views)
    progress("finding the board in space", 0.0)
    posed = [[None if view is None else pose_view(view, views.board, lens.lens)
              for view, lens in zip(shot.views, lenses, strict=True)] for shot in views.shots]
    links = all_links(posed, len(views.cameras))
    placed, tree = spanning_tree(links, len(views.cameras))
    if len(placed) < len(views.cameras):
        return _why_apart(views, lenses, posed, links, placed)
    boards, dropped = _place_boards(views, lenses, posed, tree, placed)
    start = np.array([placed[camera] for camera in range(len(views.cameras))])
    return _adjust(views, lenses, posed, start, boards, dropped, refine, progress)


def _check(views: SharedViews) -> None:
    shared = [shot for shot in views.shots if len(shot.seen_by) >= 2]
    lonely = [name for camera, name in enumerate(views.cameras)
              if not any(shot.views[camera] is not None for shot in shared)]
    if lonely:
        raise CalibrationError(f"{' and '.join(lonely)}: no picture shows the board at the same moment as another "
                               "camera. Hold the board where at least two cameras see it whole.")
    if len(shared) < FEWEST_SHOTS:
        raise CalibrationError(f"Only {len(shared)} shots show the board in two cameras; {FEWEST_SHOTS} are the least, "
                               "15 are good.")


def _why_apart(views: SharedViews, lenses: Sequence[LensStart], posed: Sequence[Sequence[PosedView | None]],
               links: Sequence[Link], placed: dict[int, Array]) -> Finding:
    """Why some camera hangs together with no other: the pair that shares most is looked into."""
    between = [each for each in links if (each.first in placed) != (each.second in placed)]
    if not between:
        apart = [name for camera, name in enumerate(views.cameras) if camera not in placed]
        raise CalibrationError(f"{' and '.join(apart)}: no shot is shared with the group of {views.cameras[0]}. Take "
                               "pictures that show the board to a camera of either group at the same moment.")
    worst = max(between, key=lambda each: each.shared)
    return explain(_doubt(views, lenses, posed, worst), worst)


def _doubt(views: SharedViews, lenses: Sequence[LensStart], posed: Sequence[Sequence[PosedView | None]],
           each: Link) -> Doubtful:
    a, b = each.first, each.second
    return Doubtful((views.cameras[a], views.cameras[b]), (lenses[a], lenses[b]),
                    ([shot[a] for shot in posed], [shot[b] for shot in posed]),
                    [shot.name for shot in views.shots], views.board)


def _place_boards(views: SharedViews, lenses: Sequence[LensStart], posed: Sequence[Sequence[PosedView | None]],
                  tree: Sequence[Link], placed: dict[int, Array]) -> tuple[list[PlacedShot], list[Dropped]]:
    """The boards that at least two cameras agree on, and the shots that were dropped."""
    boards, dropped = [], []
    for shot, those in enumerate(posed):
        board = place_shot(shot, those, placed)
        if board is not None and len(board.agreeing) >= 2:
            boards.append(board)
            dropped += [Dropped(f"{views.shots[shot].name} of {views.cameras[camera]}",
                                "the other cameras agree that the board is elsewhere", "apart")
                        for camera in board.disagreeing]
        elif board is not None and board.disagreeing:
            guilty = next((each for each in tree if shot in each.disagreeing), tree[0])
            dropped.append(explain_shot(_doubt(views, lenses, posed, guilty), shot, guilty.second_from_first))
    return boards, dropped


def _adjust(views: SharedViews, lenses: Sequence[LensStart], posed: Sequence[Sequence[PosedView | None]], start: Array,
            boards: list[PlacedShot], dropped: list[Dropped], refine: bool, progress: Progress) -> StereoSolution:
    """Adjust, drop what does not fit, adjust again."""
    total = len(boards)
    freedom = [lens.freedom(refine=refine) for lens in lenses]
    state = BundleState(np.array([lens.lens for lens in lenses]), start, np.empty((0, 4, 4)))
    while True:
        if len(boards) < FEWEST_SHOTS:
            raise CalibrationError(f"Only {len(boards)} shots fit together; {FEWEST_SHOTS} are the least, 15 are good.")
        used = _used_views(views, posed, boards, start)
        seen = _observations(used, views.board)
        state = BundleState(state.lenses, state.camera_from_world, np.array([b.world_from_board for b in boards]))
        bundle = adjust(state, seen, freedom, progress=progress)
        solution = StereoSolution(views.cameras, views.board, bundle, seen, tuple(b.shot for b in boards), used,
                                  tuple(dropped))
        strange = _strange(solution)
        if not strange or total - len(boards) + len(strange) > _MOST_DROPPED * total:
            return solution
        dropped += [Dropped(views.shots[boards[row].shot].name, reason, "residual") for row, reason in strange.items()]
        state = bundle.state
        boards = [replace(board, world_from_board=state.world_from_board[row])
                  for row, board in enumerate(boards) if row not in strange]


def _used_views(views: SharedViews, posed: Sequence[Sequence[PosedView | None]], boards: Sequence[PlacedShot],
                camera_from_world: Array) -> tuple[tuple[BoardView | None, ...], ...]:
    """[shot][camera] the views that agree, counted from the end on which the cameras agree."""
    table = []
    for board in boards:
        row: list[BoardView | None] = [None] * len(views.cameras)
        for camera in board.agreeing:
            seen = posed[board.shot][camera]
            assert seen is not None
            turned = seen.turned(camera_from_world[camera] @ board.world_from_board)
            row[camera] = seen.view.turned(views.board) if turned else seen.view
        table.append(tuple(row))
    return tuple(table)


def _observations(used: Sequence[Sequence[BoardView | None]], board: Board) -> Observations:
    rows = [(camera, shot, view) for shot, those in enumerate(used) for camera, view in enumerate(those)
            if view is not None]
    counts = [len(view.ids) for _, _, view in rows]
    return Observations(np.repeat([camera for camera, _, _ in rows], counts),
                        np.repeat([shot for _, shot, _ in rows], counts),
                        np.concatenate([view.object_points(board) for _, _, view in rows]),
                        np.concatenate([view.pixels for _, _, view in rows]))


def view_rms(solution: StereoSolution) -> Array:
    """(S, C) px, rms distance of each view's corners from where they are expected; NaN where there is no view."""
    seen = solution.seen
    shape = len(solution.shots), len(solution.cameras)
    cell = seen.shot * shape[1] + seen.camera
    squares = np.bincount(cell, np.sum(np.square(solution.bundle.residuals), axis=1), minlength=shape[0] * shape[1])
    counts = np.bincount(cell, minlength=shape[0] * shape[1])
    return np.sqrt(squares / np.where(counts, counts, np.nan)).reshape(shape)


def _strange(solution: StereoSolution) -> dict[int, str]:
    """Rows of the shots that fit far worse than the others, and why they are left out."""
    rms = view_rms(solution)
    usual = float(np.nanmedian(rms))
    limit = max(_OFF_TIMES * usual, usual + _OFF_PX)
    found = {}
    for row in range(len(rms)):
        camera = int(np.nanargmax(rms[row]))
        if rms[row, camera] > limit:
            found[row] = (f"its corners in {solution.cameras[camera]} are {rms[row, camera]:.1f} px from where the "
                          f"other shots place them (usual: {usual:.2f} px): the board or a camera moved between the "
                          "exposures, or the board is bent")
    return found
