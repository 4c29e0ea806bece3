"""Printed sheets of paper: calibration boards and a ruler, as black and white fields between straight lines.

A board's sheet lies in the board's own frame (`rhot_app.calibration.board.boards`): x right, y down, z into the paper.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.board.boards import CharucoBoard, Chessboard
from rhot_app.objects.object_file import Tag

Array = NDArray[np.float64]
Levels = NDArray[np.float32]

BLACK, WHITE = 24.0, 226.0
"""Grey levels of ink and paper that face the lamp."""

BORDER_SQUARES = 0.6  # white paper around a board, in squares
_TICK_M = 0.0012
_RULER_HALF_M = 0.016


@dataclass(frozen=True, slots=True)
class Sheet:
    """A sheet in the plane z = 0 of its own frame: the field between `x_lines[i]` and `x_lines[i + 1]`, `y_lines[j]`
    and `y_lines[j + 1]` has the grey level `levels[j, i]`.

    `x_lines` (X + 1,), `y_lines` (Y + 1,) m, increasing; `levels` (Y, X) 0..255.
    """

    x_lines: Array
    y_lines: Array
    levels: Levels

    @property
    def outline(self) -> Array:
        """(4, 3) m, the paper's corners, clockwise as seen."""
        (left, right), (top, bottom) = self.x_lines[[0, -1]], self.y_lines[[0, -1]]
        return np.array([[left, top, 0.0], [right, top, 0.0], [right, bottom, 0.0], [left, bottom, 0.0]])

    @property
    def middle(self) -> Array:
        """(3,) m."""
        return np.asarray(self.outline.mean(axis=0))


def board_sheet(board: Chessboard | CharucoBoard) -> Sheet:
    """The printed board on white paper."""
    squares_x, squares_y = board.cols + 1, board.rows + 1
    rows, columns = np.indices((squares_y, squares_x))
    if isinstance(board, CharucoBoard):
        return _charuco_sheet(board)
    fields = np.where((rows + columns) % 2 == 0, BLACK, WHITE)
    x, y = (board.square_m * np.arange(-1.0, count) for count in (squares_x, squares_y))
    return _on_paper(x, y, fields, BORDER_SQUARES * board.square_m)


def ruler_sheet(length_m: float) -> Sheet:
    """A strip with two crosses, their middles `length_m` apart at (0, 0) and (length_m, 0), and a line between them."""
    half, arm = 0.5 * _TICK_M, 0.5 * _RULER_HALF_M
    x = np.array([-arm, -half, half, arm, length_m - arm, length_m - half, length_m + half, length_m + arm])
    y = np.array([-arm, -half, half, arm])
    fields = np.full((3, 7), WHITE)
    fields[1, [0, 1, 2, 4, 5, 6]] = BLACK
    fields[:, [1, 5]] = BLACK
    return _on_paper(x, y, fields, arm)


def ruler_ends(length_m: float) -> Array:
    """(2, 3) m, the middles of the crosses in the sheet's frame."""
    return np.array([[0.0, 0.0, 0.0], [length_m, 0.0, 0.0]])


def tag_sheet(tag: Tag, face_m: float) -> Sheet:
    """A tag in the middle of a square of white paper of `face_m`; x right, y down, z into the paper."""
    family = cv2.aruco.getPredefinedDictionary(tag.key[0])
    modules = family.markerSize + 2
    bits = cv2.aruco.generateImageMarker(family, tag.id, modules, borderBits=1)
    lines = 1e-3 * tag.size_mm * (np.arange(modules + 1) / modules - 0.5)
    return _on_paper(lines, lines, np.where(bits > 0, WHITE, BLACK), 0.5 * (face_m - 1e-3 * tag.size_mm))


def _charuco_sheet(board: CharucoBoard) -> Sheet:
    """Every square is cut by the lines of a marker in its middle, whether it holds one or not."""
    modules = board.marker_family().markerSize + 2
    inside = 0.5 * (board.square_m - board.marker_m) + board.marker_m * np.arange(modules + 1) / modules
    per_square = modules + 2
    lines = [np.concatenate([square * board.square_m + np.array([0.0, *inside]) for square in range(count)]
                            + [np.array([count * board.square_m])])
             for count in (board.squares_x, board.squares_y)]
    fields = np.full((board.squares_y * per_square, board.squares_x * per_square), BLACK)
    for number, corners in _markers(board):
        column, row = (int(value) for value in np.floor(corners.mean(axis=0)[:2] / board.square_m))
        picture = np.full((per_square, per_square), WHITE)
        bits = cv2.aruco.generateImageMarker(board.marker_family(), number, modules, borderBits=1)
        picture[1:-1, 1:-1] = np.where(bits > 0, WHITE, BLACK)
        fields[row * per_square:(row + 1) * per_square, column * per_square:(column + 1) * per_square] = picture
    return _on_paper(lines[0] - board.square_m, lines[1] - board.square_m, fields, BORDER_SQUARES * board.square_m)


def _markers(board: CharucoBoard) -> Sequence[tuple[int, Array]]:
    """Number and corners (4, 3) m of every marker, from the outermost square's corner on (OpenCV's frame)."""
    described = board.opencv()
    return [(int(number), np.asarray(corners, dtype=np.float64))
            for number, corners in zip(np.ravel(described.getIds()), described.getObjPoints(), strict=True)]


def _on_paper(x_lines: Array, y_lines: Array, fields: Array, border_m: float) -> Sheet:
    """The fields with a white border around them."""
    levels = np.full((fields.shape[0] + 2, fields.shape[1] + 2), WHITE, np.float32)
    levels[1:-1, 1:-1] = fields
    x, y = (np.array([lines[0] - border_m, *lines, lines[-1] + border_m]) for lines in (x_lines, y_lines))
    return Sheet(x, y, levels)
