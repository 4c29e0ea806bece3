"""Notices to the operator."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Level = Literal["info", "warning", "error"]


@dataclass(frozen=True, slots=True)
class Notice:
    """One sentence, with the next step as a button when `action` names one (`key` tells which). A `lasting` one keeps a
    line of its own below the others."""

    level: Level
    text: str
    action: str = ""
    key: str = ""
    lasting: bool = False


# -- notices that disappear by themselves ------------------------------------------------------------------------------

CONFIRMATION_S = 10.0
FAILURE_S = 15.0


class TransientNotices:
    """Times are s on any monotonic clock. The newest comes first; the same sentence again only stays longer."""

    def __init__(self) -> None:
        self._until: dict[Notice, float] = {}

    def show(self, notice: Notice, now_s: float) -> None:
        """Show `notice` from now on: a failure for longer than a confirmation."""
        self._until.pop(notice, None)
        self._until[notice] = now_s + (FAILURE_S if notice.level == "error" else CONFIRMATION_S)

    def current(self, now_s: float) -> list[Notice]:
        """Those whose time is not up."""
        self._until = {notice: until for notice, until in self._until.items() if now_s < until}
        return list(reversed(self._until))

    def clear(self) -> None:
        """Take all of them away."""
        self._until.clear()
