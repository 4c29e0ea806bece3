"""Puts what a calibration proposes into force, in the engine and in files, and takes it back."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import msgspec

from rhot_app import rig_history
from rhot_app.calibration.proposal import Change, Command, Proposal
from rhot_app.engine.compilation import TITLE, compile_part, is_missing, part_of
from rhot_app.errors import RhotError
from rhot_app.project import Rig
from rhot_app.ui.language import tr


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
        self._change(command, self.after, self.before, f"{rig_history.RESTORING} what was before the {self.reason}")

    @property
    def way_back(self) -> str:
        """Only a file has a history."""
        if self.path is None or not self.path.exists():
            return tr("This rig has no file, so nothing is kept: it can be brought back here, until this window "
                      "closes.")
        return tr("What is in the rig file now is kept, and can be brought back at any time with Calibrate, Bring "
                  "back an earlier calibration.")

    def _change(self, command: Command, old: Rig, new: Rig, reason: str) -> None:
        set_rig(command, new)
        if self.path is not None:
            try:
                rig_history.accept(self.path, new, reason)
            except RhotError:
                set_rig(command, old)
                raise


def changes_of(proposal: Proposal, path: Path | None) -> tuple[Change, ...]:
    """All that a proposal changes; `path` is the rig's file."""
    if proposal.rig is None or proposal.rig_before is None:
        return proposal.changes
    return (*proposal.changes, RigChange(proposal.rig_before, proposal.rig, path, proposal.reason))


def use_all(changes: tuple[Change, ...], command: Command) -> None:
    """Make all changes, or none: what was made is taken back when a later one fails. Raises RhotError."""
    made: list[Change] = []
    try:
        for change in changes:
            change.use(command)
            made.append(change)
    except RhotError:
        restore_all(tuple(made), command)
        raise


def restore_all(changes: tuple[Change, ...], command: Command) -> None:
    """Take all changes back, the last one first; raises RhotError."""
    for change in reversed(changes):
        change.restore(command)


def ways_back(changes: tuple[Change, ...]) -> str:
    """How what is there now can be brought back, each way once."""
    return " ".join(dict.fromkeys(change.way_back for change in changes)) or tr("Nothing changes.")


def progress_text(rig: Rig) -> str:
    """What happens while `set_rig` runs."""
    if is_missing(part_of(rig)):
        return tr("{title}. Then the engine changes over.", title=TITLE)
    return tr("The engine changes over …")


def set_rig(command: Command, rig: Rig) -> None:
    """Have the engine go on with `rig`, whose tracker is compiled first: the engine tracks meanwhile. Raises
    EngineError."""
    compile_part(part_of(rig), lambda text, fraction: None)
    command("set_rig", document=msgspec.to_builtins(rig))
