"""Takes and their misfortunes: logs that go through the real door, the same ones for the same seed."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from pathlib import Path

import fault_injection as alter
import msgspec
import numpy as np
import pytest

from rhot_app.errors import SimulatorError
from rhot_app.evaluation import data_sets as takes
from rhot_app.evaluation.compare import judge, orders
from rhot_app.evaluation.data_sets import LOG_NAME, DataSet, Order, data_set
from rhot_app.evaluation.track import tracked
from rhot_app.project import TrackerSettings
from rhot_app.recording.raw_log import LogReader, Record, RecordKind
from rhot_app.simulator.film.film import TRUTH_NAME, Report
from rhot_app.simulator.film.node_log import CABLE, Network, Stream
from rhot_app.simulator.film.shot import Shot
from rhot_app.simulator.scene.scene import Scene, make_scene, twin_defaults
from rhot_app.sources.replay import LogValidator
from rhot_app.tracking.tracker import CameraObservations
from rhot_node.files import resource_path

SECONDS = 2.0
NODES = (1, 2)


def scene(seed: int = 1) -> Scene:
    return make_scene(twin_defaults(), seed)


@pytest.fixture(scope="module")
def grasp(tmp_path_factory: pytest.TempPathFactory) -> DataSet:
    """A take without pictures."""
    return data_set(Order(scene(), "grasp", SECONDS, sketched=True), tmp_path_factory.mktemp("takes"))


def through_the_door(one: DataSet, records: list[Record]) -> tuple[LogValidator, list[CameraObservations]]:
    door = LogValidator(one.rig)
    return door, [frame for record in records if (frame := door.feed(record)) is not None]


def found_share(frames: list[CameraObservations]) -> np.ndarray:
    """(M,) of the frames in which each marker is found."""
    return np.isfinite(np.array([frame.pixels[:, 0] for frame in frames])).mean(axis=0)


def test_every_datagram_is_admitted_and_tracked_to_a_millimetre(grasp: DataSet) -> None:
    door, frames = through_the_door(grasp, grasp.records())
    assert len(frames) == sum(record.kind is RecordKind.DATAGRAM for record in grasp.records()) > 150
    assert all(not link.door.dropped for link in door.links)
    figures = judge(grasp, TrackerSettings(kind="classic")).figures
    assert figures["tip_visible_mm"] is not None and figures["tip_visible_mm"] < 1.5
    assert figures["swaps"] == 0.0


def test_the_clocks_of_a_take_disagree_and_are_found_out(grasp: DataSet) -> None:
    door, frames = through_the_door(grasp, grasp.records())
    offsets = [link.clock.offset_s for link in door.links]
    assert all(offset is not None and offset > 1.0 for offset in offsets) and offsets[0] != offsets[1]
    first = min(frame.t_row0_master_ns for frame in frames)
    assert abs(1e-9 * first - 1000.0 - min(scene().phases_s)) < 1e-3


def test_one_order_is_filmed_once_and_the_same_anywhere(tmp_path: Path) -> None:
    order = Order(scene(3), "pinch", 0.3, sketched=True)
    told: list[str] = []
    logs = []
    for folder in (tmp_path / "a", tmp_path / "a", tmp_path / "b"):
        one = data_set(order, folder, told.append)
        with contextlib.closing(LogReader(one.folder / LOG_NAME)) as reader:
            logs.append(list(reader))  # the header says when it was filmed
        assert not one.outdated
    assert told == ["pinch, 0.3 s, seed 3"] * 2
    assert logs[0] == logs[1] == logs[2] and logs[0]


def test_a_take_is_replayed_without_its_truth(tmp_path: Path) -> None:
    """That of half an hour is larger than what is read of a file."""
    order = Order(scene(3), "pinch", 0.3, sketched=True)
    (data_set(order, tmp_path).folder / TRUTH_NAME).write_bytes(b"too large")
    one = data_set(order, tmp_path)
    assert one.records()
    with pytest.raises(SimulatorError, match=TRUTH_NAME):
        _ = one.truth


@pytest.mark.parametrize(("room", "outdated"), [("rhot_app/simulator/film", True), ("rhot_node/detect", False)])
def test_a_sketch_that_other_sources_made_is_outdated(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch, room: str, outdated: bool) -> None:
    order = Order(scene(3), "pinch", 0.3, sketched=True)
    assert not data_set(order, tmp_path).outdated
    read = Path.read_bytes
    monkeypatch.setattr(Path, "read_bytes", lambda path: b"" if room in path.as_posix() else read(path))
    takes._source_digest.cache_clear()
    try:
        assert data_set(order, tmp_path).outdated is outdated
        told: list[str] = []
        assert not data_set(order, tmp_path, told.append, anew=True).outdated
        assert bool(told) is outdated, "what is not outdated is not filmed twice"
    finally:
        takes._source_digest.cache_clear()


def test_orders_that_differ_have_names_that_differ() -> None:
    names = {Order(scene(), "grasp", 1.0).name(), Order(scene(2), "grasp", 1.0).name(),
             Order(scene(), "wave", 1.0).name(), Order(scene(), "grasp", 2.0).name(),
             Order(scene(), "grasp", 1.0, Network(loss=0.1)).name(), Order(scene(), "grasp", 1.0, CABLE, True).name(),
             Order(make_scene(msgspec.structs.replace(twin_defaults(), markers="rhot8"), 1), "grasp", 1.0).name(),
             Order(scene(), "grasp", 1.0, unpainted=frozenset({"thumb"})).name()}
    assert len(names) == 8


def test_a_hand_without_a_markers_paint_shows_all_others(tmp_path: Path) -> None:
    one = data_set(Order(scene(), "rest", 0.3, unpainted=frozenset({"ring"})), tmp_path)
    _, frames = through_the_door(one, one.records())
    share = found_share(frames)
    ring = scene().markers.ids.index("ring")
    assert share[ring] < 0.1 and np.delete(share, ring).min() > 0.9


def test_a_marker_file_that_says_something_else_is_another_order(tmp_path: Path) -> None:
    own = tmp_path / "mine.json"
    names = set()
    for shipped in ("rhot6", "rhot8"):
        own.write_bytes(resource_path("markers", f"{shipped}.json").read_bytes())
        names.add(Order(make_scene(msgspec.structs.replace(twin_defaults(), markers=str(own)), 1), "grasp", 1.0).name())
    assert len(names) == 2 and all(name.startswith("grasp-1s-mine-1-") for name in names)


def test_every_motion_is_ordered_with_every_seed() -> None:
    assert len(orders(scene(), ["rest", "wave"], range(1, 4), 2.0)) == 6


def test_a_lossy_network_loses_its_share(tmp_path: Path) -> None:
    one = data_set(Order(scene(), "rest", SECONDS, Network(loss=0.3), sketched=True), tmp_path)
    door, frames = through_the_door(one, one.records())
    assert 0.55 < len(frames) / 160 < 0.85
    assert sum(link.door.sequence.lost for link in door.links) > 20


def test_pictures_are_rendered_and_the_nodes_detector_finds_the_markers(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def here(shot: Shot, work: Callable[[Shot, int, Report], Stream], _: object) -> tuple[Stream, ...]:
        return tuple(work(shot, camera, lambda number: None) for camera in (0, 1))  # what is compiled is shared

    monkeypatch.setattr("rhot_app.evaluation.data_sets.for_each_camera", here)
    one = data_set(Order(scene(), "rest", 0.1), tmp_path)
    _, frames = through_the_door(one, one.records())
    assert len(frames) >= 7 and (found_share(frames) == 1.0).all()


def test_a_covered_camera_sees_nothing_and_a_silent_one_says_nothing(grasp: DataSet) -> None:
    records = alter.changed(grasp.records(), alter.blind(1, 0.5, 1.5))
    _, frames = through_the_door(grasp, records)
    covered = [frame for frame in frames if frame.camera == 0 and not np.isfinite(frame.pixels).any()]
    assert len(covered) == pytest.approx(40, abs=1)
    assert found_share([frame for frame in frames if frame.camera == 1]).min() > 0.9
    quiet = alter.silent(grasp.records(), 1, 0.5, 1.5)
    assert len(grasp.records()) - len(quiet) == pytest.approx(40, abs=1)


@pytest.mark.parametrize("lasting_s", [alter.EPISODE_S, (0.2, 0.2)])
def test_episodes_fill_their_share_of_the_time(lasting_s: tuple[float, float]) -> None:
    spells = alter.episodes(0.3, 2000.0, np.random.default_rng(5), lasting_s)
    lengths = spells[:, 1] - spells[:, 0]
    assert lengths.sum() / 2000.0 == pytest.approx(0.3, abs=0.03)
    assert lengths.min() >= lasting_s[0] - 1e-9 and lengths.max() <= lasting_s[1] + 1e-9
    assert (spells[1:, 0] > spells[:-1, 1]).all()


@pytest.mark.parametrize("together", [True, False])
def test_hidden_markers_are_lost_to_all_cameras_at_once_or_to_each_by_itself(grasp: DataSet, together: bool) -> None:
    change = alter.hidden(0.3, SECONDS, NODES, 6, seed=2, together=together)
    _, frames = through_the_door(grasp, alter.changed(grasp.records(), change))
    lost = [1.0 - found_share([frame for frame in frames if frame.camera == camera]) for camera in (0, 1)]
    assert 0.1 < np.mean(lost) < 0.5
    assert (np.abs(lost[0] - lost[1]).max() < 0.03) == together


def test_mixed_up_markers_stand_in_each_others_places(grasp: DataSet) -> None:
    _, right = through_the_door(grasp, grasp.records())
    _, wrong = through_the_door(grasp, alter.changed(grasp.records(), alter.mixed_up((1, 2), 0.5, SECONDS, NODES, 4)))
    swapped = [np.allclose(a.pixels[1], b.pixels[2]) and np.allclose(a.pixels[2], b.pixels[1])
               for a, b in zip(right, wrong, strict=True)]
    same = [np.array_equal(a.pixels, b.pixels, equal_nan=True) for a, b in zip(right, wrong, strict=True)]
    assert 0.1 < np.mean(swapped) < 0.9 and all(one != other for one, other in zip(swapped, same, strict=True))


def test_a_late_start_leaves_the_clocks_known(grasp: DataSet) -> None:
    door, frames = through_the_door(grasp, alter.begun_at(grasp.records(), 1.0))
    assert len(frames) == pytest.approx(82, abs=3) and all(not link.door.dropped for link in door.links)


def test_a_prolonged_log_goes_on_without_a_drop(grasp: DataSet) -> None:
    door, frames = through_the_door(grasp, list(alter.prolonged(grasp.records(), 3)))
    count = sum(record.kind is RecordKind.DATAGRAM for record in grasp.records())
    assert len(frames) == 3 * count
    assert all(not link.door.dropped and not link.door.sequence.lost for link in door.links)
    assert door.changes == LogValidator(grasp.rig).changes + 1, "one session, and no clock was set"
    times = tracked(alter.prolonged(grasp.records(), 3), grasp.rig).times_s
    assert (np.diff(times) > 0.0).all() and times[-1] > 3.0 * SECONDS
