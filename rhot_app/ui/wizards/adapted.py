"""The adapted hand: what a bare hand that moves says of its lengths and radii, and the button that uses it."""

from __future__ import annotations

from functools import partial

from rhot_app.calibration.registry import ADAPTED
from rhot_app.calibration.tracked_results import propose_hand
from rhot_app.ui.wizards.framework.definition import Definition, WizardContext
from rhot_app.ui.wizards.refined import ASK_S, EngineFeed, ShowHandStep, compared


def make_wizard(context: WizardContext, ask_s: float = ASK_S) -> Definition:
    """Show the hand, compare, use it. The engine is asked every `ask_s`."""
    feed = EngineFeed(context.connect, "adapted", ask_s)
    return compared(context, ADAPTED.title, feed, ShowHandStep(feed), partial(propose_hand, reason=ADAPTED.reason),
                    "Too little of the hand was seen.")
