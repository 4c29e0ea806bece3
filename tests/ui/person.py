"""A simulated user of a window: clicks, keys, and waiting for what the window does."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from patience import PATIENCE_S
from PySide6.QtCore import QEventLoop, QPoint, Qt, QTimer
from PySide6.QtGui import QImage
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QWidget
from screen_pictures import UPDATE, check, colours_in, picture_of

LEFT, NONE = Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier


def pause(seconds: float) -> None:
    """Let Qt run. ``QTest.qWait`` would block the other Python threads meanwhile."""
    loop = QEventLoop()
    QTimer.singleShot(round(1000 * seconds), loop.quit)
    loop.exec()


def wait(condition: Callable[[], Any], timeout_s: float = PATIENCE_S, told: Callable[[], Any] = lambda: "") -> None:
    """Let Qt run until `condition` holds; fails with the message `told` when it never does."""
    end = time.monotonic() + timeout_s
    while time.monotonic() < end and not condition():
        pause(0.005)
    assert condition(), told()


class Person:
    """A user of one window, which is shown and has the keyboard focus."""

    def __init__(self, window: Any) -> None:
        self.window = window
        window.show()
        window.activateWindow()
        assert QTest.qWaitForWindowActive(window)

    def told(self) -> Any:
        """The window's state, for the message of a failure."""
        return self.window.windowTitle()

    def until(self, condition: Callable[[], Any], timeout_s: float = PATIENCE_S) -> None:
        """Let the window run until `condition` holds, which is checked once more after the time is up."""
        wait(condition, timeout_s, self.told)

    def run(self, seconds: float) -> None:
        """Let the window run for so long."""
        pause(seconds)

    def click(self, widget: QWidget, at: QPoint | None = None) -> None:
        """Click the centre of a widget, or another point of it."""
        assert widget.isVisible() and widget.isEnabled()
        QTest.mouseClick(widget, LEFT, NONE, at or widget.rect().center())

    def keep(self, name: str, least_colours: int, take: Callable[[], QImage] | None = None,
             settle_s: float = 1.0) -> None:
        """Take a picture for the guide, of the window on the screen or by `take`, once it has `least_colours`."""
        take = take or (lambda: picture_of(self.window))
        if UPDATE:
            self.run(settle_s)
        self.until(lambda: colours_in(take()) >= least_colours)
        check(name, take(), least_colours)

    def drag(self, widget: QWidget, *places: QPoint) -> None:
        """Press the button at the first place, move over the others, release it at the last."""
        QTest.mousePress(widget, LEFT, NONE, places[0])
        for place in places[1:]:
            QTest.mouseMove(widget, place)
        QTest.mouseRelease(widget, LEFT, NONE, places[-1])

    def press(self, key: Qt.Key, widget: QWidget | None = None, modifier: Qt.KeyboardModifier = NONE) -> None:
        """Press a key."""
        QTest.keyClick(widget or self.window, key, modifier)

    def type(self, field: Any, text: str) -> None:
        """Replace the text of a field by typing."""
        self.click(field)
        field.selectAll()
        QTest.keyClicks(field, text)
