"""Videos of a node's frames: what is in them, what ends them, what may be asked, and what they never do to the rest."""

from __future__ import annotations

import hashlib
import json
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from node_fakes import FakeCamera, FakeDetector, FakeSender, node_settings
from patience import eventually, settled

from rhot_node.capture.camera import Frame
from rhot_node.clock import NodeClock
from rhot_node.daemon import NodeDaemon
from rhot_node.detect.image import YuvImage, to_bgr
from rhot_node.errors import VideoError
from rhot_node.foreground_store import ForegroundStore
from rhot_node.network.pictures import PictureBox
from rhot_node.network.requests import Responder, SettingsStore
from rhot_node.network.session import LinkKeys, Sessions
from rhot_node.video import recorder as recorder_module
from rhot_node.video.avi import read_stamps
from rhot_node.video.recorder import FREE_MIN, READ_MAX, VideoInfo, VideoRecorder

MakeRecorder = Callable[..., VideoRecorder]


def frame(number: int, size: tuple[int, int] = (64, 48)) -> Frame:
    """A ramp whose level tells the number."""
    width, height = size
    ramp = np.linspace(0, 120, width, dtype=np.uint8)[None, :] + np.uint8(number)
    chroma = np.full((height // 2, width // 2), 128, np.uint8)
    return Frame(YuvImage(np.repeat(ramp, height, 0), chroma, chroma.copy()), 100 + 2 * number,
                 10**15 + number * 25_000_000, 0, 4_000_000 + number, 48_000)


@pytest.fixture
def make(tmp_path: Path) -> Iterator[MakeRecorder]:
    made: list[VideoRecorder] = []

    def make_recorder(**options: Any) -> VideoRecorder:
        made.append(VideoRecorder(tmp_path / "left.videos", **options))
        return made[-1]

    yield make_recorder
    for one in made:
        one.close()


def info_of(recorder: VideoRecorder, name: str) -> VideoInfo:
    return next(info for info in recorder.videos() if info.name == name)


def wait_until_done(recorder: VideoRecorder, name: str) -> VideoInfo:
    eventually(lambda: info_of(recorder, name).state == "done")
    return info_of(recorder, name)


def test_a_video_has_every_frame_with_its_number_and_time(make: MakeRecorder) -> None:
    recorder = make(queue_frames=100)
    recorder.offer(frame(0))
    assert recorder.start("first").state == "recording"
    frames = [frame(k) for k in range(1, 31)]
    for one in frames:
        recorder.offer(one)
    assert recorder.stop("another") == "" and recorder.stop("first") == "first"
    recorder.offer(frame(31))
    info = wait_until_done(recorder, "first")
    assert (info.frames, info.dropped, info.message) == (30, 0, "")
    path = recorder.folder / "first.avi"
    assert [(one.number, one.t_node_ns, one.exposure_ns, one.row_time_ns) for one in read_stamps(path)] == [
        (one.number, one.t_node_ns, one.exposure_ns, one.row_time_ns) for one in frames]

    video = cv2.VideoCapture(str(path))
    assert video.get(cv2.CAP_PROP_FRAME_COUNT) == 30 and video.get(cv2.CAP_PROP_FPS) == pytest.approx(40.0, rel=0.01)
    for one in frames:
        ok, bgr = video.read()
        assert ok and np.abs(bgr.astype(int) - to_bgr(one.image)).mean() < 1.5
    assert not video.read()[0]

    data = b"".join(recorder.read("first", offset, 1000) for offset in range(0, info.size, 1000))
    assert len(data) == info.size and hashlib.sha256(data).hexdigest() == info.sha256
    assert path.stat().st_mode & 0o077 == 0 and recorder.folder.stat().st_mode & 0o077 == 0
    recorder.delete("first")
    assert recorder.videos() == [] and not list(recorder.folder.iterdir())


def test_a_slow_disk_drops_the_oldest_frames_and_keeps_nobody_waiting(
        make: MakeRecorder, monkeypatch: pytest.MonkeyPatch) -> None:
    going = threading.Event()
    encode = recorder_module.encode_picture

    def slowly(*arguments: Any) -> bytes:
        going.wait()
        return encode(*arguments)
    monkeypatch.setattr(recorder_module, "encode_picture", slowly)
    recorder = make(queue_frames=4)
    recorder.start("slow")
    for k in range(50):
        recorder.offer(frame(k))  # would never return if it waited for the disk
    going.set()
    recorder.stop()
    info = wait_until_done(recorder, "slow")
    assert info.frames in (4, 5) and info.frames + info.dropped == 50
    numbers = [one.number for one in read_stamps(recorder.folder / "slow.avi")]
    assert numbers[-4:] == [100 + 2 * k for k in range(46, 50)]


def test_observations_are_sent_before_the_video_sees_a_frame(tmp_path: Path) -> None:
    clock, sender = NodeClock(), FakeSender()
    seen: list[tuple[int, int]] = []
    daemon = NodeDaemon(SettingsStore(tmp_path / "node.json", node_settings()), clock,
                        lambda camera: FakeCamera(range(5), clock, 0), lambda settings: FakeDetector(),
                        video=lambda frame: seen.append((frame.number, len(sender.sent))))
    daemon.prepare()
    daemon.sessions.start(7, ("10.0.0.1", 5000), 0, now_node_ns=clock.now_ns(), now_s=time.monotonic())
    while daemon.step(sender, PictureBox(4.0)):
        pass
    assert seen == [(number, number + 1) for number in range(5)]


def test_a_full_disk_ends_the_video_and_says_so(make: MakeRecorder, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recorder_module, "_LOOK_S", 0.01)
    free = [FREE_MIN]
    recorder = make(free=lambda folder: free[0])
    recorder.start("one")
    recorder.offer(frame(0))
    eventually(lambda: info_of(recorder, "one").frames == 1)
    free[0] = FREE_MIN - 1
    info = wait_until_done(recorder, "one")
    assert info.frames == 1 and "512 MiB" in info.message
    assert "512 MiB" in recorder.start("one").message  # what a master hears that goes on asking for it
    with pytest.raises(VideoError, match="less than 512 MiB"):
        recorder.start("two")
    assert "two" not in [info.name for info in recorder.videos()]


def test_a_video_ends_when_its_master_is_not_heard_any_more(
        make: MakeRecorder, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recorder_module, "_LOOK_S", 0.01)
    recorder = make(lease_s=0.2)
    recorder.start("left-alone")
    recorder.offer(frame(0))
    info = wait_until_done(recorder, "left-alone")
    assert "not heard" in info.message and info.frames == 1


def test_what_a_dead_node_left_is_finished_by_the_next(make: MakeRecorder) -> None:
    recorder = make()
    recorder.start("cut")
    for k in range(5):
        recorder.offer(frame(k))
        eventually(lambda count=k + 1: info_of(recorder, "cut").frames == count)
    recorder.stop()
    whole = wait_until_done(recorder, "cut")
    path = recorder.folder / "cut.avi"
    stamps = read_stamps(path)
    path.with_suffix(".json").unlink()
    path.write_bytes(path.read_bytes()[:whole.size - 5 * 16 - 8 - 10])  # without the index and the last bytes

    again = make()
    info = wait_until_done(again, "cut")
    assert info.frames == 4 and "ended while" in info.message and read_stamps(path) == stamps[:4]
    assert cv2.VideoCapture(str(path)).get(cv2.CAP_PROP_FRAME_COUNT) == 4
    with pytest.raises(VideoError, match="started again"):
        again.start("cut")


def test_a_camera_that_changes_its_size_ends_the_video(make: MakeRecorder) -> None:
    recorder = make()
    recorder.start("one")
    recorder.offer(frame(0))
    recorder.offer(frame(1, (32, 24)))
    info = wait_until_done(recorder, "one")
    assert info.frames == 1 and "size" in info.message
    recorder.start("none")
    recorder.stop()
    assert wait_until_done(recorder, "none").message == "No frames came."


@pytest.fixture
def ask(make: MakeRecorder, tmp_path: Path) -> Callable[..., dict[str, Any]]:
    store = SettingsStore(tmp_path / "node.json", node_settings())
    responder = Responder(store, Sessions(), PictureBox(4.0), NodeClock(), dict, dict, None, make(),
                          ForegroundStore(None))

    def ask_node(**request: Any) -> dict[str, Any]:
        head, *data = responder.answer([json.dumps(request).encode()], "")
        return {**json.loads(head), "data": data}
    return ask_node


@pytest.mark.parametrize("name", ["", ".", "..", "../left", "a/b", "/etc/passwd", "a.json", "a\0", "a\n", "x" * 65,
                                  "-a"])
def test_names_that_could_lead_out_of_the_folder_are_refused(
        ask: Callable[..., dict[str, Any]], tmp_path: Path, name: str) -> None:
    before = sorted(tmp_path.rglob("*"))
    for request in ({"request": "video_start"}, {"request": "video_read", "offset": 0, "length": 9},
                    {"request": "video_delete"}):
        answer = ask(**request, name=name)
        assert not answer["ok"] and "name" in answer["error"], answer
    assert settled(lambda: sorted(tmp_path.rglob("*")) == before, 0.05)


def test_requests_are_answered_or_refused_in_a_sentence(ask: Callable[..., dict[str, Any]]) -> None:
    assert ask(request="video_list") == {"ok": True, "videos": [], "data": []}
    started = ask(request="video_start", name="a")
    assert started["video"]["state"] == "recording"
    assert "not finished" in ask(request="video_read", name="a", offset=0, length=10)["error"]
    assert "not finished" in ask(request="video_delete", name="a")["error"]
    assert ask(request="video_stop")["stopped"] == "a"
    eventually(lambda: ask(request="video_list")["videos"][0]["state"] == "done")
    assert "no video b" in ask(request="video_read", name="b", offset=0, length=10)["error"]
    for wrong in ({"offset": -1, "length": 10}, {"offset": 0, "length": READ_MAX + 1}, {"offset": 0, "length": 0}):
        assert not ask(request="video_read", name="a", **wrong)["ok"]
    assert ask(request="video_delete", name="a")["ok"]
    assert "no video a" in ask(request="video_delete", name="a")["error"]


def test_a_node_that_forgets_its_masters_ends_its_video(make: MakeRecorder, tmp_path: Path) -> None:
    recorder = make()
    store = SettingsStore(tmp_path / "node.json", node_settings())
    responder = Responder(store, Sessions(), PictureBox(4.0), NodeClock(), dict, dict, LinkKeys(), recorder,
                          ForegroundStore(None))
    responder.answer([b'{"request": "video_start", "name": "a"}'], "")
    responder.revoke(lambda public_key: False)
    wait_until_done(recorder, "a")
