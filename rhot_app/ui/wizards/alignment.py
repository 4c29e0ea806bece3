"""The alignment wizard: another tracker's world in the rig, from a movement of both."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable

from PySide6.QtWidgets import QComboBox, QFormLayout, QLabel, QLineEdit, QPushButton

from rhot_app.calibration.registry import ALIGNMENT
from rhot_app.errors import EngineError
from rhot_app.ui.backend.feed import StateFeed
from rhot_app.ui.backend.pose_feed import PoseFeed
from rhot_app.ui.common.job import Job
from rhot_app.ui.common.sentence import Sentence
from rhot_app.ui.wizards.framework.definition import Definition, SettingsStore, WizardContext
from rhot_app.ui.wizards.framework.page import AcceptPage, ChartPage, Page
from rhot_app.ui.wizards.models.step import AcceptStep, SolveStep, StepView
from rhot_app.ui.wizards.steps.alignment_steps import (
    KINDS,
    AlignmentSolver,
    SourceStep,
    TogetherStep,
    charts_of,
    simulated_kind,
)

_KIND, _DETAIL, _TRACKER = "pose source", "pose source detail", "pose tracker"  # as they are remembered


def make_wizard(context: WizardContext, poses: PoseFeed | None = None,
                now_ns: Callable[[], int] = time.monotonic_ns) -> Definition:
    """Connect, move both, look at the fit, use it. `poses` hears the other tracker; `now_ns` is the master's clock."""
    if context.listen is None:
        raise EngineError("this window cannot hear the hand; open the wizard from the main window.")
    states, poses = StateFeed(context.listen), poses or PoseFeed()
    simulated = simulated_kind(context.rig_path)
    source = SourceStep(KINDS if simulated is None else (simulated, *KINDS), poses)
    together = TogetherStep(context.rig.markers.ids, poses, states.recent, now_ns)
    solver = AlignmentSolver(together, context.rig_path)
    solve = SolveStep(solver.task, lambda result: result.report.verdict, charts_of)
    accept = AcceptStep(lambda: solver.propose(solve.report), "Record a movement of both first.")

    def end() -> None:
        poses.stop()
        states.stop()

    pages = (SourcePage(source, context.memory), TogetherPage(together, states, context),
             ChartPage(solve, context.scheme), AcceptPage(accept, context.scheme))
    return Definition(ALIGNMENT.title, pages, solver="rhot_app.ui.wizards.steps.alignment_steps",
                      put_back=end)


class SourcePage(Page):
    """Chooses the source and shows whether its poses come."""

    def __init__(self, step: SourceStep, memory: SettingsStore) -> None:
        super().__init__(step)
        self.source, self._memory = step, memory
        self.kind, self.detail, self.tracker = QComboBox(), QLineEdit(), QLineEdit()
        self.kind.addItems([kind.label for kind in step.kinds])
        self.kind.currentIndexChanged.connect(self._choose)
        self.tracker.setPlaceholderText("the only one")
        self.tracker.setToolTip("Serial number, name or role. Empty: the only one.")
        self.meaning = Sentence(2, muted=True)
        self.connect_button = QPushButton("Connect")
        self.connect_button.setAutoDefault(False)
        self.connect_button.clicked.connect(self._connect)
        self.heard = QLabel()
        self.heard.setWordWrap(True)
        self.form = QFormLayout()
        for label, field in (("Source", self.kind), ("Where", self.detail), ("Tracker", self.tracker)):
            self.form.addRow(label, field)
        self.column.addLayout(self.form)
        for widget in (self.meaning, self.connect_button, self.heard):
            self.column.addWidget(widget)
        self.column.addStretch(1)
        self.first_field = self.kind
        labels = [kind.label for kind in step.kinds]
        remembered = memory.remembered(_KIND)
        self.kind.setCurrentIndex(labels.index(remembered) if remembered in labels and labels[0] != "Simulated" else 0)
        self.detail.setText(memory.remembered(_DETAIL))
        self.tracker.setText(memory.remembered(_TRACKER) if labels[0] != "Simulated" else "")
        self._choose(self.kind.currentIndex())

    def show_view(self, view: StepView) -> None:
        """What is heard."""
        feed = self.source.feed
        self.heard.setText(f"{feed.name[:60]}: {feed.rate_hz:.0f} poses a second" if feed.opened else "")

    def _choose(self, index: int) -> None:
        self.source.kind = kind = self.source.kinds[index]
        self.meaning.setText(kind.meaning)
        self.detail.setPlaceholderText(kind.detail)
        self.detail.setEnabled(bool(kind.detail))

    def _connect(self) -> None:
        self.source.detail, self.source.tracker = self.detail.text(), self.tracker.text()
        if self.source.kind.label != "Simulated":
            for name, text in ((_KIND, self.source.kind.label), (_DETAIL, self.source.detail),
                               (_TRACKER, self.source.tracker)):
                self._memory.remember(name, text)
        self.source.connect()
        self.changed.emit()


class TogetherPage(Page):
    """Records both."""

    def __init__(self, step: TogetherStep, states: StateFeed, context: WizardContext) -> None:
        super().__init__(step)
        self.together, self._states, self._connect = step, states, context.connect
        self._job: Job | None = None
        self.marker = QComboBox()
        self.marker.addItems(list(step.markers))
        self.marker.setCurrentIndex(step.marker)
        self.marker.setToolTip("The marker that the tracker is tied to.")
        self.marker.currentIndexChanged.connect(self._choose)
        self.button = QPushButton()
        self.button.setAutoDefault(False)
        self.button.setToolTip("Space. Begins or ends; it ends by itself when the time is over.")
        self.button.clicked.connect(self._press)
        form = QFormLayout()
        form.addRow("Marker", self.marker)
        self.column.addLayout(form)
        self.column.addWidget(self.button)
        self.column.addStretch(1)
        self.first_field = self.button
        self.twin_facts = "Moves and turns."

    def entered(self) -> None:
        """Hear the hand from now on; have a resting engine track."""
        self._states.start()
        self._job = Job(lambda progress: self._start_tracking(), lambda _: None, self._refused, None, self).start()

    def show_view(self, view: StepView) -> None:
        """The button's word."""
        words = {"waiting": "Record", "recording": "Stop", "recorded": "Record again"}
        self.button.setText(words[self.together.phase])
        self.marker.setEnabled(self.together.phase != "recording")

    def _choose(self, index: int) -> None:
        self.together.marker = index
        self.changed.emit()

    def _press(self) -> None:
        self.together.capture()
        self.changed.emit()

    def _refused(self, sentence: str) -> None:
        self.together.problem = sentence
        self.changed.emit()

    def _start_tracking(self) -> None:
        with contextlib.closing(self._connect()) as asker:
            if not asker.command("hello").get("running", True):
                asker.command("start")
