"""What windows beside the main one have in common: a timer, keys, undo, the guide by F1, and an orderly end."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

from PySide6.QtCore import QSize, Qt, QTimer
from PySide6.QtGui import QKeySequence, QShortcut
from PySide6.QtWidgets import QApplication, QDialog, QLineEdit, QMessageBox, QWidget

from rhot_app.ui.common.guide import GuideViewer
from rhot_app.ui.common.job import Job
from rhot_app.ui.common.keys import bind_space
from rhot_app.ui.language import tr

AS_MAIN: Final = QSize(1280, 800)
"""The size of a window that stands over no other, which it would else be as large as."""

Action = Callable[[], object]


class WindowTools:
    """Timer, keys and guide of `window`. The guide opens at `page`, from the heading `section` on."""

    def __init__(self, window: QWidget, title: str, page: str, section: str = "") -> None:
        self._window, self._page, self._section = window, page, section
        self.guide: GuideViewer | None = None
        self.timer = QTimer(window)
        window.setWindowTitle(title)
        window.setProperty("guide", page)

    def start(self, tick: Action, tick_ms: int, keys: Mapping[str, Action], space: Action | None = None) -> None:
        """Call `tick` every `tick_ms`, and the actions by their keys. `space`: what the space bar does."""
        self.bind(keys)
        if space is not None:
            bind_space(self._window, space)
        self.timer.setTimerType(Qt.TimerType.PreciseTimer)
        self.timer.timeout.connect(tick)
        self.timer.start(tick_ms)

    def bind(self, keys: Mapping[str, Action]) -> None:
        """Call actions by their keys, and the guide by F1."""
        for key, action in {"F1": self.open_guide, **keys}.items():
            QShortcut(QKeySequence(key), self._window).activated.connect(action)

    def open_guide(self) -> None:
        """The window's page of the guide, beside it."""
        if self.guide is None:
            self.guide = GuideViewer(self._window)
        self.guide.open_page(self._page, self._section)


class ToolWindow(QDialog):
    """A window of work beside the main one. A subclass calls `start` when it is complete.

    `tick` is one turn of its timer, so that tests can turn by hand.
    """

    losing = ""
    """What is asked before a window that `would_lose` something closes."""

    def __init__(self, title: str, page: str, parent: QWidget | None = None, size: QSize | None = None,
                 section: str = "") -> None:
        """`page`, `section`: of the guide. `size` None: as large as the window that it stands over."""
        super().__init__(parent)
        self.tools = WindowTools(self, title, page, section)
        self.setWindowFlag(Qt.WindowType.WindowMaximizeButtonHint)
        self.resize(size or (parent.window().size() if parent is not None else AS_MAIN))
        self._ending: Job | None = None

    def start(self, tick_ms: int, keys: Mapping[str, Action], space: Action | None = None) -> None:
        """Begin to tick and to hear keys. Ctrl+Z undoes, in the field that is being typed in or in the window."""
        self.tools.start(self.tick, tick_ms, {"Ctrl+Z": self._undo_key, **keys}, space)

    def tick(self) -> None:
        """What is done at every turn of the timer."""

    def undo(self) -> None:
        """Take the last change back."""

    @property
    def would_lose(self) -> bool:
        """Whether closing now throws away what the person has done."""
        return False

    def stop(self) -> Action | None:
        """End what runs. What has to be waited for is returned, and done in a worker."""
        return None

    def reject(self) -> None:
        """Escape and Close: ask only when something would be lost."""
        if not self.would_lose or self._may_lose():
            super().reject()

    def done(self, result: int) -> None:
        """What runs ends with the window, however that is closed."""
        self.end()
        super().done(result)

    def end(self) -> Job:
        """Stop what runs, once; the worker's job, because a question to a node may be under way."""
        if self._ending is None:
            self.tools.timer.stop()
            waiting = self.stop()
            self._ending = Job(lambda progress: waiting and waiting(), lambda _: None, lambda sentence: None).start()
        return self._ending

    def _undo_key(self) -> None:
        focus = QApplication.focusWidget()
        if isinstance(focus, QLineEdit) and focus.isUndoAvailable():
            focus.undo()
        else:
            self.undo()

    def _may_lose(self) -> bool:
        buttons = QMessageBox.StandardButton
        return QMessageBox.question(self, self.windowTitle(), tr(self.losing), buttons.Discard | buttons.Cancel,
                                    buttons.Cancel) == buttons.Discard
