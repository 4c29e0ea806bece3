"""A small wizard with every kind of step, for the tests of the window itself."""

from __future__ import annotations

import msgspec
import numpy as np
import slow_work
from PySide6.QtWidgets import QSpinBox

from rhot_app.calibration.proposal import Proposal, Row
from rhot_app.calibration.verdict import Finding, Grade, judge
from rhot_app.ui.wizards.framework.definition import Definition, WizardContext, accept_page
from rhot_app.ui.wizards.framework.drawing import Cells, Dots, Line, Tag
from rhot_app.ui.wizards.framework.page import Page
from rhot_app.ui.wizards.framework.step import AnnotatedPicture, Bar, Step, StepView, Task


class FormStep(Step):
    """A number to enter."""

    title = "The board"

    def __init__(self):
        self.number = 0

    def view(self):
        return StepView("Say how many squares the board has.", done=self.number > 0,
                        hint="" if self.number else "Enter the number of squares.")


class FormPage(Page):
    """One field."""

    def __init__(self, step):
        super().__init__(step)
        self.box = QSpinBox()
        self.box.valueChanged.connect(self._enter)
        self.column.addWidget(self.box)
        self.column.addStretch(1)

    def _enter(self, value):
        self.step.number = value
        self.changed.emit()


def brightest(picture):
    """The column in which the middle row of a picture is brightest."""
    return float(picture.bgr[120].max(axis=1).argmax())


class CollectStep(Step):
    """Three pictures to capture."""

    title = "Take pictures"
    watches = captures = True

    def __init__(self):
        self.seen = None
        self.captured = []
        self.enough = 3

    def observe(self, pictures):
        return {name: (picture, brightest(picture)) for name, picture in pictures.items()}

    def accept_observation(self, seen):
        self.seen = seen

    def capture(self):
        if self.seen is None:
            return False
        self.captured.append(self.seen)
        return True

    def undo(self):
        if self.captured:
            self.captured.pop()
            return True
        return False

    @property
    def keeps(self):
        return bool(self.captured)

    def view(self):
        count = len(self.captured)
        annotated = {}
        for name, (picture, x) in (self.seen or {}).items():
            annotated[name] = AnnotatedPicture(picture, (
                Dots(np.array([[x, 120.0]])), Tag(x, 100.0, "edge"),
                Line(np.array([[x, 50.0], [x + 30, 50.0], [x, 80.0]]), closed=True, shaded=True)))
        bars = (Bar("pictures", count / self.enough, "captured so far"), Bar("tilt", 0.4), Bar("size", 1.0))
        return StepView("Hold the board still and press Space.", done=count >= self.enough, bars=bars,
                        annotated=annotated, overlays=dict.fromkeys(annotated, (Cells(np.eye(3)),)), kept=count)


class SolveStep(Step):
    """Counts in another process."""

    title = "Solve"

    def __init__(self, steps=3):
        self.steps = steps
        self.result = None
        self.problem = ""

    def task(self):
        return Task("Counting …", slow_work.count, (self.steps, 0.05)) if self.result is None else None

    def take_result(self, result):
        self.result = result

    def take_failure(self, sentence):
        self.problem = sentence

    def verdict(self):
        return judge("rms 0.31 px over 13 pictures", [
            Finding("tilt", Grade.FAIR, "The board was tilted by 12° at most.", "The focal length needs more.",
                    "Take three more pictures with the board tilted by 30°.")])

    def view(self):
        if self.result is None:
            return StepView("Wait a moment.", hint=self.problem)
        return StepView("Look at the verdict.", done=True, verdict=self.verdict())


def make_wizard(context: WizardContext, steps: int = 3) -> Definition:
    """The wizard's pages."""
    solve = SolveStep(steps)

    def propose():
        after = msgspec.structs.replace(context.rig, name="calibrated")
        return Proposal("lens calibration", solve.verdict(), (Row("focal length", "530.0 px", "535.9 ± 0.4 px"),
                                                              Row("picture", "640 × 480", "640 × 480")),
                        context.rig, after)

    form, collect = FormPage(FormStep()), Page(CollectStep())
    return Definition((form, collect, Page(solve), accept_page(context, propose)))
