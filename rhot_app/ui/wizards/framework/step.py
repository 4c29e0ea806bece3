"""One step of a wizard without its widgets: what to do now, what is seen, whether it is done.

The window calls `observe` in a worker's thread and everything else in its own; only `observe` may take longer than a
few milliseconds, and it must not change the step.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from rhot_app.calibration.collect import Bar
from rhot_app.calibration.proposal import Change, Command, Proposal
from rhot_app.calibration.registry import Calibration, InForce
from rhot_app.calibration.report import Report
from rhot_app.calibration.verdict import Verdict
from rhot_app.charts import Chart
from rhot_app.ui.backend.feed import Picture
from rhot_app.ui.language import tr, tr_noop
from rhot_app.ui.models.proposal import changes_of, restore_all, use_all
from rhot_app.ui.wizards.framework.drawing import Overlay

Pictures = Mapping[str, Picture]
"""One picture per camera's name, taken as nearly at the same time as the nodes deliver them."""


@dataclass(frozen=True, slots=True)
class Task:
    """Long work: ``function(*arguments, progress=...)`` runs in a process of its own, so all must pickle.

    `function` stands in a module without Qt and takes a `rhot_app.progress.Progress`.
    """

    title: str
    function: Callable[..., Any]
    arguments: tuple[Any, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class AnnotatedPicture:
    """A picture and what was found in this very picture."""

    picture: Picture
    overlay: Overlay = ()


@dataclass(frozen=True, slots=True)
class StepView:
    """Everything that is shown of a step at one moment.

    `done` ticks it off and lets the person go on, never with a `verdict` that forbids to use the result: the sentence
    then says so. `passable` lets them go on although more would be better. `hint` says why Next must wait. By camera:
    `annotated`, what was found in the last picture that was looked at; `overlays`, what is drawn over any picture;
    `pictures`, shown instead of the live ones. `kept` counts what was captured: the pictures light up when it grows.
    """

    sentence: str
    done: bool = False
    hint: str = ""
    bars: tuple[Bar, ...] = ()
    verdict: Verdict | None = None
    annotated: Mapping[str, AnnotatedPicture] = field(default_factory=dict)
    overlays: Mapping[str, Overlay] = field(default_factory=dict)
    pictures: Mapping[str, Picture] = field(default_factory=dict)
    kept: int = 0
    passable: bool = False

    def __post_init__(self) -> None:
        if self.done and self.verdict is not None and not self.verdict.acceptable:
            object.__setattr__(self, "done", False)
            object.__setattr__(self, "sentence", tr("Mend what the verdict says."))

    @property
    def may_go_on(self) -> bool:
        """Whether Next means something."""
        return self.done or self.passable


class Step:
    """Base of all steps. `title` stands in the list at the left; `cameras` are those whose pictures are shown (None:
    all of the rig's); `watches` says whether `observe` wants pictures; `captures` whether the space bar means
    something."""

    title = ""
    cameras: tuple[str, ...] | None = None
    watches = False
    captures = False

    def enter(self) -> None:
        """The person comes to this step, from either side."""

    def view(self) -> StepView:
        """What to show now; called many times a second."""
        return StepView(self.title)

    def observe(self, pictures: Pictures) -> Any:
        """Look at pictures, in a worker's thread; what is returned is handed to `accept_observation`."""
        return None

    def accept_observation(self, seen: Any) -> None:
        """What `observe` has found."""

    def capture(self) -> bool:
        """Space: keep what is seen now; whether something was kept."""
        return False

    def undo(self) -> bool:
        """Ctrl+Z outside text fields: take the last thing back; whether there was one."""
        return False

    @property
    def keeps(self) -> bool:
        """Whether closing the wizard now would lose what the person did here."""
        return False

    def task(self) -> Task | None:
        """Long work that this step still needs; asked on entering, and after every change of the step."""
        return None

    def take_result(self, result: Any) -> None:
        """What the task returned."""

    def take_failure(self, sentence: str) -> None:
        """Why the task failed."""


class ChartedStep(Step):
    """A step with charts instead of pictures."""

    @property
    def charts(self) -> tuple[Chart, ...]:
        """What is shown; the same objects until something changes."""
        return ()


# -- Step: solve -------------------------------------------------------------------------------------------------------

@dataclass(frozen=True, slots=True, eq=False)
class Done:
    """A result for which no work is needed."""

    result: Any


class SolveStep(ChartedStep):
    """Solves a calibration whenever the step is entered with other observations than before.

    `result` is what came of it, `report` what the calibration says of it. Subclasses show it over pictures.
    """

    advice = tr_noop("Look at the result, then go on.")

    def __init__(self, calibration: Calibration, now: InForce,
                 observations: Callable[[], tuple[Any, ...] | Done | None], working: str,
                 title: str = tr_noop("Result"), missing: str = tr_noop("Go back: nothing was recorded yet.")) -> None:
        """`observations` are the arguments of ``calibration.solve``, None while something is `missing`; equal ones are
        not solved again. `working` is said meanwhile."""
        self.title = title
        self.working = working
        self.result: Any = None
        self.report: Report | None = None
        self._calibration = calibration
        self._now = now
        self._observations = observations
        self._missing = missing
        self._work: Task | Done | None = None
        self._problem = ""

    def describe(self, result: Any) -> Report:
        """What the calibration says of a result."""
        assert self._calibration.report is not None
        return self._calibration.report(result, self._now)

    def _make_work(self) -> Task | Done | None:
        found = self._observations()
        if found is None or isinstance(found, Done):
            return found
        assert self._calibration.solve is not None
        return Task(self.working, self._calibration.solve, (*found, self._now))

    @property
    def charts(self) -> tuple[Chart, ...]:
        """Of the report."""
        return self.report.charts if self.report is not None else ()

    @property
    def keeps(self) -> bool:
        """A result is worth a question."""
        return self.result is not None

    def enter(self) -> None:
        """What was collected may have changed."""
        if self._make_work() != self._work:
            self.begin()

    def begin(self) -> None:
        """Do the work anew."""
        self._work, self.result, self.report, self._problem = self._make_work(), None, None, ""
        if isinstance(self._work, Done):
            self.take_result(self._work.result)

    def task(self) -> Task | None:
        """The work, until there is a result."""
        return self._work if self.result is None and isinstance(self._work, Task) else None

    def take_result(self, result: Any) -> None:
        """What came of it."""
        self.result, self.report, self._problem = result, self.describe(result), ""

    def report_again(self) -> None:
        """The same result is to be said in another way."""
        if self.result is not None:
            self.report = self.describe(self.result)

    def take_failure(self, sentence: str) -> None:
        """Why there is none."""
        self._problem = sentence

    def view(self) -> StepView:
        """The verdict, once there is one."""
        if self.report is None:
            return StepView(self._missing if self._work is None else tr("It did not work out.") if self._problem
                            else tr("One moment."), hint=self._problem)
        verdict = self.report.verdict
        return StepView(self.advice if verdict.acceptable else tr("Read what is wrong, then go back."),
                        done=verdict.acceptable, verdict=verdict)


# -- Step: accept or restore, the last of every wizard -----------------------------------------------------------------

State = Literal["proposed", "under way", "used", "restored"]


class AcceptStep(Step):
    """Shows what `propose` gives when the step is entered. `apply` and `take_back` wait: call them in a worker, between
    `begin` and `finish`."""

    title = tr_noop("Before and after")
    use_label = tr_noop("Use this calibration")

    def __init__(self, propose: Callable[[], Proposal | None], path: Path | None,
                 missing: str = tr_noop("There is no result yet.")) -> None:
        """`path` is the rig's file. `missing` is shown while `propose` gives None."""
        self._propose = propose
        self._path = path
        self._missing = missing
        self.proposal: Proposal | None = None
        self.state: State = "proposed"
        self.problem = ""

    def enter(self) -> None:
        """Another result may have come since."""
        proposal = self._propose()
        if proposal != self.proposal:
            self.proposal, self.state, self.problem = proposal, "proposed", ""

    @property
    def changes(self) -> tuple[Change, ...]:
        """What the proposal changes."""
        return changes_of(self.proposal, self._path) if self.proposal is not None else ()

    @property
    def usable(self) -> bool:
        """Whether it may be put into force now."""
        return (self.proposal is not None and self.proposal.verdict.acceptable
                and self.state in ("proposed", "restored"))

    @property
    def restorable(self) -> bool:
        """Whether the old state can be brought back now."""
        return self.state == "used"

    @property
    def keeps(self) -> bool:
        """A result that was neither used nor refused would be lost."""
        return self.usable and self.state == "proposed"

    def begin(self) -> None:
        """Something is being put into force or taken back."""
        self.state, self.problem = "under way", ""

    def finish(self, state: State, problem: str = "") -> None:
        """It has ended so."""
        self.state, self.problem = state, problem

    def apply(self, command: Command) -> None:
        """Put the proposal into force; raises RhotError."""
        use_all(self.changes, command)

    def take_back(self, command: Command) -> None:
        """Bring back what was before; raises RhotError."""
        restore_all(self.changes, command)

    def view(self) -> StepView:
        """One sentence for each state."""
        verdict = self.proposal.verdict if self.proposal is not None else None
        afterwards = self.proposal.afterwards if self.proposal is not None and self.state == "used" else ""
        return StepView(self._sentence(), done=self.state == "used", hint=self.problem or afterwards, verdict=verdict)

    def _sentence(self) -> str:
        if self.proposal is None:
            return self._missing
        if self.state == "under way":
            return tr("One moment.")
        if self.state == "used":
            return tr("It is in use and saved.")
        if self.state == "restored":
            return tr("The old one is back.")
        if not self.proposal.verdict.acceptable:
            return tr("This must not be used: go back and mend what the verdict says.")
        return tr("Compare, then use this calibration or go back.")
