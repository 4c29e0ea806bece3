"""What the steps of a calibration collect, without the window that shows them.

A calibration that names its steps so needs no wizard of its own: `rhot_app.ui.wizards.framework.collecting` makes the
pages.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from rhot_app.calibration.verdict import Verdict
    from rhot_app.state import HandState


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


class Guide(Protocol):
    """Watches a movement while it is recorded; a new one is made for every recording."""

    def watch(self, states: Sequence[HandState]) -> None:
        """See the newest states; called many times a second."""
        ...

    def bars(self) -> tuple[Bar, ...]:
        """What has been seen so far."""
        ...

    def sentence(self) -> str:
        """What to do now."""
        ...

    def shortfall(self) -> str:
        """What is missing in what was seen so far, as a sentence; "" when nothing is."""
        ...


@dataclass(frozen=True, slots=True)
class Movement:
    """A movement of `seconds`, of which the engine writes a raw log; the observation is the log's path.

    `sentence` says what to do before it begins, a new `guide` what to do meanwhile. `simulated`: what the simulated
    hand should do, as its menu says it.
    """

    title: str
    sentence: str
    seconds: float
    guide: Callable[[], Guide]
    simulated: str = ""


@dataclass(frozen=True, slots=True)
class Measurements:
    """What `measure` finds in the live pictures, (H, W, 3) BGR by camera, whenever a person presses Space; None for
    nothing. The observation is the list of what was found, of at least `count`."""

    title: str
    sentence: str
    measure: Callable[[Mapping[str, NDArray[np.uint8]]], Any]
    count: int


Answer = dict[str, Any]
"""Of an engine's command: `known`, `document` (the rig), `rows` and the fields of a verdict."""


@dataclass(frozen=True, slots=True)
class Said:
    """What to say of an answer: what to do, why it cannot be used yet, and whether it can."""

    sentence: str
    hint: str = ""
    done: bool = False


@dataclass(frozen=True, slots=True)
class WhileTracking:
    """What the engine finds of itself while it tracks: its answer to `command`, asked every second.

    The answer is proposed as it is, nothing is solved. `sentence` says what to do until there is one, `say` afterwards;
    `nothing` why there may be no proposal.
    """

    command: str
    title: str
    sentence: str
    say: Callable[[Answer, Verdict], Said]
    nothing: str
