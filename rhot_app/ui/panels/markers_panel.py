"""The markers: own colour with the name beside it, how well its place is known, and in words who sees them."""

from __future__ import annotations

from PySide6.QtCore import QRectF, QSize, Qt
from PySide6.QtGui import QColor, QPainter, QPen
from PySide6.QtWidgets import QGridLayout, QLabel, QSizePolicy, QVBoxLayout, QWidget

from rhot_app.calibration.check.camera_calibration import KNOWN_EXACTLY, calibration_error
from rhot_app.charts import hex_of
from rhot_app.project import Rig
from rhot_app.state import HandState
from rhot_app.ui.common.shapes import ShapeMark
from rhot_app.ui.language import tr, tr_noop
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.models.rows import MarkerRow, marker_name, marker_rows
from rhot_app.ui.models.words import Look, tip
from rhot_app.ui.panels.empty_state import EmptyState

_IDLE = Look(tr_noop("not tracking"), "square", "neutral", tr_noop("The nodes do not stream. Press Start."))
_UNSEEN = Look(tr_noop("not seen"), "ring", "neutral", tr_noop("Nothing has been seen of it for a second."))

_WORD_PX = 96
"""A word that names a camera may be long; the panel is no wider than its dock."""


class Swatch(QWidget):
    """A marker's own colour with a rim, so that dark ones are seen on dark ground."""

    def __init__(self, colour: str, rim: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._colour, self._rim = QColor(colour), QColor(rim)
        self.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)

    def sizeHint(self) -> QSize:  # noqa: N802
        """14 px square."""
        return QSize(14, 14)

    def paintEvent(self, event: object) -> None:  # noqa: N802
        """A rounded square."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(QPen(self._rim, 1.0))
        painter.setBrush(self._colour)
        painter.drawRoundedRect(QRectF(1, 1, 12, 12), 3, 3)
        painter.end()


class MarkersPanel(QWidget):
    """One line per marker of the rig: swatch, name, standard deviation, word, shape."""

    def __init__(self, scheme: Scheme, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setProperty("panel", True)
        self.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
        self.setProperty("guide", "markers")
        self.setToolTip(tip("marker"))
        self._scheme = scheme
        self._rig: Rig | None = None
        self._by_calibration = KNOWN_EXACTLY
        self._lines: list[tuple[ShapeMark, QLabel, QLabel]] = []
        self._shown: list[MarkerRow | None] = []
        self.empty = EmptyState(tr("No rig is open."))
        self._body = QWidget()
        self._grid = QGridLayout(self._body)
        self._grid.setContentsMargins(8, 0, 8, 0)
        self._grid.setHorizontalSpacing(6)
        self._grid.setVerticalSpacing(4)
        self._grid.setColumnStretch(1, 1)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 4, 0, 8)
        layout.addWidget(self.empty)
        layout.addWidget(self._body)
        layout.addStretch(1)

    def set_scheme(self, scheme: Scheme) -> None:
        """Change colours."""
        self._scheme = scheme
        self.show_rig(self._rig)

    def show_rig(self, rig: Rig | None) -> None:
        """Lines for another marker set."""
        self._rig, self._by_calibration = rig, calibration_error(rig)
        meaning = "\n".join(part for part in (tip("worst axis"), self._by_calibration.reason) if part)
        while (item := self._grid.takeAt(0)) is not None:
            if (widget := item.widget()) is not None:
                widget.deleteLater()
        self._lines = []
        self.empty.setVisible(rig is None)
        if rig is not None:
            self._grid.addWidget(_muted("± mm", meaning), 0, 2)
        for row, marker in enumerate(rig.markers.markers if rig is not None else (), start=1):
            mark, spread, word = ShapeMark(12), _muted("", meaning), _muted("", "")
            spread.setMinimumWidth(spread.fontMetrics().horizontalAdvance("0.00"))
            self._grid.addWidget(Swatch(hex_of(marker.display_rgb), self._scheme.muted), row, 0)
            self._grid.addWidget(QLabel(marker_name(marker.id)), row, 1)
            self._grid.addWidget(spread, row, 2)
            self._grid.addWidget(word, row, 3)
            self._grid.addWidget(mark, row, 4)
            self._lines.append((mark, spread, word))
        self._shown = [None] * len(self._lines)
        self.show_state(None, running=False)

    def show_state(self, state: HandState | None, *, running: bool) -> None:
        """What is known of each marker; None where there is no state: the nodes are `running` and see nothing, or they
        are not."""
        absent = _UNSEEN if running else _IDLE
        rows = marker_rows(state, self._by_calibration) if state is not None else []
        for k, (mark, spread, word) in enumerate(self._lines):
            row = rows[k] if k < len(rows) else None
            if row is not None and row == self._shown[k]:
                continue
            self._shown[k] = row
            look = row.look if row is not None else absent
            mark.set_shape(look.shape, self._scheme.tone(look.tone))
            word.setText(word.fontMetrics().elidedText(tr(look.word), Qt.TextElideMode.ElideMiddle, _WORD_PX))
            word.setAccessibleName(tr(look.word))
            spread.setText(row.spread if row is not None else "")
            word.setToolTip(f"{tr(look.meaning)}\n{row.detail}" if row is not None else tr(look.meaning))

    @property
    def words(self) -> list[str]:
        """The words shown, if only their ends, in the rig's order."""
        return [word.accessibleName() for *_, word in self._lines]

    @property
    def spreads(self) -> list[str]:
        """The standard deviations shown, mm, in the rig's order."""
        return [spread.text() for _, spread, _ in self._lines]


def _muted(text: str, meaning: str) -> QLabel:
    label = QLabel(text)
    label.setAlignment(Qt.AlignmentFlag.AlignRight)
    label.setProperty("muted", True)
    label.setToolTip(meaning)
    return label
