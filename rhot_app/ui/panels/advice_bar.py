"""The sentences at the bottom: what is wrong and what to do; gone when it is mended."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QHBoxLayout, QLabel, QPushButton, QSizePolicy, QToolBar, QVBoxLayout, QWidget

from rhot_app.ui.models.notice import Notice
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.shapes import ShapeMark

LOOKS: dict[str, tuple[str, str]] = {"info": ("info", "accent"), "warning": ("half", "caution"),
                                     "error": ("octagon", "fault")}
SHOWN = 3
_LEAST_PX = 34


class AdviceBar(QWidget):
    """Up to three sentences, the gravest first, below them one that lasts; a quiet one when there is nothing to say."""

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
        self._lines: list[tuple[QWidget, ShapeMark, QLabel, QPushButton]] = []
        layout = QVBoxLayout(self)
        layout.setContentsMargins(12, 5, 12, 5)
        layout.setSpacing(4)
        for _ in range(SHOWN):
            layout.addWidget(self._make_line())
        self.setFixedHeight(_LEAST_PX)  # before the toolbar around it takes the height of all lines for its own

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
        self._lines.append((line, mark, label, button))
        return line

    def set_scheme(self, scheme: Scheme) -> None:
        """Change colours."""
        self._scheme = scheme
        shown, self._shown = self._shown, None
        self.show_notices(shown or [])

    def show_notices(self, notices: list[Notice]) -> None:
        """Show these sentences instead of the last ones."""
        chosen = chosen_of(notices)
        if chosen == self._shown:
            return
        self._shown = chosen
        for k, (line, mark, label, button) in enumerate(self._lines):
            line.setVisible(k < len(chosen))
            if k < len(chosen):
                shape, tone = LOOKS[chosen[k].level]
                mark.set_shape(shape, self._scheme.tone(tone))
                label.setText(chosen[k].text)
                button.setText(chosen[k].action)
                button.setVisible(bool(chosen[k].action))
        self._fit_height()

    def _fit_height(self) -> None:
        """Toolbars do not ask how tall wrapped text gets at their width, so the bar says it."""
        layout = self.layout()
        if layout is not None and self.width() > 100:
            for line, _, label, _ in self._lines:  # each would tell the height of the sentence before
                label.updateGeometry()
                line.updateGeometry()
            layout.invalidate()  # it would count lines that have just been hidden
            self.setFixedHeight(max(layout.heightForWidth(self.width()), _LEAST_PX))

    def resizeEvent(self, event: QResizeEvent) -> None:  # noqa: N802
        """Another width wraps elsewhere."""
        super().resizeEvent(event)
        self._fit_height()

    @property
    def texts(self) -> list[str]:
        """The sentences shown."""
        return [notice.text for notice in self._shown or []]

    def _act(self, index: int) -> None:
        if self._shown is not None and index < len(self._shown):
            self.acted.emit(self._shown[index].key)


def chosen_of(notices: Sequence[Notice]) -> list[Notice]:
    """Those that are shown. A lasting one keeps the lowest line: the bar grows upwards, so nothing else moves it."""
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
