"""An original RHOT node is a text datagram per frame, as `nc -u` can send it: it moves the markers of a rig that
allows it, and nothing else."""

from __future__ import annotations

import socket
from collections.abc import Sequence

import numpy as np
import pytest
from bench import START_S, TEST_S, Bench, states_of, wait_until
from patience import PATIENCE_S
from scene import Scene, project

from rhot_app.engine.client import EngineClient
from rhot_app.state import HandState, Knowledge

RATE_HZ = 40.0


def text_of(pixels: np.ndarray) -> bytes:
    """``x,y;x,y;...`` as the thesis's node sends it."""
    return ";".join(f"{x:.2f},{y:.2f}" for x, y in pixels).encode() + b"\n"


def send_for(bench: Bench, client: EngineClient, points_m: np.ndarray, seconds: float,
             garbage: Sequence[bytes] = ()) -> list[HandState]:
    """Send what both cameras would see of these points, and `garbage` in between; returns the states of that time."""
    states: list[HandState] = []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for frame in range(round(seconds * RATE_HZ)):
            for node in bench.rig.nodes:
                address = ("127.0.0.1", node.data_port)
                sender.sendto(text_of(project(node, points_m)), address)
                if garbage:
                    sender.sendto(garbage[frame % len(garbage)], address)
            states += states_of(client, 1.0 / RATE_HZ)
    return states


@pytest.mark.timeout(TEST_S)
def test_text_datagrams_move_the_markers(bench: Bench) -> None:
    bench.allow_text()
    bench.start_engine("--start")
    here_m = Scene(bench.rig).markers_m(0.0)
    there_m = here_m + np.array([0.02, -0.03, 0.05])
    with EngineClient(bench.sockets) as client:
        wait_until(client, lambda: client.status is not None, START_S, "the engine's status")
        for points_m in (here_m, there_m):
            state = send_for(bench, client, points_m, 1.5)[-1]
            assert (state.marker_knowledge != Knowledge.UNKNOWN).all()
            assert np.linalg.norm(state.marker_raw_positions - points_m, axis=1).max() < 0.003


@pytest.mark.timeout(TEST_S)
def test_garbage_between_text_datagrams_is_counted_and_dropped(bench: Bench) -> None:
    bench.allow_text()
    bench.start_engine("--start")
    points_m = Scene(bench.rig).markers_m(0.0)
    garbage = [b"", b"nan,nan;" * 6, b"1,2;3,4", b"\xff" * 200, b"1e308,1;" * 6, b"RHOT" + bytes(60), b"x" * 9000]
    with EngineClient(bench.sockets) as client:
        wait_until(client, lambda: client.status is not None, START_S, "the engine's status")
        states = send_for(bench, client, points_m, 2.0, garbage)
        assert np.linalg.norm(states[-1].marker_raw_positions - points_m, axis=1).max() < 0.003
        wait_until(client, lambda: client.status is not None and all(
            sum(node.dropped.values()) >= 0.9 * 2.0 * RATE_HZ for node in client.status.nodes),
            PATIENCE_S, "every drop")


@pytest.mark.timeout(TEST_S)
def test_a_rig_that_does_not_allow_text_ignores_it(bench: Bench) -> None:
    bench.start_engine("--start")
    with EngineClient(bench.sockets) as client:
        wait_until(client, lambda: client.status is not None, START_S, "the engine's status")
        states = send_for(bench, client, Scene(bench.rig).markers_m(0.0), 1.0)
        assert not any((state.marker_knowledge == Knowledge.MEASURED).any() for state in states)
        wait_until(client, lambda: client.status is not None and all(
            sum(node.dropped.values()) > 0.9 * RATE_HZ for node in client.status.nodes), PATIENCE_S, "every drop")
