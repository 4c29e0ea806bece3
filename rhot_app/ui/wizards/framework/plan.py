"""What a wizard is made of, and what it is made from."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

from rhot_app.project import Rig
from rhot_app.ui.backend.contract import Asker, Listener
from rhot_app.ui.backend.solver import Solver
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.wizards.framework.page import Page

# -- What wizards remember between runs --------------------------------------------------------------------------------

class Memory(Protocol):
    """`rhot_app.ui.common.settings.Settings` is one."""

    def remembered(self, name: str) -> str:
        """What was remembered by this name, "" for nothing."""
        ...

    def remember(self, name: str, text: str) -> None:
        """Remember something by this name."""
        ...


# -- What a wizard is made of, and what it is made from ----------------------------------------------------------------

@dataclass(frozen=True, slots=True)
class Kit:
    """What every wizard is given: the rig in force, its file (None: it came from none), a way to ask the engine, the
    colours of the screen, and what was entered before. Node settings by node id are as the nodes gave them when the
    wizard was opened. `listen` makes a client that hears the hand's states, for wizards that calibrate by a moving
    hand; `make_solver` what runs their long work."""

    rig: Rig
    rig_path: Path | None
    connect: Callable[[], Asker]
    scheme: Scheme
    memory: Memory
    node_settings: dict[int, dict[str, Any]] = field(default_factory=dict)
    listen: Callable[[], Listener] | None = None
    make_solver: Callable[[], Solver] = Solver


@dataclass(frozen=True, slots=True)
class Plan:
    """A wizard ready to be shown: its pages in order, the last one an `AcceptPage`. `guide` is its page in the guide,
    where a section has the wizard's title;
    `solver` a module that the solving process should import in good time; `put_back` undoes in a worker what the wizard
    has tried out, when it is closed without being used."""

    title: str
    pages: tuple[Page, ...]
    guide: str = "calibration"
    solver: str = ""
    put_back: Callable[[], None] | None = None


# -- All wizards, in the order in which a new rig needs them -----------------------------------------------------------

@dataclass(frozen=True, slots=True)
class Wizard:
    """One wizard. `module` in this package has ``make_plan(kit)``; `reason` begins what it writes into a rig's history,
    so that the menu can tell when it was used last."""

    module: str
    title: str
    meaning: str
    reason: str

    def load(self) -> None:
        """Import what it needs; takes a moment the first time, so call it in a worker."""
        importlib.import_module(f"rhot_app.ui.wizards.{self.module}")

    def make_plan(self, kit: Kit) -> Plan:
        """Its pages for the rig at hand."""
        plan: Plan = importlib.import_module(f"rhot_app.ui.wizards.{self.module}").make_plan(kit)
        return plan


OPEN_WIZARD = "wizard "
"""A notice's key that opens the wizard whose module it names."""

WIZARDS: tuple[Wizard, ...] = (
    Wizard("camera", "Set the cameras", "Exposure, gains, white balance: what each camera is told, tried out live.",
           "camera settings"),
    Wizard("lens", "Intrinsics of a camera", "Focal length, centre and distortion of one camera's lens, from a board "
           "that is held all over its picture.", "intrinsics of"),
    Wizard("stereo", "Stereo calibration", "Where the cameras stand to each other and to the table, from a board "
           "that they see at the same time.", "stereo calibration"),
    Wizard("refined", "Use refined calibration", "How the cameras stand now, from the hand that moves while it is "
           "tracked.", "refined calibration"),
    Wizard("colours", "Colours of the markers", "Which colour each marker has, and what may be mistaken for it.",
           "colour calibration"),
    Wizard("foreground", "Background and skin", "What the empty scene and your skin look like, so that a bare hand can "
           "be tracked.", "background and skin"),
    Wizard("adapted", "Adapt the hand's shape", "How long and how thick the fingers are, from a bare hand that moves "
           "while it is tracked.", "hand adapted while it was tracked"),
    Wizard("measured", "Use measured bones", "How long the bones are, from the landmarks of a hand that two cameras "
           "see while it is tracked.", "bones measured while the hand was tracked"),
    Wizard("time", "Time of the cameras", "When each camera sees, from a hand that waves.", "time calibration"),
    Wizard("depth", "Depth without a board", "Distance from disparity, from a marker at measured distances.",
           "depth calibration"),
    Wizard("bones", "Bones of the hand", "How long the bones are, from a minute of movement or by a ruler.",
           "bones calibration"),
    Wizard("filters", "Filters", "How much jitter and how much lag, from a hand held still and one that moves fast.",
           "filter tuning"),
    Wizard("alignment", "Alignment with another tracker", "Where a Vive tracker's world is in the rig, from a movement "
           "of both.", "alignment with another tracker"),
    Wizard("certificate", "Certificate", "How good this rig is, measured as the thesis did, with 95 % intervals: five "
           "minutes.", "certificate"),
)


def wizard_named(module: str) -> Wizard | None:
    """The wizard of that module; None when there is none."""
    return next((wizard for wizard in WIZARDS if wizard.module == module), None)
