"""The form of the board: its kind, its size, its squares. What it says is judged by `models.board_form`."""

from __future__ import annotations

from PySide6.QtWidgets import QCheckBox, QComboBox, QDoubleSpinBox, QFormLayout, QLabel, QSpinBox, QWidget

from rhot_app.ui.wizards.memory import Memory
from rhot_app.ui.wizards.models.board_form import DICTIONARIES, BoardFields, BoardStep, usual_marker_mm
from rhot_app.ui.wizards.models.step import StepView
from rhot_app.ui.wizards.page import Page

MEMORY = "board"
_KINDS = (("chessboard", "Chessboard"), ("charuco", "ChArUco board"))


class BoardPage(Page):
    """What is entered is remembered for the next wizard."""

    def __init__(self, step: BoardStep, memory: Memory) -> None:
        super().__init__(step)
        self._board = step
        self._memory = memory
        self._filling = False
        self.kind = QComboBox()
        for value, text in _KINDS:
            self.kind.addItem(text, value)
        self.cols, self.rows = _count(), _count()
        self.square, self.marker = _millimetres(), _millimetres()
        self.dictionary = QComboBox()
        self.dictionary.addItems(DICTIONARIES)
        self.legacy = QCheckBox("printed with OpenCV before 4.6")
        self.legacy.setToolTip("Older programs began ChArUco boards with an even number of rows with a white square.")
        self._form = QFormLayout()
        self._form.setSpacing(8)
        self._cols_label, self._rows_label = QLabel(), QLabel()
        for label, field in (("Board", self.kind), (self._cols_label, self.cols), (self._rows_label, self.rows),
                             ("Square", self.square), ("Marker", self.marker), ("Family", self.dictionary)):
            self._form.addRow(label, field)
        self._form.addRow(self.legacy)
        note = QLabel("Measure a square with a ruler: printers scale. The scale of everything that is measured later "
                      "comes from this number. A board in true size prints with <b>rhot target</b>.")
        note.setWordWrap(True)
        note.setProperty("muted", True)
        self.column.addLayout(self._form)
        self.column.addWidget(note)
        self.column.addStretch(1)
        self.first_field = self.kind
        self._fill(step.fields)
        self._connect_fields()

    def _connect_fields(self) -> None:
        self.kind.currentIndexChanged.connect(self._take)
        self.dictionary.currentIndexChanged.connect(self._take)
        self.legacy.toggled.connect(self._take)
        for box in (self.cols, self.rows):
            box.valueChanged.connect(self._take)
        self.marker.valueChanged.connect(self._take)
        self.square.valueChanged.connect(self._square_changed)

    def add_field(self, label: str, field: QWidget) -> None:
        """One more field, above the others."""
        self._form.insertRow(0, label, field)

    def entered(self) -> None:
        """Show what stands in the step; another page may have changed it."""
        self._fill(self._board.fields)

    def _square_changed(self) -> None:
        """A marker goes along with its square until a person says otherwise."""
        before = self._board.fields
        if not self._filling and before.marker_mm == usual_marker_mm(before.square_mm):
            self._filling = True
            self.marker.setValue(usual_marker_mm(self.square.value()))
            self._filling = False
        self._take()

    def _take(self) -> None:
        if self._filling:
            return
        fields = BoardFields(kind=self.kind.currentData(), cols=self.cols.value(), rows=self.rows.value(),
                             square_mm=self.square.value(), marker_mm=self.marker.value(),
                             dictionary=self.dictionary.currentText(), legacy=self.legacy.isChecked())
        self._board.change(fields)
        self._memory.remember(MEMORY, fields.to_text())
        self._show_kind(fields)
        self.changed.emit()

    def _fill(self, fields: BoardFields) -> None:
        self._filling = True
        self.kind.setCurrentIndex(self.kind.findData(fields.kind))
        self.cols.setValue(fields.cols)
        self.rows.setValue(fields.rows)
        self.square.setValue(fields.square_mm)
        self.marker.setValue(fields.marker_mm)
        self.dictionary.setCurrentText(fields.dictionary)
        self.legacy.setChecked(fields.legacy)
        self._filling = False
        self._show_kind(fields)

    def _show_kind(self, fields: BoardFields) -> None:
        charuco = fields.kind == "charuco"
        for widget in (self.marker, self.dictionary):
            self._form.setRowVisible(widget, charuco)
        self.legacy.setVisible(charuco and fields.rows % 2 == 0)
        what = "Squares" if charuco else "Inner corners"
        self._cols_label.setText(f"{what} across")
        self._rows_label.setText(f"{what} down")
        tip = ("Count the squares." if charuco else
               "Count the points where four squares meet: a board of 10 × 7 squares has 9 × 6.")
        for box in (self.cols, self.rows):
            box.setToolTip(tip)

    def show_view(self, view: StepView) -> None:
        """Ctrl+Z may have brought something back."""
        if self._board.fields.to_text() != self._memory.remembered(MEMORY):
            self._memory.remember(MEMORY, self._board.fields.to_text())
            self._fill(self._board.fields)


def _count() -> QSpinBox:
    box = QSpinBox()
    box.setRange(3, 60)
    return box


def _millimetres() -> QDoubleSpinBox:
    box = QDoubleSpinBox()
    box.setRange(0.5, 1000.0)
    box.setDecimals(2)
    box.setSuffix(" mm")
    return box
