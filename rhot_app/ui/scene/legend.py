"""The scene's key: what solid, translucent and hatched mean, and how large ellipsoids are drawn."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFont, QFontMetricsF, QPainter, QPen, QPixmap

from rhot_app.tracking.state import Knowledge
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.models.words import KNOWLEDGE
from rhot_app.ui.scene.ellipsoid_mesh import LARGEST_M, SIGMAS, EllipsoidChoice
from rhot_app.ui.scene.known import ALPHA
from rhot_app.ui.scene.mesh_item import HATCH_PERIOD_PX

KINDS = (Knowledge.MEASURED, Knowledge.INFERRED, Knowledge.GUESSED)

_BONE_PX = (34.0, 13.0)
_PAD_PX = 8.0
_GAP_PX = 8.0


def ellipsoid_text(choice: EllipsoidChoice | None, *, cut: bool, pictures_alone: bool = False) -> str:
    """What an ellipsoid shows, "" when none is drawn; `pictures_alone`: the calibration's own error is not in it."""
    if choice is None or not choice.any:
        return ""
    size = "true size" if choice.factor == 1 else f"drawn {choice.factor} × larger"
    sigma = f"{SIGMAS:.0f} sigma of the pictures alone" if pictures_alone else f"{SIGMAS:.0f} sigma"
    return f"{sigma}, {size}" + (f", cut at {1e3 * LARGEST_M:.0f} mm" if cut else "")


class Legend:
    """Painted once into a picture, then only placed."""

    def __init__(self) -> None:
        self._key: object = None
        self._picture = QPixmap()

    def paint(self, painter: QPainter, height: int, scheme: Scheme, text: str) -> None:
        """Into the lower left corner of a widget `height` px tall; `text` is about the ellipsoids, "" for none."""
        ratio = painter.device().devicePixelRatioF()
        key = (scheme.name, text, ratio, painter.font().key())
        if key != self._key:
            self._key, self._picture = key, _draw(scheme, text, painter.font(), ratio)
        painter.drawPixmap(QPointF(_PAD_PX, height - self._picture.deviceIndependentSize().height() - _PAD_PX),
                           self._picture)


def _draw(scheme: Scheme, text: str, font: QFont, ratio: float) -> QPixmap:
    rows = [KNOWLEDGE[kind].word for kind in KINDS] + ([text] if text else [])
    metrics = QFontMetricsF(font)
    step = float(np.ceil(metrics.height())) + 3
    width = max(metrics.horizontalAdvance(row) for row in rows) + _BONE_PX[0] + _GAP_PX + 2 * _PAD_PX
    box = QRectF(0, 0, np.ceil(width), len(rows) * step + _PAD_PX)
    picture = QPixmap(round(box.width() * ratio), round(box.height() * ratio))
    picture.setDevicePixelRatio(ratio)
    picture.fill(Qt.GlobalColor.transparent)
    painter = QPainter(picture)
    painter.setRenderHints(QPainter.RenderHint.Antialiasing | QPainter.RenderHint.TextAntialiasing)
    ground = QColor(scheme.scene)
    ground.setAlpha(200)
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(ground)
    painter.drawRoundedRect(box, 6, 6)
    painter.setFont(font)
    for number, row in enumerate(rows):
        line = QRectF(_PAD_PX, 0.5 * _PAD_PX + number * step, box.width() - 2 * _PAD_PX, step)
        sign = QRectF(0, 0, *_BONE_PX)
        sign.moveCenter(QPointF(line.left() + 0.5 * _BONE_PX[0], line.center().y()))
        if number < len(KINDS):
            paint_bone(painter, sign, KINDS[number], scheme)
        else:
            painter.setPen(QPen(QColor(scheme.text), 1.5))
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawEllipse(sign.adjusted(3, 1, -3, -1))
        painter.setPen(QColor(scheme.text))
        painter.drawText(line.adjusted(_BONE_PX[0] + _GAP_PX, 0, 0, 0), Qt.AlignmentFlag.AlignVCenter, row)
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
