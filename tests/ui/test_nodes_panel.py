"""The cards of the nodes keep to the width of their dock, whatever was lost."""

from __future__ import annotations

import dataclasses

from fake_engine import FakeEngine

from rhot_app.ui.models.palette import DARK
from rhot_app.ui.panels.nodes_panel import NodesPanel

DOCK_PX = 216


def test_a_card_is_no_wider_than_its_dock(themed):
    status = FakeEngine(running=True).status(1.0)
    nodes = tuple(dataclasses.replace(node, lost=1234, dropped={"marker_set": 1234}) for node in status.nodes)
    panel = NodesPanel(DARK)
    panel.show_status(dataclasses.replace(status, nodes=nodes))
    assert panel.cards[0].row.losses == "2468 frames unused"
    assert panel.minimumSizeHint().width() <= DOCK_PX
    panel.deleteLater()
