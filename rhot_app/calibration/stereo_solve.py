"""Putting cameras together: links, one start, one bundle adjustment, and again without the shots that do not fit."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.board_poses import PosedView, pose_view
from rhot_app.calibration.lens_start import LensStart
from rhot_app.calibration.stereo_adjust import FEWEST_SHOTS, StereoSolution, adjust_rig
from rhot_app.calibration.stereo_doubts import Doubtful, explain, explain_shot
from rhot_app.calibration.stereo_links import Link
from rhot_app.calibration.stereo_start import PlacedShot, all_links, place_shot, spanning_tree
from rhot_app.calibration.stereo_views import Dropped, SharedViews
from rhot_app.calibration.verdict import Finding
from rhot_app.errors import CalibrationError
from rhot_app.progress import Progress, silent

Array = NDArray[np.float64]


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
    return adjust_rig(views, lenses, posed, start, boards, dropped, refine=refine, progress=progress)


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
