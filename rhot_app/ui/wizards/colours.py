"""The colour wizard: pick every marker's paint, look at the mask, see what may be mistaken for it, use it."""

from __future__ import annotations

from dataclasses import replace

from PySide6.QtCore import Qt
from PySide6.QtGui import QColor
from PySide6.QtWidgets import (
    QAbstractItemView,
    QComboBox,
    QHBoxLayout,
    QHeaderView,
    QLabel,
    QPushButton,
    QTableWidget,
    QTableWidgetItem,
    QVBoxLayout,
    QWidget,
)

from rhot_app.calibration.colour.colours import ColourReport
from rhot_app.calibration.colour.separability import SKIN
from rhot_app.calibration.colour.verdict import OVERLAP
from rhot_app.ui.backend.feed import Picture
from rhot_app.ui.common.theme import app_font
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.wizards.framework.colour_list import PaintList, PaintRow
from rhot_app.ui.wizards.framework.control_row import ControlRow
from rhot_app.ui.wizards.framework.definition import Definition, WizardContext, accept_result
from rhot_app.ui.wizards.framework.page import ChartView, Page, shrinkable
from rhot_app.ui.wizards.models.step import StepView
from rhot_app.ui.wizards.steps.camera_steps import Control, Value
from rhot_app.ui.wizards.steps.colour_pick import PickStep
from rhot_app.ui.wizards.steps.colour_result import BOUNDS, BoundsStep, SeparationStep


def make_wizard(context: WizardContext) -> Definition:
    """The wizard's pages for the rig at hand."""
    cameras = tuple(node.name for node in context.rig.nodes if not node.text_datagrams)
    picks = PickStep(context.rig.markers, cameras)
    bounds = BoundsStep(context.calibration, context.now, picks)
    apart = SeparationStep(context.calibration, context.now, bounds)

    def judged_now(result: ColourReport) -> ColourReport:
        """With what the light says since then."""
        assert apart.report is not None
        return replace(result, verdict=apart.report.verdict)

    accept = accept_result(context, apart, "Pick the markers' colours first.", judged_now)
    pages = (PickPage(picks, context.scheme), BoundsPage(bounds, context.scheme), SeparationPage(apart, context.scheme),
             accept)
    return Definition(pages)


# -- the page of the separability --------------------------------------------------------------------------------------

_ROW_PX = 28
_LEAST = 0.005  # less is shown as nothing


class SeparationPage(Page):
    """Nothing to enter: what the person can do about it stands in the verdict."""

    def __init__(self, step: SeparationStep, scheme: Scheme) -> None:
        super().__init__(step)
        self._apart = step
        self._shown: ColourReport | None = None
        self._scheme = scheme
        self.charts = ChartView(scheme)
        self.table = QTableWidget()
        self.table.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.table.setSelectionMode(QAbstractItemView.SelectionMode.NoSelection)
        self.table.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.table.horizontalHeader().setSectionResizeMode(QHeaderView.ResizeMode.Stretch)
        self.table.setAccessibleName("Which colour is taken for which")
        self.table.setWordWrap(False)
        self.table.setStyleSheet("QHeaderView::section { padding: 4px 0 } QTableView::item { padding: 0 }")
        caption = QLabel("The table: how much of each column's colour is taken for the marker of the row, in %, over "
                         "all lamps that may come; of a marker's own colour by the lamp where that is least.")
        caption.setWordWrap(True)
        self.centre = QWidget()
        column = QVBoxLayout(self.centre)
        column.setContentsMargins(0, 0, 0, 0)
        column.addWidget(self.charts, 1)
        column.addWidget(self.table)
        note = QLabel("The chart: the blue line shows which hues the room has, and how much of each. Where it rises "
                      "inside a marker's band, the room has things of that marker's colour.")
        note.setWordWrap(True)
        note.setProperty("muted", True)
        self.column.addWidget(caption)
        self.column.addWidget(note)
        self.column.addStretch(1)

    def show_view(self, view: StepView) -> None:
        """The newest result."""
        result = self._apart.result
        if result is not self._shown:
            self._shown = result
            self.charts.show_charts(self._apart.charts)
            if result is not None:
                self._fill(result)

    def _fill(self, result: ColourReport) -> None:
        names, heads = result.names, (*result.names, *result.separability.others)
        self.table.setColumnCount(len(heads))
        self.table.setRowCount(len(names))
        self.table.setHorizontalHeaderLabels(list(heads))
        self.table.setVerticalHeaderLabels(list(names))
        for r, shares in enumerate(result.separability.matrix):
            for c, share in enumerate(shares):
                self.table.setItem(r, c, self._cell(float(share), own=r == c))
            self.table.setRowHeight(r, _ROW_PX)
        header = self.table.horizontalHeader().sizeHint().height()
        self.table.setFixedHeight(header + _ROW_PX * len(names) + 4)

    def _cell(self, share: float, *, own: bool) -> QTableWidgetItem:
        item = QTableWidgetItem(f"{100 * share:.0f}" if own or share >= _LEAST else "–")
        item.setTextAlignment(Qt.AlignmentFlag.AlignCenter)
        bad = not own and share >= OVERLAP
        item.setFont(app_font(bold=own or bad))
        tone = self._scheme.bad if bad else self._scheme.good if own else self._scheme.muted
        item.setForeground(QColor(tone))
        return item


# -- Pages: pick colours and move their bounds -------------------------------------------------------------------------

_SHOWN = (("all", "Mask of all markers"), ("chosen", "Mask of the chosen marker"), ("none", "Picture without mask"))


class MaskChoice(QComboBox):
    """Whose mask lies over the pictures."""

    def __init__(self) -> None:
        super().__init__()
        for value, text in _SHOWN:
            self.addItem(text, value)
        self.setToolTip("The mask is what the detector really takes for each marker, pixel by pixel, in this light.")


class PickPage(Page):
    """Choose a marker in the list, click its paint in a picture."""

    def __init__(self, step: PickStep, scheme: Scheme) -> None:
        super().__init__(step)
        self._picks = step
        self.pickable = self.one_large = True
        self.list = PaintList(scheme, ("marker", "pictures"))
        self.list.setToolTip("Choose what to click next. The patches are the rig's colour and the one picked. A tick: "
                             "enough places and angles were seen; a cross: the colour is another marker's or the "
                             "skin's. Ctrl+Z takes the last click back; clicking a marker anew replaces what was "
                             "gathered for it.")
        self.mask_choice = MaskChoice()
        self.hold = _button("Hold the pictures", "Space. Then click at leisure; Space again lets them go on.")
        self.undo_button = _button("Undo", "Ctrl+Z. The last click back.")
        for widget in (self.list, self.mask_choice, self.hold, self.undo_button):
            self.column.addWidget(widget, 1 if widget is self.list else 0)
        shrinkable(self.list)
        self.list.chosen.connect(self._choose)
        self.mask_choice.currentIndexChanged.connect(self._show)
        self.hold.clicked.connect(self._hold)
        self.undo_button.clicked.connect(self._undo)

    def _choose(self, name: str) -> None:
        self._picks.chosen = name
        self.changed.emit()

    def _show(self) -> None:
        self._picks.show = self.mask_choice.currentData()
        self.changed.emit()

    def _hold(self) -> None:
        self._picks.capture()
        self.changed.emit()

    def _undo(self) -> None:
        self._picks.undo()
        self.changed.emit()

    def pick(self, picture: Picture, x: float, y: float, width: float, height: float) -> None:
        """The chosen marker is there."""
        self._picks.pick(picture, x, y, width, height)

    def show_view(self, view: StepView) -> None:
        """The list; the button says what it would do."""
        self.list.show_rows(tuple(self._row(name) for name in self._picks.names), self._picks.chosen)
        self.hold.setText("Let the pictures go on" if view.pictures else "Hold the pictures")
        self.undo_button.setEnabled(self._picks.undoable)

    def _row(self, name: str) -> PaintRow:
        gathering = self._picks.gathering
        if name == SKIN:
            count = len(gathering.skin)
            return PaintRow(name, None, "tick" if count else "ring", "picked" if count else "not picked")
        index = self._picks.base.ids.index(name)
        before, now = (markers.markers[index].display_rgb for markers in (self._picks.base, self._picks.markers))
        if name not in gathering.names:
            return PaintRow(name, None, "ring", "not picked", before)
        doubt = self._picks.doubt(name)
        state = "cross" if doubt else "tick" if gathering.variety(name) >= 1.0 else "half"
        return PaintRow(name, now, state, doubt or str(gathering.pictures(name)), before)


class BoundsPage(Page):
    """Choose a marker in the list, move its bounds."""

    def __init__(self, step: BoundsStep, scheme: Scheme) -> None:
        super().__init__(step)
        self._bounds = step
        self.one_large = True
        self.list = PaintList(scheme, ("marker", "hue"))
        self.mask_choice = MaskChoice()
        self.rows = {control.field: ControlRow(control) for control in BOUNDS}
        self.again = _button("As learnt", "The chosen marker's bounds as they were learnt from the samples.")
        self.undo_button = _button("Undo", "Ctrl+Z. The last change back.")
        self.column.addWidget(self.list, 1)
        shrinkable(self.list)
        for row in self.rows.values():
            self.column.addWidget(row)
            row.changed.connect(lambda value, goes_on, row=row: self._move(row.control, value, goes_on=goes_on))
        self.list.horizontalHeader().setVisible(False)
        buttons = QHBoxLayout()
        buttons.addWidget(self.again)
        buttons.addWidget(self.undo_button)
        self.column.addWidget(self.mask_choice)
        self.column.addLayout(buttons)
        self.list.chosen.connect(self._choose)
        self.mask_choice.currentIndexChanged.connect(self._show)
        self.again.clicked.connect(self._learn_again)
        self.undo_button.clicked.connect(self._undo)

    def _choose(self, name: str) -> None:
        self._bounds.chosen = name
        self.changed.emit()

    def _show(self) -> None:
        self._bounds.show = self.mask_choice.currentData()
        self.changed.emit()

    def _move(self, control: Control, value: Value, *, goes_on: bool) -> None:
        if value is not None:
            self._bounds.change(control, value, goes_on=goes_on)
            self.changed.emit()

    def _learn_again(self) -> None:
        self._bounds.learn_again()
        self.changed.emit()

    def _undo(self) -> None:
        self._bounds.undo()
        self.changed.emit()

    def show_view(self, view: StepView) -> None:
        """The list, and the bounds of the marker chosen."""
        step = self._bounds
        self.list.show_rows(tuple(self._row(name) for name in step.names), step.chosen)
        for row in self.rows.values():
            row.fill(step.value(row.control))
            row.setEnabled(step.result is not None)
        self.again.setEnabled(step.chosen in step.given)
        self.undo_button.setEnabled(step.undoable)

    def _row(self, name: str) -> PaintRow:
        step = self._bounds
        marker = step.markers.markers[step.markers.ids.index(name)]
        text = f"± {marker.chroma.hue_tolerance_deg:.0f}°"
        return PaintRow(name, marker.display_rgb, "half" if name in step.given else "tick",
                        f"{text}, by hand" if name in step.given else text)


def _button(text: str, meaning: str) -> QPushButton:
    button = QPushButton(text)
    button.setAutoDefault(False)
    button.setToolTip(meaning)
    return button
