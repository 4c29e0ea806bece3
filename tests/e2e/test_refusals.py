"""What cannot work is refused with a sentence and exit code 2, and leaves nothing behind."""

from __future__ import annotations

import json
import signal
import socket
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

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
@pytest.mark.parametrize("which", ["udp_port", "control_port"])
def test_a_taken_port_stops_a_node(bench: Bench, which: str) -> None:
    node = bench.rig.nodes[0]
    port = getattr(node, which)
    Scene(bench.rig).record(bench.folder / "left.yuv", node, 0.1)
    kind = socket.SOCK_DGRAM if which == "udp_port" else socket.SOCK_STREAM
    with socket.socket(socket.AF_INET, kind) as holder:
        holder.bind(("127.0.0.1", port))
        if kind == socket.SOCK_STREAM:
            holder.listen()
        assert refused(bench, bench.start_node(0, f"yuv:{bench.folder}/left.yuv"), "left", str(port))


@pytest.mark.timeout(TEST_S)
def test_a_second_engine_in_the_same_directory_is_refused(bench: Bench) -> None:
    first = bench.start_engine()
    with EngineClient(bench.sockets) as client:
        wait_until(client, lambda: client.status is not None, START_S, "the engine's status")
        second = bench.start(["rhot_app", "engine", "--rig", str(bench.rig_path), "--directory", str(bench.sockets)],
                             "second")
        assert refused(bench, second, "second", str(first.pid))
        assert client.command("hello")["pid"] == first.pid


def truncated(path: Path) -> None:
    """Half of the file is missing."""
    path.write_bytes(path.read_bytes()[:200])


def newer(path: Path) -> None:
    """The file is of a version to come."""
    path.write_text(json.dumps({**json.loads(path.read_text()), "version": 99}))


def foreign(path: Path) -> None:
    """The file is of another kind."""
    path.write_text('{"format": "shopping-list", "version": 1}')


def missing(path: Path) -> None:
    """The file is not there."""
    path.unlink()


@pytest.mark.timeout(TEST_S)
@pytest.mark.parametrize("damage", [truncated, newer, foreign, missing])
def test_bad_files_are_named(bench: Bench, damage: Callable[[Path], None]) -> None:
    node = bench.rig.nodes[0]
    damage(bench.rig_path)
    damage(bench.settings_path(node))
    engine = bench.start_engine()
    daemon = bench.start_node(0, "yuv:nowhere")
    refused(bench, engine, "engine", str(bench.rig_path))
    refused(bench, daemon, "left", str(bench.settings_path(node)))
    assert not list(bench.folder.glob(".*")), "no half-written file"


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


@pytest.mark.timeout(TEST_S)
@pytest.mark.parametrize("arguments", [["engine"], ["engine", "--rig"], ["dance"], ["replay"]])
def test_a_mistyped_command_is_code_2(arguments: list[str]) -> None:
    done = subprocess.run([sys.executable, "-m", "rhot_app", *arguments], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "Traceback" not in done.stderr
