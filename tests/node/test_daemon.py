"""The daemon's step, with fakes: states, sequences, faults, the end of a recording, live settings."""

from __future__ import annotations

import logging
import time
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest
from node_fakes import LOST_CAMERA, SIZE, FakeCamera, FakeDetector, FakeSender, saved_settings

import rhot_node.daemon
from rhot_node.clock import NodeClock
from rhot_node.config import NodeSettings
from rhot_node.daemon import NodeDaemon
from rhot_node.errors import CameraError
from rhot_node.health.checks import Check
from rhot_node.network.pictures import PictureBox
from rhot_node.wire.messages import NodeState

MASTER = ("10.0.0.1", 5000)
Script = Iterable[int | Exception | None]


class Node:
    """A daemon on fakes. Each time the camera is opened it plays the next script."""

    def __init__(self, tmp_path: Path, *scripts: Script | CameraError, loop: bool = False,
                 detector_s: float = 0.0, period_ns: int = 0) -> None:
        self.clock = NodeClock(offset_ns=10**15)
        self.store = saved_settings(tmp_path / "node.json")
        self.scripts = list(scripts)
        self.period_ns = period_ns
        self.cameras: list[FakeCamera] = []
        self.detectors: list[FakeDetector] = []
        self.detector_s = detector_s
        self.sender = FakeSender()
        self.pictures = PictureBox(4.0)
        self.daemon = NodeDaemon(self.store, self.clock, self._open, self._make_detector, loop=loop)

    def step(self, times: int = 1) -> bool:
        return all(self.daemon.step(self.sender, self.pictures) for _ in range(times))

    def start(self, session: int = 7, t_start_node_ns: int = 0) -> None:
        self.daemon.sessions.start(session, MASTER, t_start_node_ns, now_node_ns=self.clock.now_ns(),
                                   now_s=time.monotonic())

    def _open(self, _settings: object) -> FakeCamera:
        script = self.scripts.pop(0)
        if isinstance(script, CameraError):
            raise script
        self.cameras.append(FakeCamera(script, self.clock, self.period_ns))
        return self.cameras[-1]

    def _make_detector(self, _settings: NodeSettings) -> FakeDetector:
        self.detectors.append(FakeDetector(self.detector_s))
        return self.detectors[-1]


@pytest.fixture
def at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rhot_node.daemon, "REOPEN_S", 0.0)


def test_states_from_start_to_stop(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO, logger="rhot_node.daemon")
    node = Node(tmp_path, range(100))
    states = [node.daemon.state]
    node.daemon.prepare()
    states.append(node.daemon.state)
    node.step(3)
    assert not node.sender.sent
    node.start()
    states.append(node.daemon.state)
    node.step(2)
    node.daemon.sessions.stop(7)
    states.append(node.daemon.state)
    node.step(2)
    assert states == [NodeState.STARTING, NodeState.READY, NodeState.STREAMING, NodeState.READY]
    assert [observations.frame_number for observations, _ in node.sender.sent] == [3, 4]
    assert [record.message for record in caplog.records] == [
        "starting -> ready", "ready -> streaming", "streaming -> ready"]


def test_what_is_sent(tmp_path: Path) -> None:
    node = Node(tmp_path, range(100), detector_s=0.003)
    node.daemon.prepare()
    node.start()
    node.step()
    observations, address = node.sender.sent[0]
    assert address == MASTER
    assert (observations.node_id, observations.session, observations.sequence) == (3, 7, 0)
    assert (observations.width, observations.height) == SIZE
    assert observations.marker_checksum == node.store.current.markers.checksum
    assert observations.exposure_ns == 4_000_000 and observations.row_time_ns == 48_000
    assert 3_000_000 <= observations.processing_ns < 10**9
    assert observations.t_frame_node_ns <= observations.t_send_node_ns <= node.clock.now_ns()
    assert observations.markers[0].x == SIZE[0] / 2


def test_a_preview_has_the_stamp_of_its_frames_observations(tmp_path: Path) -> None:
    node = Node(tmp_path, range(100))
    node.daemon.prepare()
    node.start()
    node.step(2)
    node.pictures.wanted = True
    node.step(3)
    preview = node.pictures.take_preview()
    assert preview is not None
    (own,) = [one for one, _ in node.sender.sent if one.t_frame_node_ns == preview.t_node_ns]
    assert own.frame_number == preview.number == node.sender.sent[2][0].frame_number


def test_sequences_count_from_zero_in_each_session(tmp_path: Path) -> None:
    node = Node(tmp_path, range(100))
    node.daemon.prepare()
    node.start(7)
    node.step(3)
    node.start(8)
    node.step(2)
    assert [(o.session, o.sequence) for o, _ in node.sender.sent] == [(7, 0), (7, 1), (7, 2), (8, 0), (8, 1)]


def test_streaming_begins_with_the_first_frame_exposed_after_the_start_time(tmp_path: Path) -> None:
    node = Node(tmp_path, range(1000))
    node.daemon.prepare()
    t_start = node.clock.now_ns() + 20_000_000
    node.start(7, t_start)
    assert node.daemon.state is NodeState.STREAMING
    while not node.sender.sent:
        node.step()
    assert node.sender.sent[0][0].t_frame_node_ns >= t_start
    assert node.sender.sent[0][0].frame_number > 0 and node.sender.sent[0][0].sequence == 0


def test_a_lost_camera_is_a_fault_that_mends_itself_in_the_same_session(
        tmp_path: Path, at_once: None, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO, logger="rhot_node.daemon")
    node = Node(tmp_path, [0, 1, LOST_CAMERA], CameraError("still unplugged"), range(5))
    node.daemon.prepare()
    node.start()
    node.step(3)
    assert node.daemon.state is NodeState.FAULT and node.cameras[0].closed
    assert node.daemon.report()["message"] == "the plug was pulled"
    node.step()
    assert node.daemon.state is NodeState.FAULT and node.daemon.report()["message"] == "still unplugged"
    node.step(3)
    assert node.daemon.state is NodeState.STREAMING and node.daemon.report()["message"] == ""
    assert [(o.session, o.sequence) for o, _ in node.sender.sent] == [(7, k) for k in range(4)]
    assert node.detectors[0].resets == 1 and node.daemon.counters.faults == 1
    assert "streaming -> fault: the plug was pulled" in caplog.text and "fault -> streaming" in caplog.text


def test_the_camera_is_not_opened_again_at_once(tmp_path: Path) -> None:
    node = Node(tmp_path, [LOST_CAMERA], range(5))
    node.daemon.prepare()
    node.step(3)
    assert len(node.cameras) == 1


def test_a_looped_recording_goes_on(tmp_path: Path) -> None:
    node = Node(tmp_path, [0, 1], loop=True)
    node.daemon.prepare()
    node.start()
    assert node.step(5)
    assert node.cameras[0].rewound == 1
    assert [o.frame_number for o, _ in node.sender.sent] == [0, 1, 100, 101]


def test_gaps_and_late_frames_are_counted(tmp_path: Path) -> None:
    node = Node(tmp_path, [0, 1, None, 5, 6], period_ns=100_000, detector_s=0.002)
    node.daemon.prepare()
    node.step(5)
    counters = node.daemon.count()
    assert (counters["frames"], counters["skipped_frames"]) == (4, 3)
    assert counters["over_budget"] == 3, "the first frame has no period to be measured by"


def test_frames_that_the_network_refuses_are_counted(tmp_path: Path) -> None:
    node = Node(tmp_path, range(5))
    node.sender = FakeSender(works=False)
    node.daemon.prepare()
    node.start()
    node.step(2)
    assert [node.daemon.count()[name] for name in ("sent", "not_sent")] == [0, 2]


def test_a_silent_master_ends_the_stream(tmp_path: Path) -> None:
    node = Node(tmp_path, range(9))
    node.daemon.prepare()
    node.daemon.sessions.start(7, MASTER, 0, now_node_ns=0, now_s=time.monotonic() - 5.1)
    node.step()
    assert node.daemon.state is NodeState.READY and not node.sender.sent


def test_settings_take_effect_between_two_frames(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO, logger="rhot_node.daemon")
    node = Node(tmp_path, range(9), range(9), range(9))
    node.daemon.prepare()
    node.step()
    assert node.store.change({"preview_hz": 9}) == []
    node.step()
    assert node.pictures.preview_hz == 9 and len(node.detectors) == len(node.cameras) == 1
    node.store.change({"detector": "reference"})
    node.step()
    assert len(node.detectors) == 2 and len(node.cameras) == 1
    node.store.change({"camera": {"gain": 2.0}})
    node.step(2)
    assert len(node.cameras) == 2 and node.cameras[0].closed
    assert node.daemon.state is NodeState.READY and "fault" not in caplog.text


def test_a_camera_that_does_not_open_with_new_settings_is_a_fault(tmp_path: Path, at_once: None) -> None:
    node = Node(tmp_path, range(9), CameraError("no such mode"), CameraError("still no such mode"), range(9))
    node.daemon.prepare()
    node.store.change({"camera": {"fps": 1000}})
    node.step()
    assert node.cameras[0].closed and node.daemon.state is NodeState.FAULT
    assert node.daemon.report()["message"] == "still no such mode"
    node.step(2)
    assert node.daemon.state is NodeState.READY and len(node.cameras) == 2


def test_a_recording_is_not_opened_again_for_camera_settings(tmp_path: Path) -> None:
    node = Node(tmp_path, range(9))
    node.daemon = NodeDaemon(node.store, node.clock, node._open, node._make_detector, camera_takes_settings=False)
    node.daemon.prepare()
    node.store.change({"camera": {"gain": 2.0}})
    node.step(2)
    assert len(node.cameras) == 1 and not node.cameras[0].closed


@pytest.mark.parametrize(("changes", "sent", "dropped"), [
    ({}, [0, 1, 2], 0), ({"late_frames": "drop"}, [0], 2), ({"late_frames": "drop", "budget_ms": 1.0}, [], 3),
    ({"late_frames": "drop", "budget_ms": 9000.0}, [0, 1, 2], 0)])
def test_late_frames_are_sent_or_dropped_as_set(tmp_path: Path, changes: dict[str, object], sent: list[int],
                                                dropped: int) -> None:
    node = Node(tmp_path, range(9), period_ns=100_000, detector_s=0.002)
    node.store.change(changes)
    node.daemon.prepare()
    node.start()
    node.step(3)
    assert [o.frame_number for o, _ in node.sender.sent] == sent
    assert [o.sequence for o, _ in node.sender.sent] == list(range(len(sent))), "what is dropped is not lost"
    assert node.daemon.counters.late_dropped == dropped


def test_the_report_tells_of_the_camera_and_of_the_machine(tmp_path: Path) -> None:
    node = Node(tmp_path, range(9))
    trouble = Check("heat", "error", "It is too hot.", "Cool it.")
    node.daemon = NodeDaemon(node.store, node.clock, node._open, node._make_detector, troubles=lambda: [trouble])
    assert node.daemon.report()["camera"] == {}
    node.daemon.prepare()
    node.cameras[0].report = lambda: {"sensor": "imx219"}  # type: ignore[attr-defined]
    assert node.daemon.report()["camera"] == {"sensor": "imx219"}
    assert node.daemon.report()["health"] == [trouble]


def test_the_report_says_that_the_picture_is_black(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rhot_node.daemon, "_LIGHT_PERIOD_S", 0.0)
    node = Node(tmp_path, range(9))
    node.daemon.prepare()
    lit, capped = np.full((480, 640), 90, np.uint8), np.full((480, 640), 18, np.uint8)
    capped[:40, :40] = 200  # a reflection
    for luma, codes in ((capped, ["black"]), (lit, [])):
        node.cameras[0].luma = luma
        node.step()
        assert [trouble.code for trouble in node.daemon.report()["health"]] == codes


@pytest.mark.parametrize(("period_ns", "level", "codes"), [
    (66_000_000, 40, ["too_dark"]), (66_000_000, 130, ["slow"]), (33_000_000, 40, [])])
def test_the_report_says_whether_it_is_too_dark_for_the_rate(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch, period_ns: int, level: int, codes: list[str]) -> None:
    monkeypatch.setattr(rhot_node.daemon, "_LIGHT_PERIOD_S", 0.0)
    node = Node(tmp_path, range(99), period_ns=period_ns)
    node.daemon.prepare()
    camera = node.cameras[0]
    camera.report = lambda: {"fps": 30.0}  # type: ignore[attr-defined]
    camera.began_ns -= 10**10
    camera.luma = np.full((480, 640), level, np.uint8)
    node.step(60)
    assert [trouble.code for trouble in node.daemon.report()["health"]] == codes
