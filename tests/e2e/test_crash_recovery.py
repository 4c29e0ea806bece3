"""Nodes and engines die in the middle (kill -9) and come back: what remains goes on, and what returns is taken in."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pytest
from bench import FPS, START_S, TEST_S, Bench, kill_hard, states_of, streams, tracks, wait_until
from patience import PATIENCE_S, eventually
from scene import start_still_hand

from rhot_app.engine.client import EngineClient

NOTICED_S = 1.0
REJOINED_S = 2.0


@dataclass
class Running:
    """A bench whose nodes and engine stream a hand that holds still."""

    bench: Bench
    engine: subprocess.Popen[bytes]
    nodes: list[subprocess.Popen[bytes]]
    client: EngineClient


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    """Nodes, engine and client, once states flow; so does every test leave them."""
    bench = Bench(tmp_path_factory.mktemp("crashes"))
    try:
        with EngineClient(bench.sockets) as client:
            running = Running(bench, *start_still_hand(bench), client)
            wait_until(client, lambda: tracks(client), START_S, "states from both nodes")
            yield running
    finally:
        bench.clear()


def wait_ready(bench: Bench, name: str, times: int) -> None:
    """Wait until a node has said "ready" so many times in its log."""
    eventually(lambda: bench.log(name).count('"event": "ready"') >= times, START_S,
               told=lambda: f"{name} did not become ready: {bench.log(name)}")


@pytest.mark.timeout(TEST_S)
def test_a_killed_node_shows_within_a_second_and_joins_again(running: Running) -> None:
    bench, client = running.bench, running.client
    shown_s, named_s, joined_s = [], [], []
    for life in range(2, 6):  # the quickest of a few counts: the machine has other things to do
        kill_hard(running.nodes[0])
        shown_s.append(wait_until(client, lambda: not streams(client, "left"), PATIENCE_S, "the silent node shows"))
        named_s.append(wait_until(client, lambda: any("left" in advice.text for advice in client.status.advice),
                                  PATIENCE_S, "a sentence names the silent node"))
        wait_until(client, lambda: streams(client, "right"), PATIENCE_S, "the other node goes on")
        running.nodes[0] = bench.start_node(0, f"yuv:{bench.folder}/left.yuv")
        wait_ready(bench, "left", life)
        joined_s.append(wait_until(client, lambda: tracks(client), PATIENCE_S, "the node joins again"))
        if max(shown_s[-1], named_s[-1]) < NOTICED_S and joined_s[-1] < REJOINED_S:
            break
    assert min(shown_s) < NOTICED_S and min(named_s) < NOTICED_S and min(joined_s) < REJOINED_S


@pytest.mark.timeout(TEST_S)
def test_a_new_engine_takes_over_from_a_killed_one(running: Running) -> None:
    bench, client = running.bench, running.client
    kill_hard(running.engine)
    wait_until(client, lambda: not client.connected, PATIENCE_S, "the client sees that the engine is gone")
    assert [node.poll() for node in running.nodes] == [None, None], "nodes outlive the engine"
    running.engine = bench.start_engine("--start")
    wait_until(client, lambda: client.status is not None and client.status.pid == running.engine.pid, START_S,
               "a new status")
    wait_until(client, lambda: tracks(client), START_S, "the nodes join the new engine")
    assert [node.poll() for node in running.nodes] == [None, None]


WATCHER = """
import sys
from pathlib import Path
from rhot_app.engine.client import EngineClient
with EngineClient(Path(sys.argv[1])) as client:
    while True:
        client.poll(0.1)
        if client.state is not None:
            print("watching", flush=True)
"""


@pytest.mark.timeout(TEST_S)
def test_a_killed_client_takes_nothing_with_it(running: Running) -> None:
    bench, client = running.bench, running.client
    watcher = bench.start_code(WATCHER, str(bench.sockets), name="watcher")
    wait_until(client, lambda: "watching" in bench.log("watcher"), START_S, "the second client sees states")
    kill_hard(watcher)
    numbers: list[int] = []
    while len(numbers) < FPS:
        numbers += [state.sequence for state in states_of(client, 0.05)]
    assert (np.diff(numbers) == 1).all(), "every state still arrives"
    assert running.engine.poll() is None
    with EngineClient(bench.sockets) as late:
        wait_until(late, lambda: late.state is not None, PATIENCE_S, "a new client attaches")
