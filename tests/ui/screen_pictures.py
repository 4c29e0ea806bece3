"""Pictures of windows for the guide: taken, looked at, written when they are to be renewed."""

from __future__ import annotations

import os
import re
from pathlib import Path

import numpy as np
from PySide6.QtCore import QRect, QSize, Qt
from PySide6.QtGui import QFontMetrics, QImage
from PySide6.QtWidgets import (
    QAbstractButton,
    QApplication,
    QCheckBox,
    QLabel,
    QRadioButton,
    QScrollArea,
    QTableView,
    QToolButton,
    QWidget,
)

from rhot_app.ui.common.theme import CELL_PADDING_PX

FOLDER = Path(__file__).resolve().parents[2] / "docs" / "screenshots"
UPDATE = os.environ.get("RHOT_UPDATE_SCREENSHOTS") == "1"
SIZE = QSize(1280, 800)


def picture_of(window) -> QImage:
    """What is on the screen where the window stands, OpenGL included."""
    QApplication.processEvents()
    return window.screen().grabWindow(window.winId()).toImage()


def colours_in(image: QImage) -> int:
    """How many different colours the picture has, in coarse steps."""
    rgb = image.convertToFormat(QImage.Format.Format_RGB888)
    rows = np.frombuffer(rgb.constBits(), np.uint8).reshape(rgb.height(), rgb.bytesPerLine())[:, :3 * rgb.width()]
    coarse = (rows.reshape(-1, 3) >> 4).astype(np.intp) @ np.array([256, 16, 1])
    return int(np.count_nonzero(np.bincount(coarse)))


def check(name: str, image: QImage, least_colours: int) -> None:
    """Write the picture, or see that it is neither blank nor missing in the docs."""
    assert colours_in(image) >= least_colours, f"the page {name} is nearly blank"
    path = FOLDER / f"{name}.png"
    if UPDATE:
        FOLDER.mkdir(parents=True, exist_ok=True)
        assert image.save(str(path))
    assert path.exists(), f"{path} is missing; run this test with RHOT_UPDATE_SCREENSHOTS=1"


_ICON_GAP_PX = 4  # between the icon of a cell and its text


def cut_texts(window: QWidget) -> list[str]:
    """What cannot be read: texts of labels, buttons and tables in sight that their place does not hold, and parts that
    reach over the window's edge. What scrolls may be longer than its place."""
    for _ in range(3):  # a scrolling page is laid out once more when its bar has come or gone
        QApplication.processEvents()
    cut = []
    for part in window.findChildren(QWidget):
        if not part.isVisible() or part.visibleRegion().isEmpty():
            continue
        scrolls = _scrolls(part, window)
        if isinstance(part, (QLabel, QAbstractButton)):
            place = QRect(part.mapTo(window, part.rect().topLeft()), part.size())
            if not scrolls and not window.rect().contains(place):
                cut.append(f"{part.text()!r} reaches over the edge")
            if scrolls and part.text() and part.visibleRegion().boundingRect().width() < part.width():
                cut.append(f"{part.text()!r} is wider than what scrolls up and down")
            if isinstance(part, QLabel) and part.wordWrap() and _widest_word(part) > part.contentsRect().width():
                cut.append(f"{part.text()!r} has a word that is wider than its place")
        if isinstance(part, QLabel) and part.text() and not scrolls:
            needed = QSize(part.width(), part.heightForWidth(part.width())) if part.wordWrap() else part.sizeHint()
            if needed.height() > part.height() or needed.width() > part.width():
                cut.append(part.text())
        elif isinstance(part, QAbstractButton) and part.text() and not isinstance(part, QToolButton):
            least = part.minimumSizeHint() if isinstance(part, (QCheckBox, QRadioButton)) else part.sizeHint()
            if least.width() > part.width():
                cut.append(part.text())
        elif isinstance(part, QTableView):
            cut += _cut_cells(part)
    return cut


def _widest_word(label: QLabel) -> int:
    """px; a word that no hyphen or tag divides."""
    words = re.split(r"[\s\-–/]|<[^>]*>", label.text())
    return max(label.fontMetrics().horizontalAdvance(word) for word in words)


def _scrolls(part: QWidget, window: QWidget) -> bool:
    above = part.parentWidget()
    while above is not None and above is not window:
        if isinstance(above, QScrollArea):
            return True
        above = above.parentWidget()
    return False


def _cut_cells(table: QTableView) -> list[str]:
    """Texts of heads and cells that are wider, or where they wrap higher, than their place."""
    cut = []
    padding = 2 * (CELL_PADDING_PX + 3)
    header, model = table.horizontalHeader(), table.model()
    for column in range(model.columnCount()):
        head = model.headerData(column, Qt.Orientation.Horizontal)
        if head and header.fontMetrics().horizontalAdvance(head) > header.sectionSize(column):
            cut.append(head)
        if not table.wordWrap() and table.sizeHintForColumn(column) > table.columnWidth(column):
            cut.append(f"column {column}")
    for row in range(model.rowCount() if table.wordWrap() else 0):
        for column in range(model.columnCount()):
            cell = model.index(row, column)
            if text := cell.data():
                icon = cell.data(Qt.ItemDataRole.DecorationRole)
                left = icon.actualSize(table.iconSize()).width() + _ICON_GAP_PX if icon else 0
                room = QRect(0, 0, table.columnWidth(column) - padding - left, 10_000)
                font = cell.data(Qt.ItemDataRole.FontRole) or table.font()
                needed = QFontMetrics(font).boundingRect(room, Qt.TextFlag.TextWordWrap, text)
                if needed.height() > table.rowHeight(row) or needed.width() > room.width():
                    cut.append(text)
    return cut
