"""A sentence that changes while people aim at what stands beside it."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QLabel, QScrollArea, QSizePolicy, QWidget

from rhot_app.ui.common.theme import TEXT_PT, app_font


class Sentence(QScrollArea):
    """Text in a place of fixed height, so that nothing moves when it changes.

    The place has room for `lines` of `size_pt`. A longer text gets smaller letters down to `smallest_pt`, then scrolls.
    """

    def __init__(self, lines: int, *, size_pt: float = TEXT_PT, smallest_pt: float | None = None, bold: bool = False,
                 muted: bool = False, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._sizes = [size_pt]
        while smallest_pt is not None and self._sizes[-1] > smallest_pt:
            self._sizes.append(self._sizes[-1] - 1.0)
        self._bold = bold
        self.label = QLabel()
        self.label.setWordWrap(True)
        self.label.setTextFormat(Qt.TextFormat.PlainText)
        self.label.setAlignment(Qt.AlignmentFlag.AlignTop | Qt.AlignmentFlag.AlignLeft)
        self.label.setProperty("muted", muted)
        self.label.setFont(app_font(size_pt, bold=bold))
        self.setProperty("clear", True)
        self.setWidget(self.label)
        self.setWidgetResizable(True)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setFixedHeight(lines * self.label.fontMetrics().lineSpacing() + 2)

    def text(self) -> str:
        """The text shown."""
        return self.label.text()

    def setText(self, text: str) -> None:  # noqa: N802 like the label that it stands for
        """Another text, from its beginning."""
        if text != self.label.text():
            self.label.setText(text)
            self.setAccessibleName(text)
            self._fit()
            self.verticalScrollBar().setValue(0)

    @property
    def whole(self) -> bool:
        """Whether all of the text is seen without scrolling."""
        return self.label.heightForWidth(self.width()) <= self.height()

    def resizeEvent(self, event: QResizeEvent) -> None:  # noqa: N802
        """The width decides over the lines."""
        super().resizeEvent(event)
        self._fit()

    def _fit(self) -> None:
        for size_pt in self._sizes if len(self._sizes) > 1 else ():
            self.label.setFont(app_font(size_pt, bold=self._bold))
            if self.whole:
                break
