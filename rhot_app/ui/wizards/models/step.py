"""One step of a wizard without its widgets: what to do now, what is seen, whether it is done.

The window calls `see` in a worker's thread and everything else in its own; only `see` may take longer than a few
milliseconds, and it must not change the step.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from rhot_app.calibration.verdict import Verdict
from rhot_app.ui.wizards.feed import Picture
from rhot_app.ui.wizards.models.drawing import Overlay

Pictures = Mapping[str, Picture]
"""One picture per camera's name, taken as nearly at the same time as the nodes deliver them."""


@dataclass(frozen=True, slots=True)
class Bar:
    """One bar of progress: its name, how full it is (0..1), and what it means."""

    name: str
    fraction: float
    meaning: str = ""

    @property
    def full(self) -> bool:
        """Whether nothing is missing."""
        return self.fraction >= 1.0


@dataclass(frozen=True, slots=True)
class Task:
    """Long work: ``function(*arguments, progress=..., **options)`` runs in a process of its own, so all must pickle.

    `function` stands in a module without Qt and takes a `rhot_app.progress.Progress`.
    """

    title: str
    function: Callable[..., Any]
    arguments: tuple[Any, ...] = ()
    options: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class StepView:
    """Everything that is shown of a step at one moment.

    `done` ticks it off and lets the person go on; `passable` lets them go on although more would be better. `hint` says
    why Next must wait. `overlays` are by camera; `pictures` by camera are shown instead of the live ones. `kept` counts
    what was captured: the pictures light up when it grows.
    """

    sentence: str
    done: bool = False
    hint: str = ""
    bars: tuple[Bar, ...] = ()
    verdict: Verdict | None = None
    overlays: Mapping[str, Overlay] = field(default_factory=dict)
    pictures: Mapping[str, Picture] = field(default_factory=dict)
    kept: int = 0
    passable: bool = False

    @property
    def may_go_on(self) -> bool:
        """Whether Next means something."""
        return self.done or self.passable


class Step:
    """Base of all steps. `title` stands in the list at the left; `cameras` are those whose pictures are shown (None:
    all of the rig's); `watches` says whether `see` wants pictures; `captures` whether the space bar means something."""

    title = ""
    cameras: tuple[str, ...] | None = None
    watches = False
    captures = False

    def enter(self) -> None:
        """The person comes to this step, from either side."""

    def view(self) -> StepView:
        """What to show now; called many times a second."""
        return StepView(self.title)

    def see(self, pictures: Pictures) -> Any:
        """Look at pictures, in a worker's thread; what is returned is handed to `take`."""
        return None

    def take(self, seen: Any) -> None:
        """What `see` has found."""

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
