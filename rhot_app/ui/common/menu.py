"""Menus whose entries explain themselves and are chosen by letters."""

from __future__ import annotations

import re
from collections.abc import Sequence

from PySide6.QtGui import QAction, QShowEvent
from PySide6.QtWidgets import QMenu, QWidget


class Menu(QMenu):
    """Entries show their tooltips. Each has a letter of its own while the menu is open, as long as there are any."""

    def __init__(self, title: str, parent: QWidget | None = None) -> None:
        super().__init__(title, parent)
        self.setToolTipsVisible(True)

    def fill(self, entries: Sequence[QAction | None]) -> None:
        """Add entries, None for a line between two."""
        for entry in entries:
            if entry is None:
                self.addSeparator()
            else:
                self.addAction(entry)

    def showEvent(self, event: QShowEvent) -> None:  # noqa: N802
        """Letters for the texts as they are now; a menu at the top of the screen is not shown by Qt and needs none."""
        give_letters([entry for entry in self.actions() if entry.isVisible() and not entry.isSeparator()])
        super().showEvent(event)


def give_letters(entries: Sequence[QAction]) -> None:
    """Mark the letter that chooses each entry: the first one of a word that no entry above has, else any other."""
    taken: set[str] = set()
    for entry in entries:
        text = without_letter(entry.text())
        title = text.partition("\t")[0]
        first = [k for k, letter in enumerate(title) if letter.isalnum() and (k == 0 or title[k - 1] == " ")]
        others = [k for k, letter in enumerate(title) if letter.isalpha() and k not in first]
        place = next((k for k in (*first, *others) if title[k].lower() not in taken), None)
        lettered = literal(text)
        if place is not None:
            taken.add(title[place].lower())
            lettered = f"{literal(text[:place])}&{literal(text[place:])}"
        if lettered != entry.text():
            entry.setText(lettered)


def literal(name: str) -> str:
    """A name as an entry's text: Qt takes a single & for the mark of a letter."""
    return name.replace("&", "&&")


def without_letter(text: str) -> str:
    """What an entry's text shows, without the mark of its letter."""
    return re.sub("&(.)", r"\1", text)
