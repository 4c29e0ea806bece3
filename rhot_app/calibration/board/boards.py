"""Calibration boards: the plain chessboard and the ChArUco board, as their printed geometry.

The board's frame has its origin at the first inner corner, x along a row of corners, y along a column, z into the
paper; seen from the printed side x is right and y down, so z points away from the viewer. Inner corners are numbered
row by row: ``id = row * cols + col``.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.board.standard_board import BOARD, SQUARE_MM
from rhot_app.errors import CalibrationError

Array = NDArray[np.float64]

DEFAULT_DICTIONARY = "DICT_4X4_50"
FEWEST, MOST = 3, 60  # inner corners per side: OpenCV's detectors need three
SMALLEST_M, LARGEST_M = 0.0005, 1.0  # a printed square


class _Sized(Protocol):
    """What a grid of corners is made of."""

    @property
    def cols(self) -> int: ...
    @property
    def rows(self) -> int: ...
    @property
    def square_m(self) -> float: ...


class Lattice:
    """What every board of `cols` x `rows` inner corners, `square_m` metres apart, has in common."""

    __slots__ = ()

    @property
    def count(self: _Sized) -> int:
        """How many inner corners there are."""
        return self.cols * self.rows

    def object_points(self: _Sized) -> Array:
        """(N, 3) m, the inner corners in the board's frame, in the order of their ids; z is 0."""
        row, col = np.divmod(np.arange(self.cols * self.rows), self.cols)
        return np.column_stack([col, row, np.zeros(len(row))]) * self.square_m

    def outline(self: _Sized) -> Array:
        """(4, 3) m, the corners of the outermost squares, clockwise as seen, from beside the first inner corner."""
        right, bottom = self.cols, self.rows
        return np.array([[-1, -1, 0], [right, -1, 0], [right, bottom, 0], [-1, bottom, 0]], float) * self.square_m


@dataclass(frozen=True, slots=True)
class Chessboard(Lattice):
    """A plain chessboard with `cols` x `rows` inner corners (one less than squares) of `square_m` metres.

    The first corner is the one whose outer square is black, where the colours tell the board's ends apart, that is when
    one of `cols` and `rows` is odd and the other even (the common 9x6). Otherwise the pattern turned by 180 degrees is
    the same pattern, and the first corner is the one towards the picture's upper left: then two cameras agree only
    when both stand upright. Raises CalibrationError for impossible numbers.
    """

    cols: int
    rows: int
    square_m: float

    def __post_init__(self) -> None:
        _check(self.cols, self.rows, self.square_m)

    @property
    def one_way_up(self) -> bool:
        """Whether the colours tell the board from itself turned by 180 degrees."""
        return (self.cols + self.rows) % 2 == 1

    @property
    def free_space(self) -> float:
        """Which part of a square's side is empty around a corner, but for the four squares that meet there."""
        return 1.0

    @property
    def size_text(self) -> str:
        """The size as it is written on command lines, "9x6"."""
        return f"{self.cols}x{self.rows}"

    @property
    def text(self) -> str:
        """The board in words."""
        return f"chessboard with {self.size_text} inner corners, {self.square_m * 1e3:g} mm squares"


@dataclass(frozen=True, slots=True)
class CharucoBoard(Lattice):
    """A chessboard of `squares_x` x `squares_y` squares with a marker in every white one; parts of it suffice.

    `square_m`, `marker_m` in metres; `dictionary` is OpenCV's name of the marker family; `legacy` the layout that
    OpenCV drew before 4.6, whose first square is white when `squares_y` is even. Raises CalibrationError for impossible
    numbers or an unknown dictionary.
    """

    squares_x: int
    squares_y: int
    square_m: float
    marker_m: float
    dictionary: str = DEFAULT_DICTIONARY
    legacy: bool = False

    def __post_init__(self) -> None:
        _check(self.cols, self.rows, self.square_m)
        if not 0.2 * self.square_m < self.marker_m < 0.95 * self.square_m:
            raise CalibrationError(f"Markers of {self.marker_m * 1e3:g} mm do not go into squares of "
                                   f"{self.square_m * 1e3:g} mm: measure both, about 3:4 is usual.")
        family, held = self.marker_family(), self.squares_x * self.squares_y // 2
        if len(family.bytesList) < held:
            raise CalibrationError(f"{self.dictionary} has {len(family.bytesList)} markers, a board of "
                                   f"{self.size_text} squares needs {held}: name the dictionary it was printed with.")

    @property
    def cols(self) -> int:
        """Inner corners along x."""
        return self.squares_x - 1

    @property
    def rows(self) -> int:
        """Inner corners along y."""
        return self.squares_y - 1

    @property
    def one_way_up(self) -> bool:
        """True: every marker tells its own place."""
        return True

    @property
    def free_space(self) -> float:
        """Which part of a square's side is empty around a corner: a marker's corner is the next thing there."""
        return min(1.0, float(np.sqrt(2.0)) * (1.0 - self.marker_m / self.square_m))

    @property
    def size_text(self) -> str:
        """The size in squares, as ChArUco boards are named, "8x6"."""
        return f"{self.squares_x}x{self.squares_y}"

    @property
    def text(self) -> str:
        """The board in words."""
        layout = ", layout of OpenCV before 4.6" if self.legacy else ""
        return (f"ChArUco board with {self.size_text} squares of {self.square_m * 1e3:g} mm, markers "
                f"{self.marker_m * 1e3:g} mm of {self.dictionary}{layout}")

    @property
    def layouts_differ(self) -> bool:
        """Whether the layouts before and after OpenCV 4.6 are different boards at this size."""
        return self.squares_y % 2 == 0

    def marker_family(self) -> cv2.aruco.Dictionary:
        """OpenCV's dictionary; raises CalibrationError for an unknown name."""
        number = getattr(cv2.aruco, self.dictionary, None)
        if not self.dictionary.startswith("DICT_") or not isinstance(number, int):
            raise CalibrationError(f"There is no marker dictionary {self.dictionary!r}: the names are OpenCV's, such "
                                   f"as {DEFAULT_DICTIONARY} or DICT_5X5_100.")
        return cv2.aruco.getPredefinedDictionary(number)

    def opencv(self) -> cv2.aruco.CharucoBoard:
        """OpenCV's own description of the board."""
        board = cv2.aruco.CharucoBoard((self.squares_x, self.squares_y), self.square_m, self.marker_m,
                                       self.marker_family())
        board.setLegacyPattern(self.legacy)
        return board


Board = Chessboard | CharucoBoard


def same_pattern(first: Board, second: Board) -> bool:
    """Whether two boards differ in their lengths at most, so that what was seen of one is as good for the other."""
    if isinstance(first, CharucoBoard) and isinstance(second, CharucoBoard):
        return replace(first, square_m=second.square_m, marker_m=second.marker_m) == second
    if isinstance(first, Chessboard) and isinstance(second, Chessboard):
        return replace(first, square_m=second.square_m) == second
    return False


def parse_size(text: str) -> tuple[int, int]:
    """Read "9x6" as (9, 6); raises CalibrationError for anything else."""
    match = re.fullmatch(r"\s*(\d{1,3})\s*[xX×*,]\s*(\d{1,3})\s*", text)
    if not match:
        raise CalibrationError(f"A board's size is written as two numbers, 9x6 for nine by six inner corners, "
                               f"not {text!r}.")
    return int(match[1]), int(match[2])


def _check(cols: int, rows: int, square_m: float) -> None:
    if not (FEWEST <= cols <= MOST and FEWEST <= rows <= MOST):
        raise CalibrationError(f"A board of {cols}x{rows} inner corners is not possible: each side has {FEWEST} to "
                               f"{MOST}.")
    if not SMALLEST_M <= square_m <= LARGEST_M:
        raise CalibrationError(f"A square of {square_m * 1e3:g} mm is not possible: measure one side of a square and "
                               f"give it in millimetres, {SMALLEST_M * 1e3:g} to {LARGEST_M * 1e3:g}.")


STANDARD_BOARD = Chessboard(*parse_size(BOARD), 1e-3 * SQUARE_MM)
"""The board of `standard_board`, printed at 100 %."""
