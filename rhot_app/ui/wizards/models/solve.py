"""The step in which the computer works: one task, its report's verdict and charts."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rhot_app.calibration.verdict import Verdict
from rhot_app.ui.wizards.models.chart import Chart, ChartedStep
from rhot_app.ui.wizards.models.step import StepView, Task


class SolveStep(ChartedStep):
    """Asks `make_task` for its work whenever it is entered with other input than before; `report` is the result."""

    def __init__(self, make_task: Callable[[], Task | None], verdict_of: Callable[[Any], Verdict],
                 charts_of: Callable[[Any], tuple[Chart, ...]] = lambda report: (), title: str = "Result") -> None:
        """`make_task` gives None while something is missing; tasks with equal arguments are the same work."""
        self.title = title
        self.report: Any = None
        self.charts: tuple[Chart, ...] = ()
        self._make_task = make_task
        self._verdict_of = verdict_of
        self._charts_of = charts_of
        self._task: Task | None = None
        self._problem = ""

    @property
    def keeps(self) -> bool:
        """A report is worth a question."""
        return self.report is not None

    def enter(self) -> None:
        """What was collected may have changed."""
        task = self._make_task()
        if task != self._task:
            self._task, self.report, self.charts, self._problem = task, None, (), ""

    def task(self) -> Task | None:
        """The work, until there is a report."""
        return self._task if self.report is None else None

    def take_result(self, result: Any) -> None:
        """The report."""
        self.report, self.charts, self._problem = result, self._charts_of(result), ""

    def take_failure(self, sentence: str) -> None:
        """Why there is none."""
        self._problem = sentence

    def view(self) -> StepView:
        """The verdict, once there is one."""
        if self.report is None:
            return StepView("Go back: nothing was recorded yet." if self._task is None else
                            "It did not work out." if self._problem else "One moment.", hint=self._problem)
        verdict = self._verdict_of(self.report)
        sentence = "Look at the result, then go on." if verdict.acceptable else "Read what is wrong, then go back."
        return StepView(sentence, done=True, verdict=verdict)
