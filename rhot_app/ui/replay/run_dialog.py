"""How a recording is tracked again: which tracker, rig and hand; in place of the run that is shown, or beside it."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import Signal
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QDialog,
    QFileDialog,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from rhot_app.ui.replay.session import Choice

_TRACKERS = (("as the rig says", ""), ("classic", "classic"), ("estimator", "estimator"))
_WIDTH_PX = 480


class FileChoice(QWidget):
    """A file, or what the recording has itself."""

    def __init__(self, title: str, own: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._title, self._own = title, own
        self.path: Path | None = None
        self.label = QLabel(own)
        self.choose_button, self.forget_button = QPushButton("Choose …"), QPushButton("As recorded")
        self.choose_button.clicked.connect(self.choose)
        self.forget_button.clicked.connect(lambda: self.show_path(None))
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.addWidget(self.label, 1)
        row.addWidget(self.forget_button)
        row.addWidget(self.choose_button)
        self.show_path(None)

    def choose(self) -> None:
        """Ask for a file."""
        name, _ = QFileDialog.getOpenFileName(self, self._title, str(self.path.parent if self.path else Path.home()),
                                              "JSON files (*.json);;All files (*)")
        if name:
            self.show_path(Path(name))

    def show_path(self, path: Path | None) -> None:
        """Take a file; None for the recording's own."""
        self.path = path
        self.label.setText(path.name if path is not None else self._own)
        self.label.setToolTip(str(path or ""))
        self.forget_button.setVisible(path is not None)


class RunDialog(QDialog):
    """`chosen` gives the `Choice`. `beside`: it will be compared with the run that is shown."""

    chosen = Signal(object)

    def __init__(self, *, beside: bool, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._beside = beside
        self.setWindowTitle("Compare with another run" if beside else "Track again")
        self.setProperty("guide", "recording")
        self.setMinimumWidth(_WIDTH_PX)
        words = QLabel("The recording is tracked once more, and both hands are shown together." if beside else
                       "The recording is tracked once more; the moment that is shown stays.")
        words.setWordWrap(True)
        self.tracker_box = QComboBox()
        for text, kind in _TRACKERS:
            self.tracker_box.addItem(text, kind)
        self.rig_choice = FileChoice("Track with a rig file", "as recorded")
        self.hand_choice = FileChoice("Track with a hand file", "the rig's hand")
        self.smooth_box = QCheckBox("Smooth")
        self.smooth_box.setToolTip("Every state uses what came after it as well. Only the estimator can.")
        self.start_button, close = QPushButton("Track"), QPushButton("Cancel")
        self.start_button.setDefault(True)
        self.start_button.clicked.connect(self._choose)
        close.clicked.connect(self.reject)
        form, buttons = QGridLayout(), QHBoxLayout()
        form.setColumnStretch(1, 1)
        form.setVerticalSpacing(8)
        for row, (name, part) in enumerate((("Tracker", self.tracker_box), ("Rig", self.rig_choice),
                                            ("Hand", self.hand_choice), ("", self.smooth_box))):
            form.addWidget(QLabel(name), row, 0)
            form.addWidget(part, row, 1)
        buttons.addStretch(1)
        buttons.addWidget(close)
        buttons.addWidget(self.start_button)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(16, 16, 16, 16)
        layout.setSpacing(16)
        layout.addWidget(words)
        layout.addLayout(form)
        layout.addLayout(buttons)

    def _choose(self) -> None:
        self.chosen.emit(Choice(self.tracker_box.currentData(), self.rig_choice.path, self.hand_choice.path,
                                self._beside, self.smooth_box.isChecked()))
        self.accept()
