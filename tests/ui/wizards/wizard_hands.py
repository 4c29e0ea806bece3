"""A person's hands and patience in front of a wizard."""

from __future__ import annotations

from patience import PATIENCE_S
from person import NONE, Person, wait
from PySide6.QtCore import Qt
from screen_pictures import SIZE


def opened(launcher, window):
    """The window, "wizard" or "fit", that a launcher is opening."""
    failures = []
    launcher.failed.connect(failures.append)
    wait(lambda: getattr(launcher, window) is not None or failures)
    assert not failures
    return getattr(launcher, window)


class Hands(Person):
    """A person in front of one `WizardWindow`; `path` is the rig's file, `client` what answers for the engine."""

    wait = staticmethod(wait)

    def __init__(self, window, size=SIZE):
        window.resize(size)
        super().__init__(window)

    def told(self):
        frame = self.window.frame
        return f"at {self.title!r}: {self.sentence!r} {frame.hint.text()!r} {frame.verdict.verdict}"

    def key(self, key, modifier=NONE):
        self.press(key, modifier=modifier)

    def undo(self):
        """Ctrl+Z, outside text fields."""
        self.frame.middle.setFocus()
        self.key(Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)

    def keep(self, name, least_colours=20):
        """Take the picture of the page as it is now, for the guide."""
        super().keep(name, least_colours, lambda: self.window.grab().toImage(), settle_s=0.4)

    def next(self):
        """Click Next once it can be clicked."""
        self.until(self.frame.next_button.isEnabled)
        self.click(self.frame.next_button)

    def record(self, seconds=0.01, picture="", times=1):
        """Space: a movement of so many seconds, at most so many `times` while the page asks for it again, with a
        picture of the page for the guide while it lasts."""
        step = self.window.step
        step.seconds = seconds
        for _ in range(times):
            self.frame.middle.setFocus()
            self.key(Qt.Key.Key_Space)
            if picture:
                self.until(lambda: step.phase == "recording")
                self.run(0.6 * seconds)
                self.keep(picture)
            self.until(lambda: step.phase == "recorded", seconds + PATIENCE_S)
            if step.view().done:
                break

    def solved(self, timeout_s=PATIENCE_S):
        """Wait for the result of a step that solves."""
        step = self.window.step
        self.until(lambda: step.result is not None or step.view().hint, timeout_s)
        assert step.result is not None, step.view().hint
        return step.result

    def use(self):
        """On the last page: use what is proposed, once that is allowed."""
        self.until(lambda: self.window.step.usable)
        self.next()
        self.until(lambda: self.window.step.state == "used")

    def restore(self):
        """On the last page, after use: bring the old one back."""
        self.click(self.window.page.restore_button)
        self.until(lambda: self.window.step.state == "restored")

    @property
    def frame(self):
        return self.window.frame

    @property
    def sentence(self):
        return self.frame.sentence.text()

    @property
    def hint(self):
        return self.frame.hint.text()

    @property
    def verdict(self):
        return self.frame.verdict.verdict

    @property
    def title(self):
        return self.window.step.title
