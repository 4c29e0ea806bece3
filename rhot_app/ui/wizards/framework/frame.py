"""Where everything stands in a wizard's window. No behaviour."""

from __future__ import annotations

from PySide6.QtCore import QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QFontMetricsF, QPainter
from PySide6.QtWidgets import (
    QFrame,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QMenu,
    QProgressBar,
    QPushButton,
    QScrollArea,
    QSizePolicy,
    QStackedWidget,
    QVBoxLayout,
    QWidget,
)

from rhot_app.ui.common.parts import keep_width
from rhot_app.ui.common.sentence import Sentence
from rhot_app.ui.common.shapes import ShapeMark, paint_shape
from rhot_app.ui.common.theme import TEXT_PT, app_font
from rhot_app.ui.language import tr, tr_noop
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.wizards.framework.definition import Definition
from rhot_app.ui.wizards.framework.page import Page, VerdictView
from rhot_app.ui.wizards.framework.picture_view import PictureGrid
from rhot_app.ui.wizards.framework.step import AcceptStep, Bar, Step, StepView
from rhot_app.ui.wizards.framework.work import Work

SENTENCE_PT, SMALLEST_PT = 21.0, 13.0
"""Letters 5 mm high on a usual screen, readable from two metres; a sentence of more than four lines gets smaller ones.
"""

_SENTENCE_LINES = 4

_RIGHT_PX = 312
_BELOW_PX = 168
_BARS_PX = 340
_STATES = {"current": tr_noop("current"), "done": tr_noop("done"), "to come": tr_noop("to come")}


class WizardFrame:
    """The widgets, laid out in `parent`."""

    def __init__(self, definition: Definition, cameras: tuple[str, ...], work: Work, scheme: Scheme,
                 parent: QWidget) -> None:
        self._shown: Page | None = None
        self.steps = StepList([tr(page.step.title) for page in definition.pages], scheme)
        self.grid = PictureGrid(cameras, scheme)
        self.middle = QStackedWidget()
        self.middle.addWidget(self.grid)
        self.middle.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        self.sentence = Sentence(_SENTENCE_LINES, size_pt=SENTENCE_PT, smallest_pt=SMALLEST_PT, bold=True)
        self.hint = QLabel()
        self.hint.setWordWrap(True)
        self.hint.setTextFormat(Qt.TextFormat.PlainText)
        self.pages = QStackedWidget()
        for page in definition.pages:
            self.pages.addWidget(_scrolling(page))
            if page.centre is not None:
                self.middle.addWidget(page.centre)
        self.bars = BarsView(scheme)
        self.verdict = VerdictView(scheme)
        self.work_view = WorkView(work)
        self.below = QStackedWidget()
        self.below.addWidget(self.verdict)
        self.below.addWidget(self.work_view)
        self.close_button = QPushButton(tr("Close"))
        self.close_button.setToolTip(tr('Escape. Nothing is saved before "Use this calibration".'))
        self.back_button = QPushButton(tr("Back"))
        self.back_button.setToolTip(tr("Alt+Left. Nothing is lost."))
        self.next_button = QPushButton(tr("Next"))
        self.next_button.setDefault(True)
        self.twin_button = QPushButton(tr("Simulated hand does …"))
        self.twin_button.setToolTip(tr("The simulated rig only: what stands before its cameras."))
        self.twin_button.hide()
        self.twin_facts = Sentence(2, muted=True)
        for button in (self.close_button, self.back_button, self.twin_button):
            button.setAutoDefault(False)
        policy = self.close_button.sizePolicy()
        policy.setRetainSizeWhenHidden(True)
        self.close_button.setSizePolicy(policy)
        self._lay_out(parent)
        self._keep_width(definition)

    def _keep_width(self, definition: Definition) -> None:
        """Next is as wide as its longest word, so that Back never comes under a mouse that presses it."""
        steps = [page.step for page in definition.pages]
        keep_width(self.next_button, tr("Next"), tr("Close"),
                   *(tr(step.use_label) for step in steps if isinstance(step, AcceptStep)))

    def _lay_out(self, parent: QWidget) -> None:
        right = QVBoxLayout()
        right.setSpacing(16)
        right.addWidget(self.sentence)
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
        said = QVBoxLayout()
        said.setSpacing(8)
        said.addWidget(self.hint)
        said.addWidget(self.below, 1)
        lower.addLayout(said, 1)
        buttons = QHBoxLayout()
        buttons.addWidget(self.close_button)
        buttons.addWidget(self.twin_button)
        buttons.addWidget(self.twin_facts, 1)
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
        self.twin_facts.setText(self._shown.twin_facts if menu is not None and self._shown is not None else "")

    def show_page(self, page: Page, number: int) -> None:
        """Another step: its controls, and its own middle or the pictures."""
        self._shown = page
        self.twin_facts.setText(page.twin_facts if self.twin_button.menu() is not None else "")
        self.pages.setCurrentIndex(number)
        self.middle.setCurrentWidget(page.centre if page.centre is not None else self.grid)
        self.grid.set_pickable(page.pickable)
        self.grid.show_one_large(page.one_large)
        self.back_button.setEnabled(number > 0)
        (page.first_field or self.middle).setFocus()  # so that Space captures and no button has it

    def show_view(self, view: StepView, step: Step, current: int, done: list[bool]) -> None:
        """What the step says now."""
        self.steps.show_steps(current, done)
        self.grid.show_cameras(step.cameras)
        self.grid.show_view(view)
        self.sentence.setText(tr(view.sentence))
        working = self.work_view.wanted(step)
        self.hint.setText(tr(view.hint))
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
            self.next_button.setText(tr("Close") if step.state == "used" else tr(step.use_label))
            self.next_button.setEnabled(step.usable or step.state == "used")
            self.close_button.setVisible(step.state != "used")
        else:
            self.next_button.setText(tr("Next"))
            self.next_button.setEnabled(view.may_go_on and not working)
            self.close_button.setVisible(True)


def _scrolling(page: Page) -> QScrollArea:
    """The page, as high as it needs to be: where a small window has less room it scrolls."""
    area = QScrollArea()
    area.setProperty("clear", True)
    area.setWidgetResizable(True)
    area.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
    area.setFocusPolicy(Qt.FocusPolicy.NoFocus)
    area.setWidget(page)
    return area


# -- the steps at the left ---------------------------------------------------------------------------------------------

WIDTH_PX = 176


class StepList(QWidget):
    """Titles with marks. Not to click: steps build on each other, and Back and Next say what is possible."""

    def __init__(self, titles: list[str], scheme: Scheme, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._scheme = scheme
        self.setFixedWidth(WIDTH_PX)
        self._marks: list[ShapeMark] = []
        self._labels: list[QLabel] = []
        self.states: list[str] = []
        grid = QGridLayout()
        grid.setHorizontalSpacing(8)
        grid.setVerticalSpacing(16)
        grid.setColumnStretch(1, 1)
        for row, title in enumerate(titles):
            mark, label = ShapeMark(18), QLabel(title)
            label.setWordWrap(True)
            grid.addWidget(mark, row, 0)
            grid.addWidget(label, row, 1)
            self._marks.append(mark)
            self._labels.append(label)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 8, 0, 0)
        layout.addLayout(grid)
        layout.addStretch(1)

    def show_steps(self, current: int, done: list[bool]) -> None:
        """Mark the `current` step and those that are `done`."""
        states = ["current" if k == current else "done" if is_done else "to come" for k, is_done in enumerate(done)]
        if states == self.states:
            return
        self.states = states
        looks = {"current": ("play", "accent"), "done": ("tick", "good"), "to come": ("ring", "neutral")}
        for mark, label, state in zip(self._marks, self._labels, states, strict=True):
            shape, tone = looks[state]
            mark.set_shape(shape, self._scheme.tone(tone))
            label.setProperty("title", state == "current")
            label.setProperty("muted", state == "to come")
            label.style().unpolish(label)
            label.style().polish(label)
            label.setAccessibleName(f"{label.text()}: {tr(_STATES[state])}")


# -- long work on the screen -------------------------------------------------------------------------------------------

class WorkView(QWidget):
    """Visible while something is computed, and after it was cancelled until it is begun again."""

    again_asked = Signal()

    def __init__(self, work: Work, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._work = work
        self.label = Sentence(2, size_pt=14.0, smallest_pt=TEXT_PT, bold=True)
        self.bar = QProgressBar()
        self.bar.setRange(0, 1000)
        self.bar.setTextVisible(False)
        self.remaining = QLabel()
        self.remaining.setProperty("muted", True)
        self.cancel_button = QPushButton(tr("Cancel"))
        self.cancel_button.clicked.connect(work.cancel)
        self.again_button = QPushButton(tr("Begin again"))
        self.again_button.clicked.connect(self.again_asked)
        for button in (self.cancel_button, self.again_button):
            button.setAutoDefault(False)
        row = QHBoxLayout()
        row.addWidget(self.remaining, 1)
        row.addWidget(self.cancel_button)
        row.addWidget(self.again_button)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(self.label)
        layout.addStretch(1)
        layout.addWidget(self.bar)
        layout.addLayout(row)

    def wanted(self, step: Step) -> bool:
        """Whether there is something to show for `step`."""
        return self._work.running or (self._work.halted and step.task() is not None)

    def refresh(self, hint: str) -> None:
        """Show how far it is; `hint` is the step's word when it was halted."""
        running = self._work.running
        self.label.setText(self._work.text if running else hint)
        self.bar.setVisible(running)
        self.bar.setValue(round(1000 * self._work.fraction))
        self.remaining.setText(f"{100 * self._work.fraction:.0f} %   {self._work.remaining}" if running else "")
        self.cancel_button.setVisible(running)
        self.again_button.setVisible(not running)


# -- bars of progress --------------------------------------------------------------------------------------------------

_ROW_PX = 26
_MOST_PX = 152  # of all rows together: the part of the window that is kept for them
_BAR_PX = 12
_TICK_PX = 16


class BarsView(QWidget):
    """The bars of a step, one below the other."""

    def __init__(self, scheme: Scheme, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._scheme = scheme
        self.bars: tuple[Bar, ...] = ()
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)

    def sizeHint(self) -> QSize:  # noqa: N802
        """Room for all bars."""
        return QSize(260, self.row_px * max(len(self.bars), 1))

    @property
    def row_px(self) -> int:
        """Height of one bar's row: less where there are many."""
        return min(_ROW_PX, _MOST_PX // max(len(self.bars), 1))

    def show_bars(self, bars: tuple[Bar, ...]) -> None:
        """Other bars, or fuller ones."""
        if bars == self.bars:
            return
        if len(bars) != len(self.bars):
            self.updateGeometry()
        self.bars = bars
        self.setToolTip("\n".join(f"{tr(bar.name)}: {tr(bar.meaning)}" for bar in bars if bar.meaning))
        self.setAccessibleName(", ".join(f"{tr(bar.name)} {100 * min(bar.fraction, 1.0):.0f} %" for bar in bars))
        self.update()

    def paintEvent(self, event: object) -> None:  # noqa: N802
        """Name, bar, tick."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setFont(app_font())
        metrics = QFontMetricsF(painter.font())
        room = max((metrics.horizontalAdvance(tr(bar.name)) for bar in self.bars), default=0.0) + 12
        for row, bar in enumerate(self.bars):
            box = QRectF(0, row * self.row_px, self.width(), self.row_px)
            painter.setPen(QColor(self._scheme.text))
            painter.drawText(box, Qt.AlignmentFlag.AlignVCenter, tr(bar.name))
            track = QRectF(room, box.center().y() - _BAR_PX / 2, self.width() - room - _TICK_PX - 8, _BAR_PX)
            colour = QColor(self._scheme.good if bar.full else self._scheme.accent)
            painter.setPen(QColor(self._scheme.border))
            painter.setBrush(QColor(self._scheme.panel))
            painter.drawRoundedRect(track, 4, 4)
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(colour)
            filled = QRectF(track)
            filled.setWidth(track.width() * min(max(bar.fraction, 0.0), 1.0))
            painter.drawRoundedRect(filled, 4, 4)
            if bar.full:
                tick = QRectF(self.width() - _TICK_PX, box.center().y() - _TICK_PX / 2, _TICK_PX, _TICK_PX)
                paint_shape(painter, "tick", tick, colour)
        painter.end()
