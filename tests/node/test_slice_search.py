"""Edges along slices that a master asks for: searched, sent, refused; background and skin as they are learnt."""

from __future__ import annotations

import threading
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from node_fakes import SIZE, FakeCamera, FakeSender
from patience import eventually

from rhot_node.capture.camera import Frame
from rhot_node.clock import NodeClock
from rhot_node.detect.image import from_bgr
from rhot_node.errors import NodeError
from rhot_node.foreground_store import ForegroundStore, foreground_path, load_foreground
from rhot_node.network.pictures import PictureBox
from rhot_node.network.session import Stream
from rhot_node.slice_search import VALID_S, SliceSearch
from rhot_node.wire.codec import decode, encode
from rhot_node.wire.messages import ForegroundPart, SliceEdges, Slices
from rhot_node.wire.search import SLICES_FIT, pack_slices, unpack_map, unpack_slices

STREAM = Stream(7, ("10.0.0.1", 5000), 0)
EDGE_X = 30.5
SLICE = np.array([[28.0, 20.0, 1.0, 0.0, 8.0]])


def step_picture() -> np.ndarray:
    """(48, 64, 3) RGB: dark, and bright from x = 31 on."""
    picture = np.full((SIZE[1], SIZE[0], 3), 60, np.uint8)
    picture[:, 31:] = (200, 140, 115)  # skin
    return picture


class Searched:
    """A search without its thread, of a picture with one vertical edge."""

    def __init__(self) -> None:
        self.clock = NodeClock(offset_ns=10**15)
        self.camera = FakeCamera(range(1000), self.clock)
        self.search = SliceSearch(3, self.clock, ForegroundStore(None))
        self.search.warm_up()
        self.sender = FakeSender()

    def ask(self, slices: np.ndarray, request: int = 5, session: int = 7, running: int = 7, **changes: Any) -> str:
        values: dict[str, Any] = {"width": SIZE[0], "height": SIZE[1], "part": 0, "parts": 1, "map_step": 0} | changes
        return self.search.take(Slices(3, session, 0, request, slice_count=len(slices), records=pack_slices(slices),
                                       **values), running)

    def frame(self) -> Frame:
        frame = self.camera.read(0.0)
        assert frame is not None
        return replace(frame, image=from_bgr(step_picture()[:, :, ::-1]))

    def sent(self) -> list[Any]:
        """What the next frame makes the node send, by way of its bytes."""
        self.sender.sent.clear()
        self.search.offer(self.frame(), STREAM, self.sender)
        self.search.step()
        return [decode(encode(message)) for message, _ in self.sender.sent]


def test_the_edge_on_a_slice_is_sent_with_its_frame_until_other_slices_come() -> None:
    searched = Searched()
    assert searched.sent() == [], "nobody has asked"
    assert searched.ask(SLICE) == ""
    for number in (1, 2):
        (edges,) = searched.sent()
        assert isinstance(edges, SliceEdges)
        assert (edges.request, edges.slice_count, edges.sequence, edges.frame_number) == (5, 1, number - 1, number)
        (edge,) = edges.edges
        assert edge.offset == pytest.approx(EDGE_X - 28.0, abs=0.05) and edge.strength > 20.0
        assert edge.inside == edge.outside == pytest.approx(0.5, abs=0.01), "nothing is learnt"
    turned = SLICE * [1.0, 1.0, -1.0, 1.0, 1.0]
    assert searched.ask(turned, request=6) == ""
    (edges,) = searched.sent()
    assert (edges.request, edges.sequence) == (6, 2)
    assert edges.edges[0].offset == pytest.approx(28.0 - EDGE_X, abs=0.05) and edges.edges[0].strength < -20.0


def test_a_request_ends_after_a_second(monkeypatch: pytest.MonkeyPatch) -> None:
    searched = Searched()
    searched.ask(SLICE)
    now_s = time.monotonic()
    monkeypatch.setattr(time, "monotonic", lambda: now_s + 0.9 * VALID_S)
    assert searched.sent()
    monkeypatch.setattr(time, "monotonic", lambda: now_s + 1.1 * VALID_S)
    assert searched.sent() == []


def test_what_belongs_elsewhere_is_dropped_by_its_reason() -> None:
    searched = Searched()
    assert searched.ask(SLICE, running=0) == "session"
    assert searched.ask(SLICE, session=8) == "session"
    assert searched.search.take(Slices(4, 7, 0, 5, 64, 48, 0, 0, 1, 0, b""), 7) == "foreign_node"
    assert searched.ask(SLICE, request=2**32 - 1) == ""
    assert searched.ask(SLICE, request=0) == "", "numbers go on after the largest"
    assert searched.ask(SLICE, request=2**32 - 2) == "late"
    assert searched.ask(SLICE, request=1, width=640) == ""
    assert searched.sent() == [], "slices of another image size"


def test_many_slices_come_in_parts_and_their_edges_go_in_parts() -> None:
    searched = Searched()
    slices = np.tile(SLICE, (SLICES_FIT + 40, 1))
    slices[:, 1] = np.linspace(4.0, 40.0, len(slices))

    def part(number: int) -> str:
        own = slices[number * SLICES_FIT:(number + 1) * SLICES_FIT]
        return searched.search.take(Slices(3, 7, number, 5, 64, 48, len(slices), number, 2, 0, pack_slices(own)), 7)
    assert part(1) == ""
    assert searched.sent() == [], "half of a request is none"
    assert part(0) == ""
    messages = searched.sent()
    assert [message.part for message in messages] == [0, 1] and {message.parts for message in messages} == {2}
    found = sorted(edge.slice_index for message in messages for edge in message.edges)
    assert found == list(range(len(slices)))
    assert all(len(encode(message)) <= 1472 - 16 for message in messages)
    np.testing.assert_array_equal(unpack_slices(pack_slices(slices))[:3], unpack_slices(pack_slices(slices[:3])))


def test_a_frame_that_comes_during_a_search_is_left_out() -> None:
    searched = Searched()
    searched.ask(SLICE)
    assert [searched.search.offer(searched.frame(), STREAM, searched.sender) for _ in range(3)] == [True, False, False]
    assert searched.search.step() and not searched.search.step()
    assert searched.search.count() == {"slice_requests": 1, "slice_frames": 1, "slice_frames_skipped": 2,
                                       "edges_sent": 1, "edges_not_sent": 0}


class Camera:
    """Offers one picture after the other to a box, as a daemon does."""

    def __init__(self, picture: np.ndarray) -> None:
        self.picture, self.box, self.ending = picture, PictureBox(4.0), False
        self.pause, self.rng = threading.Event(), np.random.default_rng(1)

    def run(self) -> None:
        while not self.ending:
            noise = self.rng.integers(-3, 4, self.picture.shape)
            image = from_bgr(np.clip(self.picture + noise, 0, 255).astype(np.uint8)[:, :, ::-1])
            self.box.offer(Frame(image, 1, 1, 1, 1, 1))
            self.pause.wait(0.002)  # the camera's own pace

    def __enter__(self) -> Camera:
        self.thread = threading.Thread(target=self.run, daemon=True)
        self.thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.ending = True
        self.thread.join()


def with_hand(background: np.ndarray, rgb: tuple[int, int, int] = (200, 140, 115)) -> np.ndarray:
    picture = background.copy()
    picture[40:100, 60:110] = rgb
    return picture


BACKGROUND = np.full((120, 160, 3), (90, 110, 150), np.uint8)


def test_background_and_skin_are_learnt_kept_and_forgotten(tmp_path: Path) -> None:
    path = foreground_path(tmp_path / "left.json")
    store = ForegroundStore(path)
    assert store.report(160, 120)["sentence"].startswith("No background is learnt")
    with Camera(BACKGROUND) as camera:
        store.learn_background(camera.box, 0.2)
        with pytest.raises(NodeError, match="already"):
            store.learn_background(camera.box, 0.2)
        eventually(lambda: not store.learning)
        assert not store.learn_skin(camera.box), "there is no skin in the picture"
        assert store.report(160, 120) | {"sentence": ""} == {
            "sentence": "", "background": True, "skin": "generic", "learning_s": 0.0, "problem": ""}
        camera.picture = with_hand(BACKGROUND)
        camera.box.next_still(1.0)  # one that was being taken may have no hand
        assert store.learn_skin(camera.box)
        encoded, picture = store.mask(camera.box)
    mask = cv2.imdecode(np.frombuffer(encoded.data, np.uint8), cv2.IMREAD_GRAYSCALE)
    assert (encoded.width, encoded.height) == (80, 60) and mask.shape == (60, 80) and picture.image.size == (160, 120)
    assert np.median(mask[22:48, 32:53]) > 240 and np.median(mask[:15]) < 15
    again = ForegroundStore(path)
    for kept, used in zip(again.current, store.current, strict=True):
        np.testing.assert_array_equal(kept, used)
    assert "learn it again" in again.report(320, 240)["problem"]
    assert not again.of_size(320, 240).mean.size, "a background of another size is not used"
    again.forget()
    assert not path.exists() and again.report(160, 120)["skin"] == "none"


def test_what_is_tried_out_can_be_kept_and_taken_back(tmp_path: Path) -> None:
    path = foreground_path(tmp_path / "left.json")
    store = ForegroundStore(path)
    with Camera(with_hand(BACKGROUND)) as camera:
        assert store.learn_skin(camera.box)
        kept = path.read_bytes()
        camera.picture = BACKGROUND
        store.learn_background(camera.box, 0.1, save=False)
        eventually(lambda: not store.learning)
        assert store.report(160, 120)["background"] and path.read_bytes() == kept
        store.revert()
        assert not store.report(160, 120)["background"] and store.report(160, 120)["skin"] == "learnt"
        store.learn_background(camera.box, 0.1, save=False)
        eventually(lambda: not store.learning)
    store.save()
    assert ForegroundStore(path).report(160, 120)["background"]
    store.revert(earlier=True)
    assert not ForegroundStore(path).report(160, 120)["background"]
    assert ForegroundStore(path).report(160, 120)["skin"] == "learnt"


def test_a_file_that_is_none_is_named_and_the_node_goes_on(tmp_path: Path) -> None:
    path = tmp_path / "left.foreground.npz"
    path.write_bytes(b"no archive")
    store = ForegroundStore(path)
    assert str(path) in store.report(160, 120)["problem"] and store.report(160, 120)["skin"] == "none"
    np.savez(path, format="rhot-foreground 1", hand=np.full(32**3, np.nan), rest=np.ones(32**3),
             mean=np.empty((0, 0, 3)), sd=np.empty((0, 0, 3)))
    with pytest.raises(NodeError, match="not plausible"):
        load_foreground(path)


def test_a_map_of_the_foreground_is_sent_when_it_is_asked_for(tmp_path: Path) -> None:
    searched = Searched()
    with Camera(np.full((48, 64, 3), 60, np.uint8)) as camera:
        store = ForegroundStore(tmp_path / "x.npz")
        store.learn_background(camera.box, 0.1)
        eventually(lambda: not store.learning)
    searched.search = SliceSearch(3, searched.clock, store)
    searched.ask(np.empty((0, 5)), map_step=4)
    (part,) = searched.sent()
    assert isinstance(part, ForegroundPart) and (part.step, part.parts, part.request) == (4, 1, 5)
    known = unpack_map(part.data, part.width, part.height, part.step)
    assert known.shape == (12, 16)
    assert known[:, 9:].min() > 0.9, "bright where the empty scene was dark"
    assert known[:, :7].max() < 0.3
