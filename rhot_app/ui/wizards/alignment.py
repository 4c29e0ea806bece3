"""The alignment wizard: another tracker's world in the rig, from a movement of both."""

from __future__ import annotations

import contextlib
import shlex
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PySide6.QtWidgets import QComboBox, QFormLayout, QLabel, QLineEdit

from rhot_app.calibration.collect import Bar, Movement
from rhot_app.calibration.kinds.alignment import StreamRecording
from rhot_app.errors import EngineError
from rhot_app.objects.alignment.fit import LASTING_M, SEARCH_S
from rhot_app.objects.alignment.report import FAIR_M, FAST_M_S, REACH_M, Coverage
from rhot_app.state import HandState
from rhot_app.ui.backend.feed import StateFeed
from rhot_app.ui.backend.pose_feed import PoseFeed
from rhot_app.ui.common.job import Job
from rhot_app.ui.common.parts import plain_button
from rhot_app.ui.common.sentence import Sentence
from rhot_app.ui.language import tr, tr_noop
from rhot_app.ui.wizards.framework.definition import Definition, SettingsStore, WizardContext, accept_result
from rhot_app.ui.wizards.framework.movement import MovementPage, MovementStep
from rhot_app.ui.wizards.framework.page import ChartPage, Page
from rhot_app.ui.wizards.framework.step import SolveStep, Step, StepView

_KIND, _DETAIL, _TRACKER = "pose source", "pose source detail", "pose tracker"  # as they are remembered

Array = NDArray[np.float64]

SECONDS = 20.0

ENOUGH_RAD = LASTING_M / FAIR_M
ENOUGH_M = LASTING_M * REACH_M / FAIR_M
ENOUGH_M_S = LASTING_M * FAST_M_S / FAIR_M
"""rad, m and m/s: of the verdict's "good" (`objects.alignment.report`)."""

LEAST_HZ = 20.0
"""Hz: hands move at up to 5 Hz, and a cubic needs four samples a period."""

_RECENT_NS = 1_000_000_000


def make_wizard(context: WizardContext, poses: PoseFeed | None = None,
                now_ns: Callable[[], int] = time.monotonic_ns) -> Definition:
    """Connect, move both, look at the fit, use it. `poses` hears the other tracker; `now_ns` is the master's clock."""
    if context.listen is None:
        raise EngineError(tr("this window cannot hear the hand; open the wizard from the main window."))
    states, poses = StateFeed(context.listen), poses or PoseFeed()
    simulated = simulated_kind(context.now.path)
    source = SourceStep(KINDS if simulated is None else (simulated, *KINDS), poses)
    together = TogetherStep(context.rig.markers.ids, poses, states.recent, now_ns)
    solve = SolveStep(context.calibration, context.now,
                      lambda: None if together.recording is None else (together.recording, SEARCH_S),
                      tr("Aligning both trackers …"))
    accept = accept_result(context, solve, tr("Record a movement of both first."))

    def end() -> None:
        poses.stop()
        states.stop()

    pages = (SourcePage(source, context.memory), TogetherPage(together, states, context),
             ChartPage(solve, context.scheme), accept)
    return Definition(pages, put_back=end)


# -- steps -------------------------------------------------------------------------------------------------------------

@dataclass(frozen=True, slots=True)
class SourceKind:
    """A kind of source: the `name` of `open_source` with the detail in place of {}, and what is said of it."""

    label: str
    name: str
    meaning: str
    detail: str = ""


KINDS: tuple[SourceKind, ...] = (
    SourceKind("SteamVR", "openvr", tr_noop("A Vive tracker, by SteamVR on this machine.")),
    SourceKind("libsurvive", "libsurvive", tr_noop("A Vive tracker, by survive-cli on this machine.")),
    SourceKind(tr_noop("Program"), "run:{}", tr_noop("A program that prints a line for each pose."),
               tr_noop("program and arguments")),
    SourceKind("UDP", "udp:{}", tr_noop("Lines that a program sends to this port."), "port"),
    SourceKind("TCP", "tcp:{}", tr_noop("A program that serves lines."), "host:port"))


def simulated_kind(rig_path: Path | None) -> SourceKind | None:
    """The simulated rig's own tracker; None on another rig."""
    if rig_path is None:
        return None
    from rhot_app.simulator.nodes.remote import SERVER_NAME  # with OpenCV

    if not (rig_path.parent / SERVER_NAME).exists():
        return None
    command = shlex.join([sys.executable, "-m", "rhot_app.simulator.nodes.tracker", str(rig_path.parent)])
    return SourceKind("Simulated", f"run:{command}", tr("A tracker on the simulated index fingertip."))


class SourceStep(Step):
    """A source is chosen and listened to. `kind`, `detail` and `tracker` are as entered."""

    title = tr_noop("The tracker")

    def __init__(self, kinds: Sequence[SourceKind], feed: PoseFeed) -> None:
        self.kinds, self.feed = tuple(kinds), feed
        self.kind, self.detail, self.tracker = self.kinds[0], "", ""

    def connect(self) -> None:
        """Listen to what was entered."""
        self.feed.open(self.kind.name.replace("{}", self.detail.strip()), self.tracker.strip())

    def view(self) -> StepView:
        """Whether poses come."""
        if not self.feed.opened:
            return StepView(tr("Choose the other tracker, switch it on, then connect."))
        rate_hz = self.feed.rate_hz
        bars = (Bar(tr("poses"), min(rate_hz / LEAST_HZ, 1.0),
                    tr("{least_hz:.0f} or more a second", least_hz=LEAST_HZ)),)
        if rate_hz >= LEAST_HZ:
            return StepView(tr("{rate_hz:.0f} poses a second. Go on.", rate_hz=rate_hz), done=True, bars=bars,
                            hint=self.feed.notice)
        return StepView(tr("Waiting for poses."), bars=bars, hint=self.feed.notice)


class MotionGuide:
    """Gathers the motion of both since it was made, and says what of it is missing."""

    def __init__(self, feed: PoseFeed, marker: int, now_ns: Callable[[], int]) -> None:
        """`marker` is the number of the fingertip's."""
        self._feed, self._marker, self._now_ns = feed, marker, now_ns
        self._began_ns = now_ns()
        self._places: list[tuple[int, Array]] = []
        self._coverage: Coverage | None = None

    def watch(self, states: Sequence[HandState]) -> None:
        """The marker's places, unfiltered: a filter's lag would be taken for the tracker's delay."""
        now_ns = self._now_ns()
        last_ns = self._places[-1][0] if self._places else self._began_ns
        for state in states:
            place = state.marker_raw_positions[self._marker]
            if last_ns < state.t_master_ns <= now_ns and np.isfinite(place).all():
                self._places.append((state.t_master_ns, np.array(place)))
                last_ns = state.t_master_ns
        self._coverage = self.recording.coverage

    @property
    def recording(self) -> StreamRecording:
        """What was gathered."""
        # the other clock may be off by as much as is searched
        poses = self._feed.between(self._began_ns - round(1e9 * SEARCH_S), self._now_ns())
        return StreamRecording(np.array([1e-9 * (pose.t_master_ns - self._began_ns) for pose in poses]),
                               np.array([pose.world_from_body for pose in poses]).reshape(-1, 4, 4),
                               np.array([1e-9 * (t_ns - self._began_ns) for t_ns, _ in self._places]),
                               np.array([place for _, place in self._places]).reshape(-1, 3))

    def bars(self) -> tuple[Bar, ...]:
        """How much of what an alignment needs the motion shows."""
        return bars_of(self._coverage)

    def sentence(self) -> str:
        """What is missing most."""
        return advice(self._coverage) or tr("Good, go on.")

    def shortfall(self) -> str:
        """The same; "" when nothing is."""
        return advice(self._coverage)


class TogetherStep(MovementStep):
    """Tracker and fingertip are moved together. Both streams are gathered here; no log is written."""

    def __init__(self, markers: Sequence[str], feed: PoseFeed, recent: Callable[[float], Sequence[HandState]],
                 now_ns: Callable[[], int] = time.monotonic_ns) -> None:
        """`recent` gives the hand's states of the last seconds."""
        super().__init__(
            Movement(tr("Move both"),
                     tr("Tie the tracker to the finger. Press Record, then move and turn both, irregularly."), SECONDS,
                     lambda: MotionGuide(feed, self.marker, now_ns), tr("Moves and turns.")),
            Path(), lambda: recent(4.0), lambda: 1e-9 * now_ns())
        self.markers, self.feed = tuple(markers), feed
        self.marker = self.markers.index("index") if "index" in self.markers else 0
        self.recording: StreamRecording | None = None
        self._now_ns, self._last_second = now_ns, lambda: recent(1.0)

    @property
    def keeps(self) -> bool:
        """A movement costs a person a minute."""
        return self.recording is not None

    def capture(self) -> bool:
        """Begin, or end."""
        if self.phase == "recording":
            assert isinstance(self._guide, MotionGuide)
            self._guide.watch(self._recent())
            self.phase, self.recording = "recorded", self._guide.recording
            return True
        self.problem = self._missing()
        if self.problem:
            return False
        self.phase, self.recording, self._guide = "recording", None, self._make_guide()
        self._number, self._began_s = self._number + 1, self._clock()
        return True

    def seen(self) -> bool:
        """Whether the marker was measured within the last second."""
        return any(np.isfinite(state.marker_raw_positions[self.marker]).all() for state in self._last_second())

    def _missing(self) -> str:
        if not self.feed.between(self._now_ns() - _RECENT_NS, self._now_ns()):
            return self.feed.notice or tr("The tracker gives no poses. Go back and connect it.")
        if not self.seen():
            return (tr("The marker {marker} is not seen by two cameras. Hold it before them, or choose another one.",
                       marker=self.markers[self.marker]))
        return ""

    def view(self) -> StepView:
        """With what is not seen while it is recorded."""
        view = super().view()
        if self.phase != "recording" or view.hint or self.seen():
            return view
        return replace(view, hint=self._missing())


def bars_of(coverage: Coverage | None) -> tuple[Bar, ...]:
    """How much of what an alignment needs the motion shows."""
    turn, reach, speed = (0.0, 0.0, 0.0) if coverage is None else (
        float(coverage.turn[0]) / ENOUGH_RAD, float(np.linalg.norm(coverage.spread_m[1:])) / ENOUGH_M,
        coverage.speed_m_s / ENOUGH_M_S)
    return (Bar(tr("turn"), min(turn, 1.0),
                tr("of the tracker about two axes, {degrees:.0f} degrees rms", degrees=np.degrees(ENOUGH_RAD))),
            Bar(tr("reach"), min(reach, 1.0),
                tr("of the finger across its longest way, {enough_mm:.0f} mm rms", enough_mm=1000.0 * ENOUGH_M)),
            Bar(tr("speed"), min(speed, 1.0),
                tr("of the finger, {enough_mm_s:.0f} mm/s rms", enough_mm_s=1000.0 * ENOUGH_M_S)))


def advice(coverage: Coverage | None) -> str:
    """Which motion is missing most; "" when none is."""
    if coverage is None:
        return tr("Keep the marker in view.")
    if coverage.turn[2] < ENOUGH_RAD:
        return tr("Turn the tracker while you move it.")
    if coverage.turn[0] < ENOUGH_RAD:
        return tr("Turn it about a second axis, too.")
    if np.linalg.norm(coverage.spread_m[1:]) < ENOUGH_M:
        return tr("Move farther: up and down, left and right, near and far.")
    return "" if coverage.speed_m_s >= ENOUGH_M_S else tr("Move faster.")


# -- pages -------------------------------------------------------------------------------------------------------------

class SourcePage(Page):
    """Chooses the source and shows whether its poses come."""

    def __init__(self, step: SourceStep, memory: SettingsStore) -> None:
        super().__init__(step)
        self.source, self._memory = step, memory
        self.kind, self.detail, self.tracker = QComboBox(), QLineEdit(), QLineEdit()
        self.kind.addItems([kind.label for kind in step.kinds])
        self.kind.currentIndexChanged.connect(self._choose)
        self.tracker.setPlaceholderText(tr("the only one"))
        self.tracker.setToolTip(tr("Serial number, name or role. Empty: the only one."))
        self.meaning = Sentence(2, muted=True)
        self.connect_button = plain_button(tr("Connect"), clicked=self._connect)
        self.heard = QLabel()
        self.heard.setWordWrap(True)
        self.form = QFormLayout()
        for label, field in ((tr("Source"), self.kind), (tr("Where"), self.detail), (tr("Tracker"), self.tracker)):
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
        self.heard.setText(tr("{name}: {rate_hz:.0f} poses a second", name=feed.name[:60], rate_hz=feed.rate_hz)
                           if feed.opened else "")

    def _choose(self, index: int) -> None:
        self.source.kind = kind = self.source.kinds[index]
        self.meaning.setText(tr(kind.meaning))
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


class TogetherPage(MovementPage):
    """Records both."""

    def __init__(self, step: TogetherStep, states: StateFeed, context: WizardContext) -> None:
        super().__init__(step, context.connect, states, tr("What both show is kept until this window closes."))
        self._job: Job | None = None
        self._connect = context.connect
        self.marker = QComboBox()
        self.marker.addItems(list(step.markers))
        self.marker.setCurrentIndex(step.marker)
        self.marker.setToolTip(tr("The marker that the tracker is tied to."))
        self.marker.currentIndexChanged.connect(self._choose)
        self.together = step
        form = QFormLayout()
        form.addRow(tr("Marker"), self.marker)
        self.column.insertLayout(0, form)
        self.first_field = self.button
        self.twin_facts = tr("Moves and turns.")

    def entered(self) -> None:
        """Hear the hand from now on; have a resting engine track."""
        super().entered()
        self._job = Job(lambda progress: self._start_tracking(), lambda _: None, self._refused, None, self).start()

    def show_view(self, view: StepView) -> None:
        """The button's word."""
        super().show_view(view)
        self.marker.setEnabled(self.together.phase != "recording")

    def _choose(self, index: int) -> None:
        self.together.marker = index
        self.changed.emit()

    def _refused(self, sentence: str) -> None:
        self.together.problem = sentence
        self.changed.emit()

    def _start_tracking(self) -> None:
        with contextlib.closing(self._connect()) as client:
            if not client.command("hello").get("running", True):
                client.command("start")
