"""The depth wizard: distance from disparity without a board (RHOT 7.2.3)."""

from __future__ import annotations

from rhot_app.errors import EngineError
from rhot_app.ui.wizards.accept_page import AcceptPage
from rhot_app.ui.wizards.chart_page import ChartPage
from rhot_app.ui.wizards.depth_page import DistancePage
from rhot_app.ui.wizards.models.accept import AcceptStep
from rhot_app.ui.wizards.models.depth_steps import DistanceStep, LawStep, propose
from rhot_app.ui.wizards.plan import Kit, Plan
from rhot_app.ui.wizards.state_feed import StateFeed


def make_plan(kit: Kit) -> Plan:
    """Measure, look at the law, use it."""
    if kit.listen is None:
        raise EngineError("this window cannot hear the markers; open the wizard from the main window.")
    states = StateFeed(kit.listen)
    distances = DistanceStep(kit.rig, states.recent)
    law = LawStep(distances)
    accept = AcceptStep(lambda: propose(distances.report, kit.rig, kit.rig_path), "Measure some distances first.")
    pages = (DistancePage(distances, states), ChartPage(law, kit.scheme), AcceptPage(accept, kit.scheme))
    return Plan("Depth without a board", pages, put_back=states.stop)
