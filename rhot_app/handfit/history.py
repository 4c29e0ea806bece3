"""The steps of a fit: undo and redo of any depth, and steps that go on with the one before."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from rhot_app.handfit.state import FitState


@dataclass(frozen=True, slots=True)
class _Step:
    """A state and the words for what led to it."""

    state: FitState
    done: str


class History:
    """States, the newest of which is `state`; those that were undone wait for redo."""

    def __init__(self, state: FitState) -> None:
        self._steps = [_Step(state, "")]
        self._at = 0

    @property
    def state(self) -> FitState:
        """The state now."""
        return self._steps[self._at].state

    @property
    def past(self) -> Sequence[FitState]:
        """All states from the first one on to the one now."""
        return [step.state for step in self._steps[:self._at + 1]]

    @property
    def undoable(self) -> str:
        """What undo would take back, "" for nothing."""
        return self._steps[self._at].done

    @property
    def redoable(self) -> str:
        """What redo would bring back, "" for nothing."""
        return self._steps[self._at + 1].done if self._at + 1 < len(self._steps) else ""

    def undo(self) -> None:
        """One step back; nothing when there is none."""
        self._at = max(self._at - 1, 0)

    def redo(self) -> None:
        """One step forward again; nothing when there is none."""
        self._at = min(self._at + 1, len(self._steps) - 1)

    def take(self, state: FitState, done: str, *, goes_on: bool = False) -> None:
        """A new state, after something was `done`. `goes_on`: in place of the newest step, which was the same thing."""
        keep = self._at if goes_on and self._at and self.undoable == done else self._at + 1
        self._steps[keep:] = [_Step(state, done)]
        self._at = keep

    def rename(self, done: str) -> None:
        """Other words for the newest step; not for the first one."""
        if self._at:
            self._steps[self._at] = _Step(self.state, done)
