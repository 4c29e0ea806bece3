"""The page of the board: its form, the board that it describes, and whether the cameras see that."""

from __future__ import annotations

import time
from collections import deque
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import msgspec
from platformdirs import user_documents_path
from PySide6.QtCore import QLocale, QRegularExpression, QUrl
from PySide6.QtGui import QDesktopServices, QRegularExpressionValidator
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QDoubleSpinBox,
    QFormLayout,
    QLabel,
    QLineEdit,
    QSpinBox,
    QWidget,
)

from rhot_app.calibration.board.boards import DEFAULT_DICTIONARY, Board, make_board, parse_size, same_pattern
from rhot_app.calibration.board.corners import BoardView, detect, to_gray
from rhot_app.calibration.board.size_check import Beyond, look_beyond, size_finding, why_missing
from rhot_app.calibration.board.standard_board import BOARD, KINDS, MARKER_SHARE, SQUARE_MM, TAG_SPACING
from rhot_app.calibration.board.target import write_target
from rhot_app.calibration.verdict import Finding
from rhot_app.errors import CalibrationError
from rhot_app.ui.common.parts import plain_button
from rhot_app.ui.language import tr, tr_noop
from rhot_app.ui.wizards.framework.definition import SettingsStore
from rhot_app.ui.wizards.framework.drawing import board_marks
from rhot_app.ui.wizards.framework.page import Page
from rhot_app.ui.wizards.framework.step import AnnotatedPicture, Pictures, Step, StepView

DICTIONARIES = (DEFAULT_DICTIONARY, "DICT_4X4_250", "DICT_5X5_100", "DICT_5X5_250", "DICT_6X6_250",
                "DICT_ARUCO_ORIGINAL", "DICT_APRILTAG_36h11")
_WHY_S = 2.0  # between looks into why no board is seen
_JUDGED, _JUDGED_LEAST = 30, 4  # views that judge the board's size
UNMEASURED = tr_noop("Next waits for this size: every length that is measured later comes from it.")
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
        return tr("Not seen: {missing}.", missing=self._missing) if unseen and self._missing else ""


OTHER_BOARD = tr_noop("Go back: the board is another one than the form says.")


class BoardStep(Step):
    """Choose the board, and see at once whether the cameras recognise it."""

    title = tr_noop("Your board")
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
            return StepView(tr("Say which board you hold."), hint=self.problem)
        search = self._search
        annotated, found = search.annotated(self.board), sum(view is not None for view in search.views.values())
        wrong = search.size_finding(self.board)
        if wrong is not None:
            return StepView(tr("Count the corners again."), hint=f"{wrong.figure} {wrong.cause}", annotated=annotated)
        if self._fields.square_mm is None:
            hint = " ".join(filter(None, (tr(UNMEASURED), self._hint())))
            return StepView(tr("Measure the {parts} and type their size.", parts=tr(self.board.parts)), hint=hint,
                            annotated=annotated)
        return StepView(self._sentence(found), done=search.recognised, passable=True,
                        hint=self._hint(), annotated=annotated)

    def _sentence(self, found: int) -> str:
        if found == 0:
            return tr("Seen: this is the board. Press Next.") if self._search.recognised else tr("Show the board to "
                                                                                                 "check it.")
        names = ", ".join(name for name, view in self._search.views.items() if view is not None)
        return tr("Seen by {names}: this is the board.", names=names)

    def _hint(self) -> str:
        if self._search.missing:
            return self._search.missing
        if self.board is not None and not self.board.one_way_up:
            return (tr("This board looks the same turned by 180°: hold it the same way up all the time, or use one "
                       "with an even and an odd number of corners, or with an odd number of rows of circles."))
        return ""


def usual_marker_mm(square_mm: float) -> float:
    """The marker size that usually goes with a square."""
    return round(MARKER_SHARE * square_mm, 2)


# -- the form ----------------------------------------------------------------------------------------------------------

MEMORY = "board"
_NOTE = (tr_noop("Measure ten with a ruler and divide by ten: printers scale. The scale of everything that is measured "
                 "later comes from this number."))


@dataclass(frozen=True, slots=True)
class _Words:
    """How the form speaks of one kind of board: its name, what is counted and how, and what is measured."""

    name: str
    counted: str
    counting: str
    measured: str
    measuring: str


_WORDS = {
    "chessboard": _Words(tr_noop("Chessboard"), tr_noop("Inner corners"),
                         tr_noop("Count the points where four squares meet: a board of 10 × 7 squares has 9 × 6."),
                         tr_noop("Square, mm"), tr_noop("The side of one square as it came out of the printer.")),
    "charuco": _Words(tr_noop("ChArUco board"), tr_noop("Squares"), tr_noop("Count the squares."),
                      tr_noop("Square, mm"), tr_noop("The side of one square as it came out of the printer.")),
    "aprilgrid": _Words("AprilGrid (Kalibr)", tr_noop("Tags"),
                        tr_noop("Count the tags: tagCols, tagRows of Kalibr's file."), tr_noop("Tag, mm"),
                        tr_noop("The side of a tag's black square, tagSize in Kalibr's file (which has metres).")),
    "circles": _Words(tr_noop("Circles, asymmetric"), tr_noop("Circles"),
                      tr_noop("Count the circles in one row, and then the rows: 4 × 11 is usual."),
                      tr_noop("Spacing, mm"), tr_noop("From one row of circles to the next, which is half as far as "
                                                      "from one circle to the next in its row.")),
}


class BoardPage(Page):
    """What is entered is remembered for the next wizard; the measured size only as a hint, for a person to confirm."""

    def __init__(self, step: BoardStep, memory: SettingsStore) -> None:
        super().__init__(step)
        self._board = step
        self._memory = memory
        self._filling = False
        self._shown: BoardFields | None = None
        self.kind = QComboBox()
        for value, words in _WORDS.items():
            self.kind.addItem(tr(words.name), value)
        self.cols, self.rows = _count(), _count()
        self.square, self.marker = LengthField(), LengthField()
        self.spacing = QDoubleSpinBox()
        self.spacing.setRange(0.1, 1.0)
        self.spacing.setSingleStep(0.05)
        self.spacing.setToolTip(tr("The gap between two tags as a part of their side, tagSpacing in Kalibr's file."))
        self.dictionary = QComboBox()
        self.dictionary.addItems(DICTIONARIES)
        self.legacy = QCheckBox(tr("printed with OpenCV before 4.6"))
        self.legacy.setToolTip(tr("Older programs began ChArUco boards with an even number of rows with a white "
                                  "square."))
        self._form = QFormLayout()
        self._form.setSpacing(8)
        self._cols_label, self._rows_label, self._square_label = QLabel(), QLabel(), QLabel()
        for label, field in ((tr("Board"), self.kind), (self._cols_label, self.cols), (self._rows_label, self.rows),
                             (self._square_label, self.square), (tr("Gap, of a tag"), self.spacing),
                             (tr("Marker, mm"), self.marker), (tr("Family"), self.dictionary)):
            self._form.addRow(label, field)
        self._form.addRow(self.legacy)
        self.print_button = plain_button(tr("Print this board"), tr("Writes it as a PDF of the usual size with a "
                                                                    "ruler, and opens that to be printed."),
                                         self._print)
        self.note = QLabel(tr(_NOTE))
        self.note.setWordWrap(True)
        self.note.setProperty("muted", True)
        self.column.addLayout(self._form)
        self.column.addWidget(self.print_button)
        self.column.addWidget(self.note)
        self.column.addStretch(1)
        self.first_field = self.square
        self.twin_facts = tr("Shows a board: {board} inner corners, squares of {square_mm:g} mm.", board=BOARD,
                             square_mm=SQUARE_MM)
        for box in (self.kind, self.dictionary):  # in a small window a bar of scrolling stands beside
            box.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
            box.setMinimumContentsLength(8)
        self._fill(step.fields)
        self._connect_fields()

    def _connect_fields(self) -> None:
        self.kind.currentIndexChanged.connect(self._kind_changed)
        self.dictionary.currentIndexChanged.connect(self._take)
        self.legacy.toggled.connect(self._take)
        for box in (self.cols, self.rows, self.spacing):
            box.valueChanged.connect(self._take)
        for field in (self.square, self.marker):
            field.textChanged.connect(self._take)

    def add_field(self, label: str, field: QWidget) -> None:
        """One more field, above the others."""
        self._form.insertRow(0, label, field)

    def entered(self) -> None:
        """Show what stands in the step; another page may have changed it."""
        self._fill(self._board.fields)

    def _kind_changed(self) -> None:
        """The usual board of one kind becomes the usual one of the other."""
        fields = self._board.fields
        if not self._filling and (fields.cols, fields.rows) == SIZES[fields.kind]:
            self._filling = True
            cols, rows = SIZES[self.kind.currentData()]
            self.cols.setValue(cols)
            self.rows.setValue(rows)
            self._filling = False
        self._take()

    def _take(self) -> None:
        if self._filling:
            return
        fields = BoardFields(kind=self.kind.currentData(), cols=self.cols.value(), rows=self.rows.value(),
                             square_mm=self.square.value, marker_mm=self.marker.value,
                             dictionary=self.dictionary.currentText(), legacy=self.legacy.isChecked(),
                             tag_spacing=self.spacing.value())
        self._board.change(fields)
        self._remember(fields)
        self._show_kind(fields)
        self.changed.emit()

    def _remember(self, fields: BoardFields) -> None:
        """What was measured last is remembered until something else is."""
        last = remembered_fields(self._memory.remembered(MEMORY)).square_mm
        kept = fields if fields.square_mm is not None else msgspec.structs.replace(fields, square_mm=last)
        self._memory.remember(MEMORY, kept.to_text())
        self._shown = fields

    def _fill(self, fields: BoardFields) -> None:
        self._filling = True
        self.kind.setCurrentIndex(self.kind.findData(fields.kind))
        self.cols.setValue(fields.cols)
        self.rows.setValue(fields.rows)
        self.square.set_value(fields.square_mm)
        self.marker.set_value(fields.marker_mm)
        self.spacing.setValue(fields.tag_spacing)
        self.dictionary.setCurrentText(fields.dictionary)
        self.legacy.setChecked(fields.legacy)
        self._filling = False
        last = remembered_fields(self._memory.remembered(MEMORY)).square_mm
        self.square.setPlaceholderText(tr("measure it") if last is None else tr("last time {last:g}", last=last))
        self._shown = fields
        self._show_kind(fields)

    def _show_kind(self, fields: BoardFields) -> None:
        charuco = fields.kind == "charuco"
        for widget in (self.marker, self.dictionary):
            self._form.setRowVisible(widget, charuco)
        self._form.setRowVisible(self.spacing, fields.kind == "aprilgrid")
        self.legacy.setVisible(charuco and fields.rows % 2 == 0)
        usual = "" if fields.square_mm is None else f"{usual_marker_mm(fields.square_mm):g}"
        self.marker.setPlaceholderText(usual or tr("three quarters of a square"))
        words = _WORDS[fields.kind]
        self._cols_label.setText(tr("{counted} across", counted=tr(words.counted)))
        self._rows_label.setText(tr("Rows of circles") if fields.kind == "circles"
                                 else tr("{counted} down", counted=tr(words.counted)))
        self._square_label.setText(tr(words.measured))
        self.square.setToolTip(tr(words.measuring))
        for box in (self.cols, self.rows):
            box.setToolTip(tr(words.counting))

    def _print(self) -> None:
        """Write the board beside the recordings and open it, so that the desktop's own program prints it."""
        board = self._board.fields.to_print()
        kind = self._board.fields.kind
        path = user_documents_path() / "RHOT" / f"{kind}_{board.size_text}_{KINDS[kind][1]:g}mm.pdf"
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            write_target(path, board, _paper())
        except CalibrationError as exc:
            self.note.setText(str(exc))
            return
        except OSError as exc:
            self.note.setText(tr("{parent}: cannot be made ({strerror}), so there is no board to print.",
                                 parent=path.parent, strerror=exc.strerror))
            return
        self.note.setText(tr("{told} Print it at 100 % and glue it flat. {note}", told=_told(path), note=tr(_NOTE)))

    def show_view(self, view: StepView) -> None:
        """Ctrl+Z may have brought something back."""
        if self._board.fields != self._shown:
            self._remember(self._board.fields)
            self._fill(self._board.fields)


class LengthField(QLineEdit):
    """A length in mm that a person types, with a point or a comma; empty until then."""

    def __init__(self) -> None:
        super().__init__()
        self.setValidator(QRegularExpressionValidator(QRegularExpression(r"\d{0,4}([.,]\d{0,3})?"), self))

    @property
    def value(self) -> float | None:
        """What stands there, None for nothing."""
        text = self.text().replace(",", ".").strip(".")
        return float(text) if text else None

    def set_value(self, value: float | None) -> None:
        """Show a length, or nothing."""
        if value != self.value:
            self.setText("" if value is None else f"{value:g}")


def _count() -> QSpinBox:
    box = QSpinBox()
    box.setRange(2, 60)
    return box


def _paper() -> str:
    """What printers hold here."""
    return "letter" if QLocale.system().measurementSystem() is QLocale.MeasurementSystem.ImperialUSSystem else "A4"


def _told(path: Path) -> str:
    """Open the file; where it is, in words."""
    if QDesktopServices.openUrl(QUrl.fromLocalFile(str(path))):
        return tr("Written to {path} and opened.", path=path)
    return tr("Written to {path}; this desktop opens no PDF.", path=path)
