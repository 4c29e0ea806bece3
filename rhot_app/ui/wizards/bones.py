"""The bones wizard: enter lengths or move freely for a minute, see what is known of every bone, use the hand."""

from __future__ import annotations

from rhot_app.ui.wizards.accept_page import AcceptPage
from rhot_app.ui.wizards.bones_page import EntryPage, HandPage
from rhot_app.ui.wizards.models.accept import AcceptStep
from rhot_app.ui.wizards.models.bones_steps import SECONDS, EntryStep, HandStep, make_coach, propose
from rhot_app.ui.wizards.movement_kit import Movements
from rhot_app.ui.wizards.plan import Kit, Plan


def make_plan(kit: Kit) -> Plan:
    """Which hand, a minute of movement, the bones, use them."""
    movements = Movements(kit)
    entry = EntryStep(kit.rig.hand)
    page = movements.page("Move freely", "Press Record, then bend and stretch every finger and turn the hand.", SECONDS,
                          lambda: make_coach(kit.rig))
    page.movement.unneeded = lambda: "Press Next: the bones were entered." if entry.report is not None else ""
    hand = HandStep(entry, page.movement, kit.rig)
    accept = AcceptStep(lambda: propose(hand.report, kit.rig, kit.rig_path), "Record the movement first.")
    return Plan("Bones of the hand", (EntryPage(entry), page, HandPage(hand, kit.scheme),
                                      AcceptPage(accept, kit.scheme)),
                solver="rhot_app.calibration.bones", put_back=movements.end)
