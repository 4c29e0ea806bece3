"""The sentences at the bottom: what is wrong and what to do; gone when it is mended."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import (
    QHBoxLayout,
    QLabel,
    QMenu,
    QPushButton,
    QSizePolicy,
    QToolBar,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from rhot_app.ui.common.shapes import ShapeMark
from rhot_app.ui.models.notice import Notice
from rhot_app.ui.models.palette import Scheme

LOOKS: dict[str, tuple[str, str]] = {"info": ("info", "accent"), "warning": ("half", "caution"),
                                     "error": ("octagon", "fault")}
SHOWN = 3
RESERVED = 2
"""Lines of text that are kept free, so that a sentence that comes or goes moves nothing above it."""

_GAP_PX = 4
_MARGINS_PX = (12, 5, 12, 5)
_WRAPPED = 100  # px; narrower than this the bar is not laid out yet

_Line = tuple[QWidget, ShapeMark, QLabel, QPushButton]


class AdviceBar(QWidget):
    """The gravest sentences in two lines that are always there; below them one that lasts, in lines of its own.

    What does not fit stands in the menu of `more`.
    """

    acted = Signal(str)

    def __init__(self, scheme: Scheme, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("advice")
        self.setProperty("panel", True)
        self.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
        self.setProperty("guide", "troubles")
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Minimum)
        self._scheme = scheme
        self._shown: list[Notice] | None = None
        self._all: list[Notice] = []
        self._lines: list[_Line] = []
        self._on_line: list[Notice | None] = [None] * (SHOWN + 1)
        self._upper = QWidget()
        column = QVBoxLayout(self._upper)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(_GAP_PX)
        for _ in range(SHOWN):
            column.addWidget(self._make_line())
        column.addStretch(1)
        self.more = QToolButton()
        self.more.setToolTip("Sentences for which there is no room here.")
        self.more.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        self.more.setMenu(QMenu(self.more))
        policy = self.more.sizePolicy()
        policy.setRetainSizeWhenHidden(True)  # or sentences would wrap elsewhere when it comes
        self.more.setSizePolicy(policy)
        self.more.setText("0 more")
        self.more.hide()
        upper = QHBoxLayout()
        upper.setSpacing(10)
        upper.addWidget(self._upper, 1)
        upper.addWidget(self.more, alignment=Qt.AlignmentFlag.AlignBottom)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(*_MARGINS_PX)
        layout.setSpacing(_GAP_PX)
        layout.addLayout(upper)
        layout.addWidget(self._make_line())
        self._fit_height()

    def _make_line(self) -> QWidget:
        line, mark, label, button = QWidget(), ShapeMark(18), QLabel(), QPushButton()
        label.setWordWrap(True)
        label.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Preferred)
        row = QHBoxLayout(line)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(10)
        row.addWidget(mark)
        row.addWidget(label, 1)
        row.addWidget(button)
        index = len(self._lines)
        button.clicked.connect(lambda: self._act(index))
        line.hide()
        self._lines.append((line, mark, label, button))
        return line

    def set_scheme(self, scheme: Scheme) -> None:
        """Change colours."""
        self._scheme = scheme
        self._shown = None
        self.show_notices(self._all)

    def show_notices(self, notices: list[Notice]) -> None:
        """Show these sentences instead of the last ones."""
        if notices == self._all and self._shown is not None:
            return
        self._all, self._shown = list(notices), chosen_of(notices)
        passing = [notice for notice in self._shown if not notice.lasting]
        self._on_line = [*passing, *[None] * (SHOWN - len(passing)),
                         next((notice for notice in self._shown if notice.lasting), None)]
        for (_, mark, label, button), notice in zip(self._lines, self._on_line, strict=True):
            if notice is not None:
                shape, tone = LOOKS[notice.level]
                mark.set_shape(shape, self._scheme.tone(tone))
                label.setText(notice.text)
                label.setToolTip(notice.text)
                button.setText(notice.action)
                button.setVisible(bool(notice.action))
        self._fit_height()

    @property
    def line_px(self) -> int:
        """Height of one line: of text, or of a button beside it."""
        button = self._lines[0][3]
        return max(self.fontMetrics().height(), button.fontMetrics().height() + 6)

    def _fit_height(self) -> None:
        """Show as many sentences as the reserved lines hold; toolbars do not ask how tall wrapped text gets."""
        room = RESERVED * self.line_px + (RESERVED - 1) * _GAP_PX
        self._upper.setFixedHeight(room)
        width, left, full = self._upper.width(), room, False
        hidden: list[Notice] = [notice for notice in self._all if notice not in (self._shown or [])]
        for k, ((line, *_), notice) in enumerate(zip(self._lines[:-1], self._on_line, strict=False)):
            needed = self._height_of(k, width)
            full = full or (notice is not None and k > 0 and needed > left)
            line.setVisible(notice is not None and not full)
            if notice is not None and full:
                hidden.append(notice)
            left -= needed + _GAP_PX
        lasting = self._on_line[-1] is not None
        self._lines[-1][0].setVisible(lasting)
        self._offer(hidden)
        height = room + _MARGINS_PX[1] + _MARGINS_PX[3]
        if lasting:
            height += _GAP_PX + self._height_of(SHOWN, self.width() - _MARGINS_PX[0] - _MARGINS_PX[2])
        self.setFixedHeight(height)

    def _height_of(self, index: int, width: int) -> int:
        """Height of a line's sentence when it is `width` px wide."""
        line, _, label, _ = self._lines[index]
        layout = line.layout()
        assert layout is not None
        label.updateGeometry()
        layout.invalidate()  # it would tell the height of the sentence before
        return max(layout.heightForWidth(width), self.line_px) if width > _WRAPPED else self.line_px

    def _offer(self, hidden: list[Notice]) -> None:
        menu = self.more.menu()
        if menu.isVisible():
            return
        menu.clear()
        for notice in hidden:
            entry = menu.addAction(f"{notice.text}  {notice.action}".rstrip())
            entry.triggered.connect(lambda checked=False, key=notice.key: self.acted.emit(key) if key else None)
        self.more.setText(f"{len(hidden)} more")
        self.more.setVisible(bool(hidden))

    def resizeEvent(self, event: QResizeEvent) -> None:  # noqa: N802
        """Another width wraps elsewhere."""
        super().resizeEvent(event)
        layout = self.layout()
        if layout is not None and event.size().width() != event.oldSize().width():
            layout.activate()  # so that the part for the sentences has its new width
            self._fit_height()

    @property
    def texts(self) -> list[str]:
        """The sentences shown."""
        return [notice.text for notice in self._shown or []]

    @property
    def buttons(self) -> dict[str, QPushButton]:
        """The buttons beside the sentences, by their words."""
        return {button.text(): button for *_, button in self._lines if button.isVisible()}

    def _act(self, index: int) -> None:
        notice = self._on_line[index]
        if notice is not None:
            self.acted.emit(notice.key)


def chosen_of(notices: Sequence[Notice]) -> list[Notice]:
    """Those that are shown, the gravest first; a lasting one comes last and keeps a line of its own."""
    order = {"error": 0, "warning": 1, "info": 2}
    ordered = sorted(notices, key=lambda notice: order[notice.level])
    lasting = [notice for notice in ordered if notice.lasting][:1]
    return [*[notice for notice in ordered if not notice.lasting][:SHOWN - len(lasting)], *lasting]


def toolbar_of(advice: AdviceBar, parent: QWidget) -> QToolBar:
    """A toolbar that holds nothing but `advice` and cannot be moved or hidden."""
    bar = QToolBar("Advice", parent)
    bar.setObjectName("advicebar")
    bar.setMovable(False)
    bar.setContextMenuPolicy(Qt.ContextMenuPolicy.PreventContextMenu)
    bar.addWidget(advice)
    bar.toggleViewAction().setVisible(False)
    margins = bar.layout()
    assert margins is not None
    margins.setContentsMargins(0, 1, 0, 0)  # it took those of a toolbar with buttons before it had its name
    return bar
