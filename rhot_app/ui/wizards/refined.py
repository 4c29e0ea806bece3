"""The refined calibration: what a moving hand says of the cameras, before and after, and the button that uses it."""

from __future__ import annotations

from rhot_app.ui.models.proposal import Proposal
from rhot_app.ui.wizards.framework.page import AcceptPage, Page
from rhot_app.ui.wizards.framework.plan import Kit, Plan
from rhot_app.ui.wizards.models.step import AcceptStep, Step
from rhot_app.ui.wizards.steps.refined_steps import EngineFeed, MoveStep, propose

TITLE = "Use refined calibration"


class MovePage(Page):
    """The pictures stay; the sentence and the verdict are the window's."""

    def __init__(self, step: Step, feed: EngineFeed) -> None:
        super().__init__(step)
        self._feed = feed
        self.column.addStretch(1)

    def entered(self) -> None:
        """Ask from now on."""
        self._feed.start()


def make_plan(kit: Kit) -> Plan:
    """Move, compare, use it."""
    feed = EngineFeed(kit.connect, "refined")
    move = MoveStep(feed)

    def proposal() -> Proposal | None:
        """What is in use stays: the engine begins anew with it."""
        return accept.proposal if accept.state == "used" else propose(move.answer, kit.rig, kit.rig_path)

    accept = AcceptStep(proposal, "The calibration in force still holds, or too little of the hand was seen.")
    return Plan(TITLE, (MovePage(move, feed), AcceptPage(accept, kit.scheme)), put_back=feed.stop)
