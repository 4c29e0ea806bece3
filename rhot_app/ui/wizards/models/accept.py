"""The last step of every wizard: before and after, then in force or not, and back again."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

from rhot_app.ui.wizards.models.proposal import Command, Proposal
from rhot_app.ui.wizards.models.step import Step, StepView

State = Literal["proposed", "under way", "used", "restored"]


class AcceptStep(Step):
    """Shows what `propose` gives when the step is entered. `apply` and `take_back` wait: call them in a worker, between
    `begin` and `finish`."""

    title = "Before and after"

    def __init__(self, propose: Callable[[], Proposal | None], missing: str = "There is no result yet.") -> None:
        """`missing` is shown while `propose` gives None."""
        self._propose = propose
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
        assert self.proposal is not None
        self.proposal.use(command)

    def take_back(self, command: Command) -> None:
        """Bring back what was before; raises RhotError."""
        assert self.proposal is not None
        self.proposal.restore(command)

    def view(self) -> StepView:
        """One sentence for each state."""
        verdict = self.proposal.verdict if self.proposal is not None else None
        afterwards = self.proposal.afterwards if self.proposal is not None and self.state == "used" else ""
        return StepView(self._sentence(), done=self.state == "used", hint=self.problem or afterwards, verdict=verdict)

    def _sentence(self) -> str:
        if self.proposal is None:
            return self._missing
        if self.state == "under way":
            return "One moment."
        if self.state == "used":
            return "It is in use and saved."
        if self.state == "restored":
            return "The old one is back."
        if not self.proposal.verdict.acceptable:
            return "This must not be used: go back and mend what the verdict says."
        return "Compare, then use this calibration or go back."
