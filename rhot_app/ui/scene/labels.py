"""Texts in the scene: each is drawn once into a small picture and then only placed, because text is slow in OpenGL."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QLineF, QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFont, QFontMetricsF, QMatrix4x4, QPainter, QPixmap

from rhot_app.ui.models.label_layout import place_labels

Array = NDArray[np.float64]

_GAP_PX = 26.0


@dataclass(frozen=True, slots=True)
class TextStyle:
    """How a label looks: colour, smaller than the window's font or not, and a plate under it or none ("")."""

    colour: str
    small: bool = True
    plate: str = ""


def pixels_of(places: Array, matrix: QMatrix4x4, size: tuple[int, int]) -> Array:
    """Where `places` (N, 3) m appear, (N, 2) device-independent px; NaN behind the eye or without a place.

    `matrix` is projection times view, `size` the widget's in device-independent px.
    """
    rows = np.array(matrix.copyDataTo()).reshape(4, 4)
    clip = np.column_stack([places, np.ones(len(places))]) @ rows.T
    depth = np.where(clip[:, 3] > 0.0, clip[:, 3], np.nan)
    return np.column_stack([(clip[:, 0] / depth + 1) * 0.5 * size[0], (1 - clip[:, 1] / depth) * 0.5 * size[1]])


class LabelPainter:
    """Paints labels at places of the scene, centred, `lift` px above the place."""

    def __init__(self) -> None:
        self._pictures: dict[tuple[str, TextStyle, str, float], QPixmap] = {}

    def clear(self) -> None:
        """Forget the pictures, e.g. when colours change."""
        self._pictures.clear()

    def paint(self, painter: QPainter, matrix: QMatrix4x4, size: tuple[int, int], places: Array, texts: list[str],
              style: TextStyle, lift: float = 0.0) -> None:
        """Labels `texts` at `places` (N, 3) m; one behind the eye or without a place is left out.

        `matrix` is projection times view, `size` the widget's in device-independent px.
        """
        if not texts:
            return
        for (x, y), text in zip(pixels_of(places, matrix, size), texts, strict=True):
            if not np.isfinite(x):
                continue
            picture = self._picture(text, style, painter)
            width, height = picture.deviceIndependentSize().width(), picture.deviceIndependentSize().height()
            painter.drawPixmap(QPointF(x - 0.5 * width, y - 0.5 * height - lift), picture)

    def paint_apart(self, painter: QPainter, matrix: QMatrix4x4, size: tuple[int, int], places: Array,
                    texts: list[str], style: TextStyle) -> None:
        """As `paint`, but each beside its place and clear of the others, with a line from label to place."""
        pixels = pixels_of(places, matrix, size)
        shown = [k for k in range(len(texts)) if np.isfinite(pixels[k, 0])]
        anchors = [(float(pixels[k, 0]), float(pixels[k, 1])) for k in shown]
        pictures = [self._picture(texts[k], style, painter) for k in shown]
        sizes = [(p.deviceIndependentSize().width(), p.deviceIndependentSize().height()) for p in pictures]
        boxes = place_labels(anchors, sizes, (float(size[0]), float(size[1])), _GAP_PX)
        painter.setPen(QColor(style.colour))
        for (x, y), box in zip(anchors, boxes, strict=True):
            painter.drawLine(QLineF(x, y, *box.nearest((x, y))))
        for box, picture in zip(boxes, pictures, strict=True):
            painter.drawPixmap(QPointF(box.x, box.y), picture)

    def _picture(self, text: str, style: TextStyle, painter: QPainter) -> QPixmap:
        ratio = painter.device().devicePixelRatioF()
        font = QFont(painter.font())
        if style.small:
            font.setPointSizeF(max(font.pointSizeF() - 1.5, 8.0))
        key = (text, style, font.key(), ratio)
        if key not in self._pictures:
            self._pictures[key] = _draw(text, style, font, ratio)
        return self._pictures[key]


def _draw(text: str, style: TextStyle, font: QFont, ratio: float) -> QPixmap:
    metrics = QFontMetricsF(font)
    box = QRectF(0, 0, np.ceil(metrics.horizontalAdvance(text)) + 10, np.ceil(metrics.height()) + 2)
    picture = QPixmap(round(box.width() * ratio), round(box.height() * ratio))
    picture.setDevicePixelRatio(ratio)
    picture.fill(Qt.GlobalColor.transparent)
    painter = QPainter(picture)
    painter.setRenderHints(QPainter.RenderHint.Antialiasing | QPainter.RenderHint.TextAntialiasing)
    if style.plate:
        ground = QColor(style.plate)
        ground.setAlpha(190)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(ground)
        painter.drawRoundedRect(box, 4, 4)
    painter.setFont(font)
    painter.setPen(QColor(style.colour))
    painter.drawText(box, Qt.AlignmentFlag.AlignCenter, text)
    painter.end()
    return picture
