"""What cannot work is refused with a sentence and exit code 2, and leaves nothing behind."""

from __future__ import annotations

import signal
import socket
import subprocess

import pytest
from bench import START_S, TEST_S, Bench, ends, wait_until
from patience import PATIENCE_S
from scene import Scene

from rhot_app.engine.client import EngineClient


def refused(bench: Bench, process: subprocess.Popen[bytes], name: str, *words: str) -> bool:
    """Whether a process ended with code 2 and one sentence that has these words; asserts each on its own."""
    assert ends(process, START_S), f"{name} did not end"
    said = bench.log(name)
    assert process.returncode == 2, said
    assert "Traceback" not in said
    for word in words:
        assert word in said
    return True


@pytest.mark.timeout(TEST_S)
def test_a_taken_data_port_stops_the_engine(bench: Bench) -> None:
    port = bench.rig.nodes[1].data_port
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as holder:
        holder.bind(("0.0.0.0", port))
        assert refused(bench, bench.start_engine(), "engine", str(port), "right")


@pytest.mark.timeout(TEST_S)
def test_a_second_engine_in_the_same_directory_is_refused(bench: Bench) -> None:
    first = bench.start_engine()
    with EngineClient(bench.sockets) as client:
        wait_until(client, lambda: client.status is not None, START_S, "the engine's status")
        second = bench.start(["rhot_app", "engine", "--rig", str(bench.rig_path), "--directory", str(bench.sockets)],
                             "second")
        assert refused(bench, second, "second", str(first.pid))
        assert client.command("hello")["pid"] == first.pid


@pytest.mark.timeout(TEST_S)
def test_an_interrupt_ends_everything_cleanly(bench: Bench, fresh_programs: None) -> None:
    """As users start them; that SIGTERM does, too, every test sees at its end."""
    node = bench.rig.nodes[0]
    Scene(bench.rig).record(bench.folder / "left.yuv", node, 0.1)
    processes = [bench.start_engine("--start"), bench.start_node(0, f"yuv:{bench.folder}/left.yuv")]
    with EngineClient(bench.sockets) as client:
        wait_until(client, lambda: client.status is not None and client.status.nodes[0].received > 0, START_S,
                   "a datagram")
    for process in processes:
        process.send_signal(signal.SIGINT)
    assert all(ends(process, PATIENCE_S) for process in processes)
    assert [process.returncode for process in processes] == [0, 0]
    assert "Traceback" not in bench.log("engine") + bench.log("left")
