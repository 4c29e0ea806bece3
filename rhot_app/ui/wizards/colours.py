"""The colour wizard: pick every marker's paint, look at the mask, see what may be mistaken for it, use it."""

from __future__ import annotations

from rhot_app.ui.wizards.accept_page import AcceptPage
from rhot_app.ui.wizards.apart_page import ApartPage
from rhot_app.ui.wizards.colour_page import BoundsPage, PickPage
from rhot_app.ui.wizards.models.accept import AcceptStep
from rhot_app.ui.wizards.models.colour_bounds import BoundsStep
from rhot_app.ui.wizards.models.colour_pick import PickStep
from rhot_app.ui.wizards.models.colour_result import ApartStep, propose
from rhot_app.ui.wizards.plan import Kit, Plan


def make_plan(kit: Kit) -> Plan:
    """The wizard's pages for the rig at hand."""
    cameras = tuple(node.name for node in kit.rig.nodes if not node.text_datagrams)
    picks = PickStep(kit.rig.markers, cameras)
    bounds = BoundsStep(picks)
    apart = ApartStep(bounds)
    accept = AcceptStep(lambda: propose(apart.judged, kit.rig, kit.rig_path, kit.node_settings),
                        "Pick the markers' colours first.")
    pages = (PickPage(picks, kit.scheme), BoundsPage(bounds, kit.scheme), ApartPage(apart, kit.scheme),
             AcceptPage(accept, kit.scheme))
    return Plan("Colours of the markers", pages, solver="rhot_app.calibration.colours")
