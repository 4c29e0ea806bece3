"""Texts in the scene: each is drawn once into a small picture and then only placed, because text is slow in OpenGL."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QLineF, QPointF, QRectF, QSizeF, Qt
from PySide6.QtGui import QColor, QFont, QFontMetricsF, QMatrix4x4, QPainter, QPen, QPixmap

from rhot_app.state import Knowledge
from rhot_app.ui.language import tr
from rhot_app.ui.models.label_layout import place_labels
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.models.words import KNOWLEDGE
from rhot_app.ui.scene.ellipsoid_mesh import LARGEST_M, SIGMAS, EllipsoidChoice
from rhot_app.ui.scene.hand_mesh import ALPHA
from rhot_app.ui.scene.mesh_item import HATCH_PERIOD_PX

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


# -- The scene's key ---------------------------------------------------------------------------------------------------

KINDS = (Knowledge.MEASURED, Knowledge.INFERRED, Knowledge.GUESSED)

_BONE_PX = (34.0, 13.0)
_PAD_PX = 8.0
_KEY_GAP_PX = 8.0
_WIDEST_PX = 220.0  # of its words, so that the hand has the rest


def ellipsoid_text(choice: EllipsoidChoice | None, *, cut: bool, pictures_alone: bool = False) -> str:
    """What an ellipsoid shows, "" when none is drawn; `pictures_alone`: the calibration's own error is not in it."""
    if choice is None or not choice.any:
        return ""
    size = tr("true size") if choice.factor == 1 else tr("drawn {factor} × larger", factor=choice.factor)
    sigma = tr("{sigma:.0f} sigma of the pictures alone", sigma=SIGMAS) if pictures_alone else f"{SIGMAS:.0f} sigma"
    return f"{sigma}, {size}" + (tr(", cut at {most:.0f} mm", most=1000.0 * LARGEST_M) if cut else "")


class Legend:
    """Painted once into a picture, then only placed."""

    def __init__(self) -> None:
        self._key: object = None
        self._picture = QPixmap()
        self.rows: tuple[str, ...] = ()

    @property
    def size(self) -> QSizeF:
        """Of the key as it was painted last, px."""
        return self._picture.deviceIndependentSize()

    def paint(self, painter: QPainter, size: tuple[int, int], scheme: Scheme, text: str, tracker: str) -> None:
        """Into the lower left corner of a widget of that size, px; `text` is about the ellipsoids, "" for none;
        `tracker` is the name of what makes a hand of the markers."""
        ratio = painter.device().devicePixelRatioF()
        key = (scheme.name, text, tracker, ratio, size[0], painter.font().key())
        if key != self._key:
            widest = min(size[0] - 4 * _PAD_PX - _BONE_PX[0] - _KEY_GAP_PX, _WIDEST_PX)
            self.rows = (*(tr(KNOWLEDGE[kind].word) for kind in KINDS),
                         *_wrapped(text, QFontMetricsF(painter.font()), widest))
            self._key = key
            self._picture = _draw_key(scheme, self.rows, tracker, painter.font(), ratio)
        painter.drawPixmap(QPointF(_PAD_PX, size[1] - self.size.height() - _PAD_PX),
                           self._picture)


def _wrapped(text: str, metrics: QFontMetricsF, widest: float) -> list[str]:
    """`text` in rows no wider than `widest` px, broken after commas."""
    rows: list[str] = []
    for part in text.split(", ") if text else ():
        longer = f"{rows[-1]}, {part}" if rows else part
        if rows and metrics.horizontalAdvance(longer) <= widest:
            rows[-1] = longer
        else:
            rows.append(part)
    return rows


def _draw_key(scheme: Scheme, rows: tuple[str, ...], tracker: str, font: QFont, ratio: float) -> QPixmap:
    metrics = QFontMetricsF(font)
    step = float(np.ceil(metrics.height())) + 3
    width = max(metrics.horizontalAdvance(row) for row in rows) + _BONE_PX[0] + _KEY_GAP_PX + 2 * _PAD_PX
    head = tr("tracker: {tracker}", tracker=tracker) if tracker else ""
    width = max(width, metrics.horizontalAdvance(head) + 2 * _PAD_PX)
    above = 1 if head else 0
    box = QRectF(0, 0, np.ceil(width), (above + len(rows)) * step + _PAD_PX)
    picture = QPixmap(round(box.width() * ratio), round(box.height() * ratio))
    picture.setDevicePixelRatio(ratio)
    picture.fill(Qt.GlobalColor.transparent)
    painter = QPainter(picture)
    painter.setRenderHints(QPainter.RenderHint.Antialiasing | QPainter.RenderHint.TextAntialiasing)
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(QColor(scheme.scene))  # solid: what is large in the scene must not cut the words
    widths = [metrics.horizontalAdvance(head) if head else 0.0] * above
    widths += [metrics.horizontalAdvance(row) + _BONE_PX[0] + _KEY_GAP_PX for row in rows]
    for number, wide in enumerate(widths):  # no wider than its words: what is behind the rest stays in sight
        painter.drawRect(QRectF(0, 0.5 * _PAD_PX + number * step, wide + 2 * _PAD_PX, step))
    painter.setFont(font)
    for number, row in enumerate(rows):
        line = QRectF(_PAD_PX, 0.5 * _PAD_PX + (above + number) * step, box.width() - 2 * _PAD_PX, step)
        sign = QRectF(0, 0, *_BONE_PX)
        sign.moveCenter(QPointF(line.left() + 0.5 * _BONE_PX[0], line.center().y()))
        if number < len(KINDS):
            paint_bone(painter, sign, KINDS[number], scheme)
        elif number == len(KINDS):
            painter.setPen(QPen(QColor(scheme.text), 1.5))
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawEllipse(sign.adjusted(3, 1, -3, -1))
        painter.setPen(QColor(scheme.text))
        painter.drawText(line.adjusted(_BONE_PX[0] + _KEY_GAP_PX, 0, 0, 0), Qt.AlignmentFlag.AlignVCenter, row)
    if head:
        painter.setPen(QColor(scheme.muted))
        painter.drawText(QRectF(_PAD_PX, 0.5 * _PAD_PX, box.width(), step), Qt.AlignmentFlag.AlignVCenter, head)
    painter.end()
    return picture


def paint_bone(painter: QPainter, box: QRectF, kind: Knowledge, scheme: Scheme) -> None:
    """A piece of hand in the look of `kind`, as the scene draws it."""
    guessed = kind is Knowledge.GUESSED
    colour = QColor(scheme.guessed if guessed else scheme.hand)
    colour.setAlpha(ALPHA[kind])
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(colour if not guessed else QColor(0, 0, 0, 0))
    radius = 0.5 * box.height()
    painter.drawRoundedRect(box, radius, radius)
    if guessed:
        faint = QColor(colour)
        faint.setAlpha(ALPHA[kind] // 3)
        painter.setBrush(faint)
        painter.drawRoundedRect(box, radius, radius)
        painter.save()
        painter.setClipRect(box.adjusted(2, 0, -2, 0))
        painter.setPen(QPen(QColor(scheme.guessed), 0.4 * HATCH_PERIOD_PX))
        for x in np.arange(box.left() - box.height(), box.right(), HATCH_PERIOD_PX):
            painter.drawLine(QPointF(x, box.top()), QPointF(x + box.height(), box.bottom()))
        painter.restore()
