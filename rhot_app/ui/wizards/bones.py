"""The bones wizard: enter lengths or move freely for a minute, see what is known of every bone, use the hand."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtGui import QBrush, QColor
from PySide6.QtWidgets import (
    QAbstractItemView,
    QComboBox,
    QDoubleSpinBox,
    QGridLayout,
    QHeaderView,
    QLabel,
    QPushButton,
    QTableWidget,
    QTableWidgetItem,
    QWidget,
)

from rhot_app.calibration.hand.bones import BONE_NAMES
from rhot_app.calibration.hand.bones_report import BoneLength, BonesReport
from rhot_app.calibration.registry import BONES
from rhot_app.hand.skeleton import FINGERS
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.wizards.framework.definition import Definition, WizardContext
from rhot_app.ui.wizards.framework.movement_page import Movements
from rhot_app.ui.wizards.framework.page import AcceptPage, Page
from rhot_app.ui.wizards.models.step import AcceptStep, StepView
from rhot_app.ui.wizards.steps.bones_steps import SECONDS, EntryStep, HandStep, knowledge_of, make_guide, propose


def make_wizard(context: WizardContext) -> Definition:
    """Which hand, a minute of movement, the bones, use them."""
    movements = Movements(context)
    entry = EntryStep(context.rig.hand)
    page = movements.page("Move freely", "Press Record, then bend and stretch every finger and turn the hand.", SECONDS,
                          lambda: make_guide(context.rig))
    page.twin_facts = "Moves every joint: all of them within the minute."
    page.movement.unneeded = lambda: "Press Next: the bones were entered." if entry.report is not None else ""
    hand = HandStep(entry, page.movement, context.rig)
    accept = AcceptStep(lambda: propose(hand.report, context.rig, context.rig_path), "Record the movement first.")
    return Definition(BONES.title, (EntryPage(entry), page, HandPage(hand, context.scheme),
                                      AcceptPage(accept, context.scheme)),
                      solver="rhot_app.calibration.hand.bones", put_back=movements.end)


# -- the pages of the bones wizard -------------------------------------------------------------------------------------

_HEADS = ("bone", "length, mm", "± mm", "known")
_SIDES = (("right", "Right hand"), ("left", "Left hand"))
_ROW_PX = 30
_BOX_PX = 120
_LONGEST_MM = 400.0
_ALPHA = {"measured": 150, "inferred": 60, "guessed": 110}


class EntryPage(Page):
    """A number for each bone that was measured; 0 shows as a dash."""

    def __init__(self, step: EntryStep) -> None:
        super().__init__(step)
        self._entry = step
        self._filling = False
        self.side = QComboBox()
        for value, text in _SIDES:
            self.side.addItem(text, value)
        self.side.setToolTip("Which hand wears the markers.")
        self.boxes = {name: self._box(name) for name in BONE_NAMES}
        self.undo_button = QPushButton("Undo")
        self.undo_button.setAutoDefault(False)
        self.undo_button.setToolTip("Ctrl+Z. What was entered last.")
        self.undo_button.clicked.connect(self._undo)
        self.centre = self._form()
        note = QLabel("Most people leave this page as it is: a minute of movement shows the lengths, and how well. A "
                      "ruler helps where too few markers are worn.")
        note.setWordWrap(True)
        note.setProperty("muted", True)
        for widget in (self.side, note, self.undo_button):
            self.column.addWidget(widget)
        self.column.addStretch(1)
        self.side.currentIndexChanged.connect(self._choose)
        self.first_field = self.side

    def _form(self) -> QWidget:
        form = QWidget()
        form.setProperty("panel", True)
        grid = QGridLayout(form)
        grid.setContentsMargins(16, 16, 16, 16)
        grid.setSpacing(8)
        for column, head in enumerate(("", "first bone", "second bone", "last bone, to the tip")):
            label = QLabel(head)
            label.setWordWrap(True)
            grid.addWidget(label, 0, column)
        for row, finger in enumerate(FINGERS):
            grid.addWidget(QLabel(finger), row + 1, 0)
            for k, name in enumerate(BONE_NAMES[3 * row:3 * row + 3]):
                grid.addWidget(self.boxes[name], row + 1, k + 1)
        grid.setRowStretch(len(FINGERS) + 1, 1)
        return form

    def _box(self, name: str) -> QDoubleSpinBox:
        box = QDoubleSpinBox()
        box.setRange(0.0, _LONGEST_MM)
        box.setDecimals(1)
        box.setSuffix(" mm")
        box.setSpecialValueText("–")
        box.setKeyboardTracking(False)
        box.setAccessibleName(name)
        box.setMinimumWidth(_BOX_PX)
        box.setToolTip(f"{name.replace('.', ', ')}: from the middle of one joint to that of the next, finger bent. "
                       f"{self._entry.usual(name):.0f} mm in the hand now in use.")
        box.valueChanged.connect(lambda value: self._take(name, value))
        return box

    def _take(self, name: str, value: float) -> None:
        if not self._filling:
            self._entry.enter_length(name, value or None)
            self.changed.emit()

    def _choose(self) -> None:
        if not self._filling:
            self._entry.choose_side(self.side.currentData())
            self.changed.emit()

    def _undo(self) -> None:
        self._entry.undo()
        self.changed.emit()

    def show_view(self, view: StepView) -> None:
        """What stands in the step; Ctrl+Z may have brought something back."""
        self._filling = True
        self.side.setCurrentIndex(self.side.findData(self._entry.base.side))
        for name, box in self.boxes.items():
            value = self._entry.lengths.get(name, 0.0)
            if box.value() != value and not box.hasFocus():
                box.setValue(value)
        self._filling = False
        self.undo_button.setEnabled(self._entry.undoable)


class HandPage(Page):
    """Every bone: solid what was measured, translucent what follows from it, hatched what is only usual."""

    def __init__(self, step: HandStep, scheme: Scheme) -> None:
        super().__init__(step)
        self._hand = step
        self._scheme = scheme
        self._shown: BonesReport | None = None
        self.table = QTableWidget(0, len(_HEADS))
        self.table.setHorizontalHeaderLabels(list(_HEADS))
        self.table.horizontalHeader().setSectionResizeMode(QHeaderView.ResizeMode.Stretch)
        for column in (1, 2):
            self.table.horizontalHeader().setSectionResizeMode(column, QHeaderView.ResizeMode.ResizeToContents)
        self.table.verticalHeader().setVisible(False)
        self.table.verticalHeader().setDefaultSectionSize(_ROW_PX)
        self.table.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.table.setSelectionMode(QAbstractItemView.SelectionMode.NoSelection)
        self.table.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.table.setShowGrid(False)
        self.centre = self.table
        self.reaches = QLabel()
        self.reaches.setWordWrap(True)
        self.reaches.setToolTip("From the wrist over the finger's root to its stretched tip.")
        legend = QLabel("Solid: the markers show it. Translucent: they show it in part. Hatched: they do not; the "
                        "length is what is usual for a hand of this size.")
        legend.setWordWrap(True)
        legend.setProperty("muted", True)
        self.column.addWidget(legend)
        self.column.addWidget(self.reaches)
        self.column.addStretch(1)

    def show_view(self, view: StepView) -> None:
        """The newest report."""
        report: BonesReport | None = self._hand.report
        if report is self._shown:
            return
        self._shown = report
        bones = report.bones if report is not None else ()
        self.table.setRowCount(len(bones))
        for r, bone in enumerate(bones):
            self._fill(r, bone)
        self.reaches.setText("" if report is None else "Reach: " + ", ".join(
            f"{reach.finger} {reach.length_mm:.0f} ± {reach.std_mm:.0f}" for reach in report.reaches) + " mm")

    def _fill(self, r: int, bone: BoneLength) -> None:
        texts = (bone.name.replace(".", " "), f"{bone.length_mm:.1f}", f"{bone.std_mm:.1f}", bone.known.word)
        for c, text in enumerate(texts):
            item = QTableWidgetItem(text)
            if c in (1, 2):
                item.setTextAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
            if c == len(texts) - 1:
                item.setBackground(self._brush(knowledge_of(bone)))
            self.table.setItem(r, c, item)

    def _brush(self, knowledge: str) -> QBrush:
        guessed = knowledge == "guessed"
        colour = QColor(self._scheme.guessed if guessed else self._scheme.good)
        colour.setAlpha(_ALPHA[knowledge])
        return QBrush(colour, Qt.BrushStyle.BDiagPattern if guessed else Qt.BrushStyle.SolidPattern)
