"""An output that is slow, stuck, dead or broken costs the tracking thread nothing, and says so."""

from __future__ import annotations

import json
import logging
import socket
import threading
from collections.abc import Callable

import msgspec
import pytest
from patience import PATIENCE_S, eventually, quickest, settled
from streams import Stream, free_port, state_of
from websockets.sync.client import connect

from rhot_app.errors import OutputError
from rhot_app.hand.model import neutral_pose
from rhot_app.outputs import outputs as output_file
from rhot_app.outputs.joints import JointConverter, Sample
from rhot_app.outputs.outputs import QUEUE, Output, Outputs
from rhot_app.project import OutputSettings, Rig


class FakeSink:
    """Notes what it gets; blocks while `gate` is closed; fails as told."""

    def __init__(self) -> None:
        self.gate = threading.Event()
        self.gate.set()
        self.got: list[int] = []
        self.opened = self.closed = 0
        self.error: Exception | None = None

    def open(self) -> None:
        self.opened += 1

    def write(self, sample: Sample) -> None:
        self.gate.wait()
        if self.error is not None:
            raise self.error
        self.got.append(sample.state.sequence)

    def close(self) -> None:
        self.closed += 1


@pytest.fixture
def sink() -> FakeSink:
    return FakeSink()


@pytest.fixture
def make(rig: Rig, sink: FakeSink):
    made: list[Output] = []

    def make(rate_hz: float | None = None) -> Output:
        made.append(Output(OutputSettings("fake", rate_hz=rate_hz), sink, JointConverter(rig)))
        made[-1].start()
        return made[-1]
    yield make
    sink.gate.set()
    for one in made:
        one.stop()


def test_a_stuck_output_drops_the_oldest(rig: Rig, sink: FakeSink, make, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(output_file, "STUCK_S", 0.05)
    output = make()
    states = [state_of(rig, neutral_pose(), sequence=k) for k in range(50)]
    sink.gate.clear()
    output.send(states[0])
    eventually(lambda: not output._queue)  # it has taken the first, and hangs over it
    assert quickest(lambda: [output.send(state) for state in states[1:]], 1e-3) < 1e-2
    eventually(lambda: "states are dropped" in output.status().message)
    assert output.status().dropped > 0
    sink.gate.set()
    eventually(lambda: len(sink.got) == 1 + QUEUE)
    assert sink.got[1:] == list(range(50 - QUEUE, 50))
    eventually(lambda: output.status().message == "")


def test_an_output_is_limited_to_its_rate(rig: Rig, sink: FakeSink, make) -> None:
    output = make(rate_hz=50.0)
    state = state_of(rig, neutral_pose())
    seconds = eventually(lambda: output.send(state) or len(sink.got) > 20)
    eventually(lambda: output.status().sent == len(sink.got))
    assert len(sink.got) <= 2 + 50.0 * seconds  # fewer where the machine was busy, never more


@pytest.mark.parametrize("error", [OutputError("the line is dead; plug it in."), ZeroDivisionError("oops")])
def test_a_failed_output_says_why_and_is_opened_again(rig: Rig, sink: FakeSink, make, error: Exception,
                                                      monkeypatch: pytest.MonkeyPatch,
                                                      caplog: pytest.LogCaptureFixture) -> None:
    monkeypatch.setattr(output_file, "REOPEN_S", 0.05)
    sink.error = error
    output = make()
    state = state_of(rig, neutral_pose())

    def fed(condition: Callable[[], bool]) -> Callable[[], bool]:
        return lambda: output.send(state) or condition()
    with caplog.at_level(logging.WARNING):
        eventually(fed(lambda: output.status().state == "failed"))
        eventually(fed(lambda: sink.opened > 2))
    assert str(error) in caplog.text and caplog.text.count(str(error)) < 3 + sink.opened
    assert sink.closed >= sink.opened - 1
    sink.error = None
    eventually(fed(lambda: output.status().state == "running" and output.status().sent > 2))
    assert output.status().message == ""


def test_an_output_that_never_ends_is_left_behind(rig: Rig, sink: FakeSink, make,
                                                  monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(output_file, "END_S", 0.1)
    output = make()
    sink.gate.clear()
    output.send(state_of(rig, neutral_pose()))
    assert quickest(output.stop, 5.0, times=1) < 5.0


def test_a_client_that_never_reads_is_let_go_and_others_go_on(stream: Callable[..., Stream],
                                                             monkeypatch: pytest.MonkeyPatch) -> None:
    from rhot_app.outputs import web_server
    monkeypatch.setattr(web_server, "SILENT_S", 0.3)
    port = free_port()
    running = stream(f"ws:{port}?joints=openxr")
    eventually(lambda: running.outputs.status()[0].state == "running")
    with socket.socket() as deaf:
        deaf.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1024)
        deaf.connect(("127.0.0.1", port))
        deaf.send(f"GET / HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n".encode()
                  + b"Upgrade: websocket\r\nConnection: Upgrade\r\n"
                  b"Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\r\n")
        eventually(lambda: running.outputs.status()[0].clients == 1)
        with connect(f"ws://127.0.0.1:{port}") as client:
            got: list[int] = []

            def none_missing() -> bool:
                got.append(json.loads(client.recv(PATIENCE_S))["sequence"])
                return len(got) >= 40 and got[-1] - got[-40] == 39
            eventually(none_missing)
            eventually(lambda: running.outputs.status()[0].clients == 1 or client.recv(PATIENCE_S) is None)
    assert running.outputs.status()[0].dropped == 0


def test_a_port_in_use_is_said_and_had_when_it_is_free(stream: Callable[..., Stream],
                                                       monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(output_file, "REOPEN_S", 0.05)
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        running = stream(f"ws:{port}")
        eventually(lambda: f"port {port} of 127.0.0.1 is in use" in running.outputs.status()[0].message)
    eventually(lambda: running.outputs.status()[0].state == "running")
    assert running.outputs.status()[0].message == ""


def test_an_unknown_host_and_an_empty_one(stream: Callable[..., Stream]) -> None:
    running = stream("osc:nobody.invalid:9000", f"osc:127.0.0.1:{free_port()}")
    eventually(lambda: "'nobody.invalid' cannot be found" in running.outputs.status()[0].message)
    eventually(lambda: running.outputs.status()[1].sent > 5)  # UDP to a port where nobody listens
    assert settled(lambda: running.outputs.status()[1].state == "running")


def test_a_rigs_outputs_come_and_go_and_others_stay(rig: Rig) -> None:
    first, second = (OutputSettings("ws", str(free_port())) for _ in range(2))
    outputs = Outputs()

    def ask(*settings: OutputSettings) -> None:
        outputs.configure(msgspec.structs.replace(rig, outputs=settings))
    try:
        ask(first)
        eventually(lambda: outputs.status()[0].state == "running")
        with connect(f"ws://127.0.0.1:{first.target}") as client:
            ask(first, second)
            eventually(lambda: [status.state for status in outputs.status()] == ["running", "running"])
            with pytest.raises(OutputError, match="no output 'nothing'"):
                ask(OutputSettings("nothing"))
            assert len(outputs.status()) == 2
            ask(first)
            assert len(outputs.status()) == 1
            outputs.send(state_of(rig, neutral_pose()))
            assert client.recv(PATIENCE_S)  # the connection was never closed
    finally:
        outputs.close()
