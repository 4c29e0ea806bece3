"""What a wizard proposes in the end: figures before and after, and the changes that make it so and unmake it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, Protocol

import msgspec

from rhot_app import rig_history
from rhot_app.calibration.verdict import Verdict
from rhot_app.engine.compilation import TITLE, compile_part, is_missing, part_of
from rhot_app.errors import RhotError
from rhot_app.project import Rig
from rhot_node.files import read_input

Command = Callable[..., dict[str, Any]]
"""``command(name, **arguments)`` of the engine; raises EngineError."""

Rgb = tuple[int, int, int]

RESTORING = "restoring"
"""First word of the reason of every restore in a rig's history (`rhot_app.rig_history.restore` begins so too)."""


@dataclass(frozen=True, slots=True)
class Row:
    """One line of the last page: what, how it is now, how it would be; units inside the texts. `swatches`: the colours
    before and after, RGB 0..255."""

    what: str
    before: str
    after: str
    swatches: tuple[Rgb, Rgb] | None = None

    @property
    def changed(self) -> bool:
        """Whether there is a difference."""
        return self.before != self.after


class Change(Protocol):
    """Something that is put into force, and can be taken back afterwards. Both may wait: call them in a worker."""

    def use(self, command: Command) -> None:
        """Put it into force; raises RhotError, and nothing has changed then."""
        ...

    def restore(self, command: Command) -> None:
        """Bring back what was there before; raises RhotError."""
        ...

    @property
    def way_back(self) -> str:
        """A sentence: until when, and how, what is there now can be brought back."""
        ...


@dataclass(frozen=True, slots=True)
class RigChange:
    """Another rig: in the engine at once, and in its file with the old version kept. `path` None: it came from no file,
    and lasts until the engine ends."""

    before: Rig
    after: Rig
    path: Path | None
    reason: str

    def use(self, command: Command) -> None:
        """The new rig in the engine, then in the file."""
        self._change(command, self.before, self.after, self.reason)

    def restore(self, command: Command) -> None:
        """The old rig in the engine and in the file."""
        self._change(command, self.after, self.before, f"{RESTORING} what was before the {self.reason}")

    @property
    def way_back(self) -> str:
        """Only a file has a history."""
        if self.path is None or not self.path.exists():
            return "This rig has no file, so nothing is kept: it can be brought back here, until this window closes."
        return ("What is in the rig file now is kept, and can be brought back at any time with Calibrate, Bring back "
                "an earlier calibration.")

    def _change(self, command: Command, old: Rig, new: Rig, reason: str) -> None:
        set_rig(command, new)
        if self.path is not None:
            try:
                rig_history.accept(self.path, new, reason)
            except RhotError:
                set_rig(command, old)
                raise


@dataclass(frozen=True, slots=True)
class NodeChange:
    """Other settings of one node: at once, and in its own file. Only the fields that differ are sent."""

    node_id: int
    before: dict[str, Any]
    after: dict[str, Any]

    def use(self, command: Command) -> None:
        """The new settings."""
        _set_node(command, self.node_id, self.after)

    def restore(self, command: Command) -> None:
        """The old settings."""
        _set_node(command, self.node_id, self.before)

    @property
    def way_back(self) -> str:
        """Nodes have no history."""
        return "The nodes keep no earlier settings: these can be brought back here, until this window closes."


@dataclass(frozen=True, slots=True)
class Proposal:
    """The result of a wizard. `verdict` decides whether it may be used at all; `afterwards` says what to do next once
    it is in use."""

    reason: str
    verdict: Verdict
    rows: tuple[Row, ...]
    changes: tuple[Change, ...] = field(default=())
    afterwards: str = ""

    def use(self, command: Command) -> None:
        """Make all changes, or none: what was made is taken back when a later one fails. Raises RhotError."""
        made: list[Change] = []
        try:
            for change in self.changes:
                change.use(command)
                made.append(change)
        except RhotError:
            for change in reversed(made):
                change.restore(command)
            raise

    def restore(self, command: Command) -> None:
        """Take all changes back, the last one first; raises RhotError."""
        for change in reversed(self.changes):
            change.restore(command)

    @property
    def ways_back(self) -> str:
        """How what is there now can be brought back, each way once."""
        return " ".join(dict.fromkeys(change.way_back for change in self.changes)) or "Nothing changes."

    @property
    def rig(self) -> Rig | None:
        """The rig that would be in force; None when the rig stays as it is."""
        rigs = [change.after for change in self.changes if isinstance(change, RigChange)]
        return rigs[-1] if rigs else None

    @property
    def rig_before(self) -> Rig | None:
        """The rig that a restore brings back; None when the rig stays as it is."""
        rigs = [change.before for change in self.changes if isinstance(change, RigChange)]
        return rigs[0] if rigs else None


def progress_text(rig: Rig) -> str:
    """What happens while `set_rig` runs."""
    return f"{TITLE}. Then the engine changes over." if is_missing(part_of(rig)) else "The engine changes over …"


def set_rig(command: Command, rig: Rig) -> None:
    """Have the engine go on with `rig`, whose tracker is compiled first: the engine tracks meanwhile. Raises
    EngineError."""
    compile_part(part_of(rig), lambda text, fraction: None)
    command("set_rig", document=msgspec.to_builtins(rig))


def _set_node(command: Command, node_id: int, settings: dict[str, Any]) -> None:
    command("node", node_id=node_id, request={"request": "set_settings", "settings": settings})


# -- Calibrations in force, by the rig file's history ------------------------------------------------------------------

def in_force(path: Path) -> dict[str, datetime]:
    """Time of the last calibration by its reason, as far as it is still in force: one that a restore took away is not,
    and one that a restore brought back is. Empty for a rig file without a history."""
    versions = list(reversed(rig_history.versions(path)))  # oldest first; each file is the state before its event
    texts = [_text(version.path) for version in versions] + [_text(path)]
    states: list[dict[str, datetime]] = [{}]
    for number, version in enumerate(versions):
        after = texts[number + 1]
        if version.replaced_by.startswith(RESTORING):
            earlier = [k for k in range(number + 1) if texts[k] == after]
            states.append(dict(states[earlier[-1]]) if earlier else {})
        else:
            states.append({**states[-1], version.replaced_by: version.replaced_at})
    return states[-1]


def age_text(when: datetime, now: datetime | None = None) -> str:
    """How long ago in words: "today", "yesterday", "5 days ago", "3 months ago"."""
    days = ((now or datetime.now(UTC)).astimezone().date() - when.astimezone().date()) // timedelta(days=1)
    if days <= 0:
        return "today"
    if days == 1:
        return "yesterday"
    if days < 60:
        return f"{days} days ago"
    return f"{days // 30} months ago"


def _text(path: Path) -> bytes:
    try:
        return read_input(path)
    except OSError:
        return b""
