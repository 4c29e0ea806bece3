"""Landmark tables: what they may hold, what is refused, and the log that is made of them."""

from __future__ import annotations

import contextlib
import json
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest
from landmark_detector import detected_landmarks, landmark_rig, moving_hand
from recorded_landmarks import FOLDER, needs_recording, recording

from rhot_app.__main__ import main
from rhot_app.errors import RecordingError
from rhot_app.hand.anatomy import HandAnatomy, load_hand
from rhot_app.hand.skeleton import FINGERS
from rhot_app.project import CameraPose, load_rig, save_rig
from rhot_app.recording.landmark_log import read_landmark_table, write_landmark_log
from rhot_app.recording.raw_log import LogReader
from rhot_app.sources.replay import LogValidator
from rhot_app.state import INFERRED_M, Condition
from rhot_app.tracking.tracker import CameraObservations
from rhot_node.files import resource_path

PLACES = [f"{axis}{k}" for k in range(21) for axis in "xy"]
FPS = 30.0


def table(path: Path, frames: list[int], change: dict[str, str] | None = None, head: str = "frame,score") -> Path:
    lines = [",".join([head, *PLACES])]
    for frame in frames:
        cells = dict(zip(PLACES, (f"{200 + frame + k / 2}" for k in range(42)), strict=True)) | (change or {})
        lines.append(",".join([str(frame), *["0.9"] * head.count(","), *(cells[name] for name in PLACES)]))
    path.write_text("\n".join(lines))
    return path


def test_the_log_gives_the_tables_back(tmp_path: Path) -> None:
    rig = landmark_rig()
    tables = [read_landmark_table(table(tmp_path / "left.csv", [3, 4, 6]), FPS),
              read_landmark_table(table(tmp_path / "right.csv", [4, 5], {"x7": "", "y20": "9999"}), FPS)]
    assert write_landmark_log(tmp_path / "a.log", rig, tables) == 5
    reader, validator = LogReader(tmp_path / "a.log"), LogValidator(rig)
    frames = [frame for frame in map(validator.feed, reader) if frame is not None]
    reader.close()
    assert [frame.camera for frame in frames] == [0, 0, 1, 1, 0]
    first = frames[0].t_row0_master_ns
    assert [round(1e-9 * (frame.t_row0_master_ns - first) * FPS, 3) for frame in frames] == [0.0, 1.0, 1.0, 2.0, 3.0]
    assert all(frame.clock_bound_s < 1e-3 for frame in frames)
    np.testing.assert_allclose(frames[0].pixels, tables[0].pixels[0], atol=1e-4)
    lost = np.isnan(frames[2].pixels[:, 0])
    assert set(np.flatnonzero(lost)) == {7, 20}  # none, and outside of the image


def test_a_day_without_frames_takes_no_records(tmp_path: Path) -> None:
    rig, one = landmark_rig(), read_landmark_table(table(tmp_path / "a.csv", [1, 2, 3, 4]), FPS)
    one = replace(one, times_s=one.times_s + np.array([0.0, 0.0, 80_000.0, 80_000.0]))
    assert write_landmark_log(tmp_path / "a.log", rig, [one, one]) == 8
    validator, frames = LogValidator(rig), 0
    with contextlib.closing(LogReader(tmp_path / "a.log")) as reader:
        records = list(reader)
        for record in records:
            frames += isinstance(validator.feed(record), CameraObservations)
    assert frames == 8, "the clocks are known again after the pause"
    assert len(records) < 300


@pytest.mark.parametrize(("frames", "change", "head", "fps", "says"), [
    ([1, 1], {}, "frame,score", FPS, "line 3 has a time that is not after the one before"),
    ([1], {"x3": "abc"}, "frame,score", FPS, "line 2 holds something that is no number"),
    ([1], {"x3": "1e9"}, "frame,score", FPS, "line 2 has a pixel in no image"),
    ([1], {}, "frame,sigma", None, "give --fps"),
    ([1], {}, "number", FPS, "has no column frame or time_s"),
    ([], {}, "frame,score", FPS, "holds no frames"),
])
def test_what_is_no_table_is_refused(tmp_path: Path, frames: list[int], change: dict[str, str], head: str,
                                     fps: float | None, says: str) -> None:
    with pytest.raises(RecordingError, match=says):
        read_landmark_table(table(tmp_path / "a.csv", frames, change, head), fps)


@pytest.mark.parametrize(("unit", "large"), [(1.0, False), (1.3, True)])
def test_the_command_judges_the_reprojection_error(tmp_path: Path, capsys: pytest.CaptureFixture[str], unit: float,
                                                   large: bool) -> None:
    """Camera poses in another unit than metres."""
    rig, rig_path, tables = landmark_rig(), tmp_path / "rig.json", []
    hand = moving_hand(rig, "grasp", 1.0, FPS, 1)
    frames = detected_landmarks(rig, hand, 1)
    for camera in range(2):
        lines = [",".join(["frame", *PLACES])]
        lines += [",".join([str(number), *map(str, one.pixels.ravel())])
                  for number, one in enumerate(one for one in frames if one.camera == camera)]
        tables.append(tmp_path / f"{camera}.csv")
        tables[-1].write_text("\n".join(lines))
    nodes = tuple(msgspec.structs.replace(node, pose=CameraPose(node.pose.rotation_wxyz, tuple(
        unit * value for value in node.pose.translation_m))) for node in rig.nodes)
    save_rig(rig_path, msgspec.structs.replace(rig, nodes=nodes))
    assert main(["landmarks", *map(str, tables), "--rig", str(rig_path), "--out", str(tmp_path / "a.log"), "--fps",
                 str(FPS)]) == 0
    said = capsys.readouterr().out
    assert ("reprojection error is large" in said) == large, said
    assert ("unit of length" in said) == large


def test_the_command_says_what_is_wrong(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    one, rig_path, out = table(tmp_path / "a.csv", [1, 2]), tmp_path / "rig.json", tmp_path / "a.log"
    save_rig(rig_path, landmark_rig())
    say = ["landmarks", str(one), "--rig", str(rig_path), "--out", str(out), "--fps", "30"]
    assert main(say) == 2
    assert "rig 'landmarks' has 2 cameras, but the landmark tables are 1" in capsys.readouterr().err
    assert not out.exists()
    assert main([*say[:2], str(tmp_path / "none.csv"), *say[2:]]) == 2
    assert "none.csv: no such file." in capsys.readouterr().err
    painted = load_rig(resource_path("rigs", "two_pis.json"))
    save_rig(rig_path, msgspec.structs.replace(painted))
    assert main([*say[:2], str(one), *say[2:]]) == 2
    assert "none of its markers is a landmark" in capsys.readouterr().err
    out.write_text("")
    assert main(say) == 2
    assert "exists already" in capsys.readouterr().err


@needs_recording
def test_a_recorded_hands_bones_are_measured_and_used(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    save_rig(tmp_path / "rig.json", recording().rig)
    log, tables = tmp_path / "take.log", [str(FOLDER / f"landmarks_c{c}.csv") for c in range(2)]
    say = ["landmarks", *tables, "--rig", str(tmp_path / "rig.json"), "--fps", "30", "--json", "--out", str(log)]
    assert main(say) == 0
    measured = json.loads(capsys.readouterr().out)
    assert "measured" in measured["bones"] and not measured["reprojection_large"]
    assert main(["calibrate", "bones", "--log", str(log), "--json", "--out", str(tmp_path / "hand.json")]) == 0
    capsys.readouterr()
    with contextlib.closing(LogReader(log)) as reader:
        assert hand_bones(reader.rig.hand) == pytest.approx(hand_bones(load_hand(tmp_path / "hand.json")), rel=0.03)
        chains = recording().places[:, 1:].reshape(-1, 5, 4, 3)
        medians = np.median(np.linalg.norm(np.diff(chains, axis=2), axis=3), axis=0)
        assert hand_bones(reader.rig.hand) == pytest.approx(1e3 * medians.ravel(), rel=0.015)
    assert main([*say[:-1], str(tmp_path / "b.log"), "--bones", "rig"]) == 0
    assert json.loads(capsys.readouterr().out)["reprojection_mm"] > 1.5 * measured["reprojection_mm"]


def hand_bones(hand: HandAnatomy) -> list[float]:
    """All lengths, mm."""
    return [length for name in FINGERS for length in hand.fingers[name].bones_mm]


@needs_recording
@pytest.mark.parametrize("begin", [0, 32, 64])
def test_a_recording_that_begins_amid_a_motion_is_tracking_once_the_hands_places_are_known(begin: int) -> None:
    one = recording()
    states = [state for state, _ in one.states_from(begin, 6)]
    tracking = [state for state in states if state.condition is Condition.TRACKING]
    assert len(tracking) >= 3
    for state in tracking:
        spreads = np.sqrt(np.trace(state.marker_covariances, axis1=1, axis2=2))
        assert np.median(spreads) <= INFERRED_M
    assert any(state.condition is Condition.PARTIAL and np.isfinite(state.joint_positions).all() for state in states)


@needs_recording
@pytest.mark.parametrize("camera", [0, 1])
def test_one_camera_alone_says_how_badly_it_knows_the_distance(camera: int) -> None:
    """Of a hand that is a tenth smaller than the file's, whose distance one camera cannot show."""
    states = recording().states_from(0, 100, only=camera)[5:]
    assert all(state.condition is Condition.PARTIAL for state, _ in states)
    away = np.linalg.norm([state.joint_positions - places for state, places in states], axis=2)
    spreads = np.sqrt([np.trace(state.joint_covariances, axis1=1, axis2=2) for state, _ in states])
    assert np.percentile(away / spreads, 95) < 3.0
    assert np.median(spreads) < 0.15
