"""``rhot track`` by landmarks: drawn hands through stand-in networks, a recorded one through the real ones."""

from __future__ import annotations

import contextlib
import csv
import json
from datetime import UTC, datetime
from pathlib import Path

import cv2
import msgspec
import numpy as np
import pytest
from drawn_films import RATE, StandIn, seen_by, use_networks, video
from landmark_detector import landmark_rig, moving_hand
from recorded_landmarks import FOLDER, FPS, JUDGED, WHOLE, needs_recording, recording
from test_film_offset import film_of, heard, speech

from rhot_app.__main__ import main
from rhot_app.export import bare_hand_command, landmark_track
from rhot_app.export.landmark_track import states_of_log
from rhot_app.hand.anatomy import load_hand
from rhot_app.hand.skeleton import JOINTS
from rhot_app.project import TrackerSettings, landmark_markers, load_rig, save_rig
from rhot_app.recording.landmark_log import write_landmark_log
from rhot_app.recording.raw_log import LogReader, wall_clock_offset_ns
from rhot_app.rig_history import versions
from rhot_app.sources.frame_sets import recorded_films
from rhot_app.state import Condition
from rhot_node.capture.yuv import YuvWriter
from rhot_node.detect.image import from_bgr
from rhot_node.errors import KeypointError
from rhot_node.files import resource_path
from rhot_node.landmarks import networks
from rhot_node.landmarks.install import installed_folder
from rhot_node.pictures import open_video
from rhot_node.video.avi import Stamp, append_picture, begin_video, encode_picture, finish_video

needs_networks = pytest.mark.skipif(installed_folder() is None, reason="`rhot landmarks install` has not been run")
SECONDS = 3.0
RIG = landmark_rig()
LEFT = load_hand(resource_path("hands", "left.json"))


@pytest.fixture
def drawn(tmp_path, monkeypatch):
    """A drawn hand, whose bones are not the rig's; the command's words for its two videos."""
    hand = moving_hand(RIG, "grasp", SECONDS, RATE, 1, 0.05)
    seen = seen_by(RIG, hand.joints())
    save_rig(tmp_path / "rig.json", RIG)
    words = ["track"]
    for node in RIG.nodes:
        words.append(f"{node.name}={video(tmp_path / f'{node.name}.avi', node.intrinsics, len(hand.times_s))}")

    def use(right=0.95, **options):
        use_networks(monkeypatch, [StandIn(pixels[None], right, **options) for pixels in seen])
        return hand

    use()
    return use, [*words, "--rig", str(tmp_path / "rig.json")], tmp_path


def table_of(path: Path, prefix: str = ""):
    """(T,) s and (T, 21, 3) m of a table, NaN without a hand."""
    with path.open() as file:
        rows = list(csv.DictReader(file))
    places = [[[float(row[f"{prefix}joint_{joint}_{axis}_mm"] or "nan") for axis in "xyz"] for joint in JOINTS]
              for row in rows]
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
    assert said["other_tracked"] is None and set(said["foreign"].values()) == {0.0}
    off = np.linalg.norm(places - hand.joints(), axis=2)[20:]
    assert 1e3 * np.median(off) < 3.0
    film = cv2.VideoCapture(str(folder / "film.avi"))
    assert int(film.get(cv2.CAP_PROP_FRAME_COUNT)) == len(times)


def test_the_log_that_is_kept_is_replayed_beside_the_films(drawn, monkeypatch):
    """Tracked again, it gives what the table has; a moment finds its picture, and the time at which it was taken, by
    the film that says it."""
    use, words, folder = drawn
    use()
    taken = datetime(2024, 5, 1, 12, 0, 0, tzinfo=UTC)
    monkeypatch.setattr(landmark_track, "filmed", lambda path: taken if path.stem == RIG.nodes[1].name else None)
    assert main([*words, "--out", str(folder / "hand.csv"), "--log", str(folder / "hand.rhotlog")]) == 0
    _, places = table_of(folder / "hand.csv")
    with contextlib.closing(LogReader(folder / "hand.rhotlog")) as reader:
        rig = reader.rig
        offset_ns = wall_clock_offset_ns(reader.about, 0)
    films = recorded_films(folder / "hand.rhotlog", rig)
    assert int(films[1].video.times_ns[0]) + offset_ns == round(1e9 * taken.timestamp())
    assert [film.camera for film in films] == [0, 1] and rig.hand != RIG.hand, "its bones are measured"
    use()
    states = {state.t_master_ns: state for state in states_of_log(rig, folder / "hand.rhotlog")}
    for number in (0, 31, 55):
        t_ns = int(films[0].video.times_ns[number])
        assert films[1].number_at(t_ns) == number
        np.testing.assert_allclose(states[t_ns].joint_positions, places[number], atol=1e-6)
    assert main(["export", str(folder / "hand.rhotlog"), "--format", "csv", "--out", str(folder / "log.csv")]) == 0
    np.testing.assert_allclose(table_of(folder / "log.csv")[1], places, atol=1e-4, err_msg="one row per frame set")
    assert main([*words, "--log", str(folder / "hand.rhotlog")]) == 2, "nothing is written over unasked"


@pytest.mark.parametrize("by", ["sound", "flash"])
def test_films_that_began_apart_are_aligned_by_what_they_heard_or_saw(tmp_path, monkeypatch, capsys, by):
    hand, later = moving_hand(RIG, "grasp", SECONDS, RATE, 1, 0.05), 7
    seen, sound = seen_by(RIG, hand.joints()), speech(SECONDS + 1.0, 1)
    save_rig(tmp_path / "rig.json", RIG)
    words = ["track", "--rig", str(tmp_path / "rig.json"), "--out", str(tmp_path / "hand.csv"), "--json"]
    for node, begin in zip(RIG.nodes, (0, later), strict=True):
        lens, count, path = node.intrinsics, len(hand.times_s) - begin, tmp_path / f"{node.name}-{by}.mp4"
        if by == "sound":
            film_of(path, heard(sound, begin / RATE, SECONDS - begin / RATE, begin), count / RATE,
                    size=(lens.width, lens.height), rate=round(RATE))
        else:
            video(path := path.with_suffix(".avi"), lens, count, lit_from=20 - begin)
        words.insert(1, f"{node.name}={path}")

    def use() -> None:
        use_networks(monkeypatch, [StandIn(seen[0][None], 0.95), StandIn(seen[1][None, later:], 0.95)])

    use()
    name = RIG.nodes[1].name
    assert main([*words, "--offset", by]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["offsets_s"][name] == pytest.approx(later / RATE, abs=0.5 / RATE)
    assert 0.0 < said["offsets_std_s"][name] < 0.5 / RATE and f"{name} +0.35" in said["notes"][0]
    assert by in said["notes"][0] and said["tracked"] > 0.7
    use()
    with pytest.raises(SystemExit):
        main([*words, "--offset", by, "--offset-s", f"{name}=0.35"])
    assert "not allowed with" in capsys.readouterr().err


def test_films_that_neither_heard_nor_saw_the_same_are_not_aligned(drawn, capsys):
    _, words, folder = drawn
    for by, reason in (("sound", "no sound"), ("flash", "no light")):
        assert main([*words, "--offset", by, "--out", str(folder / "hand.csv")]) == 2
        assert reason in capsys.readouterr().err and not (folder / "hand.csv").exists()
    assert main(["track", words[1], *words[3:], "--offset", "flash"]) == 2
    assert "one film has no offset" in capsys.readouterr().err


def test_a_hand_of_the_other_side_is_none_and_is_said_to_be(drawn, capsys):
    use, words, _ = drawn
    use(right=0.05)
    assert main(words) == 0
    said = capsys.readouterr().out
    assert "No hand was tracked" in said and "100 % they found a left hand" in said


def test_paths_alone_take_the_cameras_in_order(drawn, capsys):
    _, words, _ = drawn
    assert main(["track", *(word.partition("=")[2] for word in words[1:3]), *words[3:], "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["tracked"] > 0.8


def test_the_former_name_and_its_options_are_taken(drawn, capsys):
    _, words, folder = drawn
    given = [word for one in words[1:3] for word in ("--video", one)]
    mine = folder / "mine.json"
    asked = ["bare-hand", *given, *words[3:], "--background-seconds", "2", "--unknown-size", "--fps", "20",
             "--offset-s", f"{RIG.nodes[0].name}=0.0", "--adapt", str(mine), "--json"]
    assert main(asked) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["tracked"] > 0.8 and "not used" in said["notes"][0] and said["hand_file"] == str(mine)
    bones = np.array([finger.bones_mm for finger in load_hand(mine).fingers.values()])
    assert np.abs(bones - 1e3 * moving_hand(RIG, "grasp", SECONDS, RATE, 1, 0.05).model.bones).max() < 1.0
    assert load_rig(folder / "rig.json") == RIG, "the rig stays"


def test_a_hand_file_keeps_what_was_there_and_is_not_written_without_measured_bones(drawn, capsys):
    use, words, folder = drawn
    mine = folder / "mine.json"
    mine.write_bytes(resource_path("hands", "right.json").read_bytes())
    assert main([*words, "--adapt", str(mine)]) == 0
    assert f"Written: {mine}" in capsys.readouterr().out and len(versions(mine)) == 1
    use()
    kept, (name, _, path) = mine.read_bytes(), words[1].partition("=")
    assert main(["track", f"{name}={path}", *words[3:], "--adapt", str(mine)]) == 3
    assert "not written" in (told := capsys.readouterr()).err and "one camera" in told.err
    assert mine.read_bytes() == kept
    assert main([*words, "--adapt", str(mine), "--bones", "rig"]) == 2


def test_an_unknown_size_is_estimated_where_bones_are_not_measured(drawn):
    _, words, folder = drawn
    assert main([*words, "--bones", "rig", "--unknown-size", "--out", str(folder / "hand.csv")]) == 0
    with (folder / "hand.csv").open() as file:
        last = list(csv.DictReader(file))[-1]
    assert float(last["hand_scale"]) != 1.0 and float(last["hand_scale_sd"]) > 0.0


def test_what_the_rigs_tracker_observes_is_looked_for(drawn, monkeypatch):
    _, words, folder = drawn
    rigs = []
    monkeypatch.setattr(bare_hand_command, "run", lambda args: rigs.append(args.rig) or 0)
    save_rig(folder / "rig.json", msgspec.structs.replace(RIG, tracker=TrackerSettings("estimator",
                                                                                       observe="contours")))
    assert main(words) == 0 and len(rigs) == 1
    assert main([*words, "--observe", "landmarks"]) == 0 and len(rigs) == 1


def test_a_rig_without_paint_is_tracked_by_landmarks_whatever_else_it_says():
    rig = msgspec.structs.replace(RIG, tracker=TrackerSettings())
    assert not rig.painted and (rig.tracker.kind, rig.tracker.observe) == ("estimator", "landmarks")
    painted = load_rig(resource_path("rigs", "two_pis.json"))
    mixed = msgspec.structs.replace(painted.markers, markers=(*painted.markers.markers[:1],
                                                              *RIG.markers.markers[1:]))
    for one in (painted, msgspec.structs.replace(painted, markers=mixed)):
        assert one.painted and one.tracker == painted.tracker


def test_a_rig_file_without_markers_has_bare_hands(tmp_path):
    """Cameras are enough; with another hand both have landmarks."""
    bare = {key: value for key, value in json.loads((resource_path("rigs", "two_pis.json")).read_text()).items()
            if key in ("format", "version", "name", "nodes")}
    (tmp_path / "rig.json").write_text(json.dumps(bare))
    rig = load_rig(tmp_path / "rig.json")
    assert rig.tracker.observe == "landmarks" and rig.markers == RIG.markers and rig.hand == RIG.hand
    (tmp_path / "rig.json").write_text(json.dumps(bare | {"other_hand": msgspec.to_builtins(LEFT)}))
    both = load_rig(tmp_path / "rig.json")
    assert both.markers == landmark_markers(both=True) and both.other_hand == LEFT


# -- pictures ----------------------------------------------------------------------------------------------------------

def test_one_picture_of_each_camera_is_a_film_in_which_nothing_moves(drawn, monkeypatch, capsys):
    _, words, folder = drawn
    hand = moving_hand(RIG, "grasp", SECONDS, RATE, 1, 0.05)
    still = np.repeat(seen_by(RIG, hand.joints()[30:31]), 60, axis=1)
    use_networks(monkeypatch, [StandIn(pixels[None], 0.95) for pixels in still])
    given = []
    for node in RIG.nodes:
        path = folder / f"{node.name}.png"
        cv2.imwrite(str(path), np.zeros((node.intrinsics.height, node.intrinsics.width, 3), np.uint8))
        given.append(f"{node.name}={path}")
    assert main(["track", *given, *words[3:], "--out", str(folder / "hand.csv"), "--json"]) == 0
    assert "of one picture" in json.loads(capsys.readouterr().out)["bones"]
    times, places = table_of(folder / "hand.csv")
    assert len(times) == 60
    assert 1e3 * np.median(np.linalg.norm(places[-1] - hand.joints()[30], axis=1)) < 3.0
    use_networks(monkeypatch, [StandIn(pixels[None], 0.95) for pixels in still])
    assert main(["track", *given, *words[3:], "--adapt", str(folder / "mine.json")]) == 3
    assert not (folder / "mine.json").exists(), "one picture tells too little"


@pytest.mark.parametrize("with_rig", [True, False])
def test_raw_frames_and_a_nodes_recording_have_their_own_times(drawn, capsys, with_rig):
    use, words, folder = drawn
    lens, name = RIG.nodes[0].intrinsics, RIG.nodes[0].name
    times = np.cumsum([5_000_000_000, *[50_000_000, 40_000_000] * 8])
    with YuvWriter(folder / "raw", lens.width, lens.height, 4_000_000, 0) as writer, (
            folder / "node.avi").open("w+b") as file:
        begin_video(file, lens.width, lens.height)
        for number, t_ns in enumerate(times.tolist()):
            image = from_bgr(np.zeros((lens.height, lens.width, 3), np.uint8))
            writer.append(t_ns, np.concatenate([image.y.ravel(), image.u.ravel(), image.v.ravel()]))
            append_picture(file, encode_picture(image, Stamp(number, t_ns, 4_000_000, 0)))
        finish_video(file)
    for path in (folder / "raw", folder / "node.avi"):
        use()
        given = [f"{name}={path}", *words[3:]] if with_rig else [str(path)]
        assert main(["track", *given, "--out", str(folder / f"{path.stem}.csv")]) == 0
        found, places = table_of(folder / f"{path.stem}.csv")
        np.testing.assert_allclose(np.diff(found), 1e-9 * np.diff(times), atol=1e-6)
        assert np.isfinite(places[-1]).all()


def test_a_folder_of_pictures_is_a_film_of_the_rate_that_is_given(drawn, monkeypatch, capsys):
    _, words, folder = drawn
    lens, name = RIG.nodes[0].intrinsics, RIG.nodes[0].name
    pictures = folder / "pictures"
    pictures.mkdir()
    for number in range(20):
        cv2.imwrite(str(pictures / f"{number:03d}.png"), np.zeros((lens.height, lens.width), np.uint8))
    assert main(["track", f"{name}={pictures}", *words[3:]]) == 2 and "--fps" in capsys.readouterr().err
    assert main(["track", f"{name}={pictures}", *words[3:], "--fps", "20", "--out", str(folder / "hand.csv")]) == 0
    times, places = table_of(folder / "hand.csv")
    np.testing.assert_allclose(times, np.arange(20) / 20.0)
    assert np.isfinite(places[-1]).all()
    (pictures / "999.png").write_bytes(b"no picture")
    assert main(["track", f"{name}={pictures}", *words[3:], "--fps", "20"]) == 2
    assert "999.png" in capsys.readouterr().err


# -- two hands ---------------------------------------------------------------------------------------------------------

def test_two_hands_that_cross_are_tracked_each_with_its_own_bones(drawn, monkeypatch, capsys):
    """Two drawn hands pass each other, one before the other, which is not found meanwhile; sides flicker."""
    _, words, folder = drawn
    hands = [moving_hand(one, "grasp", SECONDS, RATE, 1, 0.05)
             for one in (RIG, msgspec.structs.replace(RIG, hand=LEFT))]
    aside = np.linspace(-0.12, 0.12, len(hands[0].times_s))[:, None, None] * np.array([1.0, 0.0, 0.0])
    joints = [hands[0].joints() + aside + [0.0, 0.0, 0.1], hands[1].joints() - aside]
    seen = np.array([seen_by(RIG, one) for one in joints])  # (H, C, T, 21, 2)
    behind = np.linalg.norm(seen[0].mean(axis=2) - seen[1].mean(axis=2), axis=2) < 60.0
    seen[0][behind] = np.nan
    sides = np.full((2, len(aside)), [[0.95], [0.05]])
    sides[0, 12:14], sides[1, 40:42] = 0.1, 0.9
    use_networks(monkeypatch, [StandIn(seen[:, c], sides) for c in range(2)])
    save_rig(folder / "rig.json", msgspec.structs.replace(RIG, markers=landmark_markers(both=True), other_hand=LEFT))
    film = folder / "film.avi"
    assert main([*words, "--out", str(folder / "hand.csv"), "--overlay", str(film), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["tracked"] > 0.9 and said["other_tracked"] > 0.9 and film.exists()
    assert "Right hand: Bones measured" in said["bones"] and "Left hand: Bones measured" in said["bones"]
    assert behind.any(axis=0).sum() >= 5
    for prefix, own in (("", joints[0]), ("other_", joints[1])):
        places = table_of(folder / "hand.csv", prefix)[1]
        off = 1e3 * np.median(np.linalg.norm(places - own, axis=2), axis=1)
        assert np.nanmedian(off) < 5.0 and np.nanmax(off[5:]) < 60.0, "never the other one"


# -- bad input ---------------------------------------------------------------------------------------------------------

def test_cameras_that_face_each_other_track_a_hand_between_them(drawn, monkeypatch, capsys):
    _, words, folder = drawn
    lens = RIG.nodes[0]
    facing = msgspec.structs.replace(RIG.nodes[1], pose=msgspec.structs.replace(
        lens.pose, rotation_wxyz=(0.0, 0.0, 1.0, 0.0), translation_m=(0.0, 0.0, 1.2)))
    rig = msgspec.structs.replace(RIG, nodes=(msgspec.structs.replace(lens, pose=type(lens.pose)()), facing))
    hand = moving_hand(rig, "grasp", SECONDS, RATE, 1)
    noise = np.random.default_rng(1).normal(0.0, 1.5, (2, len(hand.times_s), 21, 2))
    use_networks(monkeypatch, [StandIn(pixels[None], 0.95) for pixels in seen_by(rig, hand.joints()) + noise])
    save_rig(folder / "rig.json", rig)
    assert main([*words, "--out", str(folder / "hand.csv"), "--json"]) == 0
    places = table_of(folder / "hand.csv")[1]
    off = 1e3 * np.median(np.linalg.norm(places - hand.joints(), axis=2), axis=1)
    assert np.isfinite(off).mean() > 0.9 and np.nanmedian(off) < 20.0


def test_a_hand_on_a_screen_of_another_size_is_not_to_be_relied_on(drawn, monkeypatch, capsys):
    _, words, _ = drawn
    flat = moving_hand(RIG, "grasp", SECONDS, RATE, 1).joints()
    flat[..., 2] = 0.6
    flat += 0.5 * (flat.mean(axis=(0, 1)) - flat)  # half as large
    use_networks(monkeypatch, [StandIn(pixels[None], 0.95) for pixels in seen_by(RIG, flat)])
    assert main(words) == 0
    said = capsys.readouterr().out
    assert "That is large" in said and "Bones measured" not in said


def test_a_film_of_another_size_than_the_lens_is_refused(drawn, capsys):
    _, words, folder = drawn
    small = msgspec.structs.replace(RIG.nodes[0].intrinsics, width=320, height=240)
    name = RIG.nodes[0].name
    assert main(["track", f"{name}={video(folder / 'small.avi', small, 3)}", *words[3:]]) == 2
    said = capsys.readouterr().err
    assert "320 x 240" in said and "calibrated at 640 x 480" in said


@needs_recording
def test_films_in_the_wrong_order_are_never_called_tracked(tmp_path):
    """The landmarks of each camera as if they were the other one's."""
    rig = landmark_track.landmark_rig_of(recording().rig, [node.name for node in recording().rig.nodes])
    write_landmark_log(tmp_path / "a.log", rig, recording().tables[::-1])
    states = list(landmark_track.states_of_log(rig, tmp_path / "a.log"))
    assert states and not any(state.condition is Condition.TRACKING for state in states)
    assert landmark_track.summarise(rig, states)["reprojection_large"]



def test_a_painted_rig_with_filters_of_its_own_tracks_a_bare_hand() -> None:
    painted = load_rig(resource_path("rigs", "two_pis.json"))
    one = painted.markers.ids[0]
    own = msgspec.structs.replace(painted.filters, position_markers={one: painted.filters.position})
    rig = landmark_track.landmark_rig_of(msgspec.structs.replace(painted, filters=own), [painted.nodes[0].name])
    assert len(rig.markers.ids) == 21 and len(rig.nodes) == 1 and not rig.filters.position_markers


@pytest.mark.parametrize(("words", "says"), [
    (["--bones", "rig", "--adapt", "mine.json"], "--bones rig"), (["--start", "3"], "--observe contours"),
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
    assert "60 degrees" in said["notes"][0] and "right hand" in said["notes"][1]
    assert said["tracked"] > 0.9 and "one camera" in said["bones"]
    _, places = table_of(film / "one.csv")
    aligned = [aligned_mm(one, other) for one, other in zip(places[WHOLE:], recording().places, strict=False)]
    assert np.median(aligned) < 18.5


@needs_recording
@needs_networks
def test_a_left_hand_before_a_rig_of_a_right_one_is_none(film, capsys):
    """The recorded film, mirrored; without a rig it is tracked as what it is."""
    source = open_video(FOLDER / "cam1_first120.mp4")
    writer = cv2.VideoWriter(str(film / "left.avi"), cv2.VideoWriter.fourcc(*"MJPG"), FPS, (720, 720))
    for _ in range(20):
        writer.write(np.ascontiguousarray(source.read()[1][:, ::-1]))
    writer.release()
    assert main(["track", f"c1={film / 'left.avi'}", "--rig", str(film / "rig.json"), "--out",
                 str(film / "none.csv")]) == 0
    assert "found a left hand, which is not tracked" in capsys.readouterr().out
    assert np.isnan(table_of(film / "none.csv")[1]).all()
    assert main(["track", str(film / "left.avi"), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["side"] == "left" and said["tracked"] > 0.5


def aligned_mm(one, other):
    """(21,) mm between two hands that are laid on each other."""
    one, other = one - one.mean(axis=0), other - other.mean(axis=0)
    left, _, right = np.linalg.svd(one.T @ other)
    turn = left @ np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))]) @ right
    return 1e3 * np.linalg.norm(one @ turn - other, axis=1)
