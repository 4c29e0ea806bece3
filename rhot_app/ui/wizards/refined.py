"""The refined calibration: what a moving hand says of the cameras, before and after, and the button that uses it. The
wizards of what else the engine finds while it tracks are made of the same parts."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable

from rhot_app.calibration.proposal import Proposal
from rhot_app.calibration.registry import REFINED
from rhot_app.calibration.tracked_results import Answer, propose_poses, verdict_from
from rhot_app.errors import RhotError
from rhot_app.project import Rig
from rhot_app.ui.backend.contract import Asker
from rhot_app.ui.backend.reader import Reader
from rhot_app.ui.wizards.framework.definition import Definition, WizardContext, accept_page
from rhot_app.ui.wizards.framework.page import Page
from rhot_app.ui.wizards.models.step import Step, StepView

ASK_S = 1.0


def make_wizard(context: WizardContext, ask_s: float = ASK_S) -> Definition:
    """Move, compare, use it. The engine is asked every `ask_s`."""
    feed = EngineFeed(context.connect, "refined", ask_s)
    return compared(context, REFINED.title, feed, MoveStep(feed), propose_poses,
                    "The calibration in force still holds, or too little of the hand was seen.")


def compared(context: WizardContext, title: str, feed: EngineFeed, move: MoveStep,
             propose: Callable[[Answer, Rig], Proposal | None], nothing: str) -> Definition:
    """Move the hand, compare what the engine made of it with what is in force, use it. `nothing`: why there may be no
    proposal."""
    def proposal() -> Proposal | None:
        """What is in use stays: the engine begins anew with it."""
        return accept.accept.proposal if accept.accept.state == "used" else propose(move.answer, context.rig)

    accept = accept_page(context, proposal, nothing)
    return Definition(title, (MovePage(move, feed), accept), put_back=feed.stop)


class MovePage(Page):
    """The pictures stay; the sentence and the verdict are the window's."""

    def __init__(self, step: Step, feed: EngineFeed) -> None:
        super().__init__(step)
        self._feed = feed
        self.column.addStretch(1)

    def entered(self) -> None:
        """Ask from now on."""
        self._feed.start()


class EngineFeed(Reader):
    """Asks the engine one `command` again and again."""

    def __init__(self, connect: Callable[[], Asker], command: str, period_s: float = ASK_S) -> None:
        super().__init__()
        self._connect, self._command, self._period_s = connect, command, period_s
        self.answer: Answer = {"known": False}
        self.problem = ""

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


class ShowHandStep(MoveStep):
    """Shows how well the tracked hand is known by now."""

    title = "Show the hand"

    def _sentence(self) -> str:
        return "Start the tracking of a bare hand by its contours. Spread and bend every finger, and turn the hand."

    def view(self) -> StepView:
        """What to do, until the hand may be used."""
        if not self.answer["known"]:
            return StepView(self._sentence() if self._clock() - self._begun_s > ASK_S else "One moment.",
                            hint=self._feed.problem)
        verdict = verdict_from(self.answer)
        if not verdict.acceptable:
            return StepView(self._sentence(), verdict=verdict, hint=self._feed.problem or "It cannot be used as it is.")
        return StepView("Go on moving for a better result, or look at it.", done=True, verdict=verdict,
                        hint=self._feed.problem)


class ShowBonesStep(ShowHandStep):
    """Shows how well the bones of the tracked hand are known by now."""

    def _sentence(self) -> str:
        return "Start the tracking by landmarks. Show the open hand to two cameras for some seconds, and turn it."
