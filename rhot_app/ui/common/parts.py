"""Small parts of many windows."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFileDialog, QLabel, QMessageBox, QPushButton, QScrollArea, QWidget

from rhot_app.ui.language import tr


def plain_button(text: str, meaning: str = "", clicked: Callable[[], object] | None = None) -> QPushButton:
    """A button that Enter in a field beside it does not press; `meaning` is its tooltip."""
    button = QPushButton(text)
    button.setAutoDefault(False)
    button.setToolTip(meaning)
    if clicked is not None:
        button.clicked.connect(clicked)
    return button


def keep_width(part: QPushButton | QLabel, *words: str) -> None:
    """As wide as its longest text, whichever of these it shows: nothing beside it moves or is cut when it changes."""
    shown = part.text()
    part.ensurePolished()
    widths = []
    for word in words:
        part.setText(word)
        widths.append(part.sizeHint().width())
    part.setText(shown)
    part.setMinimumWidth(max(widths))


def scrolled(widget: QWidget) -> QScrollArea:
    """A widget that scrolls up and down where there is no room for all of it."""
    frame = QScrollArea()
    frame.setWidgetResizable(True)
    frame.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
    frame.setWidget(widget)
    return frame


def ask_where_to_save(parent: QWidget, title: str, start: Path, kinds: str) -> Path | None:
    """A file to be written, None when the person cancels. A name with none of the endings of `kinds` gets that of
    `start`; what stands there already is asked about by the desktop's dialog, or here where the ending was missing."""
    name, _ = QFileDialog.getSaveFileName(parent, title, str(start), kinds)
    path = Path(name)
    if not name or f"*{path.suffix.lower()}" in re.findall(r"\*\.\w+", kinds.lower()):
        return path if name else None
    path = path.with_name(path.name + start.suffix)
    buttons = QMessageBox.StandardButton
    question = tr("{path} already exists. Write over it?", path=path)
    replace = not path.exists() or QMessageBox.question(parent, title, question, buttons.Yes | buttons.No,
                                                        buttons.No) == buttons.Yes
    return path if replace else None
