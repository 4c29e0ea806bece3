"""The search for tags beside that for markers: what is searched, sent, counted and skipped."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from node_fakes import FakeCamera, FakeDetector, FakeSender, node_settings

from rhot_node.clock import NodeClock
from rhot_node.config import NodeSettings, TagSettings, changed_settings
from rhot_node.daemon import NodeDaemon
from rhot_node.errors import SettingsError
from rhot_node.network.pictures import PictureBox
from rhot_node.network.requests import SettingsStore
from rhot_node.network.session import Stream
from rhot_node.tag_search import TagSearch, warm_up_picture
from rhot_node.wire.messages import FAMILIES, Fiducials, Observations

DICTIONARY = "DICT_APRILTAG_36h11"
STREAM = Stream(7, ("10.0.0.1", 5000), 0)


def settings(**tags: Any) -> NodeSettings:
    return node_settings(tags=TagSettings(**{"enabled": True, **tags}))


class Search:
    """A search without its thread, and a camera that looks at a tag."""

    def __init__(self, **tags: Any) -> None:
        clock = NodeClock(offset_ns=10**15)
        self.camera = FakeCamera(range(1000), clock, 25_000_000)
        self.camera.began_ns -= 10**12
        self.camera.luma = warm_up_picture(DICTIONARY)
        self.search, self.sender = TagSearch(settings(**tags), clock), FakeSender()

    def offer(self, count: int = 1) -> None:
        for _ in range(count):
            frame = self.camera.read(0.0)
            assert frame is not None
            self.search.offer(frame, STREAM, self.sender)


def test_a_tag_is_found_and_sent_with_its_frames_times() -> None:
    search = Search()
    for _ in range(2):
        search.offer()
        assert search.search.step()
    assert not search.search.step(), "nothing waits"
    (first, address), (second, _) = search.sender.sent
    assert isinstance(first, Fiducials) and address == STREAM.address
    assert (first.node_id, first.session, first.sequence, second.sequence) == (3, 7, 0, 1)
    assert (first.frame_number, second.frame_number) == (0, 1)
    assert second.t_frame_node_ns - first.t_frame_node_ns == 25_000_000
    tag = first.fiducials[0]
    assert (FAMILIES[tag.family], tag.number) == (DICTIONARY, 0)
    np.testing.assert_allclose(np.reshape(tag.corners, (4, 2)),
                               [[23.5, 23.5], [119.5, 23.5], [119.5, 119.5], [23.5, 119.5]], atol=0.05)
    assert search.search.count() == {"tag_frames": 2, "tag_frames_skipped": 0, "tags_found": 2, "fiducials_sent": 2,
                                     "fiducials_not_sent": 0}


def test_frames_that_come_while_one_is_searched_are_skipped() -> None:
    search = Search()
    search.offer(3)
    assert search.search.step() and not search.search.step()
    assert search.search.count()["tag_frames_skipped"] == 2
    assert search.sender.sent[0][0].frame_number == 0  # type: ignore[attr-defined]


def test_a_frame_without_a_tag_is_sent_too() -> None:
    search = Search()
    search.camera.luma = np.full_like(search.camera.luma, 128)
    search.offer()
    search.search.step()
    assert search.sender.sent[0][0].fiducials == []  # type: ignore[attr-defined]


@pytest.mark.parametrize(("rate_hz", "searched"), [(10.0, 10), (15.0, 15), (100.0, 40)])
def test_the_rate_is_kept(rate_hz: float, searched: int) -> None:
    search = Search(rate_hz=rate_hz)
    for _ in range(40):  # one second
        search.offer()
        search.search.step()
    assert abs(len(search.sender.sent) - searched) <= 1


def test_nothing_is_searched_until_it_is_asked_for() -> None:
    search = Search(enabled=False)
    search.offer()
    assert not search.search.step()
    search.search.configure(settings())
    search.offer()
    search.search.close()
    assert search.search.count()["tag_frames"] <= 1


def test_an_unknown_dictionary_is_a_sentence() -> None:
    with pytest.raises(SettingsError, match=r"DICT_9X9.*no tag dictionary; there are DICT_4X4_50"):
        changed_settings(settings(), {"tags": {"dictionaries": ["DICT_9X9"]}})


def test_the_daemon_sends_both(tmp_path: Path) -> None:
    clock, sender = NodeClock(offset_ns=10**15), FakeSender()
    camera = FakeCamera(range(1000), clock)
    camera.began_ns -= 10**12
    camera.luma = warm_up_picture(DICTIONARY)
    store = SettingsStore(tmp_path / "node.json", settings())
    daemon = NodeDaemon(store, clock, lambda _: camera, lambda _: FakeDetector())
    daemon.prepare()
    try:
        daemon.sessions.start(7, STREAM.address, 0, now_node_ns=clock.now_ns(), now_s=1e9)
        for _ in range(1000):
            daemon.step(sender, PictureBox(4.0))
            if any(isinstance(message, Fiducials) for message, _ in sender.sent):
                break
    finally:
        daemon.close()
    kinds = [type(message) for message, _ in sender.sent]
    assert Observations in kinds and Fiducials in kinds
    assert daemon.report()["tags"] == [DICTIONARY]
