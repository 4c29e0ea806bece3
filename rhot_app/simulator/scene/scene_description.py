"""What can stand before the simulated cameras, as files and programs name it."""

from __future__ import annotations

from typing import Annotated, Final, Literal

import msgspec
from msgspec import Meta

from rhot_app.calibration.board.boards import DEFAULT_DICTIONARY, CharucoBoard, Chessboard, parse_size
from rhot_app.calibration.board.standard_board import BOARD, MARKER_SHARE, SQUARE_MM

NEAREST_M: Final = 0.15
FARTHEST_M: Final = 5.0

Distance = Annotated[float, Meta(ge=NEAREST_M, le=FARTHEST_M)]
Millimetres = Annotated[float, Meta(gt=0, le=2000)]


class _Show(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="show"):
    """Root of all; the field "show" tells them apart."""


class HandShow(_Show, frozen=True, tag="hand"):
    """A hand that wears the scene's markers. `motion` is a name of resources/motions or a file; see `load_motion`.
    `cube`: it holds a cube with a tag on each face (resources/objects/cube.json)."""

    motion: str = "grasp"
    cube: bool = False


class BareHandShow(_Show, frozen=True, tag="bare_hand"):
    """A hand that wears no marker. `motion` as of a `HandShow`; `tone` of its skin, 1 to 10 on the Monk scale, null:
    drawn from the seed; `sleeve`: its arm wears one."""

    motion: str = "grasp"
    tone: Annotated[float, Meta(ge=1, le=10)] | None = None
    sleeve: bool = False


class EmptyShow(_Show, frozen=True, tag="empty"):
    """Nothing: the background alone."""


class BoardShow(_Show, frozen=True, tag="board"):
    """A calibration board, moved about with pauses, or lying on the table.

    `size` counts inner corners of a chessboard, squares of a ChArUco board, whose markers measure `marker_mm` (3/4 of a
    square when null). `legacy`: the layout of OpenCV before 4.6.
    """

    pattern: Literal["chessboard", "charuco"] = "chessboard"
    size: str = BOARD
    square_mm: Millimetres = SQUARE_MM
    marker_mm: Millimetres | None = None
    dictionary: str = DEFAULT_DICTIONARY
    legacy: bool = False
    on_table: bool = False

    def board(self) -> Chessboard | CharucoBoard:
        """The board itself; raises CalibrationError when there can be none like it."""
        across, down = parse_size(self.size)
        square_m = 1e-3 * self.square_mm
        if self.pattern == "chessboard":
            return Chessboard(across, down, square_m)
        marker_m = MARKER_SHARE * square_m if self.marker_mm is None else 1e-3 * self.marker_mm
        return CharucoBoard(across, down, square_m, marker_m, self.dictionary, self.legacy)


class RulerShow(_Show, frozen=True, tag="ruler"):
    """A paper ruler with two crosses `length_mm` apart, held still."""

    length_mm: Millimetres = 200.0


class MarkerShow(_Show, frozen=True, tag="marker"):
    """One painted ball on a stick, `distance_m` from the cameras' plane, before the middle of the cameras.

    `marker` is its id (null: the set's first). `moving`: it sweeps fast to and fro at that distance.
    """

    marker: str | None = None
    distance_m: Distance = 0.6
    moving: bool = False


Show = HandShow | BareHandShow | EmptyShow | BoardShow | RulerShow | MarkerShow
