"""What is asked of an export, and what every writer of a format gets and does."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Protocol

from rhot_app.export.frames import Frame
from rhot_app.export.states import HandStates
from rhot_app.project import Rig

Units = Literal["mm", "m"]
Tracker = Literal["classic", "estimator"]
Hand = Literal["hand", "other_hand"]


@dataclass(frozen=True, slots=True)
class ExportOptions:
    """How a recording is exported. None leaves a choice to the rig (`tracker`) or to the format (`rate_hz`, `units`).

    `hand`: which of the rig's hands a format gets that holds a single one (BVH). `smooth`: every state uses the whole
    recording, not only what came before it; the estimator alone can. `fill_s`: gaps up to this length are filled
    (`rhot_app.export.gaps`); None: none is.
    """

    tracker: Tracker | None = None
    rate_hz: float | None = None
    frame: Frame = "rig"
    units: Units | None = None
    hand: Hand = "hand"
    smooth: bool = False
    fill_s: float | None = None


@dataclass(frozen=True, slots=True)
class Plan:
    """What a writer knows before the first state. `path`: of the file to write, which is renamed when it is whole."""

    path: Path
    rig: Rig
    frame: Frame
    units: Units
    hand: Hand
    rate_hz: float | None  # of states at equal intervals; None: they come at their own times
    log: str  # name of the log
    created: str  # when it was begun, UTC
    first_ns: int  # master's time of the first state
    smooth: bool = False  # whether states use what came after them
    wall_clock_offset_ns: int | None = None  # ns since 1970 less the master's clock; None: unknown

    @property
    def scale(self) -> float:
        """The file's unit of length per metre."""
        return 1000.0 if self.units == "mm" else 1.0

    def about(self) -> dict[str, str]:
        """What formats with room for it say of themselves."""
        began = self.wall_clock_offset_ns
        return {"log": self.log, "created": self.created, "rig": self.rig.name, "tracker": self.rig.tracker.kind,
                "frame": self.frame, "up": self.rig.up, "units": self.units, "smoothed": "yes" if self.smooth else "no",
                "first_t_master_ns": str(self.first_ns),
                "first_t_unix_ns": "" if began is None else str(self.first_ns + began)}


class Writer(Protocol):
    """Writes one file. `notes` are sentences for the operator about what the format cannot hold."""

    notes: list[str]

    def add(self, states: HandStates) -> None:
        """Take the next states."""
        ...

    def finish(self) -> None:
        """Write what is left; the file is whole then."""
        ...

    def close(self) -> None:
        """Let go of the file, whole or not. May be called twice."""
        ...


@dataclass(frozen=True, slots=True)
class Format:
    """A format. `title`: what it is called where somebody chooses one. `endings` of its files, the first of which is
    given to new ones. `units`: of length, unless others may be chosen (`units_free`). `uniform`: it has a rate instead
    of times. `says_knowledge`: it says how every value is known."""

    name: str
    title: str
    writer: Callable[[Plan], Writer]
    endings: tuple[str, ...]
    units: Units
    units_free: bool = True
    uniform: bool = False
    says_knowledge: bool = False
