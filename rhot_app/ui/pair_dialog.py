"""Pair with one node: where its code comes from, a field to type it into, and what came of it."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QDialog, QHBoxLayout, QLabel, QLineEdit, QPushButton, QVBoxLayout, QWidget

from rhot_app.sources.pairing import NodeAddress
from rhot_app.ui.job import Job
from rhot_node.pairing import CODE_LENGTH

INTRO = (
    "Pairing makes sure that this computer and the node know each other, so that nobody else on the network can see "
    "its pictures, steer it, or pretend to be it.\n\n"
    "1. On the node {name}, at its console or over SSH, run:  rhot-node pair\n"
    "2. It shows a code of three groups, such as 7K2QD-9M4XT-BNWH3. Type it here within five minutes.")

Pair = Callable[[NodeAddress, str], str]
"""Pairs by a code and returns the node's name; raises a sentence."""


class PairDialog(QDialog):
    """Accepted once the node is paired."""

    def __init__(self, name: str, address: NodeAddress, pair: Pair, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWindowTitle(f"Pair with {name}")
        self._address = address
        self._pair = pair
        self._job: Job | None = None
        intro = QLabel(INTRO.format(name=name))
        intro.setTextFormat(Qt.TextFormat.PlainText)  # the name is the node's own word
        intro.setWordWrap(True)
        self.code = QLineEdit()
        self.code.setPlaceholderText("code shown by the node")
        self.code.setAccessibleName("Pairing code")
        self.code.setMaxLength(40)
        self.code.textChanged.connect(self._show_whether_complete)
        self.verdict = QLabel("")
        self.verdict.setWordWrap(True)
        self.verdict.setMinimumHeight(54)
        self.pair_button = QPushButton("Pair")
        self.pair_button.setDefault(True)
        self.pair_button.setEnabled(False)
        self.pair_button.setToolTip(f"Possible once {CODE_LENGTH} letters and digits are entered; dashes are free.")
        self.pair_button.clicked.connect(self.pair)
        cancel = QPushButton("Cancel")
        cancel.clicked.connect(self.reject)
        buttons = QHBoxLayout()
        buttons.addStretch(1)
        buttons.addWidget(cancel)
        buttons.addWidget(self.pair_button)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(16, 16, 16, 16)
        layout.setSpacing(16)
        for widget in (intro, self.code, self.verdict):
            layout.addWidget(widget)
        layout.addLayout(buttons)
        self.resize(600, 340)
        self.code.setFocus()

    def _show_whether_complete(self) -> None:
        letters = sum(character.isalnum() for character in self.code.text())
        self.pair_button.setEnabled(self._job is None and letters == CODE_LENGTH)

    def pair(self) -> None:
        """Pair in a worker."""
        if self._job is not None:
            return
        code = self.code.text()
        self.pair_button.setEnabled(False)
        self.verdict.setText("pairing …")
        self._job = Job(lambda progress: self._pair(self._address, code), self._accept, self._show_error, None,
                        self).start()

    def _accept(self, _name: str) -> None:
        self._job = None
        self.accept()

    def _show_error(self, sentence: str) -> None:
        self._job = None
        self._show_whether_complete()
        self.verdict.setText(sentence)
