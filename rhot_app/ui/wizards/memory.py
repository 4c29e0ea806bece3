"""What wizards remember between runs, by name: the board, the camera chosen last."""

from __future__ import annotations

from typing import Protocol


class Memory(Protocol):
    """`rhot_app.ui.settings.Settings` is one."""

    def remembered(self, name: str) -> str:
        """What was remembered by this name, "" for nothing."""
        ...

    def remember(self, name: str, text: str) -> None:
        """Remember something by this name."""
        ...
