"""The widgets of one step: what stands at the right below the sentence, and what takes the pictures' place."""

from __future__ import annotations

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QVBoxLayout, QWidget

from rhot_app.ui.wizards.models.step import Step, StepView


class Page(QWidget):
    """Base of all pages: hands what a person does to its `step` and shows what the step says. Holds no mathematics.

    `changed` tells the window that the person changed something, so that it asks the step anew. `centre` is a widget
    that takes the middle instead of the live pictures; None leaves the pictures there. `first_field` has the keyboard
    when the page opens. `pickable` lets the person click and drag in the pictures, see `pick`. `one_large` shows one
    picture as large as fits and the others small; a click on a small one makes it the large one.
    """

    changed = Signal()

    def __init__(self, step: Step, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.step = step
        self.centre: QWidget | None = None
        self.first_field: QWidget | None = None
        self.pickable = False
        self.one_large = False
        self.column = QVBoxLayout(self)
        self.column.setContentsMargins(0, 0, 0, 0)
        self.column.setSpacing(8)

    def entered(self) -> None:
        """The step is the current one now."""

    def show_view(self, view: StepView) -> None:
        """What the step says now; the sentence, bars, verdict and overlays are shown by the window."""

    def pick(self, camera: str, x: float, y: float, width: float, height: float) -> None:
        """A person has clicked or dragged in a picture; px of the frame, a click has no size."""
