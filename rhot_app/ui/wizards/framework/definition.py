"""What a wizard is made of, and what it is made from."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

from rhot_app.calibration.proposal import Proposal
from rhot_app.calibration.registry import Calibration, InForce
from rhot_app.project import Rig
from rhot_app.ui.backend.contract import Connect, Listener
from rhot_app.ui.backend.solver import Solver
from rhot_app.ui.language import tr_noop
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.wizards.framework.page import AcceptPage, Page
from rhot_app.ui.wizards.framework.step import AcceptStep, SolveStep

# -- What wizards remember between runs --------------------------------------------------------------------------------

class SettingsStore(Protocol):
    """`rhot_app.ui.common.settings.Settings` is one."""

    def remembered(self, name: str) -> str:
        """What was remembered by this name, "" for nothing."""
        ...

    def remember(self, name: str, text: str) -> None:
        """Remember something by this name."""
        ...


# -- What a wizard is made of, and what it is made from ----------------------------------------------------------------

@dataclass(frozen=True, slots=True)
class WizardContext:
    """What every wizard is given: its calibration, what is in force, a way to ask the engine, the colours of the
    screen, and what was entered before. Node settings are as the nodes gave them when the wizard was opened. `listen`
    makes a client that hears the hand's states, for wizards that calibrate by a moving hand; `make_solver` what runs
    their long work."""

    calibration: Calibration
    now: InForce
    connect: Connect
    scheme: Scheme
    memory: SettingsStore
    listen: Callable[[], Listener] | None = None
    make_solver: Callable[[], Solver] = Solver

    @property
    def rig(self) -> Rig:
        """The rig in force."""
        return self.now.rig


OPEN_WIZARD = "wizard "
"""A notice's key that opens the wizard of the calibration that it names."""


@dataclass(frozen=True, slots=True)
class Definition:
    """A wizard ready to be shown: its pages in order, the last one an `AcceptPage`. `put_back` undoes in a worker what
    the wizard has tried out, when it is closed without being used."""

    pages: tuple[Page, ...]
    put_back: Callable[[], object] | None = None


def accept_page(context: WizardContext, propose: Callable[[], Proposal | None],
                missing: str = tr_noop("There is no result yet.")) -> AcceptPage:
    """The last page of a wizard: what `propose` gives, beside what is in force."""
    return AcceptPage(AcceptStep(propose, context.now.path, missing), context.scheme)


def accept_result(context: WizardContext, solve: SolveStep, missing: str = tr_noop("There is no result yet."),
                  completed: Callable[[Any], Any] = lambda result: result) -> AcceptPage:
    """The same with what the calibration proposes of the result of `solve`, `completed` by what came after it."""
    def propose() -> Proposal | None:
        assert context.calibration.propose is not None
        return None if solve.result is None else context.calibration.propose(completed(solve.result), context.now)

    return accept_page(context, propose, missing)
