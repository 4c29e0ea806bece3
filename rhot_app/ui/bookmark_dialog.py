"""Asks for a few words about a moment, while a recording is made or replayed."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtWidgets import QInputDialog, QWidget

NO_WORDS = "bookmark"
"""What a bookmark says when nothing was typed: hands full of paint type nothing."""


class BookmarkDialog(QInputDialog):
    """Asks once; `taken` hears the words. Nothing waits for it."""

    def __init__(self, taken: Callable[[str], None], parent: QWidget) -> None:
        super().__init__(parent)
        self.setWindowTitle("Bookmark")
        self.setLabelText("What happens here?")
        self.textValueSelected.connect(lambda text: taken(text.strip() or NO_WORDS))
        self.open()
