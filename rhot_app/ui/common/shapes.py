"""The shapes that go with the words, and buttons' signs: drawings of `resources/icons` in a colour of the scheme.

Each is an SVG of 16 x 16 whose lines and areas are `currentColor`, so that one drawing serves every scheme and size.
"""

from __future__ import annotations

import functools

from PySide6.QtCore import QByteArray, QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QFontMetricsF, QIcon, QPainter, QPixmap
from PySide6.QtSvg import QSvgRenderer
from PySide6.QtWidgets import QMenuBar, QSizePolicy, QToolBar, QToolButton, QWidget

from rhot_app.ui.language import tr
from rhot_node.files import resource_path

_MORE_PX = 12
RATIOS = (1.0, 1.5, 2.0, 3.0)
"""Device pixels a pixel, for which icons are drawn: a window may move to another screen."""


@functools.lru_cache(maxsize=128)
def _drawing(shape: str, colour: str) -> QSvgRenderer:
    text = resource_path("icons", f"{shape}.svg").read_text(encoding="utf-8")
    return QSvgRenderer(QByteArray(text.replace("currentColor", colour).encode()))


def paint_shape(painter: QPainter, shape: str, box: QRectF, colour: QColor) -> None:
    """Draw one shape into the largest square of `box`."""
    size = min(box.width(), box.height())
    square = QRectF(0, 0, size, size)
    square.moveCenter(box.center())
    painter.save()
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    _drawing(shape, colour.name()).render(painter, square)
    painter.restore()


def shape_pixmap(shape: str, colour: str, size: int, ratio: float = 1.0, width: int | None = None) -> QPixmap:
    """The shape as a picture on nothing, `size` device-independent px; at the left of a wider one of `width`."""
    picture = QPixmap(round((width or size) * ratio), round(size * ratio))
    picture.setDevicePixelRatio(ratio)
    picture.fill(Qt.GlobalColor.transparent)
    painter = QPainter(picture)
    paint_shape(painter, shape, QRectF(1, 1, size - 2, size - 2), QColor(colour))
    painter.end()
    return picture


def shape_icon(shape: str, colour: str, size: int = 18, width: int | None = None) -> QIcon:
    """The shape as an icon, sharp on every screen; `width` px gives it some air at its right, where a text follows."""
    icon = QIcon()
    for ratio in RATIOS:
        icon.addPixmap(shape_pixmap(shape, colour, size, ratio, width))
    return icon


_ARROWS = ("qt_toolbar_ext_button", "qt_menubar_ext_button")


def show_overflow(bar: QToolBar | QMenuBar, colour: str) -> None:
    """Give a bar's own arrow, behind which stand the controls that do not fit, a colour that can be seen."""
    arrow = next((part for part in bar.findChildren(QToolButton) if part.objectName() in _ARROWS), None)
    if arrow is not None:
        arrow.setIcon(shape_icon("more", colour, _MORE_PX))
        arrow.setIconSize(QSize(_MORE_PX, _MORE_PX))
        arrow.setToolTip(tr("More controls"))


class ShapeMark(QWidget):
    """A shape in a colour, of a fixed size."""

    def __init__(self, size: int = 14, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._side = size
        self._shape, self._colour = "", QColor()
        self.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)

    def sizeHint(self) -> QSize:  # noqa: N802
        """The fixed size."""
        return QSize(self._side, self._side)

    def set_shape(self, shape: str, colour: str) -> None:
        """Show another shape or colour."""
        if (shape, QColor(colour)) != (self._shape, self._colour):
            self._shape, self._colour = shape, QColor(colour)
            self.update()

    def paintEvent(self, event: object) -> None:  # noqa: N802
        """Draw the shape."""
        if self._shape:
            painter = QPainter(self)
            paint_shape(painter, self._shape, QRectF(self.rect()).adjusted(1, 1, -1, -1), self._colour)
            painter.end()


# -- A word on a dark ground, readable over any picture ----------------------------------------------------------------

def paint_tag(painter: QPainter, corner: QPointF, text: str, *, bold: bool = False) -> None:
    """A word on a dark ground."""
    font = painter.font()
    font.setBold(bold)
    painter.setFont(font)
    metrics = QFontMetricsF(font)
    box = QRectF(corner.x(), corner.y(), metrics.horizontalAdvance(text) + 8, metrics.height() + 2)
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(QColor(0, 0, 0, 150))
    painter.drawRoundedRect(box, 3, 3)
    painter.setPen(QColor("#ffffff"))
    painter.drawText(box, Qt.AlignmentFlag.AlignCenter, text)
