"""What a calibration would change: the rig before and after with its figures side by side, and what else is set."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from rhot_app import rig_history
from rhot_app.calibration.report import Figure, Report
from rhot_app.calibration.rig_figures import figures_of
from rhot_app.calibration.verdict import Verdict
from rhot_app.project import Rig

Command = Callable[..., dict[str, Any]]
"""``command(name, **arguments)`` of the engine; raises EngineError."""

Rgb = tuple[int, int, int]


@dataclass(frozen=True, slots=True)
class Row:
    """One line of a comparison: what, how it is now, how it would be; units inside the texts. `swatches`: the colours
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
    """Something beside the rig that is put into force, and can be taken back. Both may wait: call them in a worker."""

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
class NodeChange:
    """Other settings of one node: at once, and in its own file. Only the fields that differ are sent."""

    node_id: int
    before: dict[str, Any]
    after: dict[str, Any]

    def use(self, command: Command) -> None:
        """The new settings."""
        self._set(command, self.after)

    def restore(self, command: Command) -> None:
        """The old settings."""
        self._set(command, self.before)

    @property
    def way_back(self) -> str:
        """Nodes have no history."""
        return "The nodes keep no earlier settings: these can be brought back here, until this window closes."

    def _set(self, command: Command, settings: dict[str, Any]) -> None:
        command("node", node_id=self.node_id, request={"request": "set_settings", "settings": settings})


@dataclass(frozen=True, slots=True)
class Proposal:
    """What comes of a calibration. `reason` goes into the rig's history; `verdict` decides whether it may be used.

    `rig` would take the place of `rig_before`; both are None where the rig stays as it is. `changes` are made beside
    it. `afterwards` says what to do next once it is in use.
    """

    reason: str
    verdict: Verdict
    rows: tuple[Row, ...]
    rig_before: Rig | None = None
    rig: Rig | None = None
    changes: tuple[Change, ...] = ()
    afterwards: str = ""

    def save(self, path: Path | None) -> str:
        """Write the rig, what was there before kept; the file's name, "" where it may not be used or there is no
        `path`. Raises RigError."""
        if path is None or self.rig is None or not self.verdict.acceptable:
            return ""
        rig_history.accept(path, self.rig, self.reason)
        return str(path)


def proposed(reason: str, report: Report, before: Rig, after: Rig, *, changes: tuple[Change, ...] = (),
             rows: tuple[Row, ...] = (), afterwards: str = "") -> Proposal:
    """The proposal of another rig, with the figures of the report first, and `rows` of what the rig does not hold."""
    return Proposal(reason, report.verdict, (*rows_of(before, after, report.figures), *rows), before, after, changes,
                    afterwards)


def rows_of(before: Rig, after: Rig, figures: Iterable[Figure] = ()) -> tuple[Row, ...]:
    """Each of the result's `figures` beside the rig's of the same name; then every other one in which the rigs differ,
    in the order of the rig file. What stays as it is has no row; a figure that one rig lacks is a dash."""
    old, new = ({one.name: one.brief for one in figures_of(rig)} for rig in (before, after))
    rows = {one.name: Row(one.name, old.get(one.name, ""), one.brief) for one in figures if one.name}
    names = [name for name in (*new, *(name for name in old if name not in new)) if name not in rows]
    others = (Row(name, old.get(name, "–"), new.get(name, "–")) for name in names)
    return tuple(row for row in (*rows.values(), *others) if row.changed)
