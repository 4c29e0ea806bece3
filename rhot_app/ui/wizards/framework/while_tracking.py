"""The wizard of what the engine finds of itself while it tracks: move the hand, compare, use it."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable

from rhot_app.calibration.collect import Answer, WhileTracking
from rhot_app.calibration.proposal import Proposal
from rhot_app.calibration.verdict import verdict_from
from rhot_app.errors import RhotError
from rhot_app.ui.backend.contract import CommandClient, Connect
from rhot_app.ui.backend.reader import Reader
from rhot_app.ui.language import tr
from rhot_app.ui.wizards.framework.definition import Definition, WizardContext, accept_page
from rhot_app.ui.wizards.framework.page import Page
from rhot_app.ui.wizards.framework.step import Step, StepView

ASK_S = 1.0


def ask_engine(context: WizardContext, what: WhileTracking, ask_s: float = ASK_S) -> Definition:
    """The wizard of one answer; the engine is asked every `ask_s`."""
    feed = EngineFeed(context.connect, what.command, ask_s)
    propose = context.calibration.propose

    def proposal() -> Proposal | None:
        """What is in use stays: the engine begins anew with it."""
        assert propose is not None
        return accept.accept.proposal if accept.accept.state == "used" else propose(feed.answer, context.now)

    accept = accept_page(context, proposal, what.nothing)
    return Definition((MovePage(MoveStep(what, feed), feed), accept), put_back=feed.stop)


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

    def __init__(self, connect: Connect, command: str, period_s: float = ASK_S) -> None:
        super().__init__()
        self._connect, self._command, self._period_s = connect, command, period_s
        self.answer: Answer = {"known": False}
        self.problem = ""

    def step(self, client: CommandClient) -> None:
        """Ask once; a failure becomes the problem."""
        try:
            self.answer, self.problem = client.command(self._command), ""
        except RhotError as exc:
            self.problem = str(exc)

    def _run(self) -> None:
        with contextlib.closing(self._connect()) as client:
            while not self._ending.is_set():
                self.step(client)
                self._ending.wait(self._period_s)


class MoveStep(Step):
    """Shows what the moving hand has shown so far; the newest answer is kept when the person goes on."""

    def __init__(self, what: WhileTracking, feed: EngineFeed, clock: Callable[[], float] = time.monotonic) -> None:
        self.title = what.title
        self._what = what
        self._feed = feed
        self._clock = clock
        self._begun_s = clock()

    def view(self) -> StepView:
        """What to do, until the answer may be used."""
        answer, problem = self._feed.answer, self._feed.problem
        if not answer["known"]:
            waited_s = self._clock() - self._begun_s
            return StepView(self._what.sentence if waited_s > ASK_S else tr("One moment."), hint=problem)
        verdict = verdict_from(answer)
        said = self._what.say(answer, verdict)
        return StepView(said.sentence, done=said.done, verdict=verdict, hint=problem or said.hint)
