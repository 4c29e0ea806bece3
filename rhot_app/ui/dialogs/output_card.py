"""One live stream as a card of the outputs' list: switch, name, how it goes; its address, and that as a QR code."""

from __future__ import annotations

import functools

import cv2
import numpy as np
from PySide6.QtCore import Qt
from PySide6.QtGui import QGuiApplication, QImage, QPixmap
from PySide6.QtWidgets import (
    QCheckBox,
    QFrame,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QPushButton,
    QStackedWidget,
    QWidget,
)

from rhot_app.project import OutputSettings
from rhot_app.ui.common.sentence import Sentence
from rhot_app.ui.common.shapes import ShapeMark
from rhot_app.ui.language import tr
from rhot_app.ui.models.outputs import OutputRow
from rhot_app.ui.models.palette import Scheme

_QR_PX = 132
_QUIET = 3  # modules of white around the code, besides the one of OpenCV: ISO/IEC 18004 wants four


class OutputCard(QFrame):
    """One output: switch, name, how it goes, buttons; below its address if it has one."""

    def __init__(self, settings: OutputSettings | None, row: OutputRow) -> None:
        """`settings` None: an output of the engine's command line, which cannot be changed here."""
        super().__init__()
        self.settings = settings
        self.setProperty("card", True)
        self.switch = QCheckBox()
        self.switch.setAccessibleName(tr("{title} is on", title=row.title))
        self.switch.setToolTip(tr("On or off, at once; one that is off stays in the rig."))
        self.mark, self.status_label = ShapeMark(), QLabel()
        self.title_label, self.detail_label = QLabel(row.title), QLabel(row.detail)
        self.title_label.setProperty("title", True)
        self.detail_label.setProperty("muted", True)
        for label in (self.title_label, self.status_label):
            label.setTextFormat(Qt.TextFormat.PlainText)
        self.change_button, self.remove_button = QPushButton(tr("Change …")), QPushButton(tr("Remove"))
        self.change_button.setToolTip(tr("Another target, other joints, another rate: in the form below."))
        self.remove_button.setToolTip(tr("Close it and take it out of the rig; Undo brings it back."))
        self.message_label = Sentence(2, muted=True)
        self.said = QStackedWidget()  # what has to be said stands where else the details do, so that no card grows
        self.said.addWidget(self.detail_label)
        self.said.addWidget(self.message_label)
        self.url_edit, self.copy_button = QLineEdit(), QPushButton(tr("Copy"))
        self.url_edit.setReadOnly(True)
        self.url_edit.setToolTip(tr("Where to connect. The web view's address has a secret in it: whoever knows it "
                                    "sees the hand."))
        self.copy_button.setToolTip(tr("Put the address on the clipboard."))
        self.copy_button.clicked.connect(lambda: QGuiApplication.clipboard().setText(self.url_edit.text()))
        self.code_label = QLabel()
        self.code_label.setToolTip(tr("The address as a QR code, for a telephone's or headset's camera."))
        for part in (self.switch, self.change_button, self.remove_button):
            part.setEnabled(settings is not None)
        self._lay_out()

    def show_switch(self) -> None:
        """On or off, as the rig says."""
        self.switch.setChecked(self.settings is None or self.settings.enabled)

    def _lay_out(self) -> None:
        grid = QGridLayout(self)
        grid.setContentsMargins(12, 8, 8, 8)
        grid.setColumnStretch(1, 1)
        head, line = QHBoxLayout(), QHBoxLayout()
        head.addWidget(self.title_label, 1)
        head.addWidget(self.mark)
        head.addWidget(self.status_label)
        line.addWidget(self.said, 1)
        line.addWidget(self.change_button)
        line.addWidget(self.remove_button)
        self.below = QWidget()
        below = QGridLayout(self.below)
        below.setContentsMargins(0, 0, 0, 0)
        below.setColumnStretch(0, 1)
        below.addWidget(self.url_edit, 0, 0)
        below.addWidget(self.copy_button, 0, 1)
        below.addWidget(self.code_label, 0, 2, Qt.AlignmentFlag.AlignTop)
        grid.addWidget(self.switch, 0, 0)
        for row, part in enumerate((head, line)):
            grid.addLayout(part, row, 1)
        grid.addWidget(self.below, 2, 1)

    def show_row(self, row: OutputRow, scheme: Scheme) -> None:
        """How it goes now."""
        self.mark.set_shape(row.look.shape, scheme.tone(row.look.tone))
        self.status_label.setText(row.status)
        for part in (self.mark, self.status_label, self.title_label):
            part.setToolTip(row.tooltip)
        if row.message != self.message_label.text() or row.url != self.url_edit.text():
            self.message_label.setText(row.message)
            self.url_edit.setText(row.url)
            self.url_edit.setCursorPosition(0)
            if row.url.startswith("https:"):  # others can open it; nobody photographs an address of this computer only
                self.code_label.setPixmap(qr_code(row.url, _QR_PX))
        self.said.setCurrentWidget(self.message_label if row.message else self.detail_label)
        self.below.setVisible(bool(row.url))
        self.code_label.setVisible(row.url.startswith("https:"))


@functools.lru_cache(8)
def qr_code(text: str, side_px: int) -> QPixmap:
    """A QR code in black on white with its quiet zone, about `side_px` wide; modules are whole pixels."""
    code = np.pad(cv2.QRCodeEncoder.create().encode(text), _QUIET, constant_values=255)
    factor = max(side_px // len(code), 2)
    large = np.ascontiguousarray(np.kron(code, np.ones((factor, factor), np.uint8)))
    image = QImage(large.tobytes(), len(large), len(large), len(large), QImage.Format.Format_Grayscale8)
    return QPixmap.fromImage(image.copy())
