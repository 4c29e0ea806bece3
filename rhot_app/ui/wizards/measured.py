"""The bones that the landmarks of a tracked hand show, beside the rig's, and the button that uses them."""

from __future__ import annotations

from functools import partial

from rhot_app.calibration.registry import MEASURED
from rhot_app.calibration.tracked_results import propose_hand
from rhot_app.ui.wizards.framework.definition import Definition, WizardContext
from rhot_app.ui.wizards.refined import ASK_S, EngineFeed, ShowBonesStep, compared


def make_wizard(context: WizardContext, ask_s: float = ASK_S) -> Definition:
    """Show the hand, compare its bones, use them. The engine is asked every `ask_s`."""
    feed = EngineFeed(context.connect, "measured", ask_s)
    return compared(context, MEASURED.title, feed, ShowBonesStep(feed), partial(propose_hand, reason=MEASURED.reason),
                    "Two cameras have not yet seen enough of the hand.")
