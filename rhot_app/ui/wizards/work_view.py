"""Long work on the screen: what is being done, how much of it, how long it will take, and the way out."""

from __future__ import annotations

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QHBoxLayout, QLabel, QProgressBar, QPushButton, QVBoxLayout, QWidget

from rhot_app.ui.theme import app_font
from rhot_app.ui.wizards.models.step import Step
from rhot_app.ui.wizards.work import Work


class WorkView(QWidget):
    """Visible while something is computed, and after it was cancelled until it is begun again."""

    again_asked = Signal()

    def __init__(self, work: Work, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._work = work
        self.label = QLabel()
        self.label.setFont(app_font(14.0, bold=True))
        self.label.setWordWrap(True)
        self.bar = QProgressBar()
        self.bar.setRange(0, 1000)
        self.bar.setTextVisible(False)
        self.remaining = QLabel()
        self.remaining.setProperty("muted", True)
        self.cancel_button = QPushButton("Cancel")
        self.cancel_button.clicked.connect(work.cancel)
        self.again_button = QPushButton("Solve again")
        self.again_button.clicked.connect(self.again_asked)
        for button in (self.cancel_button, self.again_button):
            button.setAutoDefault(False)
        row = QHBoxLayout()
        row.addWidget(self.remaining, 1)
        row.addWidget(self.cancel_button)
        row.addWidget(self.again_button)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(self.label)
        layout.addWidget(self.bar)
        layout.addLayout(row)
        layout.addStretch(1)

    def wanted(self, step: Step) -> bool:
        """Whether there is something to show for `step`."""
        return self._work.running or (self._work.halted and step.task() is not None)

    def refresh(self, hint: str) -> None:
        """Show how far it is; `hint` is the step's word when it was halted."""
        running = self._work.running
        self.label.setText(self._work.text if running else hint)
        self.bar.setVisible(running)
        self.bar.setValue(round(1000 * self._work.fraction))
        self.remaining.setText(f"{100 * self._work.fraction:.0f} %   {self._work.remaining}" if running else "")
        self.cancel_button.setVisible(running)
        self.again_button.setVisible(not running)
