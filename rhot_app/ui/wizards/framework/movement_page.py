"""The page of a recorded movement: one large button; the engine is asked in a worker."""

from __future__ import annotations

import contextlib
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from PySide6.QtWidgets import QLabel, QPushButton

from rhot_app.calibration.collect import Movement
from rhot_app.errors import EngineError
from rhot_app.ui.backend.contract import Asker
from rhot_app.ui.backend.feed import StateFeed
from rhot_app.ui.common.job import Job
from rhot_app.ui.wizards.framework.definition import WizardContext
from rhot_app.ui.wizards.framework.page import Page
from rhot_app.ui.wizards.models.movement import MovementStep, Request
from rhot_app.ui.wizards.models.step import StepView

_LABELS = {"waiting": "Record", "beginning": "Record", "recording": "Stop", "ending": "Stop",
           "recorded": "Record again"}


class MovementPage(Page):
    """Begins and ends the recording of a `MovementStep`."""

    def __init__(self, step: MovementStep, connect: Callable[[], Asker], states: StateFeed) -> None:
        super().__init__(step)
        self.movement = step
        self._connect = connect
        self._states = states
        self._job: Job | None = None
        self.button = QPushButton()
        self.button.setAutoDefault(False)
        self.button.setToolTip("Space. Begins or ends the recording; it ends by itself when the time is over.")
        self.button.clicked.connect(self._press)
        note = QLabel("The engine records what the cameras send, into a file that goes when this window closes.")
        note.setWordWrap(True)
        note.setProperty("muted", True)
        self.column.addWidget(self.button)
        self.column.addWidget(note)
        self.column.addStretch(1)

    def entered(self) -> None:
        """Hear the hand from now on."""
        self._states.start()

    def _press(self) -> None:
        if self.movement.capture():
            self.changed.emit()

    def show_view(self, view: StepView) -> None:
        """The button's word; ask the engine what the step wants."""
        phase = self.movement.phase
        self.button.setText(_LABELS[phase])
        self.button.setEnabled(phase in ("waiting", "recording", "recorded"))
        request = self.movement.request()
        if request is not None:
            self._job = Job(lambda progress: self._ask(request), lambda _: self._answered(request), self._refused, None,
                            self).start()

    def _ask(self, request: Request) -> None:
        with contextlib.closing(self._connect()) as asker:
            if request.kind == "end":
                asker.command("record_stop")
            else:
                if not asker.command("hello").get("running", True):
                    asker.command("start")
                asker.command("record", path=str(request.path))

    def _answered(self, request: Request) -> None:
        self.movement.answered(request)
        self.changed.emit()

    def _refused(self, sentence: str) -> None:
        self.movement.refused(sentence)
        self.changed.emit()


# -- Movements recorded for a wizard -----------------------------------------------------------------------------------

PageT = TypeVar("PageT", bound=MovementPage)
StepT = TypeVar("StepT", bound=MovementStep)


class Movements:
    """Makes the pages of recorded movements; `end` is the definition's `put_back`."""

    def __init__(self, context: WizardContext) -> None:
        if context.listen is None:
            raise EngineError("this window cannot hear the hand; open the wizard from the main window.")
        self.states = StateFeed(context.listen)
        self._connect = context.connect
        self.folder = Path(tempfile.mkdtemp(prefix="rhot-wizard-"))
        self._steps: list[MovementStep] = []

    def page(self, movement: Movement) -> MovementPage:
        """A page that records a movement."""
        return self.page_of(MovementPage, movement)

    def page_of(self, make: Callable[[MovementStep, Callable[[], Asker], StateFeed], PageT],
                movement: Movement) -> PageT:
        """The same on a page that shows more."""
        page = make(self.add(MovementStep(movement, self.folder, self.states.recent)), self._connect, self.states)
        page.twin_facts = movement.simulated
        return page

    def add(self, step: StepT) -> StepT:
        """A step made elsewhere, which `end` shall end as well; it writes into `folder`."""
        self._steps.append(step)
        return step

    def end(self) -> None:
        """End a recording that still runs, and throw the logs away. In a worker."""
        self.states.stop()
        if any(step.phase in ("beginning", "recording", "ending") for step in self._steps):
            with contextlib.closing(self._connect()) as asker:
                asker.command("record_stop")
        shutil.rmtree(self.folder, ignore_errors=True)
