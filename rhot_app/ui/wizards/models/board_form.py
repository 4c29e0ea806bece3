"""Which board the person holds: the fields of the form, the board they describe, and the step around them."""

from __future__ import annotations

from typing import Literal

import msgspec

from rhot_app.calibration.board import DEFAULT_DICTIONARY, Board, CharucoBoard, Chessboard
from rhot_app.calibration.corners import BoardView, detect
from rhot_app.errors import CalibrationError
from rhot_app.ui.wizards.models.board_drawing import board_marks
from rhot_app.ui.wizards.models.step import Pictures, Step, StepView

DICTIONARIES = (DEFAULT_DICTIONARY, "DICT_4X4_250", "DICT_5X5_100", "DICT_5X5_250", "DICT_6X6_250",
                "DICT_ARUCO_ORIGINAL", "DICT_APRILTAG_36h11")
_USUAL_SHARE = 0.75  # of a ChArUco square that its marker fills


class BoardFields(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What stands in the form: `cols` x `rows` are inner corners of a chessboard, squares of a ChArUco board."""

    kind: Literal["chessboard", "charuco"] = "chessboard"
    cols: int = 9
    rows: int = 6
    square_mm: float = 30.0
    marker_mm: float = 22.5
    dictionary: str = DEFAULT_DICTIONARY
    legacy: bool = False

    def board(self) -> Board:
        """The board described; raises CalibrationError for one that cannot be."""
        if self.kind == "chessboard":
            return Chessboard(self.cols, self.rows, 1e-3 * self.square_mm)
        return CharucoBoard(self.cols, self.rows, 1e-3 * self.square_mm, 1e-3 * self.marker_mm, self.dictionary,
                            self.legacy)

    def to_text(self) -> str:
        """For the app's memory."""
        return msgspec.json.encode(self).decode()


def fields_from(text: str) -> BoardFields:
    """Fields that were remembered; the usual ones when there are none or they cannot be read."""
    try:
        return msgspec.json.decode(text, type=BoardFields)
    except msgspec.MsgspecError:
        return BoardFields()


class BoardStep(Step):
    """Choose the board, and see at once whether the cameras recognise it."""

    title = "Your board"
    watches = True

    def __init__(self, fields: BoardFields, cameras: tuple[str, ...] | None = None) -> None:
        self.cameras = cameras
        self._fields = fields
        self._undone: list[BoardFields] = []
        self._views: dict[str, BoardView | None] = {}
        self.board: Board | None = None
        self.problem = ""
        self._build()

    @property
    def fields(self) -> BoardFields:
        """What stands in the form."""
        return self._fields

    def change(self, fields: BoardFields) -> None:
        """Something else stands in the form now."""
        if fields != self._fields:
            self._undone.append(self._fields)
            self._fields = fields
            self._build()

    def undo(self) -> bool:
        """Back to what stood there before."""
        if not self._undone:
            return False
        self._fields = self._undone.pop()
        self._build()
        return True

    def forget_views(self) -> None:
        """What was seen is of another board or camera."""
        self._views = {}

    def _build(self) -> None:
        self.forget_views()
        try:
            self.board, self.problem = self._fields.board(), ""
        except CalibrationError as exc:
            self.board, self.problem = None, str(exc)

    def see(self, pictures: Pictures) -> tuple[Board, dict[str, BoardView | None]] | None:
        """Look for the board in each picture."""
        board = self.board
        if board is None:
            return None
        return board, {name: detect(picture.bgr, board, thorough=False, source=name)
                       for name, picture in pictures.items()}

    def take(self, seen: tuple[Board, dict[str, BoardView | None]]) -> None:
        """Where the board was seen."""
        board, views = seen
        if board == self.board:
            self._views = views

    def view(self) -> StepView:
        """The question, and whether the answer fits what is seen."""
        if self.board is None:
            return StepView("Say which board you hold.", hint=self.problem)
        overlays = {name: board_marks(view, self.board) for name, view in self._views.items() if view is not None}
        return StepView(self._sentence(len(overlays)), done=True, hint=self._hint(), overlays=overlays)

    def _sentence(self, found: int) -> str:
        if found == 0:
            return "Say which board you hold, and show it to check."
        names = " and ".join(name for name, view in self._views.items() if view is not None)
        return f"Seen by {names}: this is the board."

    def _hint(self) -> str:
        if isinstance(self.board, Chessboard) and not self.board.one_way_up:
            return ("This board looks the same turned by 180°: hold it the same way up all the time, or use one with "
                    "an even and an odd number of corners.")
        return ""


def usual_marker_mm(square_mm: float) -> float:
    """The marker size that usually goes with a square."""
    return round(_USUAL_SHARE * square_mm, 1)
