"""The window of every wizard: steps at the left, pictures in the middle, what to do at the right, progress below."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QWidget

from rhot_app.ui.backend.feed import LiveFeed, Picture
from rhot_app.ui.common.job import Job
from rhot_app.ui.common.tool_window import ToolWindow
from rhot_app.ui.language import tr, tr_noop
from rhot_app.ui.wizards.framework.definition import Definition, WizardContext
from rhot_app.ui.wizards.framework.frame import WizardFrame
from rhot_app.ui.wizards.framework.page import AcceptPage
from rhot_app.ui.wizards.framework.picture_worker import PictureWorker
from rhot_app.ui.wizards.framework.step import AcceptStep, State, Step
from rhot_app.ui.wizards.framework.work import Work

TICK_MS = 16
SHOW_S = 0.1


class WizardWindow(ToolWindow):
    """Shows one `Definition`, as large as the window that it stands over. `rig_used` gives the rig in force after
    "Use this calibration" and after a restore; `used` the proposal, and whether it is in force now."""

    losing = tr_noop("Close without using this calibration? What was captured here is lost; the calibration in force "
                      "stays as it is.")
    rig_used = Signal(object)
    used = Signal(object, bool)

    def __init__(self, definition: Definition, context: WizardContext, parent: QWidget | None = None) -> None:
        title = context.calibration.title
        super().__init__(tr(title), "calibration", parent, section=title)
        self.definition = definition
        self._context = context
        self.feed = LiveFeed({node.name: node.node_id for node in context.rig.nodes if not node.text_datagrams},
                             context.connect)
        self.picture_worker = PictureWorker(self.feed)
        self.work = Work(context.make_solver(), self)
        self.frame = WizardFrame(definition, self.feed.cameras, self.work, context.scheme, self)
        self.current = 0
        self._dirty = True
        self._next_show = 0.0
        self._kept = 0
        self._job: Job | None = None
        self._connect_everything()
        self._go_to(0)
        self.feed.start()
        self.picture_worker.start()
        if context.calibration.solver:
            self.work.solver.prepare(context.calibration.solver)
        self.start(TICK_MS, {"Alt+Left": self.back}, self._capture)

    def _connect_everything(self) -> None:
        frame = self.frame
        frame.back_button.clicked.connect(self.back)
        frame.next_button.clicked.connect(self.next)
        frame.close_button.clicked.connect(self.reject)
        frame.work_view.again_asked.connect(lambda: self.work.again(self.step))
        frame.grid.picked.connect(self._pick)
        self.work.changed.connect(self.refresh)
        for page in self.definition.pages:
            page.changed.connect(self._page_changed)
            if isinstance(page, AcceptPage):
                page.restore_asked.connect(self.restore)

    # -- steps -----------------------------------------------------------------------------------------------------

    @property
    def page(self) -> QWidget:
        """The page shown."""
        return self.definition.pages[self.current]

    @property
    def step(self) -> Step:
        """The step shown."""
        return self.definition.pages[self.current].step

    @property
    def busy(self) -> bool:
        """Whether something is being put into force or taken back."""
        return self._job is not None

    def next(self) -> None:
        """The next step once this one is done; on the last one: use the calibration, then close."""
        step = self.step
        if isinstance(step, AcceptStep):
            if step.usable:
                self._apply(step, "used")
            elif step.state == "used":
                self.accept()
        elif step.view().may_go_on and not self.work.running:
            self._go_to(self.current + 1)

    def back(self) -> None:
        """The step before; what was captured stays."""
        if self.current > 0 and not self.busy:
            self._go_to(self.current - 1)

    def restore(self) -> None:
        """Bring back what was before."""
        step = self.step
        if isinstance(step, AcceptStep) and step.restorable:
            self._apply(step, "restored")

    def _go_to(self, number: int) -> None:
        self.work.leave()
        self.current = number
        page = self.definition.pages[number]
        page.step.enter()
        self.frame.show_page(page, number)
        page.entered()
        self.picture_worker.watch(page.step)
        self.feed.pause(page.centre is not None and not page.step.watches)
        self._kept = page.step.view().kept
        self.refresh()

    def _apply(self, step: AcceptStep, outcome: State) -> None:
        if self._job is not None:
            return
        before = step.state
        step.begin()
        self._job = Job(lambda progress: self._carry_out(step, outcome), lambda _: self._applied(step, outcome),
                        lambda sentence: self._not_applied(step, before, sentence), None, self).start()
        self.refresh()

    def _carry_out(self, step: AcceptStep, outcome: State) -> None:
        with contextlib.closing(self._context.connect()) as client:
            (step.apply if outcome == "used" else step.take_back)(client.command)

    def _applied(self, step: AcceptStep, outcome: State) -> None:
        self._job = None
        step.finish(outcome)
        assert step.proposal is not None
        rig = step.proposal.rig if outcome == "used" else step.proposal.rig_before
        if rig is not None:
            self.rig_used.emit(rig)
        self.used.emit(step.proposal, outcome == "used")
        self.refresh()

    def _not_applied(self, step: AcceptStep, before: State, sentence: str) -> None:
        self._job = None
        step.finish(before, sentence)
        self.refresh()

    # -- every tick ------------------------------------------------------------------------------------------------

    def tick(self) -> None:
        """What was seen in the newest pictures; what the step says to it; the pictures."""
        seen = self.picture_worker.found(self.step)
        if seen is not None:
            self.step.accept_observation(seen)
            self._dirty = True
        now = time.monotonic()
        if self._dirty or now >= self._next_show:
            self._next_show = now + SHOW_S
            self.refresh()
        self.frame.grid.refresh(self.feed)

    def refresh(self) -> None:
        """Ask the step and show it; begin its long work if it has some."""
        self._dirty = False
        self.work.offer(self.step)
        views = [page.step.view() for page in self.definition.pages]
        view = views[self.current]
        self.definition.pages[self.current].show_view(view)
        self.frame.show_view(view, self.step, self.current, [each.done for each in views])
        self.frame.grid.refresh(self.feed)
        if view.kept > self._kept:
            self.frame.grid.flash()
        self._kept = view.kept

    def _page_changed(self) -> None:
        self.work.halted = False
        self.refresh()

    def _pick(self, picture: Picture, x: float, y: float, width: float, height: float) -> None:
        self.definition.pages[self.current].pick(picture, x, y, width, height)
        self.refresh()

    # -- keys ------------------------------------------------------------------------------------------------------

    def _capture(self) -> None:
        if self.step.captures and self.step.capture():
            self.refresh()

    def undo(self) -> None:
        """Take the step's last capture back."""
        if self.step.undo():
            self._page_changed()

    # -- the end ---------------------------------------------------------------------------------------------------

    @property
    def would_lose(self) -> bool:
        """Whether closing now throws away what the person has done."""
        used = any(isinstance(page.step, AcceptStep) and page.step.state == "used" for page in self.definition.pages)
        return not used and any(page.step.keeps for page in self.definition.pages)

    def reject(self) -> None:
        """Escape and Close, unless something is just being put into force."""
        if not self.busy:
            super().reject()

    def stop(self) -> Callable[[], None]:
        """Threads and processes."""
        self.work.close()

        def wait() -> None:
            self.picture_worker.stop()
            self.feed.stop()
            if self.definition.put_back is not None:
                self.definition.put_back()

        return wait
