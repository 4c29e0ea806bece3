"""A toy calibration by the recipe of `rhot_app.ui.wizards`, second file: its wizard."""

from __future__ import annotations

from toy_calibration import TOY, mean_level, propose, report

from rhot_app.ui.wizards.framework.definition import Definition, WizardContext, accept_result
from rhot_app.ui.wizards.framework.page import ChartPage, Page
from rhot_app.ui.wizards.models.step import Bar, SolveStep, Step, StepView, Task

ENOUGH = 3


def make_wizard(context: WizardContext) -> Definition:
    """Take pictures, look at the level, use it."""
    grey = GreyStep()
    solve = SolveStep(lambda: Task("Averaging …", mean_level, (grey.levels,)) if grey.levels else None, report)
    return Definition(TOY.title, (Page(grey), ChartPage(solve, context.scheme),
                                  accept_result(context, solve, lambda level: propose(level, context.rig))))


class GreyStep(Step):
    """How bright the pictures are, three times."""

    title = "Take pictures"
    watches = captures = True

    def __init__(self):
        self.now = None
        self.levels = ()

    def observe(self, pictures):
        return float(sum(picture.bgr.mean() for picture in pictures.values()) / len(pictures))

    def accept_observation(self, seen):
        self.now = seen

    def capture(self):
        self.levels += () if self.now is None else (self.now,)
        return self.now is not None

    @property
    def keeps(self):
        return bool(self.levels)

    def view(self):
        count = len(self.levels)
        return StepView("Press Space.", done=count >= ENOUGH, bars=(Bar("pictures", count / ENOUGH),), kept=count)
