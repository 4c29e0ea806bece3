"""A step in which a movement is recorded: the engine writes the raw log that the commands read as well."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from rhot_app.calibration.collect import Bar, Guide, Movement
from rhot_app.state import HandState
from rhot_app.ui.wizards.models.step import Step, StepView

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

    def __init__(self, movement: Movement, folder: Path, recent: Callable[[], Sequence[HandState]]) -> None:
        """It ends by itself after the movement's seconds. `recent` gives the states of the last seconds; logs are
        written into `folder`. `unneeded` may be set to say why nothing need be recorded."""
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
            self.phase, self._began_s = "recording", time.monotonic()
        else:
            self.phase, self.log, self._ended_s = "recorded", request.path, time.monotonic()

    def refused(self, sentence: str) -> None:
        """The engine could not."""
        self.phase, self.problem, self.log = "waiting", sentence, None

    def view(self) -> StepView:
        """Time and guidance while it is recorded."""
        if self.phase in ("waiting", "recorded") and self.unneeded():
            return StepView(self.unneeded(), done=True)
        elapsed = time.monotonic() - self._began_s
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
            return f"{self._guide.sentence()} {max(0.0, self.seconds - elapsed_s):.0f} s left."
        if self.phase == "recorded":
            return f"{self._shortfall} Record again." if self._shortfall else "Recorded. Go on, or record again."
        return "One moment." if self.phase in ("beginning", "ending") else self._sentence

    def _bars(self, elapsed_s: float) -> tuple[Bar, ...]:
        done = {"recording": min(elapsed_s / self.seconds, 1.0), "ending": 1.0, "recorded": 1.0}.get(self.phase, 0.0)
        guide = self._guide.bars() if self._guide is not None else ()
        return (Bar("time", done, f"of {self.seconds:.0f} s recorded"), *guide)


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
        return (Bar("markers", self._seen, "markers measured by the cameras at this moment"),)

    def sentence(self) -> str:
        """The one sentence."""
        return self._sentence

    def shortfall(self) -> str:
        """Nobody can tell."""
        return ""
