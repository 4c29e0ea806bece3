"""A first lens from the same views that will put the cameras together: good enough to start from, refined there."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.board.boards import Board
from rhot_app.calibration.board.corners import BoardView
from rhot_app.calibration.board.poses import pose_view
from rhot_app.calibration.lens.start import LensStart, loose_prior
from rhot_app.calibration.stereo.bundle import adjust
from rhot_app.calibration.stereo.bundle_layout import LensFreedom
from rhot_app.calibration.stereo.bundle_model import LENS, BundleState, Observations
from rhot_app.errors import CalibrationError

Array = NDArray[np.float64]

FEWEST_VIEWS = 3


def find_lens(views: Sequence[BoardView], board: Board, name: str) -> LensStart:
    """The lens of one camera from its views: Zhang's closed form, then a robust fit of everything.

    Raises CalibrationError naming the camera when the views do not determine a lens.
    """
    if len(views) < FEWEST_VIEWS:
        raise CalibrationError(f"{name}: the board was found in {len(views)} pictures; {FEWEST_VIEWS} are the least to "
                               "find the lens from, 15 are good. Or give the intrinsics.")
    size = views[0].size
    lens = _closed_form(views, board, size)
    posed = [(view, pose_view(view, board, lens)) for view in views]
    usable = [(view, found.camera_from_board[0]) for view, found in posed if found is not None]
    counts = [len(view.ids) for view, _ in usable]
    seen = Observations(np.zeros(sum(counts), np.intp), np.repeat(np.arange(len(usable)), counts),
                        np.concatenate([view.object_points(board) for view, _ in usable]),
                        np.concatenate([view.pixels for view, _ in usable]))
    start = BundleState(lens[None], np.eye(4)[None], np.array([pose for _, pose in usable]))
    free = LensFreedom.free([True] * LENS, lens, loose_prior(lens, size))
    try:
        found = adjust(start, seen, [free]).state.lenses[0]
    except CalibrationError as exc:
        raise CalibrationError(f"{name}: {exc}") from exc
    return LensStart(found, size, None, "views")


def _closed_form(views: Sequence[BoardView], board: Board, size: tuple[int, int]) -> Array:
    points = [view.object_points(board).astype(np.float32) for view in views]
    pixels = [view.pixels.astype(np.float32) for view in views]
    matrix = cv2.initCameraMatrix2D(points, pixels, size, 1.0)
    focal = float(matrix[0, 0])
    longest = float(max(size))
    if not 0.3 * longest < focal < 10.0 * longest:  # views seen face on leave it open
        focal = longest
    return np.array([focal, focal, (size[0] - 1) / 2, (size[1] - 1) / 2, 0.0, 0.0, 0.0, 0.0, 0.0])
