"""The clients that docs/outputs.md prints receive every state, as written there (but for the ports)."""

from __future__ import annotations

import contextlib
import json
import os
import re
import subprocess
import sys
import threading
import time
import types
from collections.abc import Callable, Iterator
from pathlib import Path

import msgspec
import numpy as np
import pytest
from patience import PATIENCE_S, eventually
from streams import RATE_HZ, Stream, free_port, palm_before_cameras, state_of, unknown

from rhot_app.hand.model import neutral_pose
from rhot_app.outputs.joints import JointConverter, json_message
from rhot_app.outputs.lsl import LslSink
from rhot_app.project import OutputSettings, Rig, parse_rig

PAGE = (Path(__file__).parents[2] / "docs" / "outputs.md").read_text()
COUNTED = 30  # lines


def program(part: str, **changes: str) -> str:
    """The Python program of one part of the page, with some words changed."""
    found = re.search(rf"^## {part}\n(?:.*?)```python\n(.*?)```", PAGE, re.DOTALL | re.MULTILINE)
    assert found is not None, f"docs/outputs.md shows no program for {part}"
    text = found[1]
    for old, new in changes.items():
        assert old.lstrip("_") in text
        text = text.replace(old.lstrip("_"), new)
    return text


@contextlib.contextmanager
def running(code: str) -> Iterator[Callable[[], list[str]]]:
    """The lines that a program has printed so far."""
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                          text=True) as process:
        lines: list[str] = []
        assert process.stdout is not None
        out = process.stdout
        reader = threading.Thread(target=lambda: [lines.append(line) for line in out], daemon=True)
        reader.start()
        try:
            yield lambda: lines
        finally:
            process.kill()
            reader.join(PATIENCE_S)


def assert_full_rate(stream: Stream, lines: Callable[[], list[str]]) -> None:
    """Once lines come, one comes for every state."""
    eventually(lambda: len(lines()) > 5, told=lines)

    def none_missing() -> bool:
        sent, had = stream.sent, len(lines())
        eventually(lambda: len(lines()) >= had + COUNTED)
        return stream.sent - sent - COUNTED < 0.2 * RATE_HZ  # on their way, or while this test slept
    eventually(none_missing)


@pytest.mark.parametrize(("part", "kind", "port"), [("OSC", "osc", "9000"), ("VMC", "vmc", "39539")])
def test_osc_clients(stream: Callable[..., Stream], part: str, kind: str, port: str) -> None:
    free = free_port()
    sender = stream(f"{kind}:127.0.0.1:{free}")
    with running(program(part, **{f"_{port}": str(free)})) as lines:
        assert_full_rate(sender, lines)


def test_websocket_client(stream: Callable[..., Stream]) -> None:
    free = free_port()
    sender = stream(f"ws:{free}")
    eventually(lambda: sender.outputs.status()[0].state == "running")
    with running(program("WebSocket", _9001=str(free))) as lines:
        assert_full_rate(sender, lines)
        assert lines()[-1].startswith("right TRACKING [")


def test_zenoh_client(stream: Callable[..., Stream]) -> None:
    zenoh = pytest.importorskip("zenoh")
    free = free_port()
    config = zenoh.Config()
    config.insert_json5("mode", '"router"')
    config.insert_json5("listen/endpoints", json.dumps([f"tcp/127.0.0.1:{free}"]))
    config.insert_json5("scouting/multicast/enabled", "false")
    with zenoh.open(config):
        sender = stream(f"zenoh:127.0.0.1:{free}")
        with running(program("Zenoh", _7447=str(free))) as lines:
            assert_full_rate(sender, lines)


def test_zenoh_without_its_router(stream: Callable[..., Stream]) -> None:
    pytest.importorskip("zenoh")
    free = free_port()
    sender = stream(f"zenoh:127.0.0.1:{free}")
    eventually(lambda: f"cannot join the router at 127.0.0.1:{free}" in sender.outputs.status()[0].message)


def test_lsl_client(stream: Callable[..., Stream], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    try:
        import pylsl
    except (ImportError, RuntimeError, OSError):
        pytest.skip("liblsl is not installed; the sink is tested against a stand-in below")
    settings = tmp_path / "lsl_api.cfg"  # this machine only, and a name of the test's own
    settings.write_text("[multicast]\nResolveScope = machine\n[log]\nlevel = -3\n")
    monkeypatch.setenv("LSLAPICFG", str(settings))
    del pylsl
    name = f"RHOT {os.getpid()}"
    here = Path(__file__).parent
    code = (f"import sys, time; sys.path[:0] = [{str(here)!r}, {str(here.parent)!r}]; from streams import Stream; "
            "from synthetic_node import synthetic_rig; Stream(synthetic_rig(), sys.argv[1]); time.sleep(3600)")
    with subprocess.Popen([sys.executable, "-c", code, f"lsl:{name}"]) as sender:
        try:
            with running(program("LSL", _RHOT=name)) as lines:
                def at_full_rate() -> bool:
                    stamps = [float(line.split()[0]) for line in lines()[-COUNTED:]]
                    return len(stamps) == COUNTED and 0.5 < RATE_HZ * np.diff(stamps).mean() < 2.0
                eventually(at_full_rate, told=lines)
        finally:
            sender.kill()


def test_lsl_streams_are_described(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    pushed: list[tuple[list[float], float]] = []
    made: list[tuple[object, ...]] = []

    class Element:
        def __init__(self, labels: list[str]) -> None:
            self.labels = labels

        def append_child(self, _name: str) -> Element:
            return self

        def append_child_value(self, key: str, value: str) -> None:
            if key == "label":
                self.labels.append(value)
            if key == "unix_minus_lsl_s":
                wall.append(float(value))

    labels: list[str] = []
    wall: list[float] = []
    fake = types.SimpleNamespace(
        cf_float32=1, local_clock=lambda: 1000.0,
        StreamInfo=lambda *args: made.append(args) or types.SimpleNamespace(desc=lambda: Element(labels)),
        StreamOutlet=lambda info: types.SimpleNamespace(push_sample=lambda *sample: pushed.append(sample)))
    monkeypatch.setitem(sys.modules, "pylsl", fake)
    sink = LslSink(OutputSettings("lsl", "", "openxr"))
    sink.open()
    sink.write(JointConverter(rig).sample(state_of(rig, neutral_pose()), "openxr"))
    assert made[0][:4] == ("RHOT right", "MoCap", 26 * 9, 0.0)
    values, stamp = pushed[0]
    assert len(values) == len(labels) == 26 * 9
    assert labels[:9] == [f"palm_{part}" for part in ("x", "y", "z", "qx", "qy", "qz", "qw", "radius", "knowledge")]
    assert 999.0 < stamp <= 1000.0
    assert wall == [pytest.approx(time.time() - 1000.0, abs=60.0)]


@pytest.mark.parametrize(("module", "spec", "sentence"), [
    ("pylsl", "lsl", "extra lsl"), ("zenoh", "zenoh", "extra zenoh")])
def test_a_missing_package_is_named(stream: Callable[..., Stream], monkeypatch: pytest.MonkeyPatch, module: str,
                                    spec: str, sentence: str) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    sender = stream(spec)
    eventually(lambda: sentence in sender.outputs.status()[0].message)


def test_a_missing_liblsl_is_named(tmp_path: Path) -> None:
    (tmp_path / "pylsl.py").write_text('raise RuntimeError("LSL binary library file was not found.")\n')
    code = ("from rhot_app.outputs.lsl import LslSink; from rhot_app.project import OutputSettings\n"
            "try: LslSink(OutputSettings('lsl')).open()\nexcept Exception as exc: print(type(exc).__name__, exc)")
    done = subprocess.run([sys.executable, "-c", code], env=os.environ | {"PYTHONPATH": str(tmp_path)},
                          capture_output=True, text=True, check=True)
    assert done.stdout.startswith("OutputError LSL needs the library liblsl")


def test_json_says_what_the_page_says(rig: Rig) -> None:
    state = state_of(rig, neutral_pose(palm_before_cameras()), sequence=3)
    document = json.loads(json_message(JointConverter(rig).sample(state, "openxr")))
    (hand,) = document["hands"]
    part = re.search(r"^## WebSocket\n(.*?)^## ", PAGE, re.DOTALL | re.MULTILINE)
    assert part is not None
    for field in (*document, *hand):
        assert f"`{field}`" in part[1], field
    assert document["sequence"] == 3 and len(document["joints"]) == len(hand["positions"]) == len(hand["radii"]) == 26
    np.testing.assert_allclose(hand["positions"][1], (0.04, -0.06, -0.6), atol=1e-6)
    assert np.linalg.norm(hand["orientations"][7]) == pytest.approx(1.0, abs=1e-5)
    lost = json.loads(json_message(JointConverter(rig).sample(unknown(state), "own")))
    assert lost["hands"][0]["positions"] == [None] * 21 and lost["hands"][0]["palm_position"] is None


def test_the_documented_rig_outputs_are_valid(rig: Rig) -> None:
    found = re.search(r"```json\n(\"outputs\": .*?)```", PAGE, re.DOTALL)
    assert found is not None
    document = msgspec.to_builtins(rig) | json.loads("{" + found[1] + "}")
    assert parse_rig(msgspec.json.encode(document), "the page").outputs[0].joints == "openxr"
