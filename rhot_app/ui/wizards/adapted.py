"""The adapted hand: what a bare hand that moves says of its lengths and radii, and the button that uses it."""

from __future__ import annotations

from rhot_app.calibration.registry import ADAPTED
from rhot_app.ui.wizards.framework.plan import Kit, Plan
from rhot_app.ui.wizards.refined import compared
from rhot_app.ui.wizards.steps.adapted_steps import ShowHandStep, propose_hand
from rhot_app.ui.wizards.steps.refined_steps import ASK_S, EngineFeed


def make_plan(kit: Kit, ask_s: float = ASK_S) -> Plan:
    """Show the hand, compare, use it. The engine is asked every `ask_s`."""
    feed = EngineFeed(kit.connect, "adapted", ask_s)
    return compared(kit, ADAPTED.title, feed, ShowHandStep(feed), propose_hand(ADAPTED.reason),
                    "Too little of the hand was seen.")
