"""Pictures of a recording at its moments: the nodes' own stamps, brought to the master's clock by the log."""

from __future__ import annotations

import contextlib
import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest
from film_writing import LEVELS, level_of, write_film

from rhot_app.errors import RecordingError
from rhot_app.evaluation.data_sets import LOG_NAME, Order, data_set
from rhot_app.recording.raw_log import FILMS, LogReader, encode_log
from rhot_app.recording.video import video_path
from rhot_app.simulator.scene.scene import make_scene, twin_defaults
from rhot_app.sources.frame_sets import recorded_films
from rhot_app.sources.recorded_pictures import FilmReader
from rhot_app.sources.replay import LogValidator
from rhot_app.tracking.tracker import CameraObservations


@pytest.fixture(scope="module")
def frames(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[list[CameraObservations]]]:
    """A recording, and the frames of each of its cameras."""
    order = Order(make_scene(twin_defaults(), 2), "grasp", 1.5, sketched=True)
    log = data_set(order, tmp_path_factory.mktemp("takes")).folder / LOG_NAME
    with contextlib.closing(LogReader(log)) as reader:
        door = LogValidator(reader.rig)
        found: list[list[CameraObservations]] = [[] for _ in reader.rig.nodes]
        for record in reader:
            if isinstance(frame := door.feed(record), CameraObservations):
                found[frame.camera].append(frame)
    return log, found


@pytest.fixture
def log(frames: tuple[Path, list[list[CameraObservations]]], tmp_path: Path) -> Path:
    """The recording with the videos of both cameras; every third frame is missing in that of the second."""
    path = tmp_path / "a.rhotlog"
    shutil.copy(frames[0], path)
    with contextlib.closing(LogReader(path)) as reader:
        for camera, node in enumerate(reader.rig.nodes):
            times = [frame.t_row0_node_ns for frame in frames[1][camera]]
            write_film(video_path(path, node.name), [t for k, t in enumerate(times) if not camera or k % 3])
    return path


def test_every_frame_finds_its_own_picture(log: Path, frames: tuple[Path, list[list[CameraObservations]]]) -> None:
    with contextlib.closing(LogReader(log)) as reader:
        left, right = recorded_films(log, reader.rig)
    for number, frame in enumerate(frames[1][0]):
        assert left.number_at(frame.t_row0_master_ns) == number
        assert abs(int(left.video.times_ns[number]) - frame.t_row0_master_ns) < 100_000, "well below a frame's period"
    reader = FilmReader(left.video.source)
    for number in (7, LEVELS + 3, 0, 1):
        assert level_of(reader.picture(number)) == number % LEVELS
    lost = frames[1][1][3]
    nearest = right.number_at(lost.t_row0_master_ns)
    assert nearest is not None and nearest in (1, 2), "a frame that was lost is shown by its neighbour"


def test_no_picture_far_from_the_film(log: Path) -> None:
    with contextlib.closing(LogReader(log)) as reader:
        left, _ = recorded_films(log, reader.rig)
    assert left.number_at(int(left.video.times_ns[0]) - 1_000_000_000) is None
    assert left.number_at(int(left.video.times_ns[-1]) + 1_000_000_000) is None


def test_without_videos_there_is_none(frames: tuple[Path, list[list[CameraObservations]]]) -> None:
    with contextlib.closing(LogReader(frames[0])) as reader:
        assert recorded_films(frames[0], reader.rig) == ()


def test_another_file_in_the_videos_place_is_named(log: Path) -> None:
    with contextlib.closing(LogReader(log)) as reader:
        path = video_path(log, reader.rig.nodes[0].name)
        path.write_bytes(b"RIFF, but no video")
        with pytest.raises(RecordingError, match=path.name):
            recorded_films(log, reader.rig)


def test_an_ordinary_film_that_the_header_names(log: Path, tmp_path: Path) -> None:
    """Forward, back, and far on: a decoder gives the frame that was asked for."""
    film, first_ns = tmp_path / "hand.mp4", 5_000_000_000
    writer = cv2.VideoWriter(str(film), cv2.VideoWriter.fourcc(*"mp4v"), 25.0, (640, 480))
    for number in range(LEVELS):
        picture = np.zeros((480, 640, 3), np.uint8)
        picture[:, 16 * number:16 * (number + 1)] = 255
        writer.write(picture)
    writer.release()
    with contextlib.closing(LogReader(log)) as reader:
        rig, records = reader.rig, list(reader)
    named = {FILMS: {rig.nodes[1].name: {"path": "/gone/hand.mp4", "first_t_master_ns": first_ns}}}
    made = tmp_path / "made.rhotlog"
    made.write_bytes(b"".join(encode_log(rig, named, records)))
    [one] = recorded_films(made, rig)  # beside the log, though the folder of its name is gone
    assert one.camera == 1 and one.number_at(first_ns + 40_000_000 * 7 + 1_000_000) == 7
    reader = FilmReader(one.video.source)
    for number in (3, 4, 9, 2, 39, 0):
        shown = reader.picture(number)
        assert shown is not None and int(np.argmax(shown.mean(axis=(0, 2)))) // 16 == number
    reader.close()
    film.unlink()
    with pytest.raises(RecordingError, match=r"hand\.mp4"):
        recorded_films(made, rig)


@pytest.mark.parametrize("value", ["left.avi", {"left": 3}, {"left": {"path": "", "first_t_master_ns": 1}},
                                   {"left": {"path": "a.mp4", "first_t_master_ns": -1}}])
def test_a_header_that_names_nonsense_is_refused(log: Path, tmp_path: Path, value: object) -> None:
    with contextlib.closing(LogReader(log)) as reader:
        rig, records = reader.rig, list(reader)
    made = tmp_path / "made.rhotlog"
    made.write_bytes(b"".join(encode_log(rig, {FILMS: value}, records)))
    with pytest.raises(RecordingError, match="header"):
        recorded_films(made, rig)
