"""Cards of nodes and lines of markers keep to the width of their dock, however long what they say."""

from __future__ import annotations

import dataclasses

import msgspec
import numpy as np
from fake_engine import FakeEngine

from rhot_app.ui.models.palette import DARK
from rhot_app.ui.panels.markers_panel import MarkersPanel
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


def test_a_line_of_a_marker_is_no_wider_than_its_dock(themed):
    engine = FakeEngine(running=True)
    nodes = tuple(msgspec.structs.replace(node, name=f"the film of the {node.name} camera")
                  for node in engine.rig.nodes)
    rig = msgspec.structs.replace(engine.rig, nodes=nodes)
    state = engine.state(1.0)
    pixels = state.camera_pixels.copy()
    pixels[1] = np.nan
    state = dataclasses.replace(state, camera_pixels=pixels, camera_names=tuple(node.name for node in nodes))
    panel = MarkersPanel(DARK)
    panel.show_rig(rig)
    panel.show_state(state, running=True)
    assert any("the film" in word for word in panel.words)
    assert panel.minimumSizeHint().width() <= 264
    panel.deleteLater()
