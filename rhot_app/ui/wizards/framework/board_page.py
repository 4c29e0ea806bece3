"""The form of the board: its kind, its size, its squares. What it says is judged by `models.board_form`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

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
    QPushButton,
    QSpinBox,
    QWidget,
)

from rhot_app.calibration.board.standard_board import BOARD, KINDS, SQUARE_MM
from rhot_app.calibration.board.target import write_target
from rhot_app.errors import CalibrationError
from rhot_app.ui.wizards.framework.definition import SettingsStore
from rhot_app.ui.wizards.framework.page import Page
from rhot_app.ui.wizards.models.board_form import (
    DICTIONARIES,
    SIZES,
    BoardFields,
    BoardStep,
    remembered_fields,
    usual_marker_mm,
)
from rhot_app.ui.wizards.models.step import StepView

MEMORY = "board"
_NOTE = ("Measure ten with a ruler and divide by ten: printers scale. The scale of everything that is measured later "
         "comes from this number.")


@dataclass(frozen=True, slots=True)
class _Words:
    """How the form speaks of one kind of board: its name, what is counted and how, and what is measured."""

    name: str
    counted: str
    counting: str
    measured: str
    measuring: str


_WORDS = {
    "chessboard": _Words("Chessboard", "Inner corners", "Count the points where four squares meet: a board of 10 × 7 "
                         "squares has 9 × 6.", "Square, mm", "The side of one square as it came out of the printer."),
    "charuco": _Words("ChArUco board", "Squares", "Count the squares.", "Square, mm",
                      "The side of one square as it came out of the printer."),
    "aprilgrid": _Words("AprilGrid (Kalibr)", "Tags", "Count the tags: tagCols, tagRows of Kalibr's file.", "Tag, mm",
                        "The side of a tag's black square, tagSize in Kalibr's file (which has metres)."),
    "circles": _Words("Circles, asymmetric", "Circles", "Count the circles in one row, and then the rows: 4 × 11 is "
                      "usual.", "Spacing, mm", "From one row of circles to the next, which is half as far as from one "
                      "circle to the next in its row."),
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
            self.kind.addItem(words.name, value)
        self.cols, self.rows = _count(), _count()
        self.square, self.marker = LengthField(), LengthField()
        self.spacing = QDoubleSpinBox()
        self.spacing.setRange(0.1, 1.0)
        self.spacing.setSingleStep(0.05)
        self.spacing.setToolTip("The gap between two tags as a part of their side, tagSpacing in Kalibr's file.")
        self.dictionary = QComboBox()
        self.dictionary.addItems(DICTIONARIES)
        self.legacy = QCheckBox("printed with OpenCV before 4.6")
        self.legacy.setToolTip("Older programs began ChArUco boards with an even number of rows with a white square.")
        self._form = QFormLayout()
        self._form.setSpacing(8)
        self._cols_label, self._rows_label, self._square_label = QLabel(), QLabel(), QLabel()
        for label, field in (("Board", self.kind), (self._cols_label, self.cols), (self._rows_label, self.rows),
                             (self._square_label, self.square), ("Gap, of a tag", self.spacing),
                             ("Marker, mm", self.marker), ("Family", self.dictionary)):
            self._form.addRow(label, field)
        self._form.addRow(self.legacy)
        self.print_button = QPushButton("Print this board")
        self.print_button.setAutoDefault(False)
        self.print_button.setToolTip("Writes it as a PDF of the usual size with a ruler, and opens that to be printed.")
        self.print_button.clicked.connect(self._print)
        self.note = QLabel(_NOTE)
        self.note.setWordWrap(True)
        self.note.setProperty("muted", True)
        self.column.addLayout(self._form)
        self.column.addWidget(self.print_button)
        self.column.addWidget(self.note)
        self.column.addStretch(1)
        self.first_field = self.square
        self.twin_facts = f"Shows a board: {BOARD} inner corners, squares of {SQUARE_MM:g} mm."
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
        self.square.setPlaceholderText("measure it" if last is None else f"last time {last:g}")
        self._shown = fields
        self._show_kind(fields)

    def _show_kind(self, fields: BoardFields) -> None:
        charuco = fields.kind == "charuco"
        for widget in (self.marker, self.dictionary):
            self._form.setRowVisible(widget, charuco)
        self._form.setRowVisible(self.spacing, fields.kind == "aprilgrid")
        self.legacy.setVisible(charuco and fields.rows % 2 == 0)
        usual = "" if fields.square_mm is None else f"{usual_marker_mm(fields.square_mm):g}"
        self.marker.setPlaceholderText(usual or "three quarters of a square")
        words = _WORDS[fields.kind]
        self._cols_label.setText(f"{words.counted} across")
        self._rows_label.setText("Rows of circles" if fields.kind == "circles" else f"{words.counted} down")
        self._square_label.setText(words.measured)
        self.square.setToolTip(words.measuring)
        for box in (self.cols, self.rows):
            box.setToolTip(words.counting)

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
            self.note.setText(f"{path.parent}: cannot be made ({exc.strerror}), so there is no board to print.")
            return
        self.note.setText(f"{_told(path)} Print it at 100 % and glue it flat. {_NOTE}")

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
        return f"Written to {path} and opened."
    return f"Written to {path}; this desktop opens no PDF."
