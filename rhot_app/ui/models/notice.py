"""Notices to the operator, and the one order in which they are shown."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from rhot_app.engine.status import Level, Subject, most_urgent_first


@dataclass(frozen=True, slots=True)
class Notice:
    """One sentence, with the next step as a button when `action` names one (`key` tells which). A `lasting` one keeps a
    line of its own below the others."""

    level: Level
    text: str
    action: str = ""
    key: str = ""
    lasting: bool = False
    subject: Subject = "information"


# -- what the operator's own hand did ----------------------------------------------------------------------------------

CONFIRMATION_S = 10.0
FAILURE_S = 15.0
KEPT_S = 60.0


class TransientNotices:
    """What was done, or could not be done. It comes before all other notices for CONFIRMATION_S or FAILURE_S, then
    after them until KEPT_S are over. The same sentence again begins anew. Times are s on any monotonic clock."""

    def __init__(self) -> None:
        self._since: dict[Notice, float] = {}

    def show(self, notice: Notice, now_s: float) -> None:
        """Show `notice` from now on."""
        self._since.pop(notice, None)
        self._since[notice] = now_s

    def among(self, standing: Iterable[Notice], now_s: float) -> list[Notice]:
        """All notices in the order in which they are shown: what was just done, newest first; those `standing`, most
        urgent first; what was done before. No sentence comes twice."""
        self._since = {notice: since for notice, since in self._since.items() if now_s < since + KEPT_S}
        just: list[Notice] = []
        before: list[Notice] = []
        for notice, since in reversed(self._since.items()):
            (just if now_s < since + (FAILURE_S if notice.level == "error" else CONFIRMATION_S)
             else before).append(notice)
        ordered: dict[str, Notice] = {}
        for notice in (*just, *most_urgent_first(standing), *before):
            ordered.setdefault(notice.text, notice)
        return list(ordered.values())

    def clear(self) -> None:
        """Take all of them away."""
        self._since.clear()
