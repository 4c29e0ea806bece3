"""The knobs of the camera wizard: which cameras, and each of their settings."""

from __future__ import annotations

import time

from PySide6.QtWidgets import QComboBox, QHBoxLayout, QLabel, QPushButton, QScrollArea, QVBoxLayout, QWidget

from rhot_app.ui.wizards.control_row import ControlRow
from rhot_app.ui.wizards.models.camera_settings import CONTROLS, Control, Value
from rhot_app.ui.wizards.models.camera_steps import SettingsStep
from rhot_app.ui.wizards.models.step import StepView
from rhot_app.ui.wizards.page import Page
from rhot_app.ui.wizards.tryout import Tryout


class CameraPage(Page):
    """What is turned is tried out at once by the cameras chosen; nothing is saved."""

    def __init__(self, step: SettingsStep, tryout: Tryout) -> None:
        super().__init__(step)
        self._settings = step
        self._tryout = tryout
        self._shown: object = None
        self.which = QComboBox()
        self.which.setToolTip("Whose settings are turned. Both at once keeps equal cameras equal.")
        choices = step.choices
        if len(choices.nodes) > 1:
            self.which.addItem("All cameras", tuple(node.node_id for node in choices.nodes))
        for node in choices.nodes:
            self.which.addItem(node.name, (node.node_id,))
        self.rows = {control.field: ControlRow(control) for control in CONTROLS}
        knobs = QWidget()
        knobs.setProperty("panel", False)
        column = QVBoxLayout(knobs)
        column.setContentsMargins(0, 0, 8, 0)
        column.setSpacing(4)
        for row in self.rows.values():
            column.addWidget(row)
            row.changed.connect(lambda value, goes_on, row=row: self._turn(row.control, value, goes_on=goes_on))
        column.addStretch(1)
        scroll = QScrollArea()
        scroll.setWidgetResizable(True)
        scroll.setWidget(knobs)
        self.balance_button = QPushButton("Balance on grey")
        self.balance_button.setToolTip("Drag over something grey or white in a picture first, a sheet of paper for "
                                       "instance. Press again until nothing changes.")
        self.balance_button.setAutoDefault(False)
        self.balance_button.clicked.connect(self._balance)
        self.undo_button = QPushButton("Undo")
        self.undo_button.setToolTip("Ctrl+Z. The last change back.")
        self.undo_button.setAutoDefault(False)
        self.undo_button.clicked.connect(self._undo)
        self.problem = QLabel()
        self.problem.setWordWrap(True)
        self.column.addWidget(self.which)
        self.column.addWidget(scroll, 1)
        self.column.addWidget(self.problem)
        buttons = QHBoxLayout()
        buttons.addWidget(self.balance_button)
        buttons.addWidget(self.undo_button)
        self.column.addLayout(buttons)
        self.which.currentIndexChanged.connect(self._choose)
        tryout.told.connect(self._told)
        self.first_field = self.which
        self.pickable = True

    @property
    def chosen(self) -> tuple[int, ...]:
        """Node ids of the cameras that are being set."""
        ids: tuple[int, ...] = self.which.currentData() or ()
        return ids

    def _choose(self) -> None:
        self._shown = None
        self.changed.emit()

    def _turn(self, control: Control, value: Value, *, goes_on: bool) -> None:
        try:
            self._settings.choices.change(self.chosen, control, value, goes_on=goes_on)
        except ValueError as exc:
            self.problem.setText(str(exc))
            return
        self.changed.emit()

    def _undo(self) -> None:
        if self._settings.undo():
            self.changed.emit()

    def _balance(self) -> None:
        if self._settings.balance():
            self.changed.emit()

    def pick(self, camera: str, x: float, y: float, width: float, height: float) -> None:
        """Something grey."""
        self._settings.mark_grey(camera, (round(x), round(y), round(x + width), round(y + height)))

    def _told(self, problem: str) -> None:
        self._settings.note_told(time.monotonic_ns())
        self.problem.setText(problem)

    def show_view(self, view: StepView) -> None:
        """Show the settings, and have the cameras try out what is new."""
        choices = self._settings.choices
        self.balance_button.setEnabled(bool(self._settings.balanceable))
        if self._shown is choices.now:
            return
        self._shown = choices.now
        for node_id in self._settings.untold():
            self._tryout.want(node_id, self._settings.tell(node_id))
        for row in self.rows.values():
            values = {choices.value(node_id, row.control) for node_id in self.chosen}
            row.fill(choices.value(self.chosen[0], row.control) if self.chosen else None)
            row.told.setText(row.control.name if len(values) < 2 else f"{row.control.name} (they differ)")
        self.undo_button.setEnabled(choices.undoable)
