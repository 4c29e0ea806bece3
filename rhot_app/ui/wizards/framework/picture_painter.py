"""Paints what a step wants drawn over a picture (`framework.drawing`)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from PySide6.QtCore import QLineF, QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFontMetricsF, QImage, QPainter, QPen, QPolygonF

from rhot_app.ui.common.shapes import paint_tag
from rhot_app.ui.models.label_layout import Box, place_at_sides
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.wizards.framework.drawing import Array, Callout, Cells, Dots, Layer, Line, Mark, Overlay, Tag

_CELL_ALPHA = 60
_SHADE_ALPHA = 60
_SIDE_PX = 4.0
_PAINT_PX = 10.0


@dataclass(frozen=True, slots=True)
class FramePlacement:
    """Where the frame of `width` x `height` px lies on the widget."""

    target: QRectF
    width: int
    height: int

    @property
    def scale(self) -> float:
        """Px of the widget per px of the frame."""
        return self.target.width() / self.width

    def to_widget(self, points: Array) -> list[QPointF]:
        """(N, 2) px of the frame, (0, 0) the centre of the first pixel, as points of the widget; NaN ones left out."""
        at = (points + 0.5) * self.scale + np.array([self.target.x(), self.target.y()])
        return [QPointF(float(x), float(y)) for x, y in at if np.isfinite(x) and np.isfinite(y)]

    def to_frame(self, at: QPointF) -> tuple[float, float]:
        """A point of the widget as px of the frame, held inside it."""
        x = (at.x() - self.target.x()) / self.scale - 0.5
        y = (at.y() - self.target.y()) / self.scale - 0.5
        return min(max(x, 0.0), self.width - 1.0), min(max(y, 0.0), self.height - 1.0)


def fit(width: int, height: int, into: QRectF) -> FramePlacement:
    """The largest place for the frame in the middle of `into`."""
    scale = min(into.width() / width, into.height() / height)
    target = QRectF(0, 0, width * scale, height * scale)
    target.moveCenter(into.center())
    return FramePlacement(target, width, height)


def paint_overlay(painter: QPainter, overlay: Overlay, place: FramePlacement, scheme: Scheme) -> None:
    """Paint every mark of `overlay`, the first one undermost."""
    painter.save()
    painter.setClipRect(place.target)
    for mark in overlay:
        _paint(painter, mark, place, scheme)
    _paint_callouts(painter, [mark for mark in overlay if isinstance(mark, Callout)], place)
    painter.restore()


def callout_boxes(callouts: list[Callout], place: FramePlacement, metrics: QFontMetricsF) -> list[Box]:
    """Where the words stand, from the picture's upper left corner: at its sides, none over another."""
    anchors = [((mark.x + 0.5) * place.scale, (mark.y + 0.5) * place.scale) for mark in callouts]
    sizes = [(metrics.horizontalAdvance(mark.text) + 8, metrics.height() + 2) for mark in callouts]
    return place_at_sides(anchors, sizes, (place.target.width(), place.target.height()), _SIDE_PX)


def _paint_callouts(painter: QPainter, callouts: list[Callout], place: FramePlacement) -> None:
    if not callouts:
        return
    corner = place.target.topLeft()
    boxes = callout_boxes(callouts, place, QFontMetricsF(painter.font()))
    for colour, width in (("#000000", 3.0), ("#ffffff", 1.0)):
        painter.setPen(QPen(QColor(colour), width))
        for mark, box in zip(callouts, boxes, strict=True):
            at = QPointF((mark.x + 0.5) * place.scale, (mark.y + 0.5) * place.scale)
            line = QLineF(QPointF(*box.nearest((at.x(), at.y()))), at)
            line.setLength(max(line.length() - _PAINT_PX, 0.0))  # the paint itself stays in sight
            painter.drawLine(line.translated(corner))
    for mark, box in zip(callouts, boxes, strict=True):
        paint_tag(painter, corner + QPointF(box.x, box.y), mark.text)


def _paint(painter: QPainter, mark: Mark, place: FramePlacement, scheme: Scheme) -> None:
    match mark:
        case Dots():
            _paint_dots(painter, mark, place, scheme)
        case Line():
            _paint_line(painter, mark, place, scheme)
        case Cells():
            _paint_cells(painter, mark, place, scheme)
        case Layer():
            height, width = mark.rgba.shape[:2]
            data = np.ascontiguousarray(mark.rgba)
            painter.drawImage(place.target, QImage(data.data, width, height, 4 * width, QImage.Format.Format_RGBA8888))
        case Callout():
            pass  # all together, when everything else is painted
        case Tag():
            corner = place.to_widget(np.array([[mark.x, mark.y]]))
            if corner:
                paint_tag(painter, corner[0], mark.text)


def _paint_dots(painter: QPainter, dots: Dots, place: FramePlacement, scheme: Scheme) -> None:
    colour = _colour(dots.colour, scheme)
    places = place.to_widget(dots.points)
    for pen, width in ((QColor("#000000"), 3.5), (colour, 1.6)):
        painter.setPen(QPen(pen, width))
        painter.setBrush(colour if dots.filled else Qt.BrushStyle.NoBrush)
        for at in places:
            painter.drawEllipse(at, dots.radius, dots.radius)


def _paint_line(painter: QPainter, line: Line, place: FramePlacement, scheme: Scheme) -> None:
    colour = _colour(line.colour, scheme)
    polygon = QPolygonF(place.to_widget(line.points))
    shade = QColor(colour)
    shade.setAlpha(_SHADE_ALPHA)
    style = Qt.PenStyle.DashLine if line.dashed else Qt.PenStyle.SolidLine
    for pen, width in ((QColor(0, 0, 0, 170), line.width + 2.0), (colour, line.width)):
        painter.setPen(QPen(pen, width, style, Qt.PenCapStyle.RoundCap, Qt.PenJoinStyle.RoundJoin))
        painter.setBrush(shade if line.shaded and pen is colour else Qt.BrushStyle.NoBrush)
        if line.closed:
            painter.drawPolygon(polygon)
        else:
            painter.drawPolyline(polygon)


def _paint_cells(painter: QPainter, cells: Cells, place: FramePlacement, scheme: Scheme) -> None:
    rows, columns = cells.strength.shape
    width, height = place.target.width() / columns, place.target.height() / rows
    painter.setPen(Qt.PenStyle.NoPen)
    for row in range(rows):
        for column in range(columns):
            strength = float(cells.strength[row, column])
            if strength > 0.0:
                colour = _colour(cells.colour, scheme)
                colour.setAlpha(round(_CELL_ALPHA * min(strength, 1.0)))
                painter.fillRect(QRectF(place.target.x() + column * width, place.target.y() + row * height,
                                        width, height), colour)


def _colour(name: str, scheme: Scheme) -> QColor:
    return QColor(name if name.startswith("#") else scheme.tone(name))
