"""Nodes of this computer that do not come up: what is said of one that has ended, and of one that still works on it."""

from __future__ import annotations

import fcntl
import itertools
import os
import time
from contextlib import closing
from pathlib import Path
from types import SimpleNamespace

import pytest
from patience import eventually, settled

from rhot_app.errors import SourceError
from rhot_app.simulator.scene.scene import make_scene, node_settings, twin_defaults
from rhot_app.sources import local_nodes
from rhot_app.sources.local_nodes import LocalNode, NodePorts, NodeSupervisor


def node(folder: Path, camera: str) -> LocalNode:
    return LocalNode(folder, node_settings(make_scene(twin_defaults(), 1), 0, trust="open"), camera)


def why_not(bad: LocalNode, within_s: float) -> str:
    with closing(bad), pytest.raises(SourceError) as caught:
        bad.wait_ready(time.monotonic() + within_s)
    return str(caught.value)


def test_of_a_node_that_ended_its_last_words_are_told(tmp_path: Path) -> None:
    told = why_not(node(tmp_path, str(tmp_path / "nowhere.avi")), 60.0)
    assert "left ended before it was ready" in told and "nowhere.avi" in told


def test_a_node_that_still_compiles_is_not_said_to_have_failed(tmp_path: Path) -> None:
    told = why_not(node(tmp_path, f"stream:{tmp_path / 'nobody'}"), 0.01)
    assert "was not ready in time" in told and "start again" in told and "left.log" in told


def test_a_node_that_cannot_start_is_tried_again_ever_more_seldom_and_said_once(
        tmp_path: Path, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch) -> None:
    now_s, started = [0.0], []

    class Dead:
        """A node that ends at once."""
        name, alive, ready_waits, log_path = "left", False, False, tmp_path / "left.log"

        def __init__(self, *_arguments: object, **_options: object) -> None:
            started.append(now_s[0])

        def wait_ready(self, _deadline_s: float) -> NodePorts:
            return NodePorts(1, 2, 3)

        def last_words(self) -> str:
            return "no such camera"

        def close(self) -> None:
            """It has ended."""
    monkeypatch.setattr(local_nodes, "LocalNode", Dead)
    monkeypatch.setattr(local_nodes, "time", SimpleNamespace(monotonic=lambda: now_s[0]))
    supervisor = NodeSupervisor(tmp_path, [node_settings(make_scene(twin_defaults(), 1), 0)], ["0"])
    assert supervisor.ports(0.0) is not None
    for tick in range(600):
        now_s[0] = 0.1 * tick
        supervisor.step()
    pauses = [later - earlier for earlier, later in itertools.pairwise(started)]
    assert pauses[0] < 1.0 and pauses[-1] == pytest.approx(8.1, abs=0.25) and sorted(pauses) == pauses
    assert caplog.text.count("no such camera") == 1


def test_nodes_are_used_while_an_engine_runs_or_the_program_that_started_it(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(local_nodes, "_LOOK_S", 0.0)
    lock = tmp_path / "engine.lock"
    use = local_nodes.Use(lock, unused_s=0.05)
    assert settled(lambda: not use.over(), 0.15)
    monkeypatch.setattr(os, "getppid", lambda: 1)
    with lock.open("wb") as engine:
        fcntl.flock(engine, fcntl.LOCK_EX)
        assert settled(lambda: not use.over(), 0.15)
    eventually(use.over)
