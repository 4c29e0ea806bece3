"""A sentence for the person at the screen."""

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
