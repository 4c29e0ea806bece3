"""The real stereo pictures of a chessboard (../shared/data/stereo_chessboard), and the board in them."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from rhot_app.calibration.board.boards import Chessboard
from rhot_app.calibration.board.corners import BoardView, detect
from rhot_app.calibration.board.shared_views import BoardShot, SharedViews
from rhot_app.calibration.lens.fit import LensStart
from rhot_app.geometry.camera import full_lens

FOLDER = Path(__file__).resolve().parents[3] / "shared" / "data" / "stereo_chessboard"
NUMBERS = range(1, 15)
BOARD = Chessboard(9, 6, 0.030)
SIZE = (640, 480)

needs_pictures = pytest.mark.skipif(not FOLDER.is_dir(), reason=f"real images are not there ({FOLDER})")

Gray = NDArray[np.uint8]


def picture(camera: str, number: int) -> Gray:
    """One picture, grey."""
    image = cv2.imread(str(FOLDER / f"{camera}{number:02d}.jpg"), cv2.IMREAD_GRAYSCALE)
    assert image is not None
    return np.asarray(image, np.uint8)


@cache
def views_of(camera: str, *, mirrored: bool = False) -> list[BoardView | None]:
    """The board in all pictures of a camera, as they are or flipped left to right before the search."""
    images = [picture(camera, number) for number in NUMBERS]
    return [detect(np.ascontiguousarray(image[:, ::-1]) if mirrored else image, BOARD) for image in images]


def shared(left: list[BoardView | None], right: list[BoardView | None],
           names: tuple[str, str] = ("left", "right"), most: int = 14) -> SharedViews:
    """Shots of two lists, pair by pair; the first `most` of them."""
    pairs = list(zip(left, right, strict=False))[:most]
    return SharedViews(names, BOARD, tuple(BoardShot(f"{number:02d}", pair) for number, pair in enumerate(pairs, 1)))


def rough() -> list[LensStart]:
    """Lenses as a first guess has them, to be found from the same views."""
    lens = full_lens([530.0, 530.0, 319.5, 239.5, -0.25])
    return [LensStart(lens.copy(), SIZE, None, "views") for _ in range(2)]
