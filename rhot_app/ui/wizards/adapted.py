"""The adapted hand: what a bare hand that moves says of its lengths and radii, and the button that uses it."""

from __future__ import annotations

from rhot_app.ui.models.proposal import Proposal
from rhot_app.ui.wizards.framework.page import AcceptPage, Page
from rhot_app.ui.wizards.framework.plan import Kit, Plan
from rhot_app.ui.wizards.models.step import AcceptStep
from rhot_app.ui.wizards.refined import MovePage
from rhot_app.ui.wizards.steps.adapted_steps import ShowHandStep, propose
from rhot_app.ui.wizards.steps.refined_steps import EngineFeed

TITLE = "Adapt the hand's shape"


def make_plan(kit: Kit) -> Plan:
    """Show the hand, compare, use it."""
    feed = EngineFeed(kit.connect, "adapted")
    show = ShowHandStep(feed)

    def proposal() -> Proposal | None:
        """What is in use stays: the engine begins anew with it."""
        return accept.proposal if accept.state == "used" else propose(show.answer, kit.rig, kit.rig_path)

    accept = AcceptStep(proposal, "Too little of the hand was seen.")
    pages: tuple[Page, ...] = (MovePage(show, feed), AcceptPage(accept, kit.scheme))
    return Plan(TITLE, pages, put_back=feed.stop)
