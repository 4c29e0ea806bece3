"""The bare hand in recorded videos: tables that are read back, films, mistakes, and the nodes' own recordings."""

from __future__ import annotations

import csv
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import msgspec
import numpy as np
import pytest
from numpy.typing import NDArray
from recorded_landmarks import FOLDER, needs_recording, recorded_nodes

from rhot_app.__main__ import main
from rhot_app.barehand.start import start_pose_file
from rhot_app.barehand.tracker import BareHandTracker
from rhot_app.errors import RecordingError
from rhot_app.export.bare_hand import lost_intervals
from rhot_app.hand.skeleton import JOINTS, HandPose
from rhot_app.project import Rig, TrackerSettings, load_rig, save_rig
from rhot_app.recording.raw_log import Record, RecordKind, encode_header, encode_record
from rhot_app.simulator.bare_hand.sequence import BareHandFrame, BareHandOptions, bare_hand_rig, bare_hand_sequence
from rhot_app.sources.frame_sets import frame_sets, frames_left_out, on_one_clock, open_video
from rhot_app.tracking.contours.follower import HandFollower
from rhot_node.capture.yuv import YuvWriter
from rhot_node.detect.foreground import learn_background, skin_foreground
from rhot_node.detect.image import from_bgr
from rhot_node.video.avi import Stamp, append_picture, begin_video, encode_picture, finish_video
from rhot_node.wire.codec import encode
from rhot_node.wire.messages import ClockReply, ClockRequest, NodeState, Start, StartEntry

FPS = 15.0
EMPTY = 6
"""Frames at the beginning without a hand."""

DEPTH_M = 0.04
"""Two pixels of disparity at 0.6 m, of cameras 75 mm apart with pictures 320 px wide."""


@dataclass(frozen=True)
class Recorded:
    """A filmed hand: the rig's file, a video for each camera, and what was filmed."""

    rig: Path
    videos: dict[str, Path]
    frames: list[BareHandFrame]

    def arguments(self, *more: str) -> list[str]:
        """Of ``rhot track``, by its former name."""
        given = [word for name, path in self.videos.items() for word in ("--video", f"{name}={path}")]
        return ["bare-hand", "--observe", "contours", "--rig", str(self.rig), *given, *more]


def write_video(path: Path, pictures: Sequence[NDArray[np.uint8]], fps: float = FPS) -> Path:
    """An ordinary motion JPEG film of pictures (H, W, 3) RGB."""
    size = pictures[0].shape[1], pictures[0].shape[0]
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), fps, size)
    for picture in pictures:
        writer.write(np.ascontiguousarray(picture[..., ::-1]))
    writer.release()
    return path


def write_node_video(path: Path, pictures: Sequence[NDArray[np.uint8]], times_ns: Sequence[int]) -> Path:
    """A film as a node records it."""
    with path.open("w+b") as file:
        begin_video(file, pictures[0].shape[1], pictures[0].shape[0])
        for number, (picture, t_ns) in enumerate(zip(pictures, times_ns, strict=True)):
            image = from_bgr(np.ascontiguousarray(picture[..., ::-1]))
            append_picture(file, encode_picture(image, Stamp(number, t_ns, 4_000_000, 0)))
        finish_video(file)
    return path


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Recorded:
    folder = tmp_path_factory.mktemp("recorded")
    rig = bare_hand_rig(width=320)
    options = BareHandOptions(forearm=False)
    there = list(bare_hand_sequence(rig, "rest", 6 / FPS, FPS, 1, options).frames())
    away = list(bare_hand_sequence(rig, "rest", EMPTY / FPS, FPS, 1,
                                   BareHandOptions(forearm=False, enters_after_s=9.0)).frames())
    frames = away + there
    poses = (start_pose_file(there[0].truth.pose),)
    save_rig(folder / "rig.json", msgspec.structs.replace(rig, tracker=TrackerSettings(start_poses=poses)))
    videos = {node.name: write_video(folder / f"{node.name}.avi", [frame.images[c] for frame in frames])
              for c, node in enumerate(rig.nodes)}
    return Recorded(folder / "rig.json", videos, frames)


@pytest.mark.parametrize("start", ["frame", "pose"])
def test_a_hand_in_two_videos_is_a_table_and_a_film(recorded: Recorded, tmp_path: Path, start: str,
                                                     monkeypatch: pytest.MonkeyPatch,
                                                     capsys: pytest.CaptureFixture[str]) -> None:
    given = str(EMPTY)
    if start == "pose":
        monkeypatch.setattr("rhot_app.tracking.contours.tracker.MIN_DWELL_NS", 0)  # the film is short
        for threshold, least in (("CONTOUR_THRESHOLD", 0.5), ("LOG_ODDS_THRESHOLD", 0.2)):  # pictures 320 px wide
            monkeypatch.setattr(f"rhot_app.barehand.tracker.{threshold}", least)
        document = msgspec.to_builtins(load_rig(recorded.rig).tracker.start_poses[0])
        (tmp_path / "start.json").write_text(json.dumps({"format": "rhot-pose", "version": 1} | document))
        given = str(tmp_path / "start.json")
    out, film = tmp_path / "hand.csv", tmp_path / "hand.avi"
    code = main(recorded.arguments("--background-seconds", str((EMPTY - 0.5) / FPS), "--out", str(out), "--overlay",
                                   str(film), "--json", "--start", given))
    said = json.loads(capsys.readouterr().out)
    assert code == 0
    with out.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == said["frame_sets"] == len(recorded.frames)
    assert [row["condition"] for row in rows[:EMPTY]] == ["SEARCHING"] * EMPTY
    assert not any(row["joint_wrist_x_mm"] for row in rows[:EMPTY]), "no numbers where there is no hand"
    np.testing.assert_allclose([float(row["time_s"]) for row in rows], np.arange(len(rows)) / FPS, atol=1e-6)
    tracked = [row["condition"] in ("TRACKING", "PARTIAL") for row in rows]
    assert said["tracked"] == pytest.approx(np.mean(tracked)) and any(tracked)
    assert said["computed_per_s"] > 0.0 and said["step_p50_ms"] > 0.0
    assert said["starts"] >= 1 and said["lost_s"][0][0] == 0.0
    for row, frame in [(rows[k], recorded.frames[k]) for k in np.flatnonzero(tracked)[:4]]:  # before it drifts
        middle = 1e-3 * np.array([float(row[f"joint_middle_mcp_{axis}_mm"]) for axis in "xyz"])
        assert np.linalg.norm(middle - frame.truth.joints[JOINTS.index("middle_mcp")]) < DEPTH_M
    capture = cv2.VideoCapture(str(film))
    read, picture = capture.read()
    assert read and picture.shape == (240, 640, 3)
    assert {path.name for path in tmp_path.iterdir()} - {"start.json"} == {"hand.avi", "hand.csv"}


def test_a_hand_that_is_found_again_has_its_own_key_frames(recorded: Recorded,
                                                           monkeypatch: pytest.MonkeyPatch) -> None:
    def find(*_: object) -> HandPose:
        return there[0].truth.pose

    away, there = recorded.frames[:EMPTY], recorded.frames[EMPTY:]
    empty = [[frame.images[c] for frame in away] for c in range(2)]
    followed = HandFollower(load_rig(recorded.rig), [learn_background(skin_foreground(), one) for one in empty],
                            known_size=True)
    followed.follow(there[0].truth.pose, 0)
    shown = [*there[:4], *away, *[there[0]] * 8]
    monkeypatch.setattr("rhot_app.barehand.tracker.CONTOUR_THRESHOLD", 0.5)
    for number, frame in enumerate(shown):
        if number == len(shown) - 8:
            monkeypatch.setattr(BareHandTracker, "taken", find)
        state = followed.step(frame.images, [round(1e9 * number / FPS)] * 2)
        if number == 3:
            assert state.tracked and followed.key_frames.kept
        if followed.starts == 2:
            break
    assert state.tracked and followed.starts == 2 and not followed.key_frames.kept


def test_videos_without_a_hand_say_so(recorded: Recorded, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    name, path = next(iter(recorded.videos.items()))
    empty = write_video(tmp_path / "empty.avi", [frame.images[0] for frame in recorded.frames[:EMPTY]])
    arguments = ["track", "--observe", "contours", "--rig", str(recorded.rig), "--video", f"{name}={empty}",
                 "--background", f"{name}={path}"]
    assert main(arguments) == 0
    said = capsys.readouterr().out
    assert "No hand took the start pose" in said and "frame sets a second overall" in said
    out, mine = tmp_path / "hand.csv", tmp_path / "mine.json"
    assert main([*arguments, "--out", str(out), "--adapt", str(mine)]) == 3, "of what was asked for, a part is there"
    said = capsys.readouterr()
    assert f"Written: {out}" in said.out and str(mine) not in said.out and out.exists() and not mine.exists()
    assert f"{mine}: not written" in said.err and "bend and spread every finger" in said.err


@pytest.mark.parametrize(("more", "says"), [
    (("--video", "top=x.avi"), "no camera 'top'"), (("--video", "left"), "give a camera and its value"),
    (("--fps", "2000"), "from 1 to 1000"), (("--offset-s", "left=soon"), "no number of seconds"),
    (("--offset-s", "right=100"), "no common time"), (("--start", "99"), "frames together, 0 to 11"),
    (("--start", "-1"), "no such file"), (("--start", "nowhere.json"), "no such file"),
    (("--out", "hand.bvh"), ".csv, .parquet or .npz"),
    (("--background-seconds", "0.01"), "two pictures without a hand"),
    (("--overlay", "nowhere/pictures"), "does not exist"), (("--overlay", "hand.xyz"), "a film ends in .avi or .mp4"),
    (("--background-seconds", "2"), "only 0.80 s together"), (("--background-seconds", "0"), "a number above 0"),
    (("--background-seconds=-1",), "a number above 0"),
    (("--out", "hand.xyz"), ".csv, .parquet or .npz; rhot export"),
    (("--adapt", "hand.csv", "--out", "hand.csv"), "--out and --adapt would both write it"),
    (("--overlay", "hand.avi", "--adapt", "./hand.avi"), "--overlay and --adapt would both write it"),
    (("--adapt", "nowhere/hand.json"), "does not exist"),
    (("--out", "nowhere/hand.csv"), "does not exist")])
def test_mistakes_have_a_sentence(recorded: Recorded, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                                  capsys: pytest.CaptureFixture[str], more: tuple[str, ...], says: str) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(recorded.arguments(*more)) == 2
    assert says in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("rate", "said"), [("0", "0 is not a number above 0"), ("abc", "abc is not a finite number")])
def test_a_rate_is_a_number_above_0(recorded: Recorded, rate: str, said: str,
                                    capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="2"):
        main(recorded.arguments("--fps", rate))
    assert f"--fps: {said}" in capsys.readouterr().err


@pytest.mark.parametrize(("content", "says"), [(None, "no such file"), (b"no video", "Is it a video"),
                                               ("small", "160 x 120 px, but the lens")])
def test_videos_that_cannot_be_used_are_refused(recorded: Recorded, tmp_path: Path, content: bytes | str | None,
                                                says: str, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "other.avi"
    if isinstance(content, bytes):
        path.write_bytes(content)
    elif content == "small":
        write_video(path, [frame.images[0][::2, ::2] for frame in recorded.frames[:2]])
    assert main(["track", "--observe", "contours", "--rig", str(recorded.rig), "--video", f"left={path}"]) == 2
    assert says in capsys.readouterr().err


def test_one_file_is_not_two_cameras(recorded: Recorded, capsys: pytest.CaptureFixture[str]) -> None:
    path = recorded.videos["left"]
    assert main(["track", "--observe", "contours", "--rig", str(recorded.rig), "--video", f"left={path}", "--video",
                 f"right={path}"]) == 2
    assert "two cameras" in capsys.readouterr().err


def test_an_existing_table_stays(recorded: Recorded, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "hand.csv"
    out.write_text("mine")
    assert main(recorded.arguments("--out", str(out))) == 2
    assert "--force" in capsys.readouterr().err and out.read_text() == "mine"


def test_an_existing_film_stays(recorded: Recorded, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    film = tmp_path / "hand.avi"
    film.write_text("mine")
    assert main(recorded.arguments("--overlay", str(film))) == 2
    assert "choose another --overlay" in capsys.readouterr().err and film.read_text() == "mine"


@pytest.mark.parametrize("content", ["rig", "{broken", "[]"])
def test_adapt_replaces_a_hand_file_alone(recorded: Recorded, tmp_path: Path, content: str,
                                          capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "mine.json"
    path.write_text(recorded.rig.read_text() if content == "rig" else content)
    before = path.read_text()
    assert main(recorded.arguments("--adapt", str(path))) == 2
    said = capsys.readouterr().err
    assert f"{path}: " in said and "is no hand file" in said and path.read_text() == before
    assert list(tmp_path.iterdir()) == [path], "nor is there a history"


def test_an_interrupt_leaves_nothing(recorded: Recorded, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from rhot_app.export import bare_hand

    def stopped(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(bare_hand.HandFollower, "step", stopped)
    code = main(recorded.arguments("--out", str(tmp_path / "hand.csv"), "--overlay", str(tmp_path / "pictures")))
    assert code == 130 and not list(tmp_path.iterdir())


# -- Frame sets -------------------------------------------------------------------------------------------------------

def shades(count: int, rig: Rig) -> list[NDArray[np.uint8]]:
    """Pictures that say their number."""
    lens = rig.nodes[0].intrinsics
    return [np.full((lens.height, lens.width, 3), 8 * k, np.uint8) for k in range(count)]


def test_frames_of_unequal_rates_go_to_sets_once(tmp_path: Path) -> None:
    rig = bare_hand_rig(width=64)
    paths = [write_video(tmp_path / f"{fps}.avi", shades(fps, rig), fps) for fps in (20, 10)]
    videos = on_one_clock([open_video(node, path) for node, path in zip(rig.nodes, paths, strict=True)], {"right": 0.3})
    sets = list(frame_sets(videos))
    assert frames_left_out(videos) == 6 + 3  # the left camera's first 0.3 s, the right one's last
    assert [one.images[1] is not None for one in sets] == [k % 2 == 0 for k in range(len(sets))]
    first = sets[0]
    assert first.first_ns == 300_000_000 and abs(float(np.mean(first.images[0])) - 48.0) < 3.0  # its sixth frame
    assert all(one.images[0] is not None for one in sets)


def test_a_rate_on_the_command_line_is_obeyed(tmp_path: Path) -> None:
    rig = bare_hand_rig(width=64)
    video = open_video(rig.nodes[0], write_video(tmp_path / "a.avi", shades(5, rig), 20.0), 50.0)
    np.testing.assert_array_equal(np.diff(video.times_ns), 20_000_000)


def test_a_recording_of_a_node_has_its_own_times(tmp_path: Path) -> None:
    rig, times = bare_hand_rig(width=64), [5_000_000_000, 5_040_000_000, 5_090_000_000]
    path = write_node_video(tmp_path / "r.left.avi", shades(3, rig), times)
    (video,) = on_one_clock([open_video(rig.nodes[0], path)], {})
    read = list(video.frames())
    assert [t for t, _ in read] == times
    assert [round(float(picture.mean()) / 8) for _, picture in read] == [0, 1, 2]


def test_a_folder_of_raw_frames_has_its_own_times(tmp_path: Path) -> None:
    rig, times = bare_hand_rig(width=64), [5_000_000, 45_000_000, 95_000_000]
    lens = rig.nodes[0].intrinsics
    with YuvWriter(tmp_path / "left", lens.width, lens.height, 4_000_000, 10_000) as writer:
        for t_ns, picture in zip(times, shades(3, rig), strict=True):
            image = from_bgr(picture)
            writer.append(t_ns, np.concatenate([image.y.ravel(), image.u.ravel(), image.v.ravel()]))
    (video,) = on_one_clock([open_video(rig.nodes[0], tmp_path / "left")], {})
    read = list(video.frames())
    assert [t for t, _ in read] == [t + 10_000 * (lens.height - 1) // 2 for t in times], "of the middle row"
    assert [round(float(picture.mean()) / 8) for _, picture in read] == [0, 1, 2]


@pytest.mark.parametrize(("header", "says"), [(None, "no recording of `rhot simulate`"), ("{}", "rhot-yuv")])
def test_a_folder_that_is_no_recording_is_refused(tmp_path: Path, header: str | None, says: str) -> None:
    if header is not None:
        (tmp_path / "recording.json").write_text(header)
    with pytest.raises(RecordingError, match=says):
        open_video(bare_hand_rig(width=64).nodes[0], tmp_path)


def test_recordings_of_two_nodes_need_their_log(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rig = bare_hand_rig(width=64)
    save_rig(tmp_path / "rig.json", rig)
    paths = [write_node_video(tmp_path / f"r.{node.name}.avi", shades(3, rig), [10 ** (9 + c) + k for k in (0, 50, 90)])
             for c, node in enumerate(rig.nodes)]
    assert main(["track", "--observe", "contours", "--rig", str(tmp_path / "rig.json"), "--video", f"left={paths[0]}",
                 "--video", f"right={paths[1]}"]) == 2
    assert "r.rhotlog" in capsys.readouterr().err


def test_a_log_takes_recordings_to_the_masters_clock(tmp_path: Path) -> None:
    rig, begin, ahead = bare_hand_rig(width=64), 10**12, (5 * 10**9, -2 * 10**9)
    records = [Record(RecordKind.START, 0, begin, encode(Start(7, 1, tuple(
        StartEntry(node.node_id, 5000 + c, 0) for c, node in enumerate(rig.nodes)))))]
    for number in range(30):
        t_ns = begin + number * 10**8
        for node, offset in zip(rig.nodes, ahead, strict=True):
            request = ClockRequest(node.node_id, 7, number + 1, t_ns)
            read_ns = t_ns + 100_000 + offset
            reply = ClockReply(node.node_id, 7, number + 1, t_ns, read_ns, read_ns, 1, NodeState.STREAMING)
            records += [Record(RecordKind.CLOCK_REQUEST, node.node_id, t_ns, encode(request)),
                        Record(RecordKind.CLOCK_REPLY, node.node_id, t_ns + 200_000, encode(reply))]
    (tmp_path / "r.rhotlog").write_bytes(encode_header(rig, {}) + b"".join(map(encode_record, records)))
    times = [begin + 10**9 + k * 40_000_000 for k in range(4)]
    videos = [open_video(node, write_node_video(tmp_path / f"r.{node.name}.avi", shades(4, rig),
                                                [t + offset for t in times]))
              for node, offset in zip(rig.nodes, ahead, strict=True)]
    for video in on_one_clock(videos, {}):
        np.testing.assert_allclose(video.times_ns, times, rtol=0.0, atol=100_000)


def test_lost_intervals_end_when_the_hand_is_there_again() -> None:
    flags = [False, True, True, False, False, True, False]
    assert lost_intervals([(k * 10**9, flag) for k, flag in enumerate(flags, 5)]) == ((0, 1), (3, 5), (6, 6))


# -- A real hand ------------------------------------------------------------------------------------------------------

@needs_recording
def test_real_videos_run_and_states_without_a_hand_have_no_numbers(tmp_path: Path,
                                                                   capsys: pytest.CaptureFixture[str]) -> None:
    rig = msgspec.structs.replace(bare_hand_rig(), nodes=recorded_nodes(), calibration=None)
    save_rig(tmp_path / "rig.json", rig)
    arguments = ["track", "--observe", "contours", "--rig", str(tmp_path / "rig.json"), "--unknown-size", "--json",
                 "--out", str(tmp_path / "hand.csv"), "--overlay", str(tmp_path / "pictures")]
    for c in range(2):
        capture = cv2.VideoCapture(str(FOLDER / f"cam{c}_first120.mp4"))
        pictures = [np.ascontiguousarray(capture.read()[1][..., ::-1]) for _ in range(16)][14:]
        arguments += ["--video", f"c{c}={write_video(tmp_path / f'c{c}.avi', pictures, 30.0)}"]
    assert main(arguments) == 0
    assert json.loads(capsys.readouterr().out)["frame_sets"] == 2
    with (tmp_path / "hand.csv").open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            assert (row["condition"] == "PARTIAL") == bool(row["joint_wrist_x_mm"])
            assert row["condition"] != "TRACKING", "contours alone have shown it"
    assert len(list((tmp_path / "pictures").iterdir())) == 2
