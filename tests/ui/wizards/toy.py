"""A toy calibration by the recipe of `rhot_app.ui.wizards`, second part: its pages."""

from __future__ import annotations

from toy_steps import TOY, GreyStep, mean_level, propose, verdict_of

from rhot_app.ui.wizards.framework.definition import Definition, WizardContext
from rhot_app.ui.wizards.framework.page import AcceptPage, ChartPage, Page
from rhot_app.ui.wizards.models.step import AcceptStep, SolveStep, Task


def make_wizard(context: WizardContext) -> Definition:
    """Take pictures, look at the level, use it."""
    grey = GreyStep()
    solve = SolveStep(lambda: Task("Averaging …", mean_level, (grey.levels,)) if grey.levels else None, verdict_of)
    accept = AcceptStep(lambda: propose(solve.report, context))
    return Definition(TOY.title, (Page(grey), ChartPage(solve, context.scheme), AcceptPage(accept, context.scheme)))
