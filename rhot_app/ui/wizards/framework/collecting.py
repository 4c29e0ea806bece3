"""The wizard of a calibration that names what it collects: all pages follow from its record."""

from __future__ import annotations

from typing import Any

from rhot_app.calibration.collect import Bar, Measurements, Movement, WhileTracking
from rhot_app.ui.language import tr
from rhot_app.ui.wizards.framework.definition import Definition, WizardContext, accept_result
from rhot_app.ui.wizards.framework.movement import Movements, MovementStep
from rhot_app.ui.wizards.framework.page import ChartPage, Page
from rhot_app.ui.wizards.framework.step import Pictures, SolveStep, Step, StepView
from rhot_app.ui.wizards.framework.while_tracking import ask_engine


def make_wizard(context: WizardContext) -> Definition:
    """A page for each thing to collect, then the result, then before and after."""
    movements: Movements | None = None
    pages: list[Page] = []
    for one in context.calibration.collect:
        if isinstance(one, WhileTracking):
            return ask_engine(context, one)
        if isinstance(one, Movement):
            movements = movements or Movements(context)
            pages.append(movements.page(one))
        else:
            pages.append(Page(MeasurementStep(one)))

    def observations() -> tuple[Any, ...] | None:
        found = tuple(_collected(page.step) for page in pages)
        return None if None in found else found

    solve = SolveStep(context.calibration, context.now, observations, f"{tr(context.calibration.title)} …")
    accept = accept_result(context, solve, tr("Go back: something was not recorded yet."))
    return Definition((*pages, ChartPage(solve, context.scheme), accept), None if movements is None else movements.end)


def _collected(step: Step) -> Any:
    """What a step has collected, None for nothing."""
    if isinstance(step, MovementStep):
        return step.log
    assert isinstance(step, MeasurementStep)
    return step.found or None


class MeasurementStep(Step):
    """Keeps what is found in the pictures whenever Space is pressed."""

    watches = captures = True

    def __init__(self, what: Measurements) -> None:
        self.title = what.title
        self.found: tuple[Any, ...] = ()
        self._what = what
        self._newest: Any = None

    def observe(self, pictures: Pictures) -> Any:
        """What the calibration finds in them."""
        return self._what.measure({name: picture.bgr for name, picture in pictures.items()})

    def accept_observation(self, seen: Any) -> None:
        """What Space would keep."""
        self._newest = seen

    def capture(self) -> bool:
        """Keep it."""
        self.found += () if self._newest is None else (self._newest,)
        return self._newest is not None

    def undo(self) -> bool:
        """Forget the last one."""
        had, self.found = bool(self.found), self.found[:-1]
        return had

    @property
    def keeps(self) -> bool:
        """Whether anything was kept."""
        return bool(self.found)

    def view(self) -> StepView:
        """How many there are."""
        count, wanted = len(self.found), self._what.count
        return StepView(tr("Enough: press Next.") if count >= wanted else self._what.sentence, done=count >= wanted,
                        bars=(Bar(tr("taken"), count / wanted, tr("{count} of {wanted}", count=count, wanted=wanted)),),
                        kept=count)
