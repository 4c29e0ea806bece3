"""The steps at the left: done, current, still to come - by shape and colour."""

from __future__ import annotations

from PySide6.QtWidgets import QGridLayout, QLabel, QVBoxLayout, QWidget

from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.shapes import ShapeMark

WIDTH_PX = 176


class StepList(QWidget):
    """Titles with marks. Not to click: steps build on each other, and Back and Next say what is possible."""

    def __init__(self, titles: list[str], scheme: Scheme, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._scheme = scheme
        self.setFixedWidth(WIDTH_PX)
        self._marks: list[ShapeMark] = []
        self._labels: list[QLabel] = []
        self.states: list[str] = []
        grid = QGridLayout()
        grid.setHorizontalSpacing(8)
        grid.setVerticalSpacing(16)
        grid.setColumnStretch(1, 1)
        for row, title in enumerate(titles):
            mark, label = ShapeMark(18), QLabel(title)
            label.setWordWrap(True)
            grid.addWidget(mark, row, 0)
            grid.addWidget(label, row, 1)
            self._marks.append(mark)
            self._labels.append(label)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 8, 0, 0)
        layout.addLayout(grid)
        layout.addStretch(1)

    def show_steps(self, current: int, done: list[bool]) -> None:
        """Mark the `current` step and those that are `done`."""
        states = ["current" if k == current else "done" if is_done else "to come" for k, is_done in enumerate(done)]
        if states == self.states:
            return
        self.states = states
        looks = {"current": ("play", "accent"), "done": ("tick", "good"), "to come": ("ring", "neutral")}
        for mark, label, state in zip(self._marks, self._labels, states, strict=True):
            shape, tone = looks[state]
            mark.set_shape(shape, self._scheme.tone(tone))
            label.setProperty("title", state == "current")
            label.setProperty("muted", state == "to come")
            label.style().unpolish(label)
            label.style().polish(label)
            label.setAccessibleName(f"{label.text()}: {state}")
