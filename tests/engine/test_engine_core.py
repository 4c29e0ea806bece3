"""The engine over synthetic nodes: states out, figures, recording and replay, rigs changed while it runs."""

import resource
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise
from logging import LogRecord
from pathlib import Path
from types import SimpleNamespace

import msgspec
import numpy as np
import pytest
from fake_tracker import FakeTracker
from patience import eventually, settled
from synthetic_node import SyntheticNode, synthetic_rig

from rhot_app.engine import status
from rhot_app.engine.core import Engine
from rhot_app.engine.offline.replay_summary import replay_states, summarise
from rhot_app.engine.status import EngineStatus, Preview
from rhot_app.errors import EngineError, RecordingError, RhotError, RigError
from rhot_app.project import OneEuroSettings, OutputSettings, Rig, load_rig
from rhot_app.recording.raw_log import LogReader, RecordKind
from rhot_app.rig_history import versions
from rhot_app.sources.links import UdpNodes
from rhot_app.sources.replay import LogReplay, LogValidator
from rhot_app.state import HandState
from rhot_node.clock import NodeClock


class Bench:
    """An engine, the bytes it published, the trackers it made."""

    def __init__(self, rig: Rig) -> None:
        self.published: list[bytes] = []
        self.trackers: list[FakeTracker] = []
        self.engine = Engine(rig, None, UdpNodes, self._tracker, self.published.append)

    def _tracker(self, rig: Rig) -> FakeTracker:
        self.trackers.append(FakeTracker(rig))
        return self.trackers[-1]

    def run_until(self, condition: Callable[[], bool]) -> None:
        eventually(condition, told=self.engine.status)

    def until_published(self, more: int) -> None:
        """Run until so many more states were published."""
        count = len(self.published)
        self.run_until(lambda: len(self.published) >= count + more)


@pytest.fixture
def rig() -> Rig:
    return synthetic_rig()


@pytest.fixture
def bench(rig: Rig) -> Iterator[Bench]:
    bench = Bench(rig)
    yield bench
    bench.engine.close()


@pytest.fixture
def nodes(rig: Rig) -> Iterator[list[SyntheticNode]]:
    nodes = [SyntheticNode(rig, camera, rate_hz=100.0, clock=NodeClock(10**12 * camera, 20.0, 0)) for camera in (0, 1)]
    for node in nodes:
        node.start()
    yield nodes
    for node in nodes:
        node.close()


def test_states_carry_the_latency_of_the_one_before(bench: Bench, nodes: list[SyntheticNode]) -> None:
    bench.engine.start()
    bench.run_until(lambda: len(bench.published) > 20)
    latencies = [_decode_state(payload).latency_s for payload in bench.published[1:]]
    assert all(0.0 < latency["publish"] < latency["receive_to_state"] for latency in latencies)
    assert min(latency["publish"] for latency in latencies) < 0.05
    assert min(latency["receive_to_state"] for latency in latencies) < 0.5


def test_status_says_how_it_goes(bench: Bench, nodes: list[SyntheticNode]) -> None:
    assert bench.engine.status().condition == "IDLE"
    bench.engine.start()
    assert bench.engine.status().condition == "SEARCHING"

    def in_full_swing(status: EngineStatus) -> bool:
        rates_hz = [node.rate_hz for node in status.nodes]
        return (status.condition == "TRACKING" and "receive_to_state" in status.latency
                and all(node.state == "streaming" for node in status.nodes)
                and 0.0 < 0.8 * min(rates_hz) < status.state_rate_hz < 1.2 * max(rates_hz) < 140.0)

    bench.run_until(lambda: in_full_swing(bench.engine.status()))
    status = bench.engine.status()
    assert status.running
    assert 0.0 < status.latency["receive_to_state"].p50_s <= status.latency["receive_to_state"].p99_s
    assert [advice for advice in status.advice if advice.level == "error"] == []
    bench.engine.stop()
    assert bench.engine.status().condition == "IDLE"


def test_silent_node_is_named_and_forgotten_when_it_answers(rig: Rig, bench: Bench) -> None:
    bench.engine.start()
    bench.run_until(lambda: any("Node left does not answer at 127.0.0.1:" in advice.text
                                for advice in bench.engine.status().advice))
    node = SyntheticNode(rig, 0)
    node.start()
    bench.run_until(lambda: not any("Node left does not" in a.text for a in bench.engine.status().advice))
    said = [advice.text for advice in bench.engine.status().advice]
    node.close()
    assert not any("Node left does not" in text for text in said)


def test_a_preview_carries_what_was_found_in_its_very_frame(bench: Bench, nodes: list[SyntheticNode]) -> None:
    bench.engine.start()
    bench.run_until(lambda: min(Counter(one.camera for one in bench.trackers[-1].ingested).values(), default=0) > 20)
    frames = [one for one in bench.trackers[-1].ingested if one.camera == 1]
    frame, before = next(pair for pair in pairwise(reversed(frames[:-10]))  # a node that was held up repeats itself
                         if not np.array_equal(pair[0].pixels, pair[1].pixels))
    preview = Preview("right", 0, 640, 480, b"jpeg", frame.t_row0_node_ns)
    annotated = bench.engine.annotated(preview)
    assert np.array_equal(annotated.pixels, frame.pixels) and not np.array_equal(annotated.pixels, before.pixels)
    assert np.array_equal(annotated.flags, frame.flags) and annotated.t_master_ns == frame.t_row0_master_ns
    for other in (replace(preview, t_node_ns=frame.t_row0_node_ns + 1), replace(preview, camera="left"),
                  replace(preview, camera="unknown"), replace(preview, t_node_ns=0)):
        assert bench.engine.annotated(other) is other, "what belongs to another frame is not drawn"


def test_a_broken_tracker_is_reported_once_begins_anew_and_is_no_fault_any_more_once_it_works(
        bench: Bench, nodes: list[SyntheticNode], tracker_may_fail: list[LogRecord],
        monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rhot_app.engine.observer.RECENT_NS", 100_000_000)
    bench.engine.start()
    bench.run_until(lambda: len(bench.published) > 3)
    tracker = bench.trackers[-1]
    resets = tracker.resets
    tracker.broken = True
    bench.run_until(lambda: bench.engine.status().condition == "FAULT")
    assert any("numbers went wrong" in advice.text for advice in bench.engine.status().advice)
    bench.run_until(lambda: tracker.resets > resets + 1)
    by_camera = Counter(record.getMessage() for record in tracker_may_fail)
    assert set(by_camera.values()) == {1} and len(by_camera) <= len(nodes), "a sentence of each camera"
    tracker.broken = False
    bench.run_until(lambda: bench.engine.status().condition == "TRACKING")
    assert not any("numbers went wrong" in advice.text for advice in bench.engine.status().advice)


def test_a_camera_over_whose_frames_the_tracker_fails_costs_only_these(
        bench: Bench, nodes: list[SyntheticNode], tracker_may_fail: list[LogRecord]) -> None:
    bench.engine.start()
    bench.until_published(10)
    tracker = bench.trackers[-1]
    tracker.broken_camera = 0
    resets = tracker.resets
    bench.until_published(30)
    status = bench.engine.status()
    assert status.condition == "FAULT" and tracker.resets == resets
    assert any("camera left" in advice.text and "that picture" in advice.text for advice in status.advice)
    assert [record.levelname for record in tracker_may_fail] == ["ERROR"]


def test_log_replays_to_the_same_states(tmp_path: Path, rig: Rig, bench: Bench, nodes: list[SyntheticNode]) -> None:
    bench.engine.start()
    bench.run_until(lambda: len(bench.published) > 5)
    bench.engine.record(tmp_path / "a.log")  # in the middle of a session
    with pytest.raises(EngineError, match="already recording"):
        bench.engine.record(tmp_path / "b.log")
    first = len(bench.published)
    bench.until_published(60)
    assert bench.engine.status().log_bytes > 0 and 0.0 < bench.engine.status().log_seconds < 60.0
    bench.engine.record_stop()
    assert bench.engine.status().log_seconds == 0.0 and bench.engine.status().replaying == ""
    live = np.array([_decode_state(payload).t_master_ns for payload in bench.published[first:]])
    reader = LogReader(tmp_path / "a.log")
    summary = summarise(reader, reader.rig, FakeTracker(rig))
    right = summary["nodes"]["right"]
    assert set(right["dropped"]) <= {"time", "clock_in_doubt"}, "what a busy machine sends too late"
    assert right["accepted"] + sum(right["dropped"].values()) == right["received"]
    assert summary["state_rate_hz"] == pytest.approx(1e9 / np.diff(live).mean(), rel=0.1)
    door = LogValidator(rig)
    again = np.array([s.t_master_ns for s in replay_states(LogReader(tmp_path / "a.log"), door, FakeTracker(rig))])
    nearest = np.abs(live[:, None] - again[None, :]).min(axis=1)
    assert np.mean(nearest < 20_000) > 0.9  # the clock's estimate may step between two records of different threads


def test_tracking_goes_on_when_the_disk_is_full(tmp_path: Path, bench: Bench, nodes: list[SyntheticNode]) -> None:
    bench.engine.start()
    bench.run_until(lambda: len(bench.published) > 5)
    bench.engine.record(tmp_path / "a.log")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, ((tmp_path / "a.log").stat().st_size + 5000, before[1]))
    try:
        bench.run_until(lambda: any("has stopped" in advice.text for advice in bench.engine.status().advice))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    bench.until_published(20)
    assert bench.engine.status().log_path == ""
    assert any(record.kind is RecordKind.DATAGRAM for record in LogReader(tmp_path / "a.log"))


def test_a_disk_that_fills_is_told_before_it_is_full(tmp_path: Path, bench: Bench, nodes: list[SyntheticNode],
                                                     monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rhot_app.recording.recorder._LEAST_S", 0.2)
    monkeypatch.setattr("rhot_app.recording.recorder.os.statvfs",
                        lambda path: SimpleNamespace(f_bavail=9, f_frsize=512))
    bench.engine.start()
    bench.engine.record(tmp_path / "a.log")
    bench.run_until(lambda: any("will be full" in advice.text for advice in bench.engine.status().advice))
    bench.engine.record_stop()
    assert not any("will be full" in advice.text for advice in bench.engine.status().advice)


def _decode_state(payload: bytes) -> HandState:
    state = status.decode(status.TOPIC_STATE, payload)
    assert isinstance(state, HandState)
    return state


def test_replay_source_serves_like_nodes(tmp_path: Path, rig: Rig, bench: Bench, nodes: list[SyntheticNode]) -> None:
    bench.engine.record(tmp_path / "a.log")
    bench.engine.start()
    bench.run_until(lambda: len(bench.published) > 50)
    bench.engine.record_stop()
    for speed in (20.0, None):
        published: list[bytes] = []
        engine = Engine(rig, None, lambda rig, speed=speed: LogReplay(tmp_path / "a.log", rig, speed),
                        FakeTracker, published.append)
        engine.start()
        eventually(lambda engine=engine: any("over" in advice.text for advice in engine.status().advice))
        count = len(published)
        assert count > 25 and "receive_to_state" not in engine.status().latency
        engine.start()  # once more from the beginning
        eventually(lambda published=published, count=count: len(published) >= count + 20)
        with pytest.raises(RecordingError):
            engine.record(tmp_path / "c.log")
        assert not (tmp_path / "c.log").exists(), "a refused recording leaves a file"
        engine.close()


def test_filter_change_keeps_the_session(rig: Rig, bench: Bench, nodes: list[SyntheticNode]) -> None:
    session = bench.engine.start()
    bench.run_until(lambda: len(bench.published) > 3)
    filters = msgspec.structs.replace(rig.filters, pixel=OneEuroSettings(1.0, 0.0))
    bench.engine.set_rig(msgspec.structs.replace(rig, filters=filters))
    bench.until_published(4)
    assert bench.engine.session == session
    assert bench.trackers[-1].rig.filters == filters


def test_other_outputs_leave_tracking_alone(rig: Rig, bench: Bench, nodes: list[SyntheticNode]) -> None:
    session = bench.engine.start()
    bench.until_published(4)
    resets, received = bench.trackers[-1].resets, bench.engine.status().nodes[0].received
    bench.engine.set_rig(msgspec.structs.replace(rig, outputs=(OutputSettings("osc", "127.0.0.1:9000"),)))
    assert len(bench.trackers) == 1 and bench.trackers[-1].resets == resets and bench.engine.session == session
    assert bench.engine.status().nodes[0].received >= received
    assert bench.engine.rig.outputs
    bench.until_published(4)


def test_fewer_markers_while_streaming(rig: Rig, bench: Bench, nodes: list[SyntheticNode]) -> None:
    bench.engine.start()
    bench.until_published(10)  # frames of the old marker set are on their way
    fewer = msgspec.structs.replace(rig.markers, markers=rig.markers.markers[:4])
    bench.engine.set_rig(msgspec.structs.replace(rig, markers=fewer))
    assert settled(lambda: bench.trackers[-1].ingested == [], 0.3)
    bench.run_until(lambda: any("another marker set" in a.text for a in bench.engine.status().advice))
    bench.engine.set_rig(rig)
    bench.until_published(4)


def test_other_network_restarts_and_a_taken_port_keeps_the_old_rig(rig: Rig, bench: Bench,
                                                                   nodes: list[SyntheticNode]) -> None:
    session = bench.engine.start()
    taken = UdpNodes(synthetic_rig())
    port = taken.receivers[0].port
    with pytest.raises(RhotError, match=str(port)):
        bench.engine.set_rig(_with_data_port(rig, port))
    assert bench.engine.rig is rig
    bench.until_published(4)
    taken.close()
    bench.engine.set_rig(_with_data_port(rig, port))
    assert bench.engine.session != session
    bench.until_published(4)


def _with_data_port(rig: Rig, port: int) -> Rig:
    return msgspec.structs.replace(rig, nodes=(msgspec.structs.replace(rig.nodes[0], data_port=port), rig.nodes[1]))


def test_rig_is_saved_where_asked(tmp_path: Path, bench: Bench) -> None:
    with pytest.raises(EngineError, match="path"):
        bench.engine.save_rig(None)
    assert bench.engine.save_rig(tmp_path / "rig.json") == tmp_path / "rig.json"
    assert bench.engine.save_rig(None) == tmp_path / "rig.json"
    with pytest.raises(RigError, match="cannot be written"):
        bench.engine.save_rig(tmp_path / "no" / "rig.json")


def test_saving_a_rig_keeps_what_stood_there(tmp_path: Path, bench: Bench) -> None:
    before = bench.engine.rig
    path = bench.engine.save_rig(tmp_path / "rig.json")
    bench.engine.set_rig(msgspec.structs.replace(before, name="moved"))
    bench.engine.save_rig(None)
    kept = versions(path)
    assert load_rig(path).name == "moved" and [load_rig(version.path) for version in kept] == [before]
