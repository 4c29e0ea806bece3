"""``rhot track`` by landmarks: a drawn hand through stand-in networks, a recorded one through the real ones."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import cv2
import msgspec
import numpy as np
import pytest
from recorded_landmarks import FOLDER, FPS, JUDGED, WHOLE, needs_recording, recording

from rhot_app.__main__ import main
from rhot_app.export import landmark_track
from rhot_app.geometry.camera import CameraModel
from rhot_app.hand.skeleton import JOINTS
from rhot_app.project import load_rig, save_rig
from rhot_app.simulator.nodes.landmark_detector import landmark_rig, moving_hand
from rhot_node.errors import KeypointError
from rhot_node.files import resource_path
from rhot_node.landmarks import networks
from rhot_node.landmarks.install import installed_folder
from rhot_node.landmarks.networks import DetectedHand, Region

needs_networks = pytest.mark.skipif(installed_folder() is None, reason="`rhot landmarks install` has not been run")
SECONDS, RATE = 3.0, 20.0
RIG = landmark_rig()


def video(path: Path, lens, count: int) -> Path:
    """Black pictures of the lens's size."""
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"MJPG"), RATE, (lens.width, lens.height))
    for _ in range(count):
        writer.write(np.zeros((lens.height, lens.width, 3), np.uint8))
    writer.release()
    return path


class StandIn:
    """Finds in the pictures of a camera, one after the other, what that camera would see of a drawn hand."""

    def __init__(self, pixels, right: float = 1.0, hidden: range = range(0)) -> None:
        self._pixels, self._right, self._hidden, self._count = pixels, right, hidden, -1

    def find(self, picture):
        self._count += 1
        if self._count in self._hidden:
            return ()
        landmarks = self._pixels[self._count]
        region = Region(landmarks.mean(axis=0), 200.0, 0.0)
        return (DetectedHand(landmarks, np.zeros((21, 3)), 0.9, self._right, region),)


@pytest.fixture
def drawn(tmp_path, monkeypatch):
    """A drawn hand, whose bones are not the rig's; the command's words for its two videos."""
    hand = moving_hand(RIG, "grasp", SECONDS, RATE, 1, 0.05)
    cameras = [CameraModel.from_rig(node.intrinsics, node.pose) for node in RIG.nodes]
    seen = [np.array([camera.project(one) for one in hand.joints()]) for camera in cameras]
    save_rig(tmp_path / "rig.json", RIG)
    words = ["track"]
    for node in RIG.nodes:
        words.append(f"{node.name}={video(tmp_path / f'{node.name}.avi', node.intrinsics, len(hand.times_s))}")

    def use(**options):
        waiting = [StandIn(pixels, **options) for pixels in seen]
        asked = iter([None, *waiting])  # the command first asks whether there are networks
        monkeypatch.setattr(networks, "open_hand_networks", lambda: None)
        monkeypatch.setattr(landmark_track, "open_hand_networks", lambda: next(asked) or next(asked))
        return hand

    use()
    return use, [*words, "--rig", str(tmp_path / "rig.json")], tmp_path


def table_of(path: Path):
    """(T,) s and (T, 21, 3) m of a table, NaN without a hand."""
    with path.open() as file:
        rows = list(csv.DictReader(file))
    places = [[[float(row[f"joint_{joint}_{axis}_mm"] or "nan") for axis in "xyz"] for joint in JOINTS] for row in rows]
    return np.array([float(row["time_s"]) for row in rows]), 1e-3 * np.array(places)


def test_a_hand_is_tracked_with_its_own_bones_and_the_films_times(drawn, capsys):
    use, words, folder = drawn
    hand = use(hidden=range(6))
    assert main([*words, "--out", str(folder / "hand.csv"), "--overlay", str(folder / "film.avi"), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    times, places = table_of(folder / "hand.csv")
    np.testing.assert_allclose(times, hand.times_s, atol=1e-6)
    assert np.isnan(places[:5]).all() and said["tracked"] == pytest.approx(np.isfinite(places[:, 0, 0]).mean())
    assert said["lost_s"][0][0] == 0.0 and 0.25 < said["lost_s"][0][1] < 0.5
    assert "measured" in said["bones"] and list(said["found"].values()) == [0.9, 0.9]
    off = np.linalg.norm(places - hand.joints(), axis=2)[20:]
    assert 1e3 * np.median(off) < 3.0
    film = cv2.VideoCapture(str(folder / "film.avi"))
    assert int(film.get(cv2.CAP_PROP_FRAME_COUNT)) == len(times)


def test_a_hand_of_the_other_side_is_none(drawn, capsys):
    use, words, _ = drawn
    use(right=0.0)
    assert main(words) == 0
    assert "No hand was tracked" in capsys.readouterr().out


def test_paths_alone_take_the_cameras_in_order(drawn, capsys):
    _, words, _ = drawn
    assert main(["track", *(word.partition("=")[2] for word in words[1:3]), *words[3:], "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["tracked"] > 0.8


def test_a_painted_rig_with_filters_of_its_own_tracks_a_bare_hand() -> None:
    painted = load_rig(resource_path("rigs", "two_pis.json"))
    one = painted.markers.ids[0]
    own = msgspec.structs.replace(painted.filters, position_markers={one: painted.filters.position})
    rig = landmark_track.landmark_rig_of(msgspec.structs.replace(painted, filters=own), [painted.nodes[0].name])
    assert len(rig.markers.ids) == 21 and len(rig.nodes) == 1 and not rig.filters.position_markers


@pytest.mark.parametrize(("words", "says"), [
    (["--background-seconds", "2"], "--background-seconds is of contours"),
    (["--smooth", "--observe", "contours"], "only landmarks are smoothed"),
    (["--fps", "2000"], "--fps 2000"), (["--out", "hand.bvh"], "hand.bvh")])
def test_mistakes_are_sentences(drawn, words, says, capsys):
    assert main([*drawn[1], *words]) == 2
    assert says in capsys.readouterr().err


def test_what_is_missing_is_said(drawn, monkeypatch, capsys):
    _, words, folder = drawn
    assert main(["track", *words[1:3]]) == 2
    assert "--rig" in capsys.readouterr().err
    assert main(["track", *words[3:]]) == 2
    assert "give a video" in capsys.readouterr().err
    for given, says in (["none.mp4"], "none.mp4: no such file"), (["x=none.mp4"], "no camera 'x'"), (
            [word.partition("=")[2] for word in (*words[1:3], words[1])], "3 videos, but the rig has 2"):
        assert main(["track", *given, *words[3:]]) == 2
        assert says in capsys.readouterr().err
    (folder / "text.mp4").write_text("no video")
    assert main(["track", str(folder / "text.mp4")]) == 2
    assert "text.mp4" in capsys.readouterr().err

    def missing():
        raise KeypointError("the hand networks are not installed. Run `rhot landmarks install`.")

    monkeypatch.setattr(networks, "open_hand_networks", missing)
    assert main([*words, "--out", str(folder / "hand.csv")]) == 2
    assert "landmarks install" in capsys.readouterr().err and not (folder / "hand.csv").exists()


# -- a recorded hand ---------------------------------------------------------------------------------------------------

@pytest.fixture(scope="module")
def film(tmp_path_factory):
    folder = tmp_path_factory.mktemp("film")
    save_rig(folder / "rig.json", recording().rig)
    return folder


@needs_recording
@needs_networks
def test_a_recorded_hand_is_tracked_from_its_videos_alone(film, capsys):
    videos = [str(FOLDER / f"cam{c}_first120.mp4") for c in range(2)]
    assert main(["track", *videos, "--rig", str(film / "rig.json"), "--out", str(film / "hand.csv"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["tracked"] >= 0.9  # the hand comes into view at frame 12
    times, places = table_of(film / "hand.csv")
    places = places[np.round(times * FPS).astype(int) >= WHOLE]
    off = 1e3 * np.linalg.norm(places[:len(recording().places)] - recording().places, axis=2)[JUDGED]
    assert np.median(off) < 4.5 and np.median(off, axis=1).max() < 30.0


@needs_recording
@needs_networks
def test_one_video_without_a_rig_is_tracked_by_an_assumed_lens(film, capsys):
    assert main(["track", str(FOLDER / "cam1_first120.mp4"), "--out", str(film / "one.csv"), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert "60 degrees" in said["assumed"][0] and said["tracked"] > 0.9 and "one camera" in said["bones"]
    _, places = table_of(film / "one.csv")
    aligned = [aligned_mm(one, other) for one, other in zip(places[WHOLE:], recording().places, strict=False)]
    assert np.median(aligned) < 18.5


def aligned_mm(one, other):
    """(21,) mm between two hands that are laid on each other."""
    one, other = one - one.mean(axis=0), other - other.mean(axis=0)
    left, _, right = np.linalg.svd(one.T @ other)
    turn = left @ np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))]) @ right
    return 1e3 * np.linalg.norm(one @ turn - other, axis=1)
