"""Every JSON file that ships reads as what it says it is, and the two-Pi example fits together."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from rhot_app.hand.anatomy import load_hand
from rhot_app.hand.articulated import load_articulated
from rhot_app.project import load_rig
from rhot_node.config import load_settings
from rhot_node.files import resource_path
from rhot_node.markers import load_markers

LOADERS: dict[str, Callable[[Path], Any]] = {
    "rhot-markers": load_markers, "rhot-hand": load_hand, "rhot-articulated": load_articulated,
    "rhot-rig": load_rig, "rhot-node": load_settings}
SHIPPED = sorted(resource_path().rglob("*.json"))


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.name)
def test_shipped_files_load(path: Path) -> None:
    kind = json.loads(path.read_text()).get("format")
    if kind in LOADERS:
        LOADERS[kind](path)
    else:
        assert kind, f"{path} does not say its format"


def test_the_nodes_of_the_example_are_those_of_its_rig() -> None:
    rig = load_rig(resource_path("rigs", "two_pis.json"))
    assert [node.name for node in rig.nodes] == ["left", "right"]
    for node in rig.nodes:
        settings = load_settings(resource_path("nodes", f"{node.name}.json"))
        assert settings.node_id == node.node_id
        assert (settings.udp_port, settings.control_port, settings.preview_port) == (
            node.udp_port, node.control_port, node.preview_port)
        assert settings.broadcast_port == rig.broadcast.port
        assert (settings.camera.width, settings.camera.height) == (node.intrinsics.width, node.intrinsics.height)
        assert settings.markers == rig.markers == load_markers(resource_path("markers", "rhot6.json"))
