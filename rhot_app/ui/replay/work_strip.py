"""A line that shows long work: what is done, how far it is, how long it still takes, and a button that ends it."""

from __future__ import annotations

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QHBoxLayout, QLabel, QProgressBar, QPushButton, QWidget

from rhot_app.ui.language import tr


class WorkStrip(QWidget):
    """Hidden while nothing is done."""

    cancel_asked = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.label, self.bar, self.cancel_button = QLabel(), QProgressBar(), QPushButton(tr("Cancel"))
        self.bar.setRange(0, 100)
        self.bar.setTextVisible(False)
        self.cancel_button.clicked.connect(self.cancel_asked)
        row = QHBoxLayout(self)
        row.setContentsMargins(12, 4, 12, 4)
        row.setSpacing(12)
        row.addWidget(self.label)
        row.addWidget(self.bar, 1)
        row.addWidget(self.cancel_button)
        self.hide()

    def show_work(self, text: str, fraction: float, remaining: str) -> None:
        """How far it is; an empty text hides the line."""
        self.setVisible(bool(text))
        self.label.setText(f"{text} {remaining}".strip())
        self.bar.setValue(round(100 * fraction))
