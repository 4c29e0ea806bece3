"""Films as cameras of this computer: nodes that the app starts, that play in step, and that are started again."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest
from bench import START_S, TEST_S, node_status, wait_until
from network_pictures import sending
from patience import eventually

from rhot_app.engine.client import EngineClient
from rhot_app.errors import SourceError
from rhot_app.sources.cameras.camera_set import CameraSource, nodes_folder, prepare
from rhot_app.sources.cameras.camera_source import check_sources
from rhot_app.ui.backend.session import CAMERAS_ROLE, Session
from rhot_app.ui.models.rows import node_row


@pytest.fixture(autouse=True)
def own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))


@pytest.fixture
def session(tmp_path: Path) -> Iterator[Session]:
    session = Session(tmp_path / "e")
    yield session
    session.close()
    assert session.processes == []


def film(path: Path) -> str:
    """Two seconds of a light that goes on and off."""
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 30.0, (64, 48))
    for number in range(60):
        writer.write(np.full((48, 64, 3), 200 if number >= 30 else 60, np.uint8))
    writer.release()
    return str(path)


def quiet(text: str, fraction: float) -> None:
    """Nobody looks."""


def children(pid: int) -> list[int]:
    found = [(task / "children").read_text() for task in Path(f"/proc/{pid}/task").iterdir()]
    return [int(word) for text in found for word in text.split()]


@pytest.mark.timeout(TEST_S)
def test_two_films_are_seen_and_a_dead_node_is_started_again(session: Session, tmp_path: Path) -> None:
    prepared = prepare(check_sources([film(tmp_path / "left.avi"), film(tmp_path / "right.avi")]))
    opened = session.open_rig(prepared.rig_path, quiet)
    assert opened.begin and opened.ours and not opened.simulated
    assert all(node.public_key and node.control_port for node in opened.rig.nodes)
    start = nodes_folder(prepared.rig_path) / "start"
    first_ns = int(start.read_text())
    with EngineClient(session.directory) as client:
        client.command("start")

        def streams(name: str, more_than: int = 0) -> bool:
            status = node_status(client, name)
            return status is not None and status.state == "streaming" and status.received > more_than
        wait_until(client, lambda: streams("left") and streams("right"), START_S, "both cameras stream")
        cameras, = (one.pid for one in session.processes if one.role == CAMERAS_ROLE)
        nodes = children(cameras)
        assert len(nodes) == 2
        os.kill(nodes[1], signal.SIGKILL)
        wait_until(client, lambda: node_row(node_status(client, "right")).look.word != "streaming", START_S,
                   "the card of the dead camera says that it does not stream")
        eventually(lambda: start.exists() and int(start.read_text()) > first_ns)
        counts = [node_status(client, name).received for name in ("left", "right")]  # type: ignore[union-attr]
        wait_until(client, lambda: streams("left", counts[0]) and streams("right", counts[1]), START_S,
                   "both films again")
        assert all(node_row(node).look.word == "streaming" and not node.message for node in client.status.nodes)
    again = Session(session.directory)
    assert again.attach(quiet).begin is False, "an attached window leaves the tracking as it is"


@pytest.mark.timeout(TEST_S)
def test_a_network_camera_that_goes_and_comes_again_is_tracked_with_again(session: Session) -> None:
    with EngineClient(session.directory) as client:
        def is_in(state: str, *words: str) -> bool:
            """Whether the camera's card in the window says so."""
            status = node_status(client, "camera 1")
            card = None if status is None else node_row(status)
            return card is not None and card.look.word == state and all(word in card.message for word in words)

        with sending() as (address, _):
            session.open_rig(prepare(check_sources([f"{address}/video"])).rig_path, quiet)
            client.command("start")
            wait_until(client, lambda: is_in("streaming"), START_S, "pictures")
        wait_until(client, lambda: is_in("fault", "program that sends them"), START_S, "why there are none")
        with sending(int(address.rpartition(":")[2])):
            wait_until(client, lambda: is_in("streaming"), START_S, "pictures again")
            session.close()


@pytest.mark.timeout(TEST_S)
def test_a_camera_that_is_gone_says_why_and_leaves_nothing(session: Session, tmp_path: Path) -> None:
    prepared = prepare([CameraSource("/dev/video99", "HD Webcam", 640, 480, 30.0)])
    with pytest.raises(SourceError, match="video99"):
        session.open_rig(prepared.rig_path, quiet)
    assert session.processes == [] and not session.found()


@pytest.mark.parametrize(("arguments", "words"), [
    (["--cameras"], "Name one camera"), (["--cameras", "nowhere.mp4"], "no such film"),
    (["--hand", "left"], "goes with --cameras")])
def test_a_mistake_is_a_sentence_before_there_is_a_window(tmp_path: Path, arguments: list[str], words: str) -> None:
    done = subprocess.run([sys.executable, "-m", "rhot_app", *arguments], capture_output=True, text=True, check=False,
                          cwd=tmp_path)
    assert done.returncode == 2 and words in done.stderr and "Traceback" not in done.stderr
    assert not (tmp_path / "data").exists()
