"""The one word that can be read from two metres, with its shape and the state rate."""

from __future__ import annotations

from PySide6.QtCore import QRectF, QSize, Qt
from PySide6.QtGui import QColor, QFontMetricsF, QPainter
from PySide6.QtWidgets import QSizePolicy, QWidget

from rhot_app.ui.common.shapes import shape_pixmap
from rhot_app.ui.common.theme import app_font
from rhot_app.ui.language import tr
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.models.words import CONDITIONS, NO_RIG, Look, tip

WORD_PT = 22.0
_SHAPE_PX = 26
_RATE_TEXT = "000 Hz"


class StateBadge(QWidget):
    """Shape, word and rate. Its width is that of the longest word, so that nothing beside it moves."""

    def __init__(self, scheme: Scheme, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._scheme = scheme
        self._look: Look = NO_RIG
        self._rate = ""
        self.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)

    def sizeHint(self) -> QSize:  # noqa: N802
        """Room for every word."""
        metrics = QFontMetricsF(app_font(WORD_PT, bold=True))
        widest = max(metrics.horizontalAdvance(tr(look.word)) for look in CONDITIONS.values())
        rate = QFontMetricsF(app_font()).horizontalAdvance(_RATE_TEXT)
        return QSize(round(_SHAPE_PX + 10 + widest + 12 + rate + 8), 40)

    def set_scheme(self, scheme: Scheme) -> None:
        """Change colours."""
        self._scheme = scheme
        self.update()

    def show_look(self, look: Look, rate_hz: float | None) -> None:
        """Another state."""
        rate = f"{rate_hz:.0f} Hz" if rate_hz else ""
        if (look, rate) == (self._look, self._rate):
            return
        self._look, self._rate = look, rate
        self.setToolTip(f"{tr(look.meaning)}\n{tip('condition')}\n{tip('state rate')}")
        self.setAccessibleName(tr("State: {word} {rate}", word=tr(look.word), rate=rate))
        self.update()

    @property
    def word(self) -> str:
        """The word shown."""
        return tr(self._look.word)

    @property
    def rate(self) -> str:
        """The rate shown, "" for none."""
        return self._rate

    def paintEvent(self, event: object) -> None:  # noqa: N802
        """Shape, word, rate from left to right, pushed to the right edge."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.TextAntialiasing)
        colour = self._scheme.tone(self._look.tone)
        big, small = app_font(WORD_PT, bold=True), app_font()
        rate_width = QFontMetricsF(small).horizontalAdvance(_RATE_TEXT) + 8
        word_width = QFontMetricsF(big).horizontalAdvance(self.word)
        left = self.width() - rate_width - 12 - word_width
        painter.drawPixmap(round(left - 10 - _SHAPE_PX), round((self.height() - _SHAPE_PX) / 2),
                           shape_pixmap(self._look.shape, colour, _SHAPE_PX, self.devicePixelRatioF()))
        painter.setPen(QColor(colour))
        painter.setFont(big)
        painter.drawText(QRectF(left, 0, word_width + 4, self.height()), Qt.AlignmentFlag.AlignVCenter, self.word)
        painter.setPen(QColor(self._scheme.text))
        painter.setFont(small)
        painter.drawText(QRectF(self.width() - rate_width, 0, rate_width - 4, self.height()),
                         Qt.AlignmentFlag.AlignVCenter | Qt.AlignmentFlag.AlignRight, self._rate)
        painter.end()
