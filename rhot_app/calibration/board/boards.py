"""Calibration boards as their printed geometry: chessboard, ChArUco board, AprilGrid and grid of circles.

The board's frame has its origin at the first corner, x along a row of corners, y along a column, z into the paper; seen
from the printed side x is right and y down, so z points away from the viewer. Corners are numbered row by row:
``id = row * cols + col``. They are the inner corners of a chessboard and of a ChArUco board, the corners of an
AprilGrid's tags, and the centres of circles.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import ClassVar, Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.board.standard_board import (
    BOARD,
    KINDS,
    MARKER_SHARE,
    SQUARE_MM,
    TAG_BITS,
    TAG_BORDER_BITS,
    TAG_SPACING,
)
from rhot_app.errors import CalibrationError

Array = NDArray[np.float64]

DEFAULT_DICTIONARY = "DICT_4X4_50"
FEWEST, MOST = 3, 60  # inner corners or circles per side: OpenCV's detectors need three
SMALLEST_M, LARGEST_M = 0.0005, 1.0  # a printed square, tag or spacing


class _Sized(Protocol):
    """What a grid of corners is made of."""

    @property
    def cols(self) -> int: ...
    @property
    def rows(self) -> int: ...
    @property
    def square_m(self) -> float: ...
    @property
    def margin_m(self) -> float: ...
    def lines(self) -> tuple[Array, Array]: ...
    def object_points(self) -> Array: ...


class Lattice:
    """What every board of `cols` x `rows` corners has in common. `square_m` is the length that a person measures, the
    side of what `parts` names; all others are in proportion to it."""

    __slots__ = ()
    parts: ClassVar[str] = "squares"

    @property
    def count(self: _Sized) -> int:
        """How many corners there are."""
        return self.cols * self.rows

    @property
    def margin_m(self: _Sized) -> float:
        """How far what is printed goes beyond the outermost corners."""
        return self.square_m

    @property
    def free_space(self) -> float:
        """Which part of the way to the next grid line is empty around a corner, but for the four parts that meet there.
        """
        return 1.0

    def lines(self: _Sized) -> tuple[Array, Array]:
        """(cols,) and (rows,) m, where the lines of corners are along x and y."""
        return self.square_m * np.arange(float(self.cols)), self.square_m * np.arange(float(self.rows))

    def object_points(self: _Sized) -> Array:
        """(N, 3) m, the corners in the board's frame, in the order of their ids; z is 0."""
        x, y = self.lines()
        return np.column_stack([np.tile(x, len(y)), np.repeat(y, len(x)), np.zeros(len(x) * len(y))])

    def outline(self: _Sized) -> Array:
        """(4, 3) m, the corners of what is printed, clockwise as seen, from beside the first corner."""
        low, high = (bound(self.object_points()[:, :2], axis=0) for bound in (np.min, np.max))
        (left, top), (right, bottom) = low - self.margin_m, high + self.margin_m
        return np.array([[left, top, 0], [right, top, 0], [right, bottom, 0], [left, bottom, 0]])


@dataclass(frozen=True, slots=True)
class Chessboard(Lattice):
    """A plain chessboard with `cols` x `rows` inner corners (one less than squares) of `square_m` metres.

    When one of `cols` and `rows` is odd and the other even (the common 9x6), the colours tell the board's ends apart.
    The first corner is then the one whose outer square is black. Otherwise the pattern turned by 180 degrees is the
    same, and the first corner is the one towards the picture's upper left. Two cameras then agree only when both stand
    upright.

    Raises CalibrationError for impossible numbers.
    """

    cols: int
    rows: int
    square_m: float

    def __post_init__(self) -> None:
        _check(self.cols, self.rows)
        _check_length(self.square_m, "square", "one side of a square")

    @property
    def one_way_up(self) -> bool:
        """Whether the colours tell the board from itself turned by 180 degrees."""
        return (self.cols + self.rows) % 2 == 1

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
        _check(self.cols, self.rows)
        _check_length(self.square_m, "square", "one side of a square")
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
        """A marker's corner is the next thing beside a corner."""
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


@dataclass(frozen=True, slots=True)
class AprilGrid(Lattice):
    """Kalibr's board of `tag_cols` x `tag_rows` tags (36h11) with sides of `tag_m`; parts of it suffice.

    Tags are `spacing` of their side apart, and black squares fill the crossings between them, so that two black corners
    meet in every corner of a tag. The number 0 is at the lower left, numbers rise to the right and then upwards. A tag
    has a black border of two bits. Raises CalibrationError for impossible numbers.
    """

    parts: ClassVar[str] = "tags"
    tag_cols: int
    tag_rows: int
    tag_m: float
    spacing: float

    def __post_init__(self) -> None:
        if not (2 <= self.tag_cols <= MOST // 2 and 2 <= self.tag_rows <= MOST // 2):
            raise CalibrationError(f"An AprilGrid of {self.size_text} tags is not possible: each side has 2 to "
                                   f"{MOST // 2}.")
        _check_length(self.tag_m, "tag", "the black side of one")
        if not 0.1 <= self.spacing <= 1.0:
            raise CalibrationError(f"A spacing of {self.spacing:g} is not possible: it is the gap between two tags as "
                                   "a part of a tag's side, 0.3 for instance.")

    @property
    def square_m(self) -> float:
        """The side of a tag."""
        return self.tag_m

    @property
    def cols(self) -> int:
        """Corners along x, two of each tag."""
        return 2 * self.tag_cols

    @property
    def rows(self) -> int:
        """Corners along y."""
        return 2 * self.tag_rows

    @property
    def margin_m(self) -> float:
        """The outermost crossings are filled, too."""
        return self.spacing * self.tag_m

    def lines(self) -> tuple[Array, Array]:
        """(cols,) and (rows,) m: the sides of the tags."""
        x, y = (self.tag_m * np.add.outer((1.0 + self.spacing) * np.arange(count), [0.0, 1.0]).ravel()
                for count in (self.tag_cols, self.tag_rows))
        return x, y

    @property
    def one_way_up(self) -> bool:
        """True: every tag tells its own place."""
        return True

    @property
    def free_space(self) -> float:
        """A tag's first bit is the next thing beside a corner."""
        bit = TAG_BORDER_BITS / (TAG_BITS + 2 * TAG_BORDER_BITS)
        return min(1.0, float(np.sqrt(2.0)) * bit / self.spacing)

    @property
    def size_text(self) -> str:
        """The size in tags, "6x6"."""
        return f"{self.tag_cols}x{self.tag_rows}"

    @property
    def text(self) -> str:
        """The board in words."""
        return f"AprilGrid with {self.size_text} tags of {self.tag_m * 1e3:g} mm, spacing {self.spacing:g}"

    def number_at(self, col: int, row: int) -> int:
        """The tag in a column from the left and a row from the top."""
        return (self.tag_rows - 1 - row) * self.tag_cols + col


@dataclass(frozen=True, slots=True)
class CircleGrid(Lattice):
    """OpenCV's asymmetric grid of `rows` rows of `cols` circles each, with every other row moved by `square_m`.

    Rows are `square_m` apart, the circles of a row twice as far: OpenCV's and Kalibr's spacing. With an odd number of
    rows the first row tells the board's ends apart; with an even one the board turned by 180 degrees is the same.
    Raises CalibrationError for impossible numbers.
    """

    parts: ClassVar[str] = "spacings"
    cols: int
    rows: int
    square_m: float

    def __post_init__(self) -> None:
        _check(self.cols, self.rows, "circles")
        _check_length(self.square_m, "spacing", "from one row of circles to the next")

    def object_points(self) -> Array:
        """(N, 3) m, the centres; every other row stands to the right by the spacing."""
        row, col = np.divmod(np.arange(self.cols * self.rows), self.cols)
        return np.column_stack([2 * col + row % 2, row, np.zeros(len(row))]) * self.square_m

    @property
    def one_way_up(self) -> bool:
        """Whether the board is told from itself turned by 180 degrees."""
        return self.rows % 2 == 1

    @property
    def size_text(self) -> str:
        """The size as OpenCV has it, "4x11": circles in a row, rows."""
        return f"{self.cols}x{self.rows}"

    @property
    def text(self) -> str:
        """The board in words."""
        return f"asymmetric grid of {self.size_text} circles, spacing {self.square_m * 1e3:g} mm"


Board = Chessboard | CharucoBoard | AprilGrid | CircleGrid


def same_pattern(first: Board, second: Board) -> bool:
    """Whether two boards differ in their lengths at most, so that what was seen of one is as good for the other."""
    if isinstance(first, CharucoBoard) and isinstance(second, CharucoBoard):
        return replace(first, square_m=second.square_m, marker_m=second.marker_m) == second
    return scaled(first, second.square_m) == second


def scaled(board: Board, square_m: float) -> Board:
    """The same board of another size."""
    match board:
        case AprilGrid():
            return replace(board, tag_m=square_m)
        case CharucoBoard():
            return replace(board, square_m=square_m, marker_m=board.marker_m * square_m / board.square_m)
        case _:
            return replace(board, square_m=square_m)


def make_board(kind: str, size: str | None = None, *, square_mm: float | None = None, marker_mm: float | None = None,
               dictionary: str | None = None, legacy: bool = False, tag_spacing: float | None = None) -> Board:
    """The board of one of `KINDS`, the usual one in all that is None. Raises CalibrationError for one that cannot be,
    or for what boards of that kind do not have."""
    if kind != "charuco" and (marker_mm is not None or dictionary is not None or legacy):
        raise CalibrationError(f"Markers, their dictionary and the former layout belong to a ChArUco board, not to "
                               f"{kind}.")
    if kind != "aprilgrid" and tag_spacing is not None:
        raise CalibrationError(f"A spacing of tags belongs to an AprilGrid, not to {kind}.")
    usual_size, usual_mm = KINDS[kind]
    across, down = parse_size(size or usual_size)
    square_m = 1e-3 * (usual_mm if square_mm is None else square_mm)
    match kind:
        case "charuco":
            return CharucoBoard(across, down, square_m, MARKER_SHARE * square_m if marker_mm is None
                                else 1e-3 * marker_mm, dictionary or DEFAULT_DICTIONARY, legacy)
        case "aprilgrid":
            return AprilGrid(across, down, square_m, TAG_SPACING if tag_spacing is None else tag_spacing)
        case "circles":
            return CircleGrid(across, down, square_m)
        case _:
            return Chessboard(across, down, square_m)


def parse_size(text: str) -> tuple[int, int]:
    """Read "9x6" as (9, 6); raises CalibrationError for anything else."""
    match = re.fullmatch(r"\s*(\d{1,3})\s*[xX×*,]\s*(\d{1,3})\s*", text)
    if not match:
        raise CalibrationError(f"A board's size is written as two numbers, 9x6 for nine by six inner corners, "
                               f"not {text!r}.")
    return int(match[1]), int(match[2])


def _check(cols: int, rows: int, counted: str = "inner corners") -> None:
    if not (FEWEST <= cols <= MOST and FEWEST <= rows <= MOST):
        raise CalibrationError(f"A board of {cols}x{rows} {counted} is not possible: each side has {FEWEST} to "
                               f"{MOST}.")


def _check_length(length_m: float, name: str, measured: str) -> None:
    if not SMALLEST_M <= length_m <= LARGEST_M:
        raise CalibrationError(f"A {name} of {length_m * 1e3:g} mm is not possible: measure {measured} and give it in "
                               f"millimetres, {SMALLEST_M * 1e3:g} to {LARGEST_M * 1e3:g}.")


STANDARD_BOARD = Chessboard(*parse_size(BOARD), 1e-3 * SQUARE_MM)
"""The board of `standard_board`, printed at 100 %."""
