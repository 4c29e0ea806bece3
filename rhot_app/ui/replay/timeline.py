"""The recording from left to right: how well the hand was tracked, bookmarks, the range that is repeated, the position.

Painted, so that a drag over ten minutes costs as little as over ten seconds.
"""

from __future__ import annotations

from PySide6.QtCore import QEvent, QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QHelpEvent, QMouseEvent, QPainter, QPaintEvent, QPen, QPolygonF, QResizeEvent
from PySide6.QtWidgets import QSizePolicy, QToolTip, QWidget

from rhot_app.ui.language import tr, tr_noop
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.replay.run import LOST, NO_STATE, PARTIAL, TRACKING, Codes
from rhot_app.ui.replay.session import Replay, time_text

MARGIN_PX = 10
BAR_PX = 18
FLAG_PX = 12
_NEAR_PX = 6
_HEIGHT_PX = FLAG_PX + BAR_PX + 12

WORDS = {TRACKING: tr_noop("tracking"), PARTIAL: tr_noop("partial"), LOST: tr_noop("lost"),
         NO_STATE: tr_noop("no state")}
_TONES = {TRACKING: "good", PARTIAL: "caution", LOST: "bad"}
_HEIGHTS = {TRACKING: 1.0, PARTIAL: 0.6, LOST: 0.25}
"""Part of the bar's height, so that colour is not the only key."""


def paint_conditions(painter: QPainter, box: QRectF, codes: Codes, scheme: Scheme) -> None:
    """Draw a condition bar into `box`: full and green where tracking, lower and yellow, low and red where lost."""
    painter.fillRect(box, QColor(scheme.window))
    if not len(codes):
        return
    width, begin = box.width() / len(codes), 0
    for end in range(1, len(codes) + 1):
        if end < len(codes) and codes[end] == codes[begin]:
            continue
        code = int(codes[begin])
        if code in _TONES:
            height = _HEIGHTS[code] * box.height()
            painter.fillRect(QRectF(box.left() + begin * width, box.bottom() - height, (end - begin) * width, height),
                             QColor(scheme.tone(_TONES[code])))
        begin = end


class Timeline(QWidget):
    """Press or drag to go anywhere: `sought` gives the position, s. `show_replay` whenever runs or bookmarks change."""

    sought = Signal(float)

    def __init__(self, scheme: Scheme, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._scheme = scheme
        self._replay: Replay | None = None
        self._codes: Codes | None = None
        self.setMinimumHeight(_HEIGHT_PX)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self.setAccessibleName(tr("Timeline of the recording"))

    def sizeHint(self) -> QSize:  # noqa: N802
        """Flat and wide."""
        return QSize(400, _HEIGHT_PX)

    def set_scheme(self, scheme: Scheme) -> None:
        """Change colours."""
        self._scheme = scheme
        self.update()

    def show_replay(self, replay: Replay | None) -> None:
        """Another recording, run or list of bookmarks; None for an empty bar."""
        self._replay = replay
        self._codes = None
        self.update()

    @property
    def codes(self) -> Codes | None:
        """The bar that is drawn, one code per pixel."""
        if self._codes is None and self._replay is not None and self._length_px > 0:
            self._codes = self._replay.bar(self._length_px)
        return self._codes

    @property
    def _length_px(self) -> int:
        return self.width() - 2 * MARGIN_PX

    def x_of(self, position_s: float) -> float:
        """Where a position is drawn, px."""
        duration_s = self._replay.player.duration_s if self._replay is not None else 0.0
        return MARGIN_PX + self._length_px * (position_s / duration_s if duration_s > 0.0 else 0.0)

    def position_at(self, x: float) -> float:
        """The position that is drawn there, s."""
        duration_s = self._replay.player.duration_s if self._replay is not None else 0.0
        return min(max((x - MARGIN_PX) / max(self._length_px, 1), 0.0), 1.0) * duration_s

    def resizeEvent(self, event: QResizeEvent) -> None:  # noqa: N802
        """Another bar for another width."""
        super().resizeEvent(event)
        self._codes = None

    def mousePressEvent(self, event: QMouseEvent) -> None:  # noqa: N802
        """Go there; a bookmark that is met is met exactly."""
        if self._replay is None or event.button() != Qt.MouseButton.LeftButton:
            return
        position = self.position_at(event.position().x())
        mark = self._replay.bookmark_near(position, self._seconds_per_px() * _NEAR_PX) if (
            event.position().y() < FLAG_PX + 2) else None
        self.sought.emit(self._replay.seconds_of(mark.t_master_ns) if mark is not None else position)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:  # noqa: N802
        """Scrub."""
        if self._replay is not None and event.buttons() & Qt.MouseButton.LeftButton:
            self.sought.emit(self.position_at(event.position().x()))

    def _seconds_per_px(self) -> float:
        return self._replay.player.duration_s / max(self._length_px, 1) if self._replay is not None else 0.0

    def event(self, event: QEvent) -> bool:
        """The mouse has been held still: which moment that is."""
        if event.type() == QEvent.Type.ToolTip and isinstance(event, QHelpEvent):
            QToolTip.showText(event.globalPos(), self.tool_tip_at(float(event.pos().x())), self)
            return True
        return bool(super().event(event))

    def tool_tip_at(self, x: float) -> str:
        """Time, condition and bookmark at a place in the widget."""
        if self._replay is None or self.codes is None or not len(self.codes):
            return ""
        position = self.position_at(x)
        code = int(self.codes[min(max(int(x - MARGIN_PX), 0), len(self.codes) - 1)])
        mark = self._replay.bookmark_near(position, self._seconds_per_px() * _NEAR_PX)
        return f"{time_text(position)}: {tr(WORDS[code])}" + (f"\n{mark.text}" if mark is not None else "")

    def paintEvent(self, event: QPaintEvent) -> None:  # noqa: N802
        """Range, bar, flags, position."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        box = QRectF(MARGIN_PX, FLAG_PX + 4, self._length_px, BAR_PX)
        if self._replay is None or self.codes is None:
            painter.fillRect(box, QColor(self._scheme.window))
            return
        paint_conditions(painter, box, self.codes, self._scheme)
        self._paint_loop(painter, box, self._replay)
        for mark in self._replay.bookmarks:
            self._paint_flag(painter, self.x_of(self._replay.seconds_of(mark.t_master_ns)))
        x = self.x_of(self._replay.player.position_s)
        painter.setPen(QPen(QColor(self._scheme.text), 2.0))
        painter.drawLine(QPointF(x, FLAG_PX), QPointF(x, box.bottom() + 6))
        painter.end()

    def _paint_loop(self, painter: QPainter, box: QRectF, replay: Replay) -> None:
        """What is not repeated is dimmed; brackets stand at the ends."""
        if replay.player.loop is None:
            return
        begin, end = (self.x_of(at_s) for at_s in replay.player.loop)
        veil = QColor(self._scheme.panel)
        veil.setAlpha(170)
        painter.fillRect(QRectF(box.left(), box.top(), begin - box.left(), box.height()), veil)
        painter.fillRect(QRectF(end, box.top(), box.right() - end, box.height()), veil)
        painter.setPen(QPen(QColor(self._scheme.accent), 2.0))
        for x, inward in ((begin, 5.0), (end, -5.0)):
            painter.drawPolyline(QPolygonF([QPointF(x + inward, box.top() - 3), QPointF(x, box.top() - 3),
                                            QPointF(x, box.bottom() + 3), QPointF(x + inward, box.bottom() + 3)]))

    def _paint_flag(self, painter: QPainter, x: float) -> None:
        painter.setPen(QPen(QColor(self._scheme.accent), 1.5))
        painter.setBrush(QColor(self._scheme.accent))
        painter.drawLine(QPointF(x, 2), QPointF(x, FLAG_PX + 4))
        painter.drawPolygon(QPolygonF([QPointF(x, 2), QPointF(x + 8, 5), QPointF(x, 8)]))
