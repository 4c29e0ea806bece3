"""The refined calibration: what a moving hand says of the cameras, before and after, and the button that uses it."""

from __future__ import annotations

from rhot_app.calibration.registry import REFINED
from rhot_app.ui.models.proposal import Proposal
from rhot_app.ui.wizards.framework.definition import Definition, WizardContext
from rhot_app.ui.wizards.framework.page import AcceptPage, Page
from rhot_app.ui.wizards.models.step import AcceptStep, Step
from rhot_app.ui.wizards.steps.refined_steps import ASK_S, EngineFeed, MakeProposal, MoveStep, propose


class MovePage(Page):
    """The pictures stay; the sentence and the verdict are the window's."""

    def __init__(self, step: Step, feed: EngineFeed) -> None:
        super().__init__(step)
        self._feed = feed
        self.column.addStretch(1)

    def entered(self) -> None:
        """Ask from now on."""
        self._feed.start()


def make_wizard(context: WizardContext, ask_s: float = ASK_S) -> Definition:
    """Move, compare, use it. The engine is asked every `ask_s`."""
    feed = EngineFeed(context.connect, "refined", ask_s)
    return compared(context, REFINED.title, feed, MoveStep(feed), propose,
                    "The calibration in force still holds, or too little of the hand was seen.")


def compared(context: WizardContext, title: str, feed: EngineFeed, move: MoveStep, make: MakeProposal,
             nothing: str) -> Definition:
    """Move the hand, compare what the engine made of it with what is in force, use it. `nothing`: why there may be no
    proposal."""
    def proposal() -> Proposal | None:
        """What is in use stays: the engine begins anew with it."""
        return accept.proposal if accept.state == "used" else make(move.answer, context.rig, context.rig_path)

    accept = AcceptStep(proposal, nothing)
    return Definition(title, (MovePage(move, feed), AcceptPage(accept, context.scheme)), put_back=feed.stop)
