"""Videos of real node processes, fetched by `rhot video collect`: whole, also after a cut, never over other files."""

from __future__ import annotations

import contextlib
import fcntl
import json
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from node_process import PERIOD_NS, READY_S, SIZE, Node, write_settings
from patience import PATIENCE_S, eventually
from synthetic_node import synthetic_rig

from rhot_app.__main__ import main
from rhot_app.errors import RecordingError
from rhot_app.keys import load_master_keys
from rhot_app.project import Rig, save_rig
from rhot_app.recording import video as video_module
from rhot_app.recording.raw_log import LogReader, RecordKind, encode_header
from rhot_app.recording.video import collect_videos, video_path
from rhot_node.capture.yuv import YuvWriter
from rhot_node.video.avi import read_stamps
from rhot_node.wire.codec import decode
from rhot_node.wire.messages import Observations

pytestmark = pytest.mark.timeout(READY_S + 100.0)

NAME = "20261124T231500Z-5f3a9c01"
FRAMES = 30


class Setup:
    """A node whose frames are noise, so that its video is large; its rig, and a log that names its video."""

    def __init__(self, folder: Path) -> None:
        noise = np.random.default_rng(3).integers(0, 256, SIZE[0] * SIZE[1] * 3 // 2, dtype=np.uint8)
        with YuvWriter(folder / "noise", *SIZE, 4_000_000, 20_000) as writer:
            for k in range(20):
                writer.append(k * PERIOD_NS, np.roll(noise, 7 * k))
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        self.settings = write_settings(folder, control_port=port)
        self.camera = f"yuv:{folder / 'noise'}"
        rig = synthetic_rig(2)
        node = msgspec.structs.replace(rig.nodes[0], name="left", control_port=port)
        self.rig = msgspec.structs.replace(rig, nodes=(node,))
        self.log = folder / "log" / "wave.rhotlog"
        self.log.parent.mkdir()
        self.write_log({"video": NAME})
        self.folder = self.settings.with_name("left.videos")
        self.node: Node | None = None

    def write_log(self, about: dict[str, object], rig: Rig | None = None) -> None:
        self.log.write_bytes(encode_header(rig or self.rig, about))

    def run(self) -> Node:
        self.node = Node(self.settings, self.camera, "--loop")
        return self.node

    def record(self, frames: int = FRAMES) -> None:
        """Have the running node record so many frames."""
        assert self.node is not None
        node = self.node
        assert json.loads(node.ask(request="video_start", name=NAME)[0])["ok"]
        eventually(lambda: json.loads(node.ask(request="video_start", name=NAME)[0])["video"]["frames"] >= frames)
        node.ask(request="video_stop", name=NAME)

    def videos(self) -> list[dict[str, Any]]:
        assert self.node is not None
        found: list[dict[str, Any]] = json.loads(self.node.ask(request="video_list")[0])["videos"]
        return found

    def collect(self, **options: object) -> list[video_module.Collected]:
        return collect_videos(self.log, self.rig, load_master_keys().own, **options)  # type: ignore[arg-type]


@pytest.fixture
def setup(tmp_path: Path) -> Iterator[Setup]:
    setup = Setup(tmp_path)
    yield setup
    if setup.node is not None:
        with contextlib.suppress(ValueError):
            setup.node.end(signal.SIGKILL)


def test_a_video_comes_whole_though_its_node_dies_on_the_way(setup: Setup, capsys: pytest.CaptureFixture[str]) -> None:
    setup.run()
    setup.record()
    target = video_path(setup.log, "left")
    part = target.with_name(f"{target.name}.part")

    def kill(text: str, fraction: float) -> None:
        if fraction > 0.4 and setup.node is not None:
            setup.node.end(signal.SIGKILL)
            setup.node = None
    with pytest.raises(RecordingError, match="goes on where it was cut off"):
        setup.collect(patience_s=0.3, progress=kill)
    original = (setup.folder / f"{NAME}.avi").read_bytes()
    came = part.read_bytes()
    assert 0.3 * len(original) < len(came) < len(original) and original.startswith(came) and not target.exists()

    setup.run()
    fractions: list[float] = []
    [collected] = setup.collect(progress=lambda text, fraction: fractions.append(fraction))
    assert fractions[0] >= len(came) / len(original) - 1e-9  # it went on, and did not begin anew
    assert target.read_bytes() == original and not part.exists() and collected.info.frames >= FRAMES
    lines = target.with_suffix(".csv").read_text().splitlines()
    stamps = read_stamps(target)
    assert lines[0] == "frame_number,t_node_ns,exposure_ns,row_time_ns" and len(lines) == len(stamps) + 1
    assert lines[1] == f"{stamps[0].number},{stamps[0].t_node_ns},4000000,20000"
    assert not list(setup.folder.iterdir())  # removed from the node, now that it is whole here

    assert main(["video", "collect", str(setup.log)]) == 0  # nothing is left to do
    assert str(target) in capsys.readouterr().out


def test_what_cannot_be_collected_is_said_in_a_sentence(
        setup: Setup, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    setup.run()
    with pytest.raises(RecordingError, match="no video of this recording"):
        setup.collect()
    setup.record(2)
    target = video_path(setup.log, "left")
    target.write_bytes(b"something else")
    with pytest.raises(RecordingError, match="nothing is written over"):
        setup.collect()
    assert target.read_bytes() == b"something else" and (setup.folder / f"{NAME}.avi").exists()
    target.unlink()

    part = target.with_name(f"{target.name}.part")
    part.write_bytes(b"of an older video")
    with part.open("ab") as other:
        fcntl.flock(other, fcntl.LOCK_EX)
        with pytest.raises(RecordingError, match="being fetched already"):
            setup.collect()
    with pytest.raises(RecordingError, match="did not come as the node has it"):
        setup.collect()
    assert not part.exists() and not target.exists()
    out = tmp_path / "out"
    assert main(["video", "collect", str(setup.log), "--out", str(out)]) == 2
    assert "no such folder" in capsys.readouterr().err
    out.mkdir()
    assert main(["video", "collect", str(setup.log), "--out", str(out), "--keep"]) == 0
    assert (out / target.name).read_bytes() == (setup.folder / f"{NAME}.avi").read_bytes()

    setup.write_log({})
    assert main(["video", "collect", str(setup.log)]) == 2
    assert "recorded without video" in capsys.readouterr().err
    setup.write_log({"video": "../../etc/passwd"})
    assert main(["video", "collect", str(setup.log)]) == 2
    assert "is it damaged" in capsys.readouterr().err


def test_a_recording_with_video_has_the_same_frames_in_both(setup: Setup, tmp_path: Path) -> None:
    node = setup.run()
    rig = synthetic_rig(2)
    ports = {name: node.ready[name] for name in ("udp_port", "control_port", "preview_port", "pairing_port")}
    left = msgspec.structs.replace(rig.nodes[0], node_id=node.ready["node_id"], name="left", data_port=0, **ports)
    save_rig(tmp_path / "rig.json", msgspec.structs.replace(rig, nodes=(left, rig.nodes[1])))
    log = tmp_path / "both.rhotlog"
    engine = subprocess.Popen(
        [sys.executable, "-m", "rhot_app", "engine", "--rig", str(tmp_path / "rig.json"), "--unchecked", "--start",
         "--log", str(log), "--video", "--directory", str(tmp_path / "engine")], stderr=subprocess.PIPE, text=True)
    try:
        eventually(lambda: any(one["frames"] > 40 for one in setup.videos()), READY_S, told=engine.poll)
    finally:
        engine.send_signal(signal.SIGTERM)
        said = engine.communicate(timeout=PATIENCE_S)[1]
    assert engine.returncode == 0, said
    eventually(lambda: [one["state"] for one in setup.videos()] == ["done"])  # ended by the engine, not by its silence
    assert setup.videos()[0]["message"] == ""
    [collected] = collect_videos(log, msgspec.structs.replace(rig, nodes=(left,)), load_master_keys().own)
    assert collected.path == tmp_path / "both.left.avi"
    with contextlib.closing(LogReader(log)) as reader:
        logged = [decode(one.data) for one in reader if one.kind is RecordKind.DATAGRAM]
    observed = {(one.frame_number, one.t_frame_node_ns) for one in logged if isinstance(one, Observations)}
    filmed = {(one.number, one.t_node_ns) for one in read_stamps(collected.path)}
    assert len(filmed & observed) > 0.5 * len(filmed)


def test_video_without_a_log_is_refused(setup: Setup, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    save_rig(tmp_path / "rig.json", setup.rig)
    assert main(["engine", "--rig", str(tmp_path / "rig.json"), "--video"]) == 2
    assert "--video needs --log" in capsys.readouterr().err
