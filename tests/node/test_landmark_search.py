"""The hand networks on a node: what is searched, sent, counted, and said when they cannot be used."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from node_fakes import SIZE, FakeCamera, FakeDetector, FakeSender, node_settings
from patience import eventually
from shipped_markers import LANDMARKS21, RHOT6

from rhot_node.clock import NodeClock
from rhot_node.config import NodeSettings, changed_settings
from rhot_node.daemon import NodeDaemon
from rhot_node.detect.image import YuvImage, from_bgr, to_bgr
from rhot_node.detectors import DetectorChoice
from rhot_node.errors import KeypointError, SettingsError
from rhot_node.landmark_search import LandmarkSearch
from rhot_node.landmarks import install
from rhot_node.landmarks.networks import HAND_SIGMA, DetectedHand, Region
from rhot_node.network.pictures import PictureBox
from rhot_node.network.requests import SettingsStore
from rhot_node.network.session import Stream
from rhot_node.wire.codec import decode, encode
from rhot_node.wire.messages import HandLandmarks, Observations

STREAM = Stream(7, ("10.0.0.1", 5000), 0)


def landmark_settings(**changes: Any) -> NodeSettings:
    return node_settings(**{"markers": LANDMARKS21, "detector": "landmarks", **changes})


class FixedHands:
    """In place of the networks: the same hands in every picture."""

    def __init__(self, count: int = 1) -> None:
        points = np.column_stack([np.linspace(2.0, 70.0, 21), np.linspace(40.0, 10.0, 21)])  # the last ones outside
        self.hands = tuple(DetectedHand(points, np.zeros((21, 3)), 1.0 + 1e-7, 0.9, Region(np.zeros(2), 50.0, 0.0))
                           for _ in range(count))
        self.shapes: list[tuple[int, ...]] = []

    def find(self, picture: YuvImage) -> tuple[DetectedHand, ...]:
        self.shapes.append(to_bgr(picture).shape)
        return self.hands


class Search:
    """A search without its thread."""

    def __init__(self, settings: NodeSettings | None = None, hands: int = 1) -> None:
        clock = NodeClock(offset_ns=10**15)
        self.camera = FakeCamera(range(1000), clock, 25_000_000)
        self.camera.began_ns -= 10**9
        self.networks, self.opened, self.failure = FixedHands(hands), list[str](), ""
        self.search = LandmarkSearch(settings or landmark_settings(), clock, self.open)
        self.sender = FakeSender()

    def open(self, model: str) -> Any:
        self.opened.append(model)
        if self.failure:
            raise KeypointError(self.failure)
        return self.networks

    def offer(self, count: int = 1) -> None:
        for _ in range(count):
            frame = self.camera.read(0.0)
            assert frame is not None
            self.search.offer(frame, STREAM, self.sender)

    def sent(self) -> list[HandLandmarks]:
        return [message for message, _ in self.sender.sent if isinstance(message, HandLandmarks)]


def test_hands_are_sent_with_their_frames_times() -> None:
    search = Search(hands=2)
    for _ in range(2):
        search.offer()
        assert search.search.step()
    first, second = search.sent()
    assert (first.node_id, first.session, first.sequence, second.sequence) == (3, 7, 0, 1)
    assert second.t_frame_node_ns - first.t_frame_node_ns == 25_000_000
    assert (first.width, first.height) == SIZE and search.networks.shapes == [(48, 64, 3)] * 2
    hand = first.hands[0]
    assert (hand.presence, hand.right) == (1.0, pytest.approx(0.9))
    assert hand.points[0] == pytest.approx((2.0, 40.0, (50.0 * HAND_SIGMA) ** 2, 0.0, (50.0 * HAND_SIGMA) ** 2))
    assert hand.points[-1] == (0.0,) * 5, "outside the image"
    assert len(decode(encode(first)).hands) == 2  # type: ignore[union-attr]
    assert search.search.count() == {"landmark_frames": 2, "landmark_frames_skipped": 0, "hands_found": 4,
                                     "landmarks_sent": 2, "landmarks_not_sent": 0}


def test_a_frame_without_a_hand_is_sent_too() -> None:
    search = Search(hands=0)
    search.offer()
    search.search.step()
    assert search.sent()[0].hands == ()


def test_frames_that_come_while_one_is_searched_are_skipped() -> None:
    search = Search()
    search.offer(3)
    assert search.search.step() and not search.search.step()
    assert search.search.count()["landmark_frames_skipped"] == 2


@pytest.mark.parametrize(("detector", "model"), [("landmarks", "full"), ("landmarks:full", "full"),
                                                 ("landmarks:lite", "lite"), ("fast", None)])
def test_the_settings_say_which_networks(detector: str, model: str | None) -> None:
    search = Search(landmark_settings(detector=detector))
    search.offer()
    search.search.step()
    assert search.opened == ([model] if model else []) and len(search.sent()) == len(search.opened)


def test_other_settings_take_effect_while_the_node_runs() -> None:
    search = Search(landmark_settings(detector="fast"))
    search.search.configure(landmark_settings(detector="landmarks:lite"))
    search.offer()
    assert eventually(lambda: len(search.sent()) == 1)
    search.search.configure(landmark_settings(detector="fast"))
    search.offer()
    search.search.close()
    assert search.opened == ["lite"] and len(search.sent()) == 1


def test_an_unknown_network_is_refused() -> None:
    with pytest.raises(SettingsError, match="detector"):
        changed_settings(landmark_settings(), {"detector": "landmarks:huge"})


def test_networks_that_cannot_be_used_are_reported_until_they_can(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rhot_node.landmark_search.RETRY_S", 0.0)
    search = Search()
    search.failure = "the hand networks are not installed"
    search.offer()
    search.search.step()
    (check,) = search.search.troubles()
    assert check.level == "error" and "not installed" in check.sentence and not search.sent()
    search.failure = ""
    search.offer()
    search.search.step()
    assert search.search.troubles() == [] and len(search.sent()) == 1


def test_a_search_that_is_spared_goes_on_when_nobody_says_so_any_more(monkeypatch: pytest.MonkeyPatch) -> None:
    search = Search()
    search.search.spare()
    search.offer(2)
    assert not search.search.step() and not search.search.wanted
    monkeypatch.setattr("rhot_node.landmark_search.RETRY_S", 0.0)
    search.search.spare()
    search.offer()
    assert search.search.step() and len(search.sent()) == 1


# -- the daemon --------------------------------------------------------------------------------------------------------

def daemon_messages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, settings: NodeSettings, wanted: type) -> list[Any]:
    """What a daemon sends until a message of the type `wanted` is among it."""
    monkeypatch.setattr("rhot_node.landmark_search.open_networks", lambda model: FixedHands())
    clock, sender = NodeClock(offset_ns=10**15), FakeSender()
    camera = FakeCamera(range(100_000), clock)
    camera.began_ns -= 10**13
    daemon = NodeDaemon(SettingsStore(tmp_path / "node.json", settings), clock, lambda _: camera,
                        lambda _: FakeDetector())
    daemon.prepare()
    try:
        daemon.sessions.start(7, STREAM.address, 0, now_node_ns=clock.now_ns(), now_s=1e9)

        def found() -> bool:
            daemon.step(sender, PictureBox(4.0))
            return any(isinstance(message, wanted) for message, _ in sender.sent)
        assert eventually(found)
    finally:
        daemon.close()
    return [message for message, _ in sender.sent]


def test_a_camera_that_is_spared_still_says_that_it_sees(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rhot_node.landmark_search.LandmarkSearch.wanted", False)
    sent = daemon_messages(tmp_path, monkeypatch, landmark_settings(), Observations)
    assert all(isinstance(message, Observations) for message in sent)


def test_a_set_of_landmarks_alone_sends_no_markers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    sent = daemon_messages(tmp_path, monkeypatch, landmark_settings(), HandLandmarks)
    assert all(isinstance(message, HandLandmarks) for message in sent)


def test_painted_markers_are_sent_beside_landmarks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    mixed = NodeSettings(3, "left", type(RHOT6)((*RHOT6.markers[:2], *LANDMARKS21.markers)), detector="landmarks")
    sent = daemon_messages(tmp_path, monkeypatch, mixed, HandLandmarks)
    assert any(isinstance(message, Observations) for message in sent)


def test_landmarks_are_lost_to_the_detector_of_paint(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    monkeypatch.setattr(install, "SERVICE_FOLDER", tmp_path / "none")
    choice = DetectorChoice(lambda settings: FakeDetector())
    detector = choice.make(landmark_settings())
    found = detector.detect(from_bgr(np.full((48, 64, 3), 90, np.uint8)))
    assert len(found) == 21 and not any(one.found for one in found) and choice.troubles() == []
