"""The bones wizard: enter lengths or move freely for a minute, see what is known of every bone, use the hand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal

import msgspec
import numpy as np
from PySide6.QtCore import Qt
from PySide6.QtGui import QBrush, QColor
from PySide6.QtWidgets import QComboBox, QDoubleSpinBox, QGridLayout, QLabel, QWidget

from rhot_app.calibration.collect import Bar, Guide, Movement
from rhot_app.calibration.hand.bones import BONE_NAMES, enter_bones
from rhot_app.calibration.hand.bones_result import BoneLength, BonesResult
from rhot_app.calibration.hand.marker_places import tracks_of
from rhot_app.calibration.kinds.bones import roles_of
from rhot_app.errors import CalibrationError
from rhot_app.hand.anatomy import HandAnatomy
from rhot_app.hand.skeleton import BONES, FINGERS
from rhot_app.project import Rig
from rhot_app.state import HandState
from rhot_app.ui.common.parts import plain_button
from rhot_app.ui.common.record_table import RecordTable
from rhot_app.ui.language import tr, tr_noop
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.wizards.framework.definition import Definition, WizardContext, accept_result
from rhot_app.ui.wizards.framework.movement import Movements, QuietGuide
from rhot_app.ui.wizards.framework.page import Page, figure_columns
from rhot_app.ui.wizards.framework.step import Done, SolveStep, Step, StepView

if TYPE_CHECKING:
    from rhot_app.calibration.hand.bones_collector import BonesCollector

SECONDS = 60.0


def make_wizard(context: WizardContext) -> Definition:
    """Which hand, a minute of movement, the bones, use them."""
    movements, rig = Movements(context), context.rig
    entry = EntryStep(rig.hand)
    page = movements.page(Movement(
        tr("Move freely"), tr("Press Record, then bend and stretch every finger and turn the hand."), SECONDS,
        lambda: make_guide(rig), tr("Moves every joint: all of them within the minute.")))
    page.movement.unneeded = lambda: tr("Press Next: the bones were entered.") if entry.result is not None else ""

    def measured() -> tuple[Any, ...] | Done | None:
        if entry.result is not None:
            return Done(entry.result)
        log = page.movement.log
        return None if log is None else (log, entry.base)

    hand = SolveStep(context.calibration, context.now, measured, tr("Fitting the hand …"))
    accept = accept_result(context, hand, tr("Record the movement first."))
    return Definition((EntryPage(entry), page, HandPage(hand, context.scheme), accept), put_back=movements.end)


# -- steps -------------------------------------------------------------------------------------------------------------

Side = Literal["right", "left"]


class EntryStep(Step):
    """The first page: which hand, and the bones that were measured with a ruler, in mm; none means: by movement."""

    title = tr_noop("Your hand")

    def __init__(self, hand: HandAnatomy) -> None:
        self._hand = hand
        self._lengths: dict[str, float] = {}
        self._side: Side = hand.side
        self._undone: list[tuple[dict[str, float], Side]] = []
        self.result: BonesResult | None = None
        self.problem = ""

    @property
    def base(self) -> HandAnatomy:
        """The hand to begin from, of the side chosen."""
        return msgspec.structs.replace(self._hand, side=self._side)

    @property
    def lengths(self) -> dict[str, float]:
        """What was entered, by bone, mm."""
        return dict(self._lengths)

    @property
    def keeps(self) -> bool:
        """Measuring takes a person minutes."""
        return bool(self._lengths)

    @property
    def undoable(self) -> bool:
        """Whether something was entered."""
        return bool(self._undone)

    def usual(self, name: str) -> float:
        """A bone's length in the hand to begin from, mm."""
        finger, _, bone = name.partition(".")
        return float(self._hand.fingers[finger].bones_mm[BONES[FINGERS.index(finger)].index(bone)])

    def enter_length(self, name: str, length_mm: float | None) -> None:
        """A bone's length; None for one that was not measured."""
        lengths = {bone: value for bone, value in self._lengths.items() if bone != name}
        if length_mm is not None:
            lengths[name] = length_mm
        self._change(lengths, self._side)

    def choose_side(self, side: Side) -> None:
        """Left or right."""
        self._change(self._lengths, side)

    def undo(self) -> bool:
        """Back to what was entered before."""
        if not self._undone:
            return False
        self._lengths, self._side = self._undone.pop()
        self._judge()
        return True

    def _change(self, lengths: dict[str, float], side: Side) -> None:
        if (lengths, side) != (self._lengths, self._side):
            self._undone.append((self._lengths, self._side))
            self._lengths, self._side = lengths, side
            self._judge()

    def _judge(self) -> None:
        self.result, self.problem = None, ""
        if self._lengths:
            try:
                self.result = enter_bones(self.base, {name: self._lengths[name] for name in BONE_NAMES
                                                      if name in self._lengths})
            except CalibrationError as exc:
                self.problem = str(exc)

    def view(self) -> StepView:
        """Either way is right."""
        if self.problem:
            return StepView(tr("Mend what was entered."), hint=self.problem)
        if self.result is None:
            return StepView(tr("Press Next to measure by movement."), done=True,
                            hint=tr("Or enter bones that you have measured with a ruler, joint to joint."))
        return StepView(tr("Press Next: the bones are as entered."), done=True, verdict=self.result.verdict)


class SweepGuide:
    """Which fingers have bent and stretched enough, by the collector that the command uses."""

    def __init__(self, rig: Rig) -> None:
        self._rig = rig
        self._collector: BonesCollector | None = None
        self._columns: list[int] = []
        self._last = -1
        self._first_s = 0.0

    def watch(self, states: Sequence[HandState]) -> None:
        """Take every state once."""
        for state in states:
            if state.t_master_ns > self._last:
                self._last = state.t_master_ns
                if self._collector is None:
                    self._begin(state)
                if self._collector is not None:
                    self._collector.add(1e-9 * state.t_master_ns - self._first_s,
                                        state.marker_raw_positions[self._columns])

    def _begin(self, state: HandState) -> None:
        from rhot_app.calibration.hand.bones_collector import BonesCollector

        self._first_s = 1e-9 * state.t_master_ns
        positions, (roles, painted) = state.marker_raw_positions[None], roles_of(self._rig)
        tracks = tracks_of(np.zeros(1), np.nan_to_num(positions), state.marker_ids, roles, painted=painted)
        self._columns = [state.marker_ids.index(place.name) for place in tracks.places]
        self._collector = BonesCollector(tracks.places)

    def bars(self) -> tuple[Bar, ...]:
        """One for each finger with a marker at its end."""
        if self._collector is None:
            return ()
        from rhot_app.calibration.hand.bones_collector import LEAST_S

        progress = self._collector.progress
        fingers = (Bar(finger.finger, finger.fraction,
                       tr("bent and stretched {sweeps} times; how far shows when the hand is fitted",
                          sweeps=finger.sweeps)) for finger in progress.fingers if finger.seen)
        return (Bar(tr("in sight"), min(progress.seconds / LEAST_S, 1.0),
                    tr("of {least_s:.0f} s in which the cameras see the markers together", least_s=LEAST_S)), *fingers)

    def sentence(self) -> str:
        """What to do next."""
        return self._collector.progress.sentence if self._collector is not None else tr("Show the hand to both "
                                                                                        "cameras.")

    def shortfall(self) -> str:
        """What has not moved enough."""
        return "" if self._collector is not None and self._collector.progress.done else self.sentence()


def make_guide(rig: Rig) -> Guide:
    """A guide for the markers of the rig; a quiet one when none of them names its place on the hand."""
    roles, painted = roles_of(rig)
    try:
        tracks_of(np.zeros(1), np.zeros((1, len(rig.markers.ids), 3)), rig.markers.ids, roles, painted=painted)
    except CalibrationError:
        return QuietGuide(tr("Bend and stretch every finger."))
    return SweepGuide(rig)


def knowledge_of(bone: BoneLength) -> str:
    """``measured``, ``inferred`` or ``guessed``: shown solid, translucent and hatched, as everywhere."""
    return {"observed": "measured", "entered": "measured", "partly": "inferred"}.get(bone.known.value, "guessed")


# -- the pages of the bones wizard -------------------------------------------------------------------------------------

_SIDES = (("right", tr_noop("Right hand")), ("left", tr_noop("Left hand")))
_ROW_PX = 30
_BOX_PX = 104
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
            self.side.addItem(tr(text), value)
        self.side.setToolTip(tr("Which hand wears the markers."))
        self.boxes = {name: self._box(name) for name in BONE_NAMES}
        self.undo_button = plain_button(tr("Undo"), tr("Ctrl+Z. What was entered last."), self._undo)
        self.centre = self._form()
        note = QLabel(tr("Most people leave this page as it is: a minute of movement shows the lengths, and how well. "
                         "A ruler helps where too few markers are worn."))
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
        for column, head in enumerate(("", tr("first bone"), tr("second bone"), tr("last bone, to the tip"))):
            label = QLabel(head)
            label.setWordWrap(True)
            grid.addWidget(label, 0, column)
        for row, finger in enumerate(FINGERS):
            grid.addWidget(QLabel(tr(finger)), row + 1, 0)
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
        box.setAccessibleName(tr(name.replace(".", " ")))
        box.setMinimumWidth(_BOX_PX)
        box.setToolTip(tr("{name}: from the middle of one joint to that of the next, finger bent. {usual:.0f} mm in "
                          "the hand now in use.", name=tr(name.replace(".", " ")), usual=self._entry.usual(name)))
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

    def __init__(self, step: SolveStep, scheme: Scheme) -> None:
        super().__init__(step)
        self._hand = step
        self._scheme = scheme
        self._shown: BonesResult | None = None
        self.table: RecordTable[tuple[str, ...]] = RecordTable((), selectable=False)
        self.table.setShowGrid(False)
        self.table.verticalHeader().setDefaultSectionSize(_ROW_PX)
        self.centre = self.table
        self.reaches = QLabel()
        self.reaches.setWordWrap(True)
        self.reaches.setToolTip(tr("From the wrist over the finger's root to its stretched tip."))
        legend = QLabel(tr("Solid: the markers show it. Translucent: they show it in part. Hatched: they do not; the "
                           "length is what is usual for a hand of this size."))
        legend.setWordWrap(True)
        legend.setProperty("muted", True)
        self.column.addWidget(legend)
        self.column.addWidget(self.reaches)
        self.column.addStretch(1)

    def show_view(self, view: StepView) -> None:
        """The newest result."""
        result: BonesResult | None = self._hand.result
        if result is self._shown:
            return
        self._shown = result
        self._show_bones()
        self.reaches.setText("" if result is None else tr("Reach: ")
                             + ", ".join(
            f"{tr(reach.finger)} {reach.length_mm:.0f} ± {reach.std_mm:.0f}" for reach in result.reaches) + " mm")

    def _show_bones(self) -> None:
        result, report = self._shown, self._hand.report
        if result is None or report is None:
            self.table.show_records((), ())
            return
        brushes = {bone.name: self._brush(knowledge_of(bone)) for bone in result.bones}
        *columns, last = figure_columns(report.tables[0].heads)
        last = replace(last, roles=lambda row: {Qt.ItemDataRole.BackgroundRole: brushes[row[0]]})
        self.table.show_records(report.tables[0].texts, (*columns, last))
        self.table.fit_columns()

    def _brush(self, knowledge: str) -> QBrush:
        guessed = knowledge == "guessed"
        colour = QColor(self._scheme.guessed if guessed else self._scheme.good)
        colour.setAlpha(_ALPHA[knowledge])
        return QBrush(colour, Qt.BrushStyle.BDiagPattern if guessed else Qt.BrushStyle.SolidPattern)
