"""A recorded movement: the engine writes the raw log that the commands read as well."""

from __future__ import annotations

import contextlib
import shutil
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, TypeVar

from PySide6.QtWidgets import QLabel, QPushButton

from rhot_app.calibration.collect import Bar, Guide, Movement
from rhot_app.errors import EngineError
from rhot_app.state import HandState
from rhot_app.ui.backend.contract import Connect
from rhot_app.ui.backend.feed import StateFeed
from rhot_app.ui.common.job import Job
from rhot_app.ui.language import tr, tr_noop
from rhot_app.ui.wizards.framework.definition import WizardContext
from rhot_app.ui.wizards.framework.page import Page
from rhot_app.ui.wizards.framework.step import Step, StepView

Phase = Literal["waiting", "beginning", "recording", "ending", "recorded"]
"""``beginning`` and ``ending`` are while the engine is asked; the page's worker does that."""


@dataclass(frozen=True, slots=True)
class Request:
    """What the page shall ask the engine now."""

    kind: Literal["begin", "end"]
    path: Path


class MovementStep(Step):
    """Space or the button begins, and ends. `log` is the finished recording; recording again forgets it."""

    captures = True

    def __init__(self, movement: Movement, folder: Path, recent: Callable[[], Sequence[HandState]],
                 clock: Callable[[], float] = time.monotonic) -> None:
        """It ends by itself after the movement's seconds. `recent` gives the states of the last seconds; logs are
        written into `folder`. `unneeded` may be set to say why nothing need be recorded."""
        self._clock = clock
        self.title = movement.title
        self.seconds = movement.seconds
        self.phase: Phase = "waiting"
        self.problem = ""
        self.log: Path | None = None
        self.unneeded: Callable[[], str] = lambda: ""
        self._sentence = movement.sentence
        self._folder = folder
        self._make_guide = movement.guide
        self._guide: Guide | None = None
        self._recent = recent
        self._number = 0
        self._began_s = 0.0
        self._ended_s = 0.0
        self._path = folder
        self._asked = False

    @property
    def keeps(self) -> bool:
        """A recording costs a person a minute."""
        return self.log is not None

    def capture(self) -> bool:
        """Begin, or end what is being recorded."""
        if self.phase in ("waiting", "recorded"):
            self.phase, self.problem, self.log = "beginning", "", None
            self._number += 1
            self._path = self._folder / f"{self.title.lower().replace(' ', '-')}-{self._number}.log"
            self._guide = self._make_guide()
        elif self.phase == "recording":
            self.phase = "ending"
        else:
            return False
        self._asked = False
        return True

    def request(self) -> Request | None:
        """What the engine must be asked, once."""
        if self._asked or self.phase not in ("beginning", "ending"):
            return None
        self._asked = True
        return Request("begin" if self.phase == "beginning" else "end", self._path)

    def answered(self, request: Request) -> None:
        """The engine did it."""
        if request.kind == "begin":
            self.phase, self._began_s = "recording", self._clock()
        else:
            self.phase, self.log, self._ended_s = "recorded", request.path, self._clock()

    def refused(self, sentence: str) -> None:
        """The engine could not."""
        self.phase, self.problem, self.log = "waiting", sentence, None

    def view(self) -> StepView:
        """Time and guidance while it is recorded."""
        if self.phase in ("waiting", "recorded") and self.unneeded():
            return StepView(self.unneeded(), done=True)
        elapsed = self._clock() - self._began_s
        if self.phase == "recording":
            assert self._guide is not None
            self._guide.watch(self._recent())
            if elapsed >= self.seconds:
                self.capture()
        recorded = self.phase == "recorded"
        return StepView(self._say(elapsed), done=recorded and not self._shortfall, passable=recorded, hint=self.problem,
                        bars=self._bars(elapsed), kept=self._number if recorded else 0)

    @property
    def _shortfall(self) -> str:
        return self._guide.shortfall() if self._guide is not None else ""

    def _say(self, elapsed_s: float) -> str:
        if self.phase == "recording":
            assert self._guide is not None
            return tr("{sentence} {left:.0f} s left.", sentence=self._guide.sentence(),
                      left=max(0.0, self.seconds - elapsed_s))
        if self.phase == "recorded" and self._shortfall:
            return tr("{shortfall} Record again.", shortfall=self._shortfall)
        if self.phase == "recorded":
            return tr("Recorded. Go on, or record again.")
        return tr("One moment.") if self.phase in ("beginning", "ending") else self._sentence

    def _bars(self, elapsed_s: float) -> tuple[Bar, ...]:
        done = {"recording": min(elapsed_s / self.seconds, 1.0), "ending": 1.0, "recorded": 1.0}.get(self.phase, 0.0)
        guide = self._guide.bars() if self._guide is not None else ()
        return (Bar(tr("time"), done, tr("of {seconds:.0f} s recorded", seconds=self.seconds)), *guide)


class QuietGuide:
    """Says one sentence all the time, and shows how many of the markers are seen."""

    def __init__(self, sentence: str) -> None:
        self.unneeded: Callable[[], str] = lambda: ""
        self._sentence = sentence
        self._seen = 0.0

    def watch(self, states: Sequence[HandState]) -> None:
        """Count the markers of the newest state."""
        if states:
            knowledge = states[-1].marker_knowledge
            self._seen = float((knowledge == 0).mean()) if len(knowledge) else 0.0

    def bars(self) -> tuple[Bar, ...]:
        """The markers that are measured now."""
        return (Bar(tr("markers"), self._seen, tr("markers measured by the cameras at this moment")),)

    def sentence(self) -> str:
        """The one sentence."""
        return self._sentence

    def shortfall(self) -> str:
        """Nobody can tell."""
        return ""


# -- the page: one large button; the engine is asked in a worker -------------------------------------------------------

NOTE = tr_noop("The engine records what the cameras send, into a file that goes when this window closes.")
_LABELS = {"waiting": tr_noop("Record"), "beginning": tr_noop("Record"), "recording": tr_noop("Stop"),
           "ending": tr_noop("Stop"),
           "recorded": tr_noop("Record again")}


class MovementPage(Page):
    """Begins and ends the recording of a `MovementStep`."""

    def __init__(self, step: MovementStep, connect: Connect, states: StateFeed, note: str = NOTE) -> None:
        super().__init__(step)
        self.movement = step
        self._connect = connect
        self._states = states
        self._job: Job | None = None
        self.button = QPushButton()
        self.button.setAutoDefault(False)
        self.button.setToolTip(tr("Space. Begins or ends the recording; it ends by itself when the time is over."))
        self.button.clicked.connect(self._press)
        words = QLabel(tr(note))
        words.setWordWrap(True)
        words.setProperty("muted", True)
        self.column.addWidget(self.button)
        self.column.addWidget(words)
        self.column.addStretch(1)

    def entered(self) -> None:
        """Hear the hand from now on."""
        self._states.start()

    def _press(self) -> None:
        if self.movement.capture():
            self.changed.emit()

    def show_view(self, view: StepView) -> None:
        """The button's word; ask the engine what the step wants."""
        phase = self.movement.phase
        self.button.setText(tr(_LABELS[phase]))
        self.button.setEnabled(phase in ("waiting", "recording", "recorded"))
        request = self.movement.request()
        if request is not None:
            self._job = Job(lambda progress: self._ask(request), lambda _: self._answered(request), self._refused, None,
                            self).start()

    def _ask(self, request: Request) -> None:
        with contextlib.closing(self._connect()) as client:
            if request.kind == "end":
                client.command("record_stop")
            else:
                if not client.command("hello").get("running", True):
                    client.command("start")
                client.command("record", path=str(request.path))

    def _answered(self, request: Request) -> None:
        self.movement.answered(request)
        self.changed.emit()

    def _refused(self, sentence: str) -> None:
        self.movement.refused(sentence)
        self.changed.emit()


# -- Movements recorded for a wizard -----------------------------------------------------------------------------------

PageT = TypeVar("PageT", bound=MovementPage)
StepT = TypeVar("StepT", bound=MovementStep)


class Movements:
    """Makes the pages of recorded movements; `end` is the definition's `put_back`."""

    def __init__(self, context: WizardContext) -> None:
        if context.listen is None:
            raise EngineError(tr("this window cannot hear the hand; open the wizard from the main window."))
        self.states = StateFeed(context.listen)
        self._connect = context.connect
        self.folder = Path(tempfile.mkdtemp(prefix="rhot-wizard-"))
        self._steps: list[MovementStep] = []

    def page(self, movement: Movement) -> MovementPage:
        """A page that records a movement."""
        return self.page_of(MovementPage, movement)

    def page_of(self, make: Callable[[MovementStep, Connect, StateFeed], PageT],
                movement: Movement) -> PageT:
        """The same on a page that shows more."""
        page = make(self.add(MovementStep(movement, self.folder, self.states.recent)), self._connect, self.states)
        page.twin_facts = tr(movement.simulated)
        return page

    def add(self, step: StepT) -> StepT:
        """A step made elsewhere, which `end` shall end as well; it writes into `folder`."""
        self._steps.append(step)
        return step

    def end(self) -> None:
        """End a recording that still runs, and throw the logs away. In a worker."""
        self.states.stop()
        if any(step.phase in ("beginning", "recording", "ending") for step in self._steps):
            with contextlib.closing(self._connect()) as client:
                client.command("record_stop")
        shutil.rmtree(self.folder, ignore_errors=True)
