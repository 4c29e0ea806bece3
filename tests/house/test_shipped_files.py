"""Every JSON file that ships reads as what it says it is, and the two-Pi example fits together."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from shipped_markers import RHOT6
from shipped_rig import TWO_PIS

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


def test_the_example_nodes_run_on_one_machine_and_the_first_has_the_ports_of_a_pi() -> None:
    ports = [(settings.udp_port, settings.control_port, settings.preview_port, settings.pairing_port)
             for settings in (load_settings(resource_path("nodes", f"{name}.json")) for name in ("left", "right"))]
    assert len({*ports[0], *ports[1]}) == 8
    assert {(node.udp_port, node.control_port, node.preview_port, node.pairing_port)
            for node in TWO_PIS.nodes} == {ports[0]}


def test_the_nodes_of_the_example_are_those_of_its_rig() -> None:
    assert [node.name for node in TWO_PIS.nodes] == ["left", "right"]
    for node in TWO_PIS.nodes:
        settings = load_settings(resource_path("nodes", f"{node.name}.json"))
        assert settings.node_id == node.node_id
        assert settings.broadcast_port == TWO_PIS.broadcast.port
        assert (settings.camera.width, settings.camera.height) == (node.intrinsics.width, node.intrinsics.height)
        assert settings.markers == TWO_PIS.markers == RHOT6
