"""The pages on which colours are picked and their bounds moved, beside the live mask."""

from __future__ import annotations

from PySide6.QtWidgets import QComboBox, QHBoxLayout, QPushButton

from rhot_app.calibration.separability import SKIN
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.wizards.colour_list import PaintList, PaintRow
from rhot_app.ui.wizards.control_row import ControlRow
from rhot_app.ui.wizards.models.camera_settings import Control, Value
from rhot_app.ui.wizards.models.colour_bounds import BOUNDS, BoundsStep
from rhot_app.ui.wizards.models.colour_pick import PickStep
from rhot_app.ui.wizards.models.step import StepView
from rhot_app.ui.wizards.page import Page

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

    def pick(self, camera: str, x: float, y: float, width: float, height: float) -> None:
        """The chosen marker is there."""
        self._picks.pick(camera, x, y, width, height)

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
            row.setEnabled(step.report is not None)
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
