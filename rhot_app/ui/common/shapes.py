"""The shapes that go with the words: disc, ring, half, square, cross, tick, octagon, hatch; and buttons' signs."""

from __future__ import annotations

import math

from PySide6.QtCore import QLineF, QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QBrush, QColor, QFontMetricsF, QIcon, QPainter, QPen, QPixmap, QPolygonF
from PySide6.QtWidgets import QMenuBar, QSizePolicy, QToolBar, QToolButton, QWidget

from rhot_app.ui.language import tr


def paint_shape(painter: QPainter, shape: str, box: QRectF, colour: QColor) -> None:
    """Draw one shape into the largest square of `box`."""
    size = min(box.width(), box.height())
    square = QRectF(0, 0, size, size)
    square.moveCenter(box.center())
    width = max(size * 0.14, 1.5)
    inner = square.adjusted(width / 2, width / 2, -width / 2, -width / 2)
    painter.save()
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    pen = QPen(colour, width, Qt.PenStyle.SolidLine, Qt.PenCapStyle.RoundCap, Qt.PenJoinStyle.RoundJoin)
    painter.setPen(pen)
    painter.setBrush(Qt.BrushStyle.NoBrush)
    if shape == "disc":
        painter.setBrush(colour)
        painter.drawEllipse(inner)
    elif shape == "ring":
        painter.drawEllipse(inner)
    elif shape == "half":
        painter.drawEllipse(inner)
        painter.setBrush(colour)
        painter.drawPie(inner, 90 * 16, 180 * 16)
    elif shape == "square":
        painter.drawRect(inner.adjusted(width / 2, width / 2, -width / 2, -width / 2))
    elif shape == "cross":
        painter.drawLine(QLineF(inner.topLeft(), inner.bottomRight()))
        painter.drawLine(QLineF(inner.topRight(), inner.bottomLeft()))
    elif shape == "tick":
        painter.drawPolyline(QPolygonF([QPointF(inner.left(), inner.center().y()),
                                        QPointF(inner.left() + 0.38 * inner.width(), inner.bottom() - 0.1 * size),
                                        QPointF(inner.right(), inner.top() + 0.1 * size)]))
    elif shape == "hatch":
        painter.setPen(QPen(colour, max(width * 0.6, 1.0)))
        painter.setBrush(QBrush(colour, Qt.BrushStyle.BDiagPattern))
        painter.drawEllipse(inner)
    elif shape == "octagon":
        _paint_octagon(painter, square, colour)
    elif shape == "play":
        painter.setBrush(colour)
        painter.drawPolygon(QPolygonF([inner.topLeft() + QPointF(width, 0), inner.bottomLeft() + QPointF(width, 0),
                                       QPointF(inner.right(), inner.center().y())]))
    elif shape == "stop":
        painter.setBrush(colour)
        painter.drawRect(inner.adjusted(width / 2, width / 2, -width / 2, -width / 2))
    elif shape == "info":
        _paint_info(painter, square, colour)
    elif shape in _PLAYER_SIGNS:
        _paint_player_sign(painter, shape, inner, colour)
    painter.restore()


_PLAYER_SIGNS = ("pause", "next", "previous", "first", "last")


def _paint_player_sign(painter: QPainter, shape: str, box: QRectF, colour: QColor) -> None:
    """The signs of a player: two bars, or a triangle with a bar at its tip (a step) or with two (to the end)."""
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(colour)
    bar = 0.22 * box.width()
    if shape == "pause":
        painter.drawRect(QRectF(box.left() + 0.1 * box.width(), box.top(), bar, box.height()))
        painter.drawRect(QRectF(box.right() - 0.1 * box.width() - bar, box.top(), bar, box.height()))
        return
    if shape in ("previous", "first"):  # the mirror image
        painter.translate(2.0 * box.center().x(), 0.0)
        painter.scale(-1.0, 1.0)
    bars = 2 if shape in ("first", "last") else 1
    tip = box.right() - bars * 1.4 * bar + 0.4 * bar
    painter.drawPolygon(QPolygonF([box.topLeft(), box.bottomLeft(), QPointF(tip, box.center().y())]))
    for number in range(bars):
        painter.drawRect(QRectF(box.right() - bar - number * 1.4 * bar, box.top(), bar, box.height()))


def _paint_octagon(painter: QPainter, square: QRectF, colour: QColor) -> None:
    centre, radius = square.center(), square.width() / 2
    corners = [QPointF(centre.x() + radius * math.cos(math.pi / 8 + k * math.pi / 4),
                       centre.y() + radius * math.sin(math.pi / 8 + k * math.pi / 4)) for k in range(8)]
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(colour)
    painter.drawPolygon(QPolygonF(corners))
    _paint_mark(painter, square, downward=True)


def _paint_info(painter: QPainter, square: QRectF, colour: QColor) -> None:
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(colour)
    painter.drawEllipse(square)
    _paint_mark(painter, square, downward=False)


def _paint_mark(painter: QPainter, square: QRectF, *, downward: bool) -> None:
    """An exclamation mark, or turned over an i, cut out of a filled shape."""
    painter.setCompositionMode(QPainter.CompositionMode.CompositionMode_DestinationOut)
    painter.setBrush(Qt.GlobalColor.black)
    centre, unit = square.center(), square.height() / 16
    bar = QRectF(centre.x() - unit, centre.y() - (4.5 if downward else 1.2) * unit, 2 * unit, 5.7 * unit)
    dot_y = centre.y() + (3.4 if downward else -3.4) * unit
    painter.drawRect(bar)
    painter.drawEllipse(QPointF(centre.x(), dot_y), 1.2 * unit, 1.2 * unit)


def shape_pixmap(shape: str, colour: str, size: int, ratio: float = 1.0) -> QPixmap:
    """The shape as a picture on nothing, `size` device-independent px."""
    picture = QPixmap(round(size * ratio), round(size * ratio))
    picture.setDevicePixelRatio(ratio)
    picture.fill(Qt.GlobalColor.transparent)
    painter = QPainter(picture)
    paint_shape(painter, shape, QRectF(1, 1, size - 2, size - 2), QColor(colour))
    painter.end()
    return picture


def shape_icon(shape: str, colour: str, ratio: float = 1.0) -> QIcon:
    """The shape as an icon of 24 x 18 px with some air at its right, where the text follows."""
    picture = QPixmap(round(24 * ratio), round(18 * ratio))
    picture.setDevicePixelRatio(ratio)
    picture.fill(Qt.GlobalColor.transparent)
    painter = QPainter(picture)
    paint_shape(painter, shape, QRectF(1, 1, 16, 16), QColor(colour))
    painter.end()
    return QIcon(picture)


_ARROWS = ("qt_toolbar_ext_button", "qt_menubar_ext_button")


def show_overflow(bar: QToolBar | QMenuBar, colour: str) -> None:
    """Give a bar's own arrow, behind which stand the controls that do not fit, a colour that can be seen."""
    arrow = next((part for part in bar.findChildren(QToolButton) if part.objectName() in _ARROWS), None)
    if arrow is not None:
        ratio = bar.devicePixelRatioF()
        picture = QPixmap(round(10 * ratio), round(16 * ratio))
        picture.setDevicePixelRatio(ratio)
        picture.fill(Qt.GlobalColor.transparent)
        painter = QPainter(picture)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(QPen(QColor(colour), 1.6))
        for x in (1.0, 5.0):
            painter.drawPolyline(QPolygonF([QPointF(x, 3.0), QPointF(x + 4.0, 8.0), QPointF(x, 13.0)]))
        painter.end()
        arrow.setIcon(QIcon(picture))
        arrow.setIconSize(QSize(10, 16))
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
        """Draw from a picture, because the octagon's mark is cut out."""
        if self._shape:
            painter = QPainter(self)
            ratio = self.devicePixelRatioF()
            painter.drawPixmap(0, 0, shape_pixmap(self._shape, self._colour.name(), self._side, ratio))
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
