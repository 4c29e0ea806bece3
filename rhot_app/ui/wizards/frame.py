"""Where everything stands in a wizard's window. No behaviour."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QMenu, QPushButton, QStackedWidget, QVBoxLayout, QWidget

from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.theme import app_font
from rhot_app.ui.wizards.bars import BarsView
from rhot_app.ui.wizards.models.accept import AcceptStep
from rhot_app.ui.wizards.models.step import Step, StepView
from rhot_app.ui.wizards.page import Page
from rhot_app.ui.wizards.picture_view import PictureWall
from rhot_app.ui.wizards.plan import Plan
from rhot_app.ui.wizards.step_list import StepList
from rhot_app.ui.wizards.verdict_view import VerdictView
from rhot_app.ui.wizards.work import Work
from rhot_app.ui.wizards.work_view import WorkView

SENTENCE_PT = 21.0
"""Letters 5 mm high on a usual screen: readable from two metres."""

_RIGHT_PX = 312
_BELOW_PX = 168
_BARS_PX = 340


class WizardFrame:
    """The widgets, laid out in `parent`."""

    def __init__(self, plan: Plan, cameras: tuple[str, ...], work: Work, scheme: Scheme, parent: QWidget) -> None:
        self.steps = StepList([page.step.title for page in plan.pages], scheme)
        self.wall = PictureWall(cameras, scheme)
        self.middle = QStackedWidget()
        self.middle.addWidget(self.wall)
        self.middle.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        self.sentence = QLabel()
        self.sentence.setFont(app_font(SENTENCE_PT, bold=True))
        self.sentence.setWordWrap(True)
        self.sentence.setAlignment(Qt.AlignmentFlag.AlignTop | Qt.AlignmentFlag.AlignLeft)
        self.hint = QLabel()
        self.hint.setWordWrap(True)
        self.pages = QStackedWidget()
        for page in plan.pages:
            self.pages.addWidget(page)
            if page.centre is not None:
                self.middle.addWidget(page.centre)
        self.bars = BarsView(scheme)
        self.verdict = VerdictView(scheme)
        self.work_view = WorkView(work)
        self.below = QStackedWidget()
        self.below.addWidget(self.verdict)
        self.below.addWidget(self.work_view)
        self.close_button = QPushButton("Close")
        self.close_button.setToolTip("Escape. Nothing is saved before \"Use this calibration\".")
        self.back_button = QPushButton("Back")
        self.back_button.setToolTip("Alt+Left. Nothing is lost.")
        self.next_button = QPushButton("Next")
        self.next_button.setDefault(True)
        self.twin_button = QPushButton("Simulated hand does …")
        self.twin_button.setToolTip("The simulated rig only: what stands before its cameras.")
        self.twin_button.hide()
        for button in (self.close_button, self.back_button, self.twin_button):
            button.setAutoDefault(False)
        self._lay_out(parent)

    def _lay_out(self, parent: QWidget) -> None:
        right = QVBoxLayout()
        right.setSpacing(16)
        right.addWidget(self.sentence)
        right.addWidget(self.hint)
        right.addWidget(self.pages, 1)
        holder = QWidget()
        holder.setFixedWidth(_RIGHT_PX)
        holder.setLayout(right)
        right.setContentsMargins(0, 0, 0, 0)
        upper = QHBoxLayout()
        upper.setSpacing(16)
        upper.addWidget(self.steps)
        upper.addWidget(self.middle, 1)
        upper.addWidget(holder)
        self._lower = QFrame()
        self._lower.setProperty("panel", True)
        self._lower.setFixedHeight(_BELOW_PX)
        lower = QHBoxLayout(self._lower)
        lower.setContentsMargins(16, 8, 16, 8)
        lower.setSpacing(24)
        self.bars.setFixedWidth(_BARS_PX)
        lower.addWidget(self.bars, alignment=Qt.AlignmentFlag.AlignTop)
        lower.addWidget(self.below, 1)
        buttons = QHBoxLayout()
        buttons.addWidget(self.close_button)
        buttons.addWidget(self.twin_button)
        buttons.addStretch(1)
        buttons.addWidget(self.back_button)
        buttons.addWidget(self.next_button)
        layout = QVBoxLayout(parent)
        layout.setContentsMargins(16, 16, 16, 16)
        layout.setSpacing(16)
        layout.addLayout(upper, 1)
        layout.addWidget(self._lower)
        layout.addLayout(buttons)

    def offer_twin(self, menu: QMenu | None) -> None:
        """A button for what the simulated hand does; None on a real rig, where a person does it."""
        if menu is not None:
            self.twin_button.setMenu(menu)
        self.twin_button.setVisible(menu is not None)

    def show_page(self, page: Page, number: int) -> None:
        """Another step: its controls, and its own middle or the pictures."""
        self.pages.setCurrentWidget(page)
        self.middle.setCurrentWidget(page.centre if page.centre is not None else self.wall)
        self.wall.set_pickable(page.pickable)
        self.wall.show_one_large(page.one_large)
        self.back_button.setEnabled(number > 0)
        (page.first_field or self.middle).setFocus()  # so that Space captures and no button has it

    def show_view(self, view: StepView, step: Step, current: int, done: list[bool]) -> None:
        """What the step says now."""
        self.steps.show_steps(current, done)
        self.wall.show_cameras(step.cameras)
        self.wall.show_view(view)
        self.sentence.setText(view.sentence)
        working = self.work_view.wanted(step)
        self.hint.setText(view.hint)
        self.hint.setVisible(bool(view.hint) and not working)
        self.bars.show_bars(view.bars)
        self.bars.setVisible(bool(view.bars))
        self.verdict.show_verdict(view.verdict)
        self.below.setCurrentWidget(self.work_view if working else self.verdict)
        if working:
            self.work_view.refresh(view.hint)
        self._show_next(view, step, working)

    def _show_next(self, view: StepView, step: Step, working: bool) -> None:
        if isinstance(step, AcceptStep):
            self.next_button.setText("Close" if step.state == "used" else "Use this calibration")
            self.next_button.setEnabled(step.usable or step.state == "used")
            self.close_button.setVisible(step.state != "used")
        else:
            self.next_button.setText("Next")
            self.next_button.setEnabled(view.may_go_on and not working)
            self.close_button.setVisible(True)
