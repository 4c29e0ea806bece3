"""What the live twin shows can be changed while it runs, and its cameras obey what their nodes tell them."""

from __future__ import annotations

import contextlib
import socket
import threading
from collections.abc import Iterator
from pathlib import Path

import msgspec
import numpy as np
import pytest

from rhot_app.calibration.board.boards import STANDARD_BOARD
from rhot_app.calibration.board.corners import detect
from rhot_app.errors import CalibrationError, SimulatorError
from rhot_app.simulator.nodes.live import TwinServer
from rhot_app.simulator.nodes.live_cameras import FrameSocket, LiveCameras
from rhot_app.simulator.nodes.live_scene import LiveScene
from rhot_app.simulator.nodes.remote import (
    CoverRequest,
    LampRequest,
    ShowRequest,
    StateRequest,
    TrackerRequest,
    TwinRemote,
)
from rhot_app.simulator.render.camera_controls import Lamp
from rhot_app.simulator.scene.scene import make_scene, twin_defaults
from rhot_app.simulator.scene.scene_description import BoardShow, HandShow, MarkerShow
from rhot_node.capture.stream import HEADER_BYTES, StreamHeader, pack_settings, unpack_header
from rhot_node.config import CameraSettings

WIDTH, HEIGHT = 320, 240


class Rig:
    """A stage, its cameras and a node that has connected to the left one; steps are taken by hand."""

    def __init__(self, folder: Path) -> None:
        settings = twin_defaults()
        wide = msgspec.structs.replace(settings.presets["wide"], width=WIDTH, height=HEIGHT)
        self.scene = make_scene(msgspec.structs.replace(settings, presets={"wide": wide}), 1)
        self.sockets = [FrameSocket(folder / f"{name}.frames") for name in self.scene.names]
        self.stage = LiveScene(self.scene, HandShow("still"))
        self.cameras = LiveCameras(self.scene, self.stage, self.sockets)
        self.node = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self.node.connect(str(folder / "left.frames"))
        self.node.settimeout(2.0)

    def frame(self) -> tuple[StreamHeader, np.ndarray]:
        """The left camera's next frame: header and Y plane."""
        self.cameras.step()
        header = unpack_header(self.receive(HEADER_BYTES))
        planes = np.frombuffer(self.receive(header.frame_bytes), np.uint8)
        return header, planes[:WIDTH * HEIGHT].reshape(HEIGHT, WIDTH)

    def ask(self, request: ShowRequest | LampRequest | CoverRequest) -> None:
        """What the door's thread does, while the cameras go on."""
        asking = threading.Thread(target=self.stage.perform, args=(request,))
        asking.start()
        while asking.is_alive():
            self.frame()

    def receive(self, count: int) -> bytearray:
        data = bytearray()
        while len(data) < count:
            data += self.node.recv(count - len(data))
        return data

    def close(self) -> None:
        self.node.close()
        for each in self.sockets:
            each.close()


@pytest.fixture
def rig(tmp_path: Path) -> Iterator[Rig]:
    rig = Rig(tmp_path)
    yield rig
    rig.close()


def test_a_board_takes_the_hands_place_and_begins_with_a_pause(rig: Rig) -> None:
    hand = rig.frame()[1].astype(float)
    rig.ask(ShowRequest(BoardShow(on_table=True)))
    picture = rig.frame()[1]
    assert np.abs(picture - hand).mean() > 5.0
    view = detect(np.ascontiguousarray(picture), STANDARD_BOARD)
    assert view is not None and len(view.pixels) == 54
    rig.ask(ShowRequest(MarkerShow(distance_m=0.4)))
    assert rig.stage.perform(StateRequest())["name"] == "marker thumb at 0.4 m"
    assert (rig.frame()[1][:20] < 80).all(), "nothing is left of the board"


def test_lamp_changes_every_picture_and_stays_for_what_is_shown_next(rig: Rig) -> None:
    rig.frame()
    bright = rig.frame()[1].mean()
    rig.ask(LampRequest(brightness=0.25))
    assert rig.frame()[1].mean() == pytest.approx(0.25 ** (1 / 2.2) * bright, rel=0.05)
    rig.ask(ShowRequest(HandShow("rest")))
    rig.ask(LampRequest(kelvin=3000.0))
    assert rig.stage.setting.lamp == Lamp(brightness=0.25, kelvin=3000.0)


def test_a_covered_camera_alone_sees_nothing_until_it_is_uncovered(rig: Rig) -> None:
    rig.frame()
    before = rig.frame()[1]
    rig.ask(CoverRequest(("right",)))
    assert np.abs(rig.frame()[1].astype(float) - before).mean() < 5.0, "it is the other one that is covered"
    rig.ask(CoverRequest(("left",)))
    black = rig.frame()[1]
    assert black.max() < 30 and black.std() > 0.3, "no light, but the sensor's noise"
    rig.ask(LampRequest(brightness=2.0))
    rig.ask(ShowRequest(HandShow("rest")))
    assert rig.frame()[1].max() < 30, "whatever is shown, and by whatever light"
    assert rig.stage.perform(StateRequest())["covered"] == ["left"]
    rig.ask(CoverRequest())
    assert rig.frame()[1].mean() > before.mean(), "uncovered, by the brighter lamp"
    with pytest.raises(SimulatorError, match=r"'middle'.*left, right"):
        rig.stage.perform(CoverRequest(("middle",)))


def test_what_cannot_be_shown_changes_nothing(rig: Rig) -> None:
    before = rig.stage.setting
    with pytest.raises(CalibrationError):
        rig.stage.perform(ShowRequest(BoardShow(size="1x1")))
    with pytest.raises(SimulatorError, match="kelvin"):
        rig.stage.perform(LampRequest(kelvin=3.0))
    assert rig.stage.setting is before


def full(taken: Iterator[bool]) -> int:
    """How many frames are taken until one is not; the last of them only in part."""
    return next(number for number, one in enumerate(taken) if not one)


def test_a_node_that_does_not_run_for_a_while_loses_frames_and_not_its_camera(rig: Rig) -> None:
    left, frame = rig.sockets[0], np.zeros(WIDTH * HEIGHT * 3 // 2, np.uint8)
    headers = (StreamHeader(WIDTH, HEIGHT, number, 1, 1, 1) for number in range(1000, 2000))
    left.hear()
    kept = full(left.send(header, frame) for header in headers)
    for _ in range(3):
        assert not left.send(next(headers), frame), "it is behind, and nobody waits for it"
    numbers = []
    while len(numbers) < kept:
        header = unpack_header(rig.receive(HEADER_BYTES))
        numbers.append(header.number)
        if len(numbers) == kept - 1:
            left.send(next(headers), frame)
        rig.receive(header.frame_bytes)
    assert numbers == list(range(1000, 1000 + kept)), "whole frames, in their order"
    assert left.send(next(headers), frame)
    assert unpack_header(rig.receive(HEADER_BYTES)).number > 1000 + kept + 3


def test_a_node_that_is_stuck_is_let_go(tmp_path: Path) -> None:
    left, frame = FrameSocket(tmp_path / "left.frames", stuck_s=0.0), np.zeros(WIDTH * HEIGHT * 3 // 2, np.uint8)
    with contextlib.closing(left), contextlib.closing(socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)) as node:
        node.connect(str(tmp_path / "left.frames"))
        left.hear()
        header = StreamHeader(WIDTH, HEIGHT, 1, 1, 1, 1)
        full(left.send(header, frame) for _ in range(1000))
        node.settimeout(2.0)
        while node.recv(1 << 20):
            pass  # to the end of the stream


def test_cameras_obey_what_their_node_says(rig: Rig) -> None:
    rig.frame()
    header, picture = rig.frame()
    assert header.exposure_ns == 4_000_000
    rig.node.sendall(pack_settings(CameraSettings(exposure_us=8000.0, gain=1.5)))
    header, brighter = rig.frame()
    assert header.exposure_ns == 8_000_000
    assert brighter.mean() == pytest.approx(3.0 ** (1 / 2.2) * picture.mean(), rel=0.06)
    report = rig.cameras.report()
    assert report["left"]["exposure_us"] == 8000.0 and report["left"]["gain"] == 1.5
    assert report["right"]["exposure_us"] == 4000.0
    rig.node.sendall(pack_settings(CameraSettings(exposure_us=900_000.0)))
    assert rig.frame()[0].exposure_ns == 25_000_000, "no exposure outlasts a frame"


def test_a_node_that_talks_nonsense_is_cut_off_and_may_come_back(rig: Rig, tmp_path: Path) -> None:
    rig.frame()
    rig.node.sendall(b"good morning, sensor")
    rig.cameras.step()
    rig.node.close()
    rig.node = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    rig.node.connect(str(tmp_path / "left.frames"))
    rig.node.settimeout(2.0)
    assert rig.frame()[0].width == WIDTH


def test_remote_and_door_understand_each_other(rig: Rig, tmp_path: Path) -> None:
    rig.stage.report = {"cameras": rig.cameras.report(), "rate_hz": 21.5, "preset_hz": 40.0}
    door = TwinServer(tmp_path, rig.stage.perform)
    door.start()
    ending = threading.Event()
    running = threading.Thread(target=lambda: [rig.cameras.step() for _ in iter(ending.is_set, True)])
    running.start()
    try:
        with TwinRemote(tmp_path) as twin:
            assert twin.state().show == HandShow("still")
            state = twin.show(BoardShow(pattern="charuco", size="8x6", square_mm=25.0))
            assert state.show == BoardShow(pattern="charuco", size="8x6", square_mm=25.0)
            assert state.cameras["right"].contrast == 1.0 and (state.rate_hz, state.preset_hz) == (21.5, 40.0)
            assert twin.lamp(mains_hz=50.0).lamp.mains_hz == 50.0
            assert twin.cover("right").covered == ("right",) and twin.cover().covered == ()
            with pytest.raises(SimulatorError, match="toe"):
                twin.show(MarkerShow(marker="toe"))
            with pytest.raises(SimulatorError, match="distance_m"):
                twin.show(MarkerShow(distance_m=0.01))
    finally:
        ending.set()
        running.join()
        door.close()
    assert not (tmp_path / "twin.ipc").exists()


def test_the_foreign_tracker_is_where_the_hand_is_and_goes_on(rig: Rig) -> None:
    def rows(since_ns: int = 0) -> list[tuple[int, list[float]]]:
        return rig.stage.perform(TrackerRequest(since_ns))["poses"]

    first = rows()
    newest_ns = first[-1][0]
    assert 100 <= len(first) <= 121 and len({t_ns for t_ns, _ in first}) == len(first)
    rig.frame()
    later = rows(newest_ns)
    assert later and all(t_ns > newest_ns for t_ns, _ in later)
    places = np.array([numbers[:3] for _, numbers in first])
    assert np.linalg.norm(places - places.mean(axis=0), axis=1).max() < 2e-3, "the hand is still"
    rig.ask(ShowRequest(HandShow("roam")))
    place = np.array([numbers[:3] for _, numbers in rows()]).mean(axis=0)
    assert np.linalg.norm(place - places.mean(axis=0)) > 5e-3
