"""The refined calibration without its widgets: what the engine has found from the moving hand, and what it proposes."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec

from rhot_app.calibration.registry import REFINED
from rhot_app.calibration.verdict import Finding, Grade, Verdict
from rhot_app.errors import EngineError, RhotError
from rhot_app.project import Rig, parse_rig
from rhot_app.ui.backend.contract import Asker
from rhot_app.ui.models.proposal import Proposal, RigChange, Row
from rhot_app.ui.models.rows import rig_rows
from rhot_app.ui.wizards.models.step import Step, StepView

ASK_S = 1.0

Answer = dict[str, Any]
MakeProposal = Callable[[Answer, Rig, Path | None], Proposal | None]


class EngineFeed:
    """Asks the engine one `command` again and again. A thread; `start` may be called again, `stop` ends it for good."""

    def __init__(self, connect: Callable[[], Asker], command: str, period_s: float = ASK_S) -> None:
        self._connect, self._command, self._period_s = connect, command, period_s
        self._ending = threading.Event()
        self._thread: threading.Thread | None = None
        self.answer: Answer = {"known": False}
        self.problem = ""

    def start(self) -> None:
        """Begin to ask, unless it does already."""
        if self._thread is None and not self._ending.is_set():
            self._thread = threading.Thread(target=self._run, name=f"asking for {self._command}", daemon=True)
            self._thread.start()

    def stop(self, timeout_s: float = 2.0) -> None:
        """End the thread."""
        self._ending.set()
        if self._thread is not None:
            self._thread.join(timeout_s)

    def step(self, asker: Asker) -> None:
        """Ask once; a failure becomes the problem."""
        try:
            self.answer, self.problem = asker.command(self._command), ""
        except RhotError as exc:
            self.problem = str(exc)

    def _run(self) -> None:
        with contextlib.closing(self._connect()) as asker:
            while not self._ending.is_set():
                self.step(asker)
                self._ending.wait(self._period_s)


class MoveStep(Step):
    """Shows what the moving hand has shown so far; the newest answer is kept when the person goes on."""

    title = "Move the hand"

    def __init__(self, feed: EngineFeed, clock: Callable[[], float] = time.monotonic) -> None:
        self._feed = feed
        self._clock = clock
        self._begun_s = clock()

    @property
    def answer(self) -> Answer:
        """The engine's newest."""
        return self._feed.answer

    def view(self) -> StepView:
        """What to do, until the refined calibration may be used."""
        answer = self._feed.answer
        if not answer["known"]:
            waited_s = self._clock() - self._begun_s
            sentence = "Start the tracking and move the hand through both pictures, near and far."
            return StepView(sentence if waited_s > ASK_S else "One moment.", hint=self._feed.problem)
        verdict = verdict_from(answer)
        if not answer["stale"]:
            return StepView("The calibration in force still holds: there is nothing to do." if verdict.acceptable else
                            "No better calibration was found.", verdict=verdict, hint=self._feed.problem)
        if not answer["usable"]:
            return StepView("Go on: move the hand through both pictures, near and far.", verdict=verdict,
                            hint=self._feed.problem or "The movement does not yet determine all of it.")
        return StepView("Go on moving for a better result, or look at it.", done=True, verdict=verdict,
                        hint=self._feed.problem)


def verdict_from(answer: Answer) -> Verdict:
    """The verdict in an engine's answer. Raises EngineError when it is of another version."""
    try:
        findings = tuple(Finding(one["code"], Grade(one["grade"]), one["figure"], one["cause"], one["remedy"])
                         for one in answer["findings"])
        return Verdict(answer["verdict"], findings)
    except (KeyError, TypeError, ValueError) as exc:
        raise EngineError(f"the engine's answer cannot be read ({exc}); is it of another version? Restart "
                          "engine and app.") from exc


def propose(answer: Answer, rig: Rig, path: Path | None) -> Proposal | None:
    """The rig with refined poses; None while there is nothing that may be used."""
    if not answer.get("known") or not answer["stale"]:
        return None
    after = parse_rig(msgspec.json.encode(answer["document"]), "the refined rig")
    # Nothing but poses: the rig may have been edited since the engine was asked.
    nodes = tuple(msgspec.structs.replace(node, pose=refined.pose) for node, refined
                  in zip(rig.nodes, after.nodes, strict=True))
    refined = msgspec.structs.replace(rig, nodes=nodes, calibration=after.calibration)
    figures = tuple(Row(what, before, now) for what, before, now in answer["rows"])
    return Proposal(REFINED.reason, verdict_from(answer), (*figures, *rig_rows(rig, refined)),
                    (RigChange(rig, refined, path, REFINED.reason),))
