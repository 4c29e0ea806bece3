"""What a wizard is made of, and what it is made from."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

from rhot_app.calibration.proposal import Proposal
from rhot_app.calibration.registry import CALIBRATIONS, Calibration
from rhot_app.project import Rig
from rhot_app.ui.backend.contract import Asker, Listener
from rhot_app.ui.backend.solver import Solver
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.wizards.framework.page import AcceptPage, Page
from rhot_app.ui.wizards.models.step import AcceptStep, SolveStep

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
    """What every wizard is given: the rig in force, its file (None: it came from none), a way to ask the engine, the
    colours of the screen, and what was entered before. Node settings by node id are as the nodes gave them when the
    wizard was opened. `listen` makes a client that hears the hand's states, for wizards that calibrate by a moving
    hand; `make_solver` what runs their long work."""

    rig: Rig
    rig_path: Path | None
    connect: Callable[[], Asker]
    scheme: Scheme
    memory: SettingsStore
    node_settings: dict[int, dict[str, Any]] = field(default_factory=dict)
    listen: Callable[[], Listener] | None = None
    make_solver: Callable[[], Solver] = Solver


@dataclass(frozen=True, slots=True)
class Definition:
    """A wizard ready to be shown: its pages in order, the last one an `AcceptPage`. `guide` is its page in the guide,
    where a section has the wizard's title;
    `solver` a module that the solving process should import in good time; `put_back` undoes in a worker what the wizard
    has tried out, when it is closed without being used."""

    title: str
    pages: tuple[Page, ...]
    guide: str = "calibration"
    solver: str = ""
    put_back: Callable[[], object] | None = None


def accept_page(context: WizardContext, propose: Callable[[], Proposal | None],
                missing: str = "There is no result yet.") -> AcceptPage:
    """The last page of a wizard: what `propose` gives, beside what is in force."""
    return AcceptPage(AcceptStep(propose, context.rig_path, missing), context.scheme)


def accept_result(context: WizardContext, solve: SolveStep, propose: Callable[[Any], Proposal | None],
                  missing: str = "There is no result yet.") -> AcceptPage:
    """The same with what `propose` makes of the result of `solve`."""
    return accept_page(context, lambda: None if solve.result is None else propose(solve.result), missing)


# -- All wizards -------------------------------------------------------------------------------------------------------

class Wizard(Calibration):
    """A calibration with a wizard: the module of its name in this package has ``make_wizard(context)``."""

    __slots__ = ()

    def load(self) -> None:
        """Import what it needs; takes a moment the first time, so call it in a worker."""
        importlib.import_module(f"rhot_app.ui.wizards.{self.name}")

    def make_wizard(self, context: WizardContext) -> Definition:
        """Its pages for the rig at hand."""
        made: Definition = importlib.import_module(f"rhot_app.ui.wizards.{self.name}").make_wizard(context)
        return made


OPEN_WIZARD = "wizard "
"""A notice's key that opens the wizard of the calibration that it names."""

WIZARDS = tuple(Wizard(*one) for one in CALIBRATIONS)


def wizard_named(name: str) -> Wizard | None:
    """The wizard of that calibration; None when there is none."""
    return next((wizard for wizard in WIZARDS if wizard.name == name), None)
