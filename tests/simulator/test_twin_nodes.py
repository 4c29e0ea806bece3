"""Simulated nodes that do not come up: what is said of one that has ended, and of one that still works on it."""

from __future__ import annotations

import time
from contextlib import closing
from pathlib import Path

import pytest

from rhot_app.errors import SimulatorError
from rhot_app.simulator.nodes.nodes import TwinNode
from rhot_app.simulator.scene.scene import make_scene, node_settings, twin_defaults


def node(folder: Path, camera: str) -> TwinNode:
    return TwinNode(folder, node_settings(make_scene(twin_defaults(), 1), 0, trust="open"), camera)


def why_not(bad: TwinNode, within_s: float) -> str:
    with closing(bad), pytest.raises(SimulatorError) as caught:
        bad.wait_ready(time.monotonic() + within_s)
    return str(caught.value)


def test_of_a_node_that_ended_its_last_words_are_told(tmp_path: Path) -> None:
    told = why_not(node(tmp_path, str(tmp_path / "nowhere.avi")), 60.0)
    assert "left ended before it was ready" in told and "nowhere.avi" in told


def test_a_node_that_still_compiles_is_not_said_to_have_failed(tmp_path: Path) -> None:
    told = why_not(node(tmp_path, f"stream:{tmp_path / 'nobody'}"), 0.01)
    assert "was not ready in time" in told and "start again" in told and "left.log" in told
