"""The sentences at the bottom: what was just done, what is wrong and what to do; gone when it is mended."""

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
    QWidgetAction,
)

from rhot_app.ui.common.shapes import ShapeMark
from rhot_app.ui.language import tr
from rhot_app.ui.models.notice import Notice
from rhot_app.ui.models.palette import Scheme

STYLES: dict[str, tuple[str, str]] = {"info": ("info", "accent"), "warning": ("half", "caution"),
                                     "error": ("octagon", "fault")}
RESERVED = 2
"""Lines of text that are kept free, so that a sentence that comes or goes moves nothing above it."""

_GAP_PX = 4
_SPACING_PX = 10
_MARGINS_PX = (12, 5, 12, 5)
_WRAPPED = 100  # px; narrower than this the bar is not laid out yet
_LIST_PX = 760
_SHORTER = 0.95  # of a text that is still too long


class NoticeLine(QWidget):
    """One notice: a mark, its sentence, the next step as a button. It takes its height from `fit`."""

    acted = Signal(str)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.notice: Notice | None = None
        self.mark, self.label, self.button = ShapeMark(18), QLabel(), QPushButton()
        self.label.setWordWrap(True)
        self.label.setTextFormat(Qt.TextFormat.PlainText)
        self.label.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Preferred)
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(_SPACING_PX)
        row.addWidget(self.mark)
        row.addWidget(self.label, 1)
        row.addWidget(self.button)
        self.button.clicked.connect(self._act)

    @property
    def least_px(self) -> int:
        """Height of one line: of text, or of a button beside it."""
        return max(self.fontMetrics().height(), self.button.fontMetrics().height() + 6)

    def show_notice(self, notice: Notice | None, scheme: Scheme) -> None:
        """Another notice, or none."""
        self.notice = notice
        if notice is not None:
            shape, tone = STYLES[notice.level]
            self.mark.set_shape(shape, scheme.tone(tone))
            self.label.setToolTip(notice.text)
            self.setAccessibleName(notice.text)
            self.button.setText(notice.action.replace("&", "&&"))
            self.button.setVisible(bool(notice.action))

    def fit(self, width: int, room_px: int | None = None) -> tuple[int, bool]:
        """Show the sentence `width` px wide, in no more than `room_px` of height; the height, and whether it is
        whole."""
        text = "" if self.notice is None else self.notice.text
        self.label.setText(text)
        if width <= _WRAPPED:
            return self.least_px, True
        taken = self.mark.sizeHint().width() + _SPACING_PX
        if self.notice is not None and self.notice.action:
            taken += self.button.sizeHint().width() + _SPACING_PX
        wide = max(width - taken, _WRAPPED)
        length = len(text)
        while room_px is not None and length and self.label.heightForWidth(wide) > max(room_px, self.least_px):
            length = int(_SHORTER * length)
            self.label.setText(f"{text[:length].rpartition(' ')[0]} …")
        self.updateGeometry()
        return max(self.label.heightForWidth(wide), self.least_px), length == len(text)

    def _act(self) -> None:
        if self.notice is not None and self.notice.key:
            self.acted.emit(self.notice.key)


class AdviceBar(QWidget):
    """The first notices in two lines that are always there; below them one that lasts, in lines of its own.

    What does not fit, or not wholly, stands in the list of `more`, which Alt+M opens.
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
        self._all: list[Notice] | None = None
        self._waiting: list[Notice] = []
        self._upper = QWidget()
        self._lines, self._lasting = [NoticeLine() for _ in range(RESERVED)], NoticeLine()
        column = QVBoxLayout(self._upper)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(_GAP_PX)
        for line in self._lines:
            column.addWidget(line)
        column.addStretch(1)
        for line in (*self._lines, self._lasting):
            line.acted.connect(self.acted)
            line.hide()
        self.more = self._make_more()
        upper = QHBoxLayout()
        upper.setSpacing(_SPACING_PX)
        upper.addWidget(self._upper, 1)
        upper.addWidget(self.more, alignment=Qt.AlignmentFlag.AlignBottom)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(*_MARGINS_PX)
        layout.setSpacing(_GAP_PX)
        layout.addLayout(upper)
        layout.addWidget(self._lasting)
        self._fit_height()

    def _make_more(self) -> QToolButton:
        more = QToolButton()
        more.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        more.setMenu(QMenu(more))
        more.menu().aboutToShow.connect(self._list_waiting)
        policy = more.sizePolicy()
        policy.setRetainSizeWhenHidden(True)  # or sentences would wrap elsewhere when it comes
        more.setSizePolicy(policy)
        more.setText(tr("{n} &more", "{n} &more", 0))
        more.hide()
        return more

    def set_scheme(self, scheme: Scheme) -> None:
        """Change colours."""
        self._scheme = scheme
        notices, self._all = self._all or [], None
        self.show_notices(notices)

    def show_notices(self, notices: Sequence[Notice]) -> None:
        """Show these instead of the last ones, in this order; the first that lasts keeps a line of its own."""
        if notices == self._all:
            return
        self._all = list(notices)
        lasting = next((notice for notice in notices if notice.lasting), None)
        others = [notice for notice in notices if notice is not lasting]
        for k, line in enumerate(self._lines):
            line.show_notice(others[k] if k < len(others) else None, self._scheme)
        self._lasting.show_notice(lasting, self._scheme)
        self._fit_height()

    def _fit_height(self) -> None:
        """Show as many sentences as the reserved lines hold; toolbars do not ask how tall wrapped text gets. One that
        asks for nothing takes one line while others wait."""
        least = self._lasting.least_px
        room = left = RESERVED * least + (RESERVED - 1) * _GAP_PX
        self._upper.setFixedHeight(room)
        whole = []
        for line, following in zip(self._lines, (*self._lines[1:], None), strict=True):
            notice = line.notice
            line.setVisible(notice is not None and left >= least)
            if notice is not None and left >= least:
                others = following is not None and following.notice is not None
                height, complete = line.fit(self._upper.width(), least if notice.level == "info" and others else left)
                left -= height + _GAP_PX
                whole += [notice] if complete else []
        height = room + _MARGINS_PX[1] + _MARGINS_PX[3]
        self._lasting.setVisible(self._lasting.notice is not None)
        if self._lasting.notice is not None:
            whole.append(self._lasting.notice)
            height += _GAP_PX + self._lasting.fit(self.width() - _MARGINS_PX[0] - _MARGINS_PX[2])[0]
        self._waiting = [notice for notice in self._all or () if notice not in whole]
        self.more.setText(tr("{n} &more", "{n} &more", len(self._waiting)))
        self.more.setToolTip("\n".join(self.waiting))
        self.more.setVisible(bool(self._waiting))
        self.setFixedHeight(height)

    def _list_waiting(self) -> None:
        """The list as it is when it is opened: nothing moves in it under the mouse."""
        menu = self.more.menu()
        menu.clear()
        for notice in self._waiting:
            line = NoticeLine()
            line.setObjectName("advice")
            line.show_notice(notice, self._scheme)
            line.setContentsMargins(*_MARGINS_PX)
            width = min(_LIST_PX, self.width())
            height = line.fit(width - _MARGINS_PX[0] - _MARGINS_PX[2])[0]
            line.setFixedSize(width, height + _MARGINS_PX[1] + _MARGINS_PX[3])
            line.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
            if notice.action:
                line.setFocusProxy(line.button)
            line.acted.connect(self.acted)
            line.button.clicked.connect(menu.close)
            entry = QWidgetAction(menu)
            entry.setText(notice.text)
            entry.setDefaultWidget(line)
            entry.triggered.connect(line.button.click)
            menu.addAction(entry)

    def resizeEvent(self, event: QResizeEvent) -> None:  # noqa: N802
        """Another width wraps elsewhere."""
        super().resizeEvent(event)
        layout = self.layout()
        if layout is not None and event.size().width() != event.oldSize().width():
            layout.activate()  # so that the part for the sentences has its new width
            self._fit_height()

    @property
    def texts(self) -> list[str]:
        """The sentences shown, if only their beginning; in the order in which they stand."""
        return [line.notice.text for line in (*self._lines, self._lasting)
                if line.notice is not None and not line.isHidden()]

    @property
    def waiting(self) -> list[str]:
        """The sentences that are not shown, or not wholly: those of the list."""
        return [notice.text for notice in self._waiting]

    @property
    def buttons(self) -> dict[str, QPushButton]:
        """The buttons beside the sentences, by their words."""
        return {line.button.text(): line.button for line in (*self._lines, self._lasting)
                if line.button.isVisible()}


def toolbar_of(advice: AdviceBar, parent: QWidget) -> QToolBar:
    """A toolbar that holds nothing but `advice` and cannot be moved or hidden."""
    bar = QToolBar(tr("Advice"), parent)
    bar.setObjectName("advicebar")
    bar.setMovable(False)
    bar.setContextMenuPolicy(Qt.ContextMenuPolicy.PreventContextMenu)
    bar.addWidget(advice)
    bar.toggleViewAction().setVisible(False)
    margins = bar.layout()
    assert margins is not None
    margins.setContentsMargins(0, 1, 0, 0)  # it took those of a toolbar with buttons before it had its name
    return bar
