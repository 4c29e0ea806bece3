"""The time wizard: when each camera sees, from a waving hand."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rhot_app.calibration.commands.time import propose, report, solve_log
from rhot_app.calibration.registry import TIME
from rhot_app.state import HandState
from rhot_app.ui.wizards.framework.definition import Definition, WizardContext, accept_result
from rhot_app.ui.wizards.framework.movement_page import Movements
from rhot_app.ui.wizards.framework.page import ChartPage
from rhot_app.ui.wizards.models.step import Bar, SolveStep, Task

SECONDS = 20.0


def make_wizard(context: WizardContext) -> Definition:
    """Wave, look at the fit, use it."""
    movements, rig = Movements(context), context.rig
    wave = movements.page("Wave", "Press Record, then wave your hand up and down before the cameras for 20 seconds.",
                          SECONDS, WaveGuide)
    wave.twin_facts = "Waves briskly."
    solve = SolveStep(lambda: None if wave.movement.log is None else Task(
        "Comparing the cameras' times …", solve_log, (wave.movement.log, rig)), lambda result: report(result, rig))
    accept = accept_result(context, solve, lambda result: propose(result, rig, context.node_settings),
                           "Record a movement first.")
    return Definition(TIME.title, (wave, ChartPage(solve, context.scheme), accept),
                      solver="rhot_app.calibration.time.offset", put_back=movements.end)


_FAST_PX_S = 120.0  # a hand that crosses half the picture in two seconds
_REACH_PX = 250.0


class WaveGuide:
    """Tells whether the hand moves fast enough up and down: a delay shows as speed times time."""

    def __init__(self) -> None:
        self._speed_px_s = 0.0
        self._low, self._high = np.inf, -np.inf

    def watch(self, states: Sequence[HandState]) -> None:
        """Vertical speed and reach in the first camera."""
        if len(states) < 3:
            return
        rows = np.array([state.camera_pixels[0, :, 1] for state in states])
        t_s = 1e-9 * (np.array([state.t_master_ns for state in states]) - states[0].t_master_ns)
        if not np.isfinite(rows).any() or t_s[-1] <= 0.0:
            return
        step_s = np.maximum(np.diff(t_s), 1e-3)[:, None]
        speeds = np.abs(np.diff(rows, axis=0)) / step_s
        if np.isfinite(speeds).any():
            self._speed_px_s = float(np.nanmedian(speeds))
        self._low, self._high = min(self._low, float(np.nanmin(rows))), max(self._high, float(np.nanmax(rows)))

    def bars(self) -> tuple[Bar, ...]:
        """Speed now, and how much of the picture was used."""
        reach = max(self._high - self._low, 0.0) if np.isfinite(self._high - self._low) else 0.0
        return (Bar("speed", min(self._speed_px_s / _FAST_PX_S, 1.0), "how fast the markers move up and down now"),
                Bar("reach", min(reach / _REACH_PX, 1.0), "how much of the picture's height the markers have crossed"))

    def sentence(self) -> str:
        """Faster, farther, or go on."""
        if self._speed_px_s < _FAST_PX_S:
            return "Faster: up and down."
        return "Good, go on waving." if self._high - self._low >= _REACH_PX else "Good speed: wave farther up and down."

    def shortfall(self) -> str:
        """What the verdict tells better: the work says how well the times are known."""
        return ""
