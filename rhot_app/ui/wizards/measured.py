"""The bones that the landmarks of a tracked hand show, beside the rig's, and the button that uses them."""

from __future__ import annotations

from rhot_app.calibration.registry import MEASURED
from rhot_app.ui.wizards.framework.definition import Definition, WizardContext
from rhot_app.ui.wizards.refined import compared
from rhot_app.ui.wizards.steps.adapted_steps import ShowBonesStep, propose_hand
from rhot_app.ui.wizards.steps.refined_steps import ASK_S, EngineFeed


def make_wizard(context: WizardContext, ask_s: float = ASK_S) -> Definition:
    """Show the hand, compare its bones, use them. The engine is asked every `ask_s`."""
    feed = EngineFeed(context.connect, "measured", ask_s)
    return compared(context, MEASURED.title, feed, ShowBonesStep(feed), propose_hand(MEASURED.reason),
                    "Two cameras have not yet seen enough of the hand.")
