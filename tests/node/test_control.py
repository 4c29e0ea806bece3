"""The control channel over real ZeroMQ sockets: every request, every wrong one, stills and previews."""

from __future__ import annotations

import json
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import zmq
from node_fakes import OF_ANY_PORT, grey_image, node_settings, saved_settings
from patience import PATIENCE_MS, eventually, settled

from rhot_node.capture.camera import Frame
from rhot_node.clock import NodeClock
from rhot_node.config import load_settings
from rhot_node.detect.image import YuvImage, to_bgr
from rhot_node.errors import LinkError
from rhot_node.foreground_store import ForegroundStore
from rhot_node.network.control import ControlServer
from rhot_node.network.pairing import OfferFile, Reception
from rhot_node.network.pictures import PictureBox
from rhot_node.network.requests import Responder
from rhot_node.network.session import Sessions
from rhot_node.video.recorder import VideoRecorder

RNG = np.random.default_rng(3)


def noisy_frame(number: int = 5) -> Frame:
    planes = [RNG.integers(0, 256, shape, dtype=np.uint8) for shape in ((480, 640), (240, 320), (240, 320))]
    return Frame(YuvImage(*planes), number, 1000 + number, 2000, 0, 0)


class Served:
    """A control server in its thread, with a client."""

    def __init__(self, folder: Path) -> None:
        self.store = saved_settings(folder / "node.json", **OF_ANY_PORT, preview_hz=20.0, trust="open")
        self.sessions = Sessions()
        self.foreground = ForegroundStore(folder / "node.foreground.npz")
        self.server = ControlServer(self.store.current, None)
        self.server.start(Responder(self.store, self.sessions, self.server.pictures, NodeClock(),
                                    lambda: {"state": "ready"}, lambda: {"frames": 12}, None,
                                    VideoRecorder(folder / "videos"), self.foreground),
                          Reception(None, OfferFile(folder / "offer.json"), lambda: {"name": "left"}))
        self.context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
        self.client = self.context.socket(zmq.REQ)
        self.client.connect(f"tcp://127.0.0.1:{self.server.control_port}")
        self.client.rcvtimeo = PATIENCE_MS

    def ask_raw(self, *parts: bytes) -> list[bytes]:
        self.client.send_multipart(parts)
        return self.client.recv_multipart()

    def ask(self, **request: Any) -> dict[str, Any]:
        answer: dict[str, Any] = json.loads(self.ask_raw(json.dumps(request).encode())[0])
        return answer

    def close(self) -> None:
        self.server.close()
        self.server.close()
        self.context.destroy(linger=0)


@pytest.fixture
def served(tmp_path: Path) -> Iterator[Served]:
    served = Served(tmp_path)
    yield served
    served.close()


def test_state_counters_and_settings(served: Served) -> None:
    assert served.ask(request="state") == {"ok": True, "state": "ready"}
    assert served.ask(request="counters") == {"ok": True, "counters": {"frames": 12}}
    answer = served.ask(request="settings")
    assert answer["ok"] and answer["settings"]["node_id"] == 3
    assert answer["settings"]["markers"]["markers"][0]["id"]


def test_settings_are_saved_and_say_what_needs_a_restart(served: Served) -> None:
    answer = served.ask(request="set_settings", settings={"camera": {"gain": 3.5}, "udp_port": 4711})
    assert answer == {"ok": True, "restart": ["udp_port"]}
    assert load_settings(served.store.path) == served.store.current
    assert served.store.current.camera.gain == 3.5
    answer = served.ask(request="set_settings", settings={"preview_hz": 2})
    assert answer["restart"] == ["udp_port"], "what waits for a restart still waits"


def test_settings_are_tried_out_without_being_saved(served: Served) -> None:
    before = served.store.path.read_bytes()
    served.ask(request="set_settings", settings={"camera": {"gain": 3.5, "contrast": 2}}, save=False)
    assert served.store.current.camera.gain == 3.5 and served.store.path.read_bytes() == before
    served.ask(request="set_settings", settings={"camera": {"gain": 4.0}})
    saved = load_settings(served.store.path).camera
    assert saved.gain == 4.0 and saved.contrast is None and served.store.current.camera.contrast == 2


def test_wrong_settings_change_nothing(served: Served) -> None:
    before = served.store.path.read_bytes()
    answer = served.ask(request="set_settings", settings={"camera": {"gain": -1}})
    assert not answer["ok"] and "camera.gain" in answer["error"]
    assert served.store.path.read_bytes() == before and served.store.current.camera.gain is None


def test_settings_that_cannot_be_saved_change_nothing(served: Served) -> None:
    served.store.path = served.store.path.parent / "gone" / "node.json"
    answer = served.ask(request="set_settings", settings={"preview_hz": 2})
    assert not answer["ok"] and "gone" in answer["error"]
    assert served.store.current.preview_hz == 20.0


@pytest.mark.parametrize("data", [
    b"", b"{", b"[]", b"null", b"\xff", b'{"request": "dance"}', b'{"ask": "state"}', b'{"request": "state", "x": 1}',
    b'{"request": "start", "session": 0, "host": "127.0.0.1", "port": 5000}',
    b'{"request": "start", "session": 1, "host": "127.0.0.1", "port": 0}',
    b'{"request": "start", "session": 18446744073709551616, "host": "127.0.0.1", "port": 5000}',
    b'{"request": "start", "session": 1, "host": "nowhere.invalid", "port": 5000}',
    b'{"request": "start", "session": 1, "port": 5000}', b'{"request": "set_settings", "settings": 3}',
])
def test_a_wrong_request_is_answered_with_a_sentence(served: Served, data: bytes) -> None:
    answer = json.loads(served.ask_raw(data)[0])
    assert answer["ok"] is False and len(answer["error"]) > 10
    assert served.ask(request="state")["ok"], "the channel still works"
    assert served.sessions.current is None


def test_a_request_in_two_parts_is_refused(served: Served) -> None:
    assert b"2 parts" in served.ask_raw(b"{}", b"{}")[0]


def test_start_and_stop(served: Served) -> None:
    assert served.ask(request="start", session=9, host="10.0.0.1", port=5000) == {"ok": True, "verdict": "started"}
    assert served.sessions.current is not None and served.sessions.current.address == ("10.0.0.1", 5000)
    assert served.ask(request="stop") == {"ok": True, "stopped": True}
    answer = served.ask(request="start", session=9, host="10.0.0.1", port=5000)
    assert not answer["ok"] and "new session" in answer["error"]


@pytest.mark.parametrize(("asked", "kind"), [("", "png"), (', "format": "jpeg"', "jpeg")])
def test_a_still_is_the_whole_frame_without_loss_or_nearly_so(served: Served, asked: str, kind: str) -> None:
    frame = noisy_frame()
    offering = threading.Event()

    def offer() -> None:
        while not offering.wait(0.01):
            served.server.pictures.offer(frame)

    thread = threading.Thread(target=offer)
    thread.start()
    head, data = served.ask_raw(f'{{"request": "still"{asked}}}'.encode())
    offering.set()
    thread.join()
    assert json.loads(head) == {"ok": True, "format": kind, "width": 640, "height": 480, "number": 5,
                                "t_node_ns": 1005}
    image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    assert image is not None
    luma, expected = (cv2.cvtColor(bgr, cv2.COLOR_BGR2GRAY).astype(float) for bgr in (image, to_bgr(frame.image)))
    if kind == "png":
        assert np.array_equal(image, to_bgr(frame.image))
    else:
        assert np.abs(luma - expected).mean() < 3.0


def test_a_node_without_frames_says_so(served: Served, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rhot_node.network.pictures.STILL_S", 0.1)
    answer = served.ask(request="still")
    assert not answer["ok"] and "no frame" in answer["error"]


def test_previews_are_small_and_only_for_those_who_look(served: Served) -> None:
    pictures = served.server.pictures
    assert not pictures.wanted
    viewer = served.context.socket(zmq.SUB)
    viewer.rcvtimeo = PATIENCE_MS
    viewer.connect(f"tcp://127.0.0.1:{served.server.preview_port}")
    viewer.subscribe(b"")
    eventually(lambda: pictures.wanted)
    pictures.offer(noisy_frame(8))
    head, jpeg = viewer.recv_multipart()
    assert json.loads(head) == {"node_id": 3, "number": 8, "t_node_ns": 1008, "width": 640, "height": 480,
                                "preview_width": 320, "preview_height": 240}
    image = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR)
    assert image is not None and image.shape == (240, 320, 3)
    viewer.close(linger=0)
    eventually(lambda: not pictures.wanted)


def test_nothing_is_copied_when_nobody_looks() -> None:
    woken: list[int] = []
    box = PictureBox(4.0, lambda: woken.append(1))
    frame = Frame(grey_image(), 1, 0, 0, 0, 0)
    box.offer(frame)
    assert box.take_preview() is None and not woken
    box.wanted = True
    for _ in range(50):
        box.offer(frame)
    assert len(woken) == 1, "fifty frames at once are one preview at 4 Hz"
    preview = box.take_preview()
    assert preview is not None and preview.image.y is not frame.image.y
    assert box.take_preview() is None


def test_a_preview_waits_for_a_frame_that_is_searched(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [1000.0]
    monkeypatch.setattr("rhot_node.network.pictures.time.monotonic", lambda: now[0])
    box = PictureBox(4.0)
    box.wanted = True

    def offered(number: int, searched: bool) -> int | None:
        now[0] += 0.03
        box.offer(Frame(grey_image(), number, 0, 0, 0, 0), searched=searched)
        preview = box.take_preview()
        return None if preview is None else preview.number

    assert [offered(1, True), offered(2, True)] == [1, None]
    now[0] += 0.25
    assert [offered(3, False), offered(4, False), offered(5, True)] == [None, None, 5]
    now[0] += 0.55
    assert offered(6, False) == 6, "a node that searches nothing shows its picture all the same"


def test_previews_keep_their_rate(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [1000.0]
    monkeypatch.setattr("rhot_node.network.pictures.time.monotonic", lambda: now[0])
    woken: list[float] = []
    box = PictureBox(4.0, lambda: woken.append(now[0]))
    box.wanted = True
    for k in range(400):
        now[0] = 1000.0 + k / 40
        box.offer(Frame(grey_image(), k, 0, 0, 0, 0))
    assert 39 <= len(woken) <= 41


@pytest.mark.parametrize("setting", ["control_port", "preview_port", "pairing_port"])
def test_a_taken_port_is_named_with_its_setting(served: Served, setting: str) -> None:
    port = getattr(served.server, setting)
    with pytest.raises(LinkError, match=f"{setting}: TCP port {port}"):
        ControlServer(node_settings(**{**OF_ANY_PORT, setting: port}), None)


def test_an_open_node_says_so_and_has_no_keys(served: Served) -> None:
    answer = served.ask(request="link")
    assert not answer["ok"] and "open to everybody" in answer["error"]
    stranger = served.context.socket(zmq.REQ)
    stranger.rcvtimeo = PATIENCE_MS
    stranger.connect(f"tcp://127.0.0.1:{served.server.pairing_port}")
    stranger.send(b'{"request": "hello"}')
    assert json.loads(stranger.recv()) == {"ok": True, "name": "left", "trust": "open"}
    stranger.close(linger=0)


def test_trust_is_not_changed_from_afar(served: Served) -> None:
    answer = served.ask(request="set_settings", settings={"trust": "paired"})
    assert not answer["ok"] and "settings file" in answer["error"]
    assert served.ask(request="set_settings", settings={"trust": "open", "preview_hz": 3.0})["ok"]


def test_background_and_skin_are_learnt_over_the_channel(served: Served) -> None:
    ending = threading.Event()

    def film() -> None:
        while not ending.wait(0.005):
            served.server.pictures.offer(noisy_frame())

    camera = threading.Thread(target=film)
    camera.start()
    try:
        for seconds in (0, 61, None):
            assert not served.ask(request="learn_background", seconds=seconds)["ok"]
        assert served.ask(request="learn_background", seconds=0.1) == {"ok": True}
        eventually(lambda: not served.foreground.learning)
        assert served.foreground.report(640, 480)["background"]
        assert served.ask(request="learn_skin") == {"ok": True, "found": False}
        answer, png = served.ask_raw(b'{"request": "foreground_mask"}')
        told = json.loads(answer)
        size, stamp = told.pop("mask_bytes"), (told.pop("number"), told.pop("t_node_ns"))
        assert told == {"ok": True, "format": "png", "width": 320, "height": 240}
        assert cv2.imdecode(np.frombuffer(png[:size], np.uint8), cv2.IMREAD_GRAYSCALE).shape == (240, 320)
        assert cv2.imdecode(np.frombuffer(png[size:], np.uint8), cv2.IMREAD_COLOR).shape == (480, 640, 3)
        assert stamp == (noisy_frame().number, noisy_frame().t_node_ns)
        assert cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_GRAYSCALE).shape == (240, 320), \
            "a master that knows of no picture reads the mask as before"
        learnt = served.foreground.current
        assert served.ask(request="learn_background", seconds=0.2) == {"ok": True}
        assert served.ask(request="revert_foreground") == {"ok": True}
        assert not served.foreground.learning
        assert settled(lambda: np.array_equal(served.foreground.current.mean, learnt.mean), 0.4), "it was given up"
        assert served.ask(request="forget_foreground") == {"ok": True}
        assert not served.foreground.report(640, 480)["background"]
    finally:
        ending.set()
        camera.join()
