"""The time wizard: when each camera sees, from a waving hand."""

from __future__ import annotations

from rhot_app.calibration.registry import TIME
from rhot_app.ui.wizards.framework.definition import Definition, WizardContext
from rhot_app.ui.wizards.framework.movement_page import Movements
from rhot_app.ui.wizards.framework.page import AcceptPage, ChartPage
from rhot_app.ui.wizards.models.step import AcceptStep, SolveStep, Task
from rhot_app.ui.wizards.steps.time_steps import SECONDS, WaveGuide, charts_of, propose, solve_log


def make_wizard(context: WizardContext) -> Definition:
    """Wave, look at the fit, use it."""
    movements = Movements(context)
    wave = movements.page("Wave", "Press Record, then wave your hand up and down before the cameras for 20 seconds.",
                          SECONDS, WaveGuide)
    wave.twin_facts = "Waves briskly."
    movement = wave.movement

    def task() -> Task | None:
        log = movement.log
        return None if log is None else Task("Comparing the cameras' times …", solve_log, (log, context.rig))

    solve = SolveStep(task, lambda report: report.verdict, charts_of)
    accept = AcceptStep(lambda: propose(solve.report, context.rig, context.rig_path, context.node_settings),
                        "Record a movement first.")
    return Definition(TIME.title, (wave, ChartPage(solve, context.scheme), AcceptPage(accept, context.scheme)),
                      solver="rhot_app.calibration.time.offset", put_back=movements.end)
