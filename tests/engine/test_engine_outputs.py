"""An engine with outputs: asked for on the command line and by the rig, refused, and told in its status."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
from pathlib import Path

import msgspec
import pytest
from fake_tracker import FakeTracker
from patience import PATIENCE_S, eventually
from synthetic_node import synthetic_rig
from websockets.sync.client import connect

from rhot_app.engine import output_process
from rhot_app.engine.client import EngineClient
from rhot_app.engine.core import Engine
from rhot_app.engine.output_process import OutputProcess
from rhot_app.errors import OutputError
from rhot_app.project import OutputSettings, Rig, save_rig
from rhot_app.sources.links import UdpNodes


def free_port() -> int:
    """A port that is free for TCP at this moment."""
    with socket.socket() as sock:
        sock.bind(("127.0.0.1", 0))
        return int(sock.getsockname()[1])


def engine(folder: Path, *arguments: str) -> subprocess.Popen[str]:
    """`rhot engine` in a folder that has a rig.json."""
    return subprocess.Popen([sys.executable, "-m", "rhot_app", "engine", "--rig", "rig.json", "--directory", "engine",
                             *arguments], cwd=folder, env=os.environ | {"PYTHONUNBUFFERED": "1"},
                            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


@pytest.mark.parametrize(("arguments", "sentence"), [
    (["--output", "pigeon:coop"], "there is no output 'pigeon'"), (["--output", "osc:9000"], "is not HOST:PORT"),
    (["--output", "ws:9001?hz=0"], "not a rate above 0"), (["--web", "127.0.0.1:99999"], "99999: this is not ["),
    ([], "'pager:x'")])
def test_what_cannot_be_is_refused(tmp_path: Path, arguments: list[str], sentence: str) -> None:
    rig = synthetic_rig()
    outputs = () if arguments else (OutputSettings("pager", "x"),)
    save_rig(tmp_path / "rig.json", msgspec.structs.replace(rig, outputs=outputs))
    with engine(tmp_path, *arguments) as process:
        said = process.communicate(timeout=PATIENCE_S)[1]
    assert process.returncode == 2 and sentence in said and len(said.splitlines()) == 1


def test_the_command_line_and_the_rig_both_stream(tmp_path: Path, streaming_rig: Rig) -> None:
    ports = [free_port(), free_port()]
    taken = socket.create_server(("127.0.0.1", 0))
    rig = msgspec.structs.replace(streaming_rig, outputs=(OutputSettings("ws", str(ports[0]), "openxr"),))
    save_rig(tmp_path / "rig.json", rig)
    with engine(tmp_path, "--start", "--json", "--web", f"127.0.0.1:{ports[1]}", "--output",
                f"ws:{taken.getsockname()[1]}") as process:
        try:
            assert process.stdout is not None
            urls = json.loads(process.stdout.readline())["outputs"]
            web = next(url for spec, url in urls.items() if spec.startswith("web:"))
            for url, joints in ((urls[f"ws:{ports[0]}?joints=openxr"], 26), (f"{web.replace('http', 'ws')}states", 26)):
                with connect(url) as client:
                    hand = json.loads(client.recv(PATIENCE_S))["hands"][0]
                    assert len(hand["positions"]) == joints
            with EngineClient(tmp_path / "engine") as client:
                eventually(lambda: client.poll(0.1) and client.status is not None and client.status.state_rate_hz > 0)
                assert client.status is not None
                states = {status.spec: status.state for status in client.status.outputs}
                assert list(states.values()).count("running") == 2 and list(states.values()).count("failed") == 1
                assert any("is in use by another program" in advice.text for advice in client.status.advice)
                refused = msgspec.to_builtins(msgspec.structs.replace(rig, outputs=(OutputSettings("pager", "x"),)))
                with pytest.raises(Exception, match="no output 'pager'"):
                    client.command("set_rig", document=refused)
                client.command("set_rig", document=msgspec.to_builtins(msgspec.structs.replace(rig, outputs=())))
                eventually(lambda: client.poll(0.1) and client.status is not None and len(client.status.outputs) == 2)
        finally:
            process.send_signal(signal.SIGTERM)
        said = process.communicate(timeout=PATIENCE_S)[1]
    assert process.returncode == 0
    assert said.count(f"web view is at {web}") == 1, "whatever else is said of the rig"
    assert f"opens the output ws:{ports[0]}" in said, "the rig's author may be somebody else"
    taken.close()


def test_an_engine_that_cannot_have_its_outputs_opens_nothing() -> None:
    rig = msgspec.structs.replace(synthetic_rig(), outputs=(OutputSettings("pager", "x"),))
    opened: list[object] = []
    with pytest.raises(OutputError, match="pager"):
        Engine(rig, None, lambda rig: opened.append(rig) or UdpNodes(rig), FakeTracker, lambda payload: None,
               outputs=OutputProcess("ipc://nowhere"))
    assert opened == []


def test_a_crashed_output_process_is_started_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(output_process, "RESTART_S", 0.1)
    rig = msgspec.structs.replace(synthetic_rig(), outputs=(OutputSettings("ws", str(free_port())),))
    outputs = OutputProcess(f"ipc://{tmp_path}/states.ipc")
    outputs.configure(rig)
    try:
        outputs.settle()
        assert [status.state for status in outputs.status()] == ["running"]
        assert outputs._process is not None
        first = outputs._process.pid
        os.kill(first, signal.SIGKILL)
        eventually(lambda: any("ended (code -9)" in text for text in outputs.complaints()))
        eventually(lambda: outputs.status()[0].state == "running" and outputs.complaints() == [])
        assert outputs._process.pid != first
    finally:
        outputs.close()


def test_a_hanging_output_process_is_started_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(output_process, "RESTART_S", 0.1)
    rig = msgspec.structs.replace(synthetic_rig(), outputs=(OutputSettings("ws", str(free_port())),))
    outputs = OutputProcess(f"ipc://{tmp_path}/states.ipc")
    outputs.configure(rig)
    try:
        outputs.settle()
        assert outputs._process is not None
        first = outputs._process.pid
        os.kill(first, signal.SIGSTOP)
        monkeypatch.setattr(output_process, "SILENT_S", 0.5)
        eventually(lambda: any("ended (code -9)" in text for text in outputs.complaints()))
        monkeypatch.setattr(output_process, "SILENT_S", 60.0)
        eventually(lambda: outputs.status()[0].state == "running" and outputs._process.pid != first)
    finally:
        outputs.close()


def test_outputs_are_opened_and_closed_while_others_go_on(tmp_path: Path) -> None:
    ports = [free_port(), free_port()]
    one, other = (OutputSettings("ws", str(port)) for port in ports)
    rig = synthetic_rig()
    outputs = OutputProcess(f"ipc://{tmp_path}/states.ipc", [OutputSettings("osc", "127.0.0.1:9")])

    def use(*chosen: OutputSettings) -> list[str]:
        outputs.configure(msgspec.structs.replace(rig, outputs=chosen))
        return [status.spec for status in outputs.status() if not status.fixed]

    try:
        use(one)
        outputs.settle()
        with connect(f"ws://127.0.0.1:{ports[0]}") as client:
            assert use(one, other) == [one.spec, other.spec]
            eventually(lambda: listens(ports[1]))
            assert use(one, msgspec.structs.replace(other, enabled=False)) == [one.spec]
            eventually(lambda: not listens(ports[1]))
            assert [status.spec for status in outputs.status()] == ["osc:127.0.0.1:9", one.spec]
            client.ping().wait(PATIENCE_S)
        assert use() == []
        eventually(lambda: not listens(ports[0]))
    finally:
        outputs.close()


def test_a_replay_leaves_the_rigs_outputs_out(tmp_path: Path) -> None:
    rig = msgspec.structs.replace(synthetic_rig(), outputs=(OutputSettings("ws", str(free_port())),))
    outputs = OutputProcess(f"ipc://{tmp_path}/states.ipc", follow_rig=False)
    outputs.configure(rig)
    assert outputs.status() == () and outputs.complaints() == []
    outputs.close()


def test_outputs_end_with_their_engine(tmp_path: Path) -> None:
    save_rig(tmp_path / "rig.json", synthetic_rig())
    port = free_port()
    with engine(tmp_path, "--json", "--output", f"ws:{port}") as process:
        try:
            assert process.stdout is not None and process.stdout.readline()
            with connect(f"ws://127.0.0.1:{port}"):
                process.kill()
                eventually(lambda: not listens(port))
        finally:
            process.kill()


def listens(port: int) -> bool:
    """Whether somebody listens on a port of this computer."""
    with socket.socket() as sock:
        return sock.connect_ex(("127.0.0.1", port)) == 0
