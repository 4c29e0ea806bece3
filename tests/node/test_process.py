"""A real ``rhot-node`` process on real sockets: its whole life, its deaths, and what it says when it cannot start."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from node_process import OFFSET_S, PERIOD_NS, READY_S, SIZE, Node, Twin, i420, write_settings
from patience import eventually
from shipped_markers import RHOT6

from rhot_node.capture.yuv import YuvWriter
from rhot_node.wire.messages import NodeState, Stop

pytestmark = pytest.mark.timeout(READY_S + 100.0)


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("recording")
    frame = i420()
    with YuvWriter(folder, *SIZE, 4_000_000, 20_000) as writer:
        for k in range(40):
            writer.append(k * PERIOD_NS, frame)
    return folder


@pytest.fixture
def run_node() -> Iterator[Callable[..., Node]]:
    nodes: list[Node] = []

    def start(settings: Path, camera: str, *options: str) -> Node:
        nodes.append(Node(settings, camera, *options))
        return nodes[-1]

    yield start
    for node in nodes:
        node.end(signal.SIGKILL)


def test_a_whole_life(run_node: Callable[..., Node], tmp_path: Path, recording: Path, fresh_programs: None) -> None:
    node = run_node(write_settings(tmp_path), f"yuv:{recording}", "--loop")
    assert {key: node.ready[key] for key in ("event", "node_id", "name", "width", "height")} == {
        "event": "ready", "node_id": 3, "name": "left", "width": SIZE[0], "height": SIZE[1]}
    reply = node.clock()
    assert (reply.state, reply.session) == (NodeState.READY, 0)
    offset_s = (reply.t2_node_ns - reply.t1_master_ns) * 1e-9
    assert OFFSET_S <= offset_s < OFFSET_S + 0.5

    node.start(7)
    frames = node.observations(20)
    assert [frame.sequence for frame in frames] == list(range(20)) and {frame.session for frame in frames} == {7}
    steps = np.diff([frame.t_frame_node_ns for frame in frames]) / np.diff([frame.frame_number for frame in frames])
    assert np.median(steps) == pytest.approx(PERIOD_NS, rel=1e-3)
    assert all(marker.found for marker in frames[-1].markers) and len(frames[-1].markers) == 6
    assert (frames[-1].markers[0].x, frames[-1].markers[0].y) == pytest.approx((20.0, 20.0), abs=0.6)
    assert frames[-1].marker_checksum == RHOT6.checksum
    assert node.clock(7).state is NodeState.STREAMING and node.clock(7).session == 7

    state = json.loads(node.ask(request="state")[0])
    assert (state["state"], state["session"]) == ("streaming", 7)
    head, png = node.ask(request="still")
    assert json.loads(head)["ok"] and png.startswith(b"\x89PNG")
    counters = json.loads(node.ask(request="counters")[0])["counters"]
    assert counters["frames"] >= counters["sent"] >= 20 and counters["clock_requests"] >= 3

    node.say(Stop(7, 1))
    node.wait_for(NodeState.READY)
    node.socket.settimeout(0.2)
    with pytest.raises(TimeoutError):
        while True:
            node.hear()
    code, out, err = node.end()
    assert code == 0 and out == ""
    for change in ("starting -> ready", "ready -> streaming", "streaming -> ready"):
        assert change in err


def test_a_node_is_small_and_tells_the_service_manager(tmp_path: Path, recording: Path) -> None:
    """Neither the master's libraries nor Qt nor SciPy, within 250 MB, and signs of life as systemd wants them."""
    script = """import sys
from pathlib import Path
import rhot_node.__main__ as m
sys.argv[1:] = {!r}
code = m.main()
loaded = {{name.split(".")[0] for name, module in sys.modules.items() if module is not None}}
print(sorted(loaded & {{"scipy", "PySide6", "OpenGL", "pyqtgraph", "rhot_app"}}))
print(next(line.split()[1] for line in Path("/proc/self/status").read_text().splitlines() if line[:6] == "VmHWM:"))
sys.exit(code)"""
    arguments = ["--settings", str(write_settings(tmp_path)), "--camera", f"yuv:{recording}"]
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager:
        manager.bind(str(tmp_path / "notify"))
        manager.settimeout(0.1)
        environment = os.environ | {"NOTIFY_SOCKET": str(tmp_path / "notify"), "WATCHDOG_USEC": "1500000"}
        for _ in range(2):  # a start that had to compile takes more memory; the next one did not
            done = subprocess.run([sys.executable, "-c", script.format(arguments)], capture_output=True, text=True,
                                  timeout=READY_S, env=environment)
            assert done.returncode == 0, done.stderr
            _, unwanted, peak_kb = done.stdout.splitlines()
            heard = _drain(manager)
            if int(peak_kb) <= 250 * 1024:
                break
    assert unwanted == "[]" and "the recording is over" in done.stderr
    assert int(peak_kb) <= 250 * 1024, f"{peak_kb} kB"
    assert heard[0].startswith("READY=1\n") and heard[-1] == "STOPPING=1"
    assert heard[1:-1] and set(heard[1:-1]) == {"WATCHDOG=1"}


def _drain(sock: socket.socket) -> list[str]:
    heard: list[str] = []
    with contextlib.suppress(TimeoutError):
        while True:
            heard.append(sock.recv(200).decode())
    return heard


def test_killed_and_started_again_it_is_another_boot(run_node: Callable[..., Node], tmp_path: Path,
                                                     recording: Path) -> None:
    first = run_node(write_settings(tmp_path), f"yuv:{recording}", "--loop")
    boot_id = first.clock().boot_id
    first.start(7)
    first.observations(3)
    first.end(signal.SIGKILL)
    second = run_node(write_settings(tmp_path, udp_port=first.ready["udp_port"]), f"yuv:{recording}", "--loop")
    assert second.ready["udp_port"] == first.ready["udp_port"]
    reply = second.clock(7)
    assert reply.boot_id != boot_id and reply.state is NodeState.READY and reply.session == 0
    second.start(8)
    assert second.observations(3)[0].sequence == 0


def test_a_lost_camera_is_reported_and_the_stream_goes_on_when_it_is_back(run_node: Callable[..., Node],
                                                                          tmp_path: Path) -> None:
    path = tmp_path / "twin.sock"
    twin = Twin(path)
    node = run_node(write_settings(tmp_path), f"stream:{path}")
    node.start(7)
    before = node.observations(5)[-1]
    twin.close()
    node.wait_for(NodeState.FAULT, session=7)
    state = json.loads(node.ask(request="state")[0])
    assert state["state"] == "fault" and "twin" in state["message"]
    path.unlink()
    twin = Twin(path)
    node.wait_for(NodeState.STREAMING, session=7)
    after = node.observations(1)[0]
    assert after.session == 7 and after.sequence > before.sequence
    code, _, err = node.end(signal.SIGINT)
    twin.close()
    assert code == 0 and "streaming -> fault" in err and "fault -> streaming" in err


@pytest.mark.parametrize(("started", "said"), [(False, ""), (True, "in order")])
def test_a_node_that_starts_ends_even_where_an_exception_is_swallowed(started: bool, said: str) -> None:
    """As in the compiler's calls back to Python."""
    program = f"""
import os, signal
from rhot_node.__main__ import End
end = End(None)
if {started}:
    end.started()
try:
    os.kill(os.getpid(), signal.SIGTERM)
except KeyboardInterrupt:
    print("in order" if end.due() else "not asked")
else:
    print("alive")
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.returncode == 0 and done.stdout.strip() == said, done.stderr


def test_it_ends_with_the_process_that_started_it(tmp_path: Path, recording: Path) -> None:
    arguments = [sys.executable, "-m", "rhot_node", "--settings", str(write_settings(tmp_path)), "--camera",
                 f"yuv:{recording}", "--loop", "--exit-with-parent"]
    # It is started by a thread that ends at once, which must not end it.
    script = f"""
import subprocess, sys, threading, time
def start():
    global node
    node = subprocess.Popen({arguments!r}, stdout=subprocess.PIPE)
thread = threading.Thread(target=start); thread.start(); thread.join()
print(node.pid, flush=True)
node.stdout.readline()
time.sleep(0.2)
print(node.poll(), flush=True)
time.sleep(60)
"""
    parent = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
    assert parent.stdout is not None
    pid = int(parent.stdout.readline())
    assert parent.stdout.readline() == "None\n"
    parent.kill()
    parent.communicate()
    eventually(lambda: not _alive(pid), told=lambda: "the node outlived its parent")


def _alive(pid: int) -> bool:
    """Whether the process still runs; one that only waits to be reaped does not."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except FileNotFoundError:
        return False


def failed_start(*arguments: str) -> str:
    done = subprocess.run([sys.executable, "-m", "rhot_node", *arguments], capture_output=True, text=True,
                          timeout=READY_S)
    assert done.returncode == 2, done.stderr
    assert done.stdout == "" and "Traceback" not in done.stderr
    return done.stderr


def test_what_is_wrong_is_said_in_a_sentence_with_code_2(tmp_path: Path, recording: Path) -> None:
    settings = str(write_settings(tmp_path))
    assert "no such file" in failed_start("--settings", str(tmp_path / "none.json"), "--camera", "0")
    broken = tmp_path / "broken.json"
    broken.write_bytes(Path(settings).read_bytes()[:100])
    assert f"{broken}: not valid JSON" in failed_start("--settings", str(broken), "--camera", "0")
    settings = str(write_settings(tmp_path, trust="paired"))
    said = failed_start("--settings", settings, "--camera", "77")
    assert "/dev/video77: no such camera" in said
    assert "Pairing code" not in said and not list(tmp_path.glob("*.pairing.json")), "no code before it has started"
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        sock.bind(("127.0.0.1", 0))
        port = sock.getsockname()[1]
        taken = str(write_settings(tmp_path, udp_port=port))
        assert f"udp_port: UDP port {port}" in failed_start("--settings", taken, "--camera", f"yuv:{recording}")
    assert "--camera" in failed_start("--settings", settings)

