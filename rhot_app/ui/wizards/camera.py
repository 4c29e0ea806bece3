"""The wizard for what the cameras are told: exposure, gains, white balance, contrast, saturation, brightness."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable
from typing import Any

from PySide6.QtCore import QObject, Signal
from PySide6.QtWidgets import QComboBox, QHBoxLayout, QLabel, QPushButton, QScrollArea, QVBoxLayout, QWidget

from rhot_app.calibration.proposal import NodeChange
from rhot_app.errors import RhotError
from rhot_app.ui.backend.contract import Asker
from rhot_app.ui.backend.feed import Picture
from rhot_app.ui.common.job import Job
from rhot_app.ui.wizards.framework.control_row import ControlRow
from rhot_app.ui.wizards.framework.definition import Definition, WizardContext, accept_page
from rhot_app.ui.wizards.framework.page import Page, shrinkable
from rhot_app.ui.wizards.models.step import StepView
from rhot_app.ui.wizards.steps.camera_steps import CONTROLS, CameraChoices, Control, SettingsStep, Value


def make_wizard(context: WizardContext) -> Definition:
    """The wizard's pages for the rig at hand."""
    choices = CameraChoices(context.rig.nodes, context.now.node_settings)
    step = SettingsStep(choices, context.rig.markers)
    tryout = Tryout(context.connect)
    last = accept_page(context, step.propose, "No picture shows these settings yet, or they cannot be used: go back.")
    accept = last.accept
    page = CameraPage(step, tryout)
    tryout.setParent(page)

    def put_back() -> None:
        """What was only tried out goes; what was saved stays."""
        in_force: dict[int, Settings] = {node.node_id: choices.whole(node.node_id, before=True)
                                         for node in choices.nodes}
        if accept.state == "used" and accept.proposal is not None:
            for change in accept.proposal.changes:
                if isinstance(change, NodeChange):
                    in_force[change.node_id]["camera"].update(change.after["camera"])
        tryout.put_back(in_force)

    return Definition((page, last), put_back=put_back)


# -- the knobs of the camera wizard ------------------------------------------------------------------------------------

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
        shrinkable(scroll)
        self.column.addWidget(self.problem)
        buttons = QHBoxLayout()
        buttons.addWidget(self.balance_button)
        buttons.addWidget(self.undo_button)
        self.column.addLayout(buttons)
        self.which.currentIndexChanged.connect(self._choose)
        tryout.answered.connect(self._answered)
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

    def pick(self, picture: Picture, x: float, y: float, width: float, height: float) -> None:
        """Something grey."""
        self._settings.mark_grey(picture.camera, (round(x), round(y), round(x + width), round(y + height)))

    def _answered(self, problem: str) -> None:
        self._settings.note_sent(time.monotonic_ns())
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
            row.check_box.setText(row.control.name if len(values) < 2 else f"{row.control.name} (they differ)")
        self.undo_button.setEnabled(choices.undoable)


# -- node settings tried out while a person turns a knob ---------------------------------------------------------------

Settings = dict[str, Any]


class Tryout(QObject):
    """`want` as often as you like; at most one request is under way. `answered` with "" or with what went wrong."""

    answered = Signal(str)

    def __init__(self, connect: Callable[[], Asker], parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._connect = connect
        self._wanted: dict[int, Settings] = {}
        self._job: Job | None = None
        self._tried: set[int] = set()
        self._lock = threading.Lock()  # between the worker that sends and the one that puts back

    @property
    def under_way(self) -> bool:
        """Whether the nodes have not been told everything yet."""
        return self._job is not None

    def want(self, node_id: int, settings: Settings) -> None:
        """Have the node go by `settings` without saving them."""
        self._wanted[node_id] = settings
        self._tried.add(node_id)
        self._begin()

    def _begin(self) -> None:
        if self._job is None and self._wanted:
            wanted, self._wanted = self._wanted, {}
            self._job = Job(lambda progress: self._send(wanted), self._sent, self._failed, None, self).start()

    def _send(self, wanted: dict[int, Settings]) -> None:
        with self._lock, contextlib.closing(self._connect()) as asker:
            for node_id, settings in wanted.items():
                try_settings(asker, node_id, settings)

    def _sent(self, _: None) -> None:
        self._job = None
        self.answered.emit("")
        self._begin()

    def _failed(self, sentence: str) -> None:
        self._job = None
        self.answered.emit(sentence)
        self._begin()

    def put_back(self, before: dict[int, Settings]) -> None:
        """Have every node that was told anything go by `before` again; waits, so call it in a worker. A node that does
        not answer is left: what was tried out ends with its process."""
        self._wanted = {}
        with self._lock, contextlib.closing(self._connect()) as asker:
            for node_id in sorted(self._tried):
                try:
                    try_settings(asker, node_id, before[node_id])
                except RhotError:
                    continue


def try_settings(asker: Asker, node_id: int, settings: Settings) -> None:
    """Settings that are in force but not saved; raises EngineError with the node's sentence."""
    asker.command("node", node_id=node_id, request={"request": "set_settings", "settings": settings, "save": False})
