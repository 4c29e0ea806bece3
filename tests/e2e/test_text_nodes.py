"""An original RHOT node is a text datagram per frame, as `nc -u` can send it: it moves the markers of a rig that
allows it, and nothing else."""

from __future__ import annotations

import socket
from collections.abc import Sequence

import numpy as np
import pytest
from bench import START_S, TEST_S, Bench, states_of, wait_until
from patience import PATIENCE_S, eventually
from scene import Scene, project

from rhot_app.engine.client import EngineClient
from rhot_app.state import HandState, Knowledge

RATE_HZ = 40.0


def text_of(pixels: np.ndarray) -> bytes:
    """``x,y;x,y;...`` as the thesis's node sends it."""
    return ";".join(f"{x:.2f},{y:.2f}" for x, y in pixels).encode() + b"\n"


def send(bench: Bench, client: EngineClient, points_m: np.ndarray, frames: int,
         garbage: Sequence[bytes] = ()) -> list[HandState]:
    """Send what both cameras would see of these points, and `garbage` in between; returns the states of that time."""
    states: list[HandState] = []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for frame in range(frames):
            for node in bench.rig.nodes:
                address = ("127.0.0.1", node.data_port)
                sender.sendto(text_of(project(node, points_m)), address)
                if garbage:
                    sender.sendto(garbage[frame % len(garbage)], address)
            states += states_of(client, 1.0 / RATE_HZ)
    return states


def send_until_it_follows(bench: Bench, client: EngineClient, points_m: np.ndarray,
                          garbage: Sequence[bytes] = ()) -> None:
    """Send until a state has every marker where it is."""
    def follows() -> bool:
        states = send(bench, client, points_m, len(garbage) or 1, garbage)
        return bool(states) and (states[-1].marker_knowledge != Knowledge.UNKNOWN).all() and (
            np.linalg.norm(states[-1].marker_raw_positions - points_m, axis=1).max() < 0.003)

    eventually(follows, told=lambda: client.state)


def count_dropped(client: EngineClient) -> int:
    """The fewest datagrams that the engine has dropped of a node."""
    return min(sum(node.dropped.values()) for node in client.status.nodes)


@pytest.mark.timeout(TEST_S)
def test_text_datagrams_move_the_markers_and_garbage_between_them_is_counted_and_dropped(bench: Bench) -> None:
    bench.allow_text()
    bench.start_engine("--start")
    here_m = Scene(bench.rig).markers_m(0.0)
    there_m = here_m + np.array([0.02, -0.03, 0.05])
    garbage = [b"", b"nan,nan;" * 6, b"1,2;3,4", b"\xff" * 200, b"1e308,1;" * 6, b"RHOT" + bytes(60), b"x" * 9000]
    with EngineClient(bench.sockets) as client:
        wait_until(client, lambda: client.status is not None, START_S, "the engine's status")
        for points_m in (here_m, there_m):
            send_until_it_follows(bench, client, points_m, garbage)
        before = count_dropped(client)
        send(bench, client, there_m, 2 * len(garbage), garbage)
        wait_until(client, lambda: count_dropped(client) >= before + 2 * len(garbage), PATIENCE_S, "every drop")
        error_m = np.linalg.norm(send(bench, client, there_m, 5)[-1].marker_raw_positions - there_m, axis=1)
        assert error_m.max() < 0.003, "garbage moves no marker"


@pytest.mark.timeout(TEST_S)
def test_a_rig_that_does_not_allow_text_ignores_it(bench: Bench) -> None:
    bench.start_engine("--start")
    with EngineClient(bench.sockets) as client:
        wait_until(client, lambda: client.status is not None, START_S, "the engine's status")
        states = send(bench, client, Scene(bench.rig).markers_m(0.0), 20)
        assert not any((state.marker_knowledge == Knowledge.MEASURED).any() for state in states)
        wait_until(client, lambda: count_dropped(client) == 20, PATIENCE_S, "every drop")
