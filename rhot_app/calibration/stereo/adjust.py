"""The adjustment of a whole rig: without the shots that do not fit, and with the board's own shape."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.board.boards import Board
from rhot_app.calibration.board.corners import BoardView
from rhot_app.calibration.board.poses import BoardErrors, PosedView, find_board_errors
from rhot_app.calibration.board.shared_views import Dropped, SharedViews
from rhot_app.calibration.bundle.adjustment import Bundle, adjust
from rhot_app.calibration.bundle.model import BundleState, LensFreedom, Observations
from rhot_app.calibration.bundle.robust_error import MOST_DROPPED, misfit_limit, tilt_spread
from rhot_app.calibration.lens.fit import LensStart
from rhot_app.calibration.stereo.start import PlacedShot
from rhot_app.errors import CalibrationError
from rhot_app.progress import Progress, within

Array = NDArray[np.float64]

FEWEST_SHOTS = 3
ALIKE_RAD = float(np.radians(10.0))
"""Boards whose normals are all within this angle tell focal length from distance badly, and not their own shape."""


@dataclass(frozen=True, slots=True)
class StereoSolution:
    """The adjusted rig.

    `shots` are indices into the views' shots, one per board of the `bundle`; `views` [shot][camera] what was used, with
    the corners counted from the same end in all cameras; `seen` those corners as the bundle takes them; `dropped` the
    shots that did not fit, with reasons; `board_errors` how far the board is from its drawing, None if it is as drawn.
    """

    cameras: tuple[str, ...]
    board: Board
    bundle: Bundle
    seen: Observations
    shots: tuple[int, ...]
    views: tuple[tuple[BoardView | None, ...], ...]
    dropped: tuple[Dropped, ...]
    board_errors: BoardErrors | None = None


def adjust_rig(views: SharedViews, lenses: Sequence[LensStart], posed: Sequence[Sequence[PosedView | None]],
               start: Array, boards: list[PlacedShot], dropped: list[Dropped], *, refine: bool,
               progress: Progress) -> StereoSolution:
    """Adjust, drop what does not fit, adjust again; then find the board's own errors.

    `start` (C, 4, 4) m camera_from_world; `boards` where the board was in each shot. Raises CalibrationError when too
    few shots are left.
    """
    total = len(boards)
    freedom = [lens.freedom(refine=refine) for lens in lenses]
    state = BundleState(np.array([lens.lens for lens in lenses]), start, np.empty((0, 4, 4)))
    while True:
        if len(boards) < FEWEST_SHOTS:
            raise CalibrationError(f"Only {len(boards)} shots fit together; {FEWEST_SHOTS} are the least, 15 are good.")
        used = _used_views(views, posed, boards, start)
        seen = _observations(used, views.board)
        state = BundleState(state.lenses, state.camera_from_world, np.array([b.world_from_board for b in boards]))
        bundle = adjust(state, seen, freedom, progress=within(progress, 0.05, 0.5))
        solution = StereoSolution(views.cameras, views.board, bundle, seen, tuple(b.shot for b in boards), used,
                                  tuple(dropped))
        strange = _strange(solution)
        if not strange or total - len(boards) + len(strange) > MOST_DROPPED * total:
            return _settled(solution, freedom, progress)
        dropped += [Dropped(views.shots[boards[row].shot].name, reason, "residual") for row, reason in strange.items()]
        state = bundle.state
        boards = [replace(board, world_from_board=state.world_from_board[row])
                  for row, board in enumerate(boards) if row not in strange]


def _settled(solution: StereoSolution, freedom: list[LensFreedom], progress: Progress) -> StereoSolution:
    """With the board's own errors, where these views can tell them."""
    kept = any(lens.basis.shape[1] == 0 for lens in freedom)
    if kept or tilt_spread(solution.bundle.state.world_from_board) < ALIKE_RAD:
        return solution  # what is wrong with a lens that may not change, or with views all alike, would bend the board
    board, seen = solution.board, solution.seen
    progress("finding the board's own errors", 0.5)
    bundle, errors = find_board_errors(solution.bundle, seen, freedom, board.count, board.square_m,
                                       progress=within(progress, 0.5, 0.95))
    return replace(solution, bundle=bundle, board_errors=errors)


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
                        np.concatenate([view.pixels for _, _, view in rows]),
                        np.concatenate([view.ids for _, _, view in rows]))


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
    limit, usual = misfit_limit(rms)
    found = {}
    for row in range(len(rms)):
        camera = int(np.nanargmax(rms[row]))
        if rms[row, camera] > limit:
            found[row] = (f"its corners in {solution.cameras[camera]} are {rms[row, camera]:.1f} px from where the "
                          f"other shots place them (usual: {usual:.2f} px): the board or a camera moved between the "
                          "exposures, or the board is bent")
    return found
