"""The time wizard: when each camera sees, from a waving hand."""

from __future__ import annotations

from rhot_app.calibration.registry import TIME
from rhot_app.ui.wizards.framework.movement_page import Movements
from rhot_app.ui.wizards.framework.page import AcceptPage, ChartPage
from rhot_app.ui.wizards.framework.plan import Kit, Plan
from rhot_app.ui.wizards.models.step import AcceptStep, SolveStep, Task
from rhot_app.ui.wizards.steps.time_steps import SECONDS, WaveCoach, charts_of, propose, solve_log


def make_plan(kit: Kit) -> Plan:
    """Wave, look at the fit, use it."""
    movements = Movements(kit)
    wave = movements.page("Wave", "Press Record, then wave your hand up and down before the cameras for 20 seconds.",
                          SECONDS, WaveCoach)
    wave.twin_facts = "Waves briskly."
    movement = wave.movement

    def task() -> Task | None:
        log = movement.log
        return None if log is None else Task("Comparing the cameras' times …", solve_log, (log, kit.rig))

    solve = SolveStep(task, lambda report: report.verdict, charts_of)
    accept = AcceptStep(lambda: propose(solve.report, kit.rig, kit.rig_path, kit.node_settings),
                        "Record a movement first.")
    return Plan(TIME.title, (wave, ChartPage(solve, kit.scheme), AcceptPage(accept, kit.scheme)),
                solver="rhot_app.calibration.time.offset", put_back=movements.end)
