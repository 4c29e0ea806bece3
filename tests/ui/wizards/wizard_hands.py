"""A person's hands and patience in front of a wizard."""

from __future__ import annotations

import time

from patience import PATIENCE_S
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from screen_pictures import SIZE, check


class Hands:
    """Clicks and keys on one `WizardWindow`."""

    def __init__(self, window):
        self.window = window
        window.resize(SIZE)
        window.show()
        window.activateWindow()
        assert QTest.qWaitForWindowActive(window)

    @staticmethod
    def wait(condition, timeout_s=PATIENCE_S):
        end = time.monotonic() + timeout_s
        while time.monotonic() < end and not condition():
            QTest.qWait(10)
        assert condition()

    def until(self, condition, timeout_s=PATIENCE_S):
        try:
            self.wait(condition, timeout_s)
        except AssertionError:
            frame = self.window.frame
            raise AssertionError(f"at {self.title!r}: {self.sentence!r} {frame.hint.text()!r} "
                                 f"{frame.verdict.verdict}") from None

    def run(self, seconds):
        QTest.qWait(round(1000 * seconds))

    def click(self, widget):
        assert widget.isVisible() and widget.isEnabled()
        QTest.mouseClick(widget, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier,
                         QPoint(widget.width() // 2, widget.height() // 2))

    def type(self, field, text):
        """Click into a field and type something instead of what stands there."""
        self.click(field)
        field.selectAll()
        QTest.keyClicks(field, text)

    def key(self, key, modifier=Qt.KeyboardModifier.NoModifier):
        QTest.keyClick(self.window, key, modifier)

    def keep(self, name, least_colours=20):
        """Take the picture of the page as it is now, for the guide."""
        self.run(0.4)
        check(name, self.window.grab().toImage(), least_colours)

    def next(self):
        """Click Next once it can be clicked."""
        self.until(lambda: self.window.frame.next_button.isEnabled())
        self.click(self.window.frame.next_button)

    @property
    def sentence(self):
        return self.window.frame.sentence.text()

    @property
    def title(self):
        return self.window.step.title
