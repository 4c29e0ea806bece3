"""Earlier versions of the rig file: what differs, and the button that brings one back."""

from __future__ import annotations

import contextlib
from pathlib import Path

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QDialog, QHBoxLayout, QListWidget, QPushButton, QVBoxLayout, QWidget

from rhot_app import rig_history
from rhot_app.calibration.proposal import rows_of
from rhot_app.errors import RhotError
from rhot_app.project import Rig
from rhot_app.rig_history import Version
from rhot_app.ui.backend.contract import Connect
from rhot_app.ui.common.job import Job
from rhot_app.ui.common.parts import plain_button
from rhot_app.ui.common.sentence import Sentence
from rhot_app.ui.language import date_text, tr
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.models.proposal import set_rig
from rhot_app.ui.wizards.framework.page import RowTable


class VersionsDialog(QDialog):
    """`rig_used` gives the rig that was brought back. Bringing back keeps what was there, so it can be undone here."""

    rig_used = Signal(object)

    def __init__(self, path: Path, rig: Rig, connect: Connect, scheme: Scheme,
                 parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWindowTitle(tr("Earlier calibrations"))
        self.setProperty("guide", "calibration")
        self.resize(1000, 560)
        self._path = path
        self._rig = rig
        self._connect = connect
        self._versions: list[Version] = []
        self._job: Job | None = None
        self.list = QListWidget()
        self.list.setFixedWidth(300)
        self.list.setSpacing(4)
        self.list.setWordWrap(True)
        self.list.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.list.currentRowChanged.connect(self._show_version)
        self.table = RowTable(scheme, ("", "now", "then"))
        self.sentence = Sentence(2)
        self.back_button = QPushButton(tr("Bring it back"))
        self.back_button.setToolTip(tr("Puts the chosen version into force. What is there now is kept, and can be "
                                       "brought back the same way."))
        self.back_button.clicked.connect(self.bring_back)
        close = plain_button(tr("Close"), clicked=self.reject)
        middle, buttons = QHBoxLayout(), QHBoxLayout()
        middle.addWidget(self.list)
        middle.addWidget(self.table, 1)
        buttons.addWidget(self.sentence, 1)
        buttons.addWidget(close)
        buttons.addWidget(self.back_button)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(16, 16, 16, 16)
        layout.setSpacing(16)
        layout.addLayout(middle, 1)
        layout.addLayout(buttons)
        self._list_versions()

    def _list_versions(self) -> None:
        self._versions = rig_history.versions(self._path)
        self.list.clear()
        for version in self._versions:
            self.list.addItem(tr("{date}\nbefore {reason}", date=date_text(version.replaced_at),
                                 reason=version.replaced_by))
        self.back_button.setEnabled(bool(self._versions))
        if self._versions:
            self.list.setCurrentRow(0)
        else:
            self.sentence.setText(tr("Nothing has been replaced yet: there is no earlier calibration of this rig."))

    def _show_version(self, number: int) -> None:
        if not 0 <= number < len(self._versions):
            return
        try:
            rows = rows_of(self._rig, rig_history.load_version(self._path, self._versions[number]))
        except RhotError as exc:
            self.table.show_records(())
            self.sentence.setText(str(exc))
            self.back_button.setEnabled(False)
            return
        self.table.show_records(rows)
        self.back_button.setEnabled(bool(rows))
        self.sentence.setText("" if rows else tr("This version says the same as the rig does now."))

    def bring_back(self) -> None:
        """Put the chosen version into force, in a worker."""
        number = self.list.currentRow()
        if self._job is None and 0 <= number < len(self._versions):
            version = self._versions[number]
            self.back_button.setEnabled(False)
            self._job = Job(lambda progress: self._restore(version), self._restored, self._failed, None, self).start()

    def _restore(self, version: Version) -> Rig:
        with contextlib.closing(self._connect()) as client:
            set_rig(client.command, rig_history.load_version(self._path, version))
            try:
                return rig_history.restore(self._path, version)
            except RhotError:
                set_rig(client.command, self._rig)
                raise

    def _restored(self, rig: Rig) -> None:
        self._job = None
        self._rig = rig
        self._list_versions()
        self.sentence.setText(tr("It is back in force. What was there before stands first in the list now."))
        self.rig_used.emit(rig)

    def _failed(self, sentence: str) -> None:
        self._job = None
        self.back_button.setEnabled(True)
        self.sentence.setText(sentence)
