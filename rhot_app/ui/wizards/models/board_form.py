"""Which board the person holds: the fields of the form, the board they describe, and the step around them."""

from __future__ import annotations

import time
from collections import deque
from dataclasses import dataclass
from typing import Literal

import msgspec

from rhot_app.calibration.board.boards import DEFAULT_DICTIONARY, Board, make_board, parse_size, same_pattern
from rhot_app.calibration.board.corners import BoardView, detect, to_gray
from rhot_app.calibration.board.size_check import Beyond, look_beyond, size_finding, why_missing
from rhot_app.calibration.board.standard_board import KINDS, MARKER_SHARE, TAG_SPACING
from rhot_app.calibration.verdict import Finding
from rhot_app.errors import CalibrationError
from rhot_app.ui.wizards.models.drawing import board_marks
from rhot_app.ui.wizards.models.step import AnnotatedPicture, Pictures, Step, StepView

DICTIONARIES = (DEFAULT_DICTIONARY, "DICT_4X4_250", "DICT_5X5_100", "DICT_5X5_250", "DICT_6X6_250",
                "DICT_ARUCO_ORIGINAL", "DICT_APRILTAG_36h11")
_WHY_S = 2.0  # between looks into why no board is seen
_JUDGED, _JUDGED_LEAST = 30, 4  # views that judge the board's size
UNMEASURED = "Next waits for this size: every length that is measured later comes from it."
Kind = Literal["chessboard", "charuco", "aprilgrid", "circles"]
SIZES: dict[str, tuple[int, int]] = {kind: parse_size(size) for kind, (size, _) in KINDS.items()}
"""Of the boards that are printed where nobody says otherwise."""


class BoardFields(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What stands in the form: `cols` x `rows` are inner corners of a chessboard, squares of a ChArUco board, tags of
    an AprilGrid, or circles in a row and rows; `square_mm` the side of a square or tag, or the spacing of circles.

    `square_mm` is None until a person has measured it: a number that stood there already would be believed. Without
    `marker_mm` a marker is the usual share of its square.
    """

    kind: Kind = "chessboard"
    cols: int = SIZES["chessboard"][0]
    rows: int = SIZES["chessboard"][1]
    square_mm: float | None = None
    marker_mm: float | None = None
    dictionary: str = DEFAULT_DICTIONARY
    legacy: bool = False
    tag_spacing: float = TAG_SPACING

    def board(self) -> Board:
        """The board described, of the usual size as long as it is not measured; raises CalibrationError for one that
        cannot be."""
        charuco, tags = self.kind == "charuco", self.kind == "aprilgrid"
        return make_board(self.kind, f"{self.cols}x{self.rows}", square_mm=self.square_mm,
                          marker_mm=self.marker_mm if charuco else None,
                          dictionary=self.dictionary if charuco else None, legacy=charuco and self.legacy,
                          tag_spacing=self.tag_spacing if tags else None)

    def to_print(self) -> Board:
        """The same board as it is drawn: with squares of the usual size, whatever came out of the printer."""
        return msgspec.structs.replace(self, square_mm=None, marker_mm=None).board()

    def to_text(self) -> str:
        """For the app's memory."""
        return msgspec.json.encode(self).decode()


def fields_from(text: str) -> BoardFields:
    """The board that was remembered, without its measures; the usual one when there is none or it cannot be read."""
    return msgspec.structs.replace(remembered_fields(text), square_mm=None, marker_mm=None)


def remembered_fields(text: str) -> BoardFields:
    """All that was remembered, the measures included."""
    try:
        return msgspec.json.decode(text, type=BoardFields)
    except msgspec.MsgspecError:
        return BoardFields()


@dataclass(frozen=True, slots=True, eq=False)
class BoardObservation:
    """What one look saw in `pictures`: the board it looked for, the board by camera, whether its squares go on where
    they should end, and why no camera sees it, when that was looked into."""

    board: Board
    pictures: Pictures
    views: dict[str, BoardView | None]
    beyond: tuple[Beyond, ...] = ()
    missing: str | None = None


class BoardSearch:
    """Looks for a board in pictures, and finds out what is wrong where none is seen for a while, or a larger one."""

    def __init__(self) -> None:
        self._beyond: deque[Beyond] = deque(maxlen=_JUDGED)
        self.forget()

    def forget(self) -> None:
        """What was seen is of another board or camera."""
        self.pictures: Pictures = {}
        self.views: dict[str, BoardView | None] = {}
        self.recognised = False
        self._missing = ""
        self._next_why_s = 0.0
        self._beyond.clear()

    def look(self, pictures: Pictures, board: Board) -> BoardObservation:
        """Look for the board in each picture; where it is in none, find out why now and then, for that takes long."""
        views = {name: detect(picture.bgr, board, thorough=False, source=name) for name, picture in pictures.items()}
        seen = {name: view for name, view in views.items() if view is not None}
        now_s = time.monotonic()
        if seen:
            self._next_why_s = now_s + _WHY_S
            beyond = (look_beyond(to_gray(pictures[name].bgr), view, board) for name, view in seen.items())
            return BoardObservation(board, pictures, views, tuple(one for one in beyond if one is not None), "")
        if now_s < self._next_why_s or not pictures:
            return BoardObservation(board, pictures, views)
        self._next_why_s = now_s + _WHY_S
        return BoardObservation(board, pictures, views,
                                missing=why_missing(to_gray(next(iter(pictures.values())).bgr), board))

    def accept_observation(self, seen: BoardObservation) -> None:
        """What a look has seen."""
        self.pictures, self.views = seen.pictures, seen.views
        self.recognised = self.recognised or any(view is not None for view in seen.views.values())
        self._beyond.extend(seen.beyond)
        if seen.missing is not None:
            self._missing = seen.missing

    def annotated(self, board: Board, colour: str = "good") -> dict[str, AnnotatedPicture]:
        """The pictures looked at last, with the corners found in them."""
        return {name: AnnotatedPicture(self.pictures[name], () if view is None else board_marks(view, board, colour))
                for name, view in self.views.items()}

    def size_finding(self, board: Board | None) -> Finding | None:
        """What the pictures say against the board's size."""
        if board is None or len(self._beyond) < _JUDGED_LEAST:
            return None
        return size_finding(tuple(self._beyond), board)

    @property
    def missing(self) -> str:
        """Why no camera sees the board, in a sentence; empty while one does, or nobody has looked into it."""
        unseen = all(view is None for view in self.views.values())
        return f"Not seen: {self._missing}." if unseen and self._missing else ""


OTHER_BOARD = "Go back: the board is another one than the form says."


class BoardStep(Step):
    """Choose the board, and see at once whether the cameras recognise it."""

    title = "Your board"
    watches = True

    def __init__(self, fields: BoardFields, cameras: tuple[str, ...] | None = None) -> None:
        self.cameras = cameras
        self._fields = fields
        self._undone: list[BoardFields] = []
        self._search = BoardSearch()
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
        self._search.forget()

    def _build(self) -> None:
        before = self.board
        try:
            self.board, self.problem = self._fields.board(), ""
        except CalibrationError as exc:
            self.board, self.problem = None, str(exc)
        if before is None or self.board is None or not same_pattern(before, self.board):
            self.forget_views()

    def observe(self, pictures: Pictures) -> BoardObservation | None:
        """Look for the board in each picture."""
        board = self.board
        return None if board is None else self._search.look(pictures, board)

    def accept_observation(self, seen: BoardObservation) -> None:
        """Where the board was seen."""
        if seen.board == self.board:
            self._search.accept_observation(seen)

    def view(self) -> StepView:
        """The question, and whether the answer fits what is seen."""
        if self.board is None:
            return StepView("Say which board you hold.", hint=self.problem)
        search = self._search
        annotated, found = search.annotated(self.board), sum(view is not None for view in search.views.values())
        wrong = search.size_finding(self.board)
        if wrong is not None:
            return StepView("Count the corners again.", hint=f"{wrong.figure} {wrong.cause}", annotated=annotated)
        if self._fields.square_mm is None:
            hint = " ".join(filter(None, (UNMEASURED, self._hint())))
            return StepView(f"Measure the {self.board.parts} and type their size.", hint=hint, annotated=annotated)
        return StepView(self._sentence(found), done=search.recognised, passable=True,
                        hint=self._hint(), annotated=annotated)

    def _sentence(self, found: int) -> str:
        if found == 0:
            return "Seen: this is the board. Press Next." if self._search.recognised else "Show the board to check it."
        names = " and ".join(name for name, view in self._search.views.items() if view is not None)
        return f"Seen by {names}: this is the board."

    def _hint(self) -> str:
        if self._search.missing:
            return self._search.missing
        if self.board is not None and not self.board.one_way_up:
            return ("This board looks the same turned by 180°: hold it the same way up all the time, or use one with "
                    "an even and an odd number of corners, or with an odd number of rows of circles.")
        return ""


def usual_marker_mm(square_mm: float) -> float:
    """The marker size that usually goes with a square."""
    return round(MARKER_SHARE * square_mm, 2)
