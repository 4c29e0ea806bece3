"""One thing that was looked at: its level, what was found, what to do."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Level = Literal["ok", "warning", "error"]
LEVELS: tuple[Level, ...] = ("ok", "warning", "error")


@dataclass(frozen=True, slots=True)
class Check:
    """`code` is a short key, `text` a sentence on what was found, `remedy` one on what to do; empty when ok."""

    code: str
    level: Level
    text: str
    remedy: str = ""

    @property
    def sentence(self) -> str:
        """What was found and what to do."""
        return f"{self.text} {self.remedy}".rstrip()


def worst(checks: list[Check]) -> Level:
    """The highest level among `checks`; ok for none."""
    return max((check.level for check in checks), key=LEVELS.index, default="ok")
