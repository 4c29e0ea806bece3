"""Another tracker's world is found in the rig; motion that does not show it is refused; drift is noticed."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from aligned_streams import make_scene, random_pose
from scipy.stats import chi2

from rhot_app.__main__ import main
from rhot_app.calibration.verdict import Grade
from rhot_app.errors import CalibrationError
from rhot_app.estimation.se3 import exp_so3, log_so3, quaternion_from_rotation
from rhot_app.geometry.transforms import apply, fit_rigid, inverse, rigid
from rhot_app.objects.alignment.alignment_file import load_alignment, save_alignment, to_alignment
from rhot_app.objects.alignment.drift import DriftMonitor
from rhot_app.objects.alignment.fit import UNKNOWNS, AlignmentEstimate, AlignmentModel, align
from rhot_app.objects.alignment.motion_stream import MotionStream, consistent, read_stream
from rhot_app.objects.alignment.report import calibrate_alignment
from rhot_app.recording.qualisys import read_qualisys


def errors(fit, scene):
    """Of the parameters in the order of the covariance."""
    out = [fit.rig_from_foreign[:3, 3] - scene.rig_from_foreign[:3, 3],
           log_so3(fit.rig_from_foreign[:3, :3] @ scene.rig_from_foreign[:3, :3].T),
           fit.tracker_from_body[:3, 3] - scene.tracker_from_body[:3, 3], [fit.offset_s - scene.offset_s]]
    return np.concatenate(out)


@cache
def trials():
    out = []
    for seed in range(20):  # 200 degrees of freedom
        scene = make_scene(seed)
        fit, _ = align(scene.foreign, scene.rig, search_s=0.05)
        out.append((errors(fit, scene), fit))
    return out


def test_the_transform_and_the_offset_are_recovered_from_noisy_streams():
    for error, fit in trials():
        assert np.linalg.norm(error[:3]) < 0.5e-3
        assert np.linalg.norm(error[3:6]) < np.radians(0.1)
        assert np.linalg.norm(error[6:9]) < 0.5e-3
        assert abs(error[9]) < 1e-3
        assert 0.85 < fit.inlier_ratio < 0.93  # 5 % outliers in either stream, 2 samples at each end


def test_the_errors_are_consistent_with_the_covariance():
    squares = [error @ np.linalg.solve(fit.covariance, error) for error, fit in trials()]
    size = len(trials()[0][0])
    assert 0.5 < np.mean(squares) / size < 2.0  # 0.7 to 1.35 with p = 0.99 where consistent
    assert np.mean(np.array(squares) < chi2.ppf(0.99, size)) > 0.75


@pytest.mark.parametrize("rates", [(60.0, 127.0), (127.0, 60.0)])
def test_jacobians_are_the_finite_differences(rates):
    scene = make_scene(3, rates=rates, noise=0.0, outliers=0.0)
    rng = np.random.default_rng(0)
    model = AlignmentModel(scene.foreign, scene.rig)
    model.select(0.0)
    model.thin(40)
    estimate = AlignmentEstimate(
        exp_so3(0.05 * rng.normal(size=3)) @ scene.rig_from_foreign[:3, :3], rng.normal(size=3),
        0.1 * rng.normal(size=3), scene.offset_s + 0.0013)
    _, jacobian = model.linearise(estimate)
    for column in range(UNKNOWNS):
        step = np.zeros(UNKNOWNS)
        step[column] = 1e-6
        up, down = (model.linearise(estimate.moved(sign * step)) for sign in (1.0, -1.0))
        np.testing.assert_allclose(jacobian[:, :, column], -(up[0] - down[0]) / 2e-6, atol=2e-4)


@pytest.mark.parametrize(("motion", "code"), [
    ({"spread_rad": (0.0, 0.0, 0.0)}, "no_rotation"),
    ({"spread_rad": (0.35, 0.0, 0.0)}, "one_axis"),
    ({"slow": 0.05}, "slow"),
    ({"spread_m": (0.08, 0.0, 0.0)}, "one_direction"),
    ({"offset_s": 1.03}, "edge"),
    ({"offset_s": 1.4}, "not_rigid"),
])
def test_motion_that_does_not_show_the_answer_is_refused(motion, code):
    scene = make_scene(1, **motion)
    verdict = calibrate_alignment(scene.foreign, scene.rig).verdict
    assert not verdict.acceptable and code in verdict.codes, verdict


@pytest.mark.parametrize(("motion", "code"), [({"spread_m": (0.2, 0.2, 0.0)}, "planar"), ({"seconds": 3.0}, "short"),
                                              ({"seconds": 3.0}, "uncertain")])
def test_motion_that_shows_less_is_not_good(motion, code):
    scene = make_scene(1, **motion)
    verdict = calibrate_alignment(scene.foreign, scene.rig).verdict
    assert verdict.grade is Grade.FAIR and code in verdict.codes, verdict


def test_good_motion_is_accepted():
    scene = make_scene(1, start_s=1.7e9)  # wall clock
    report = calibrate_alignment(scene.foreign, scene.rig)
    assert report.verdict.acceptable and not report.verdict.findings, report.verdict
    assert abs(report.fit.offset_s - scene.offset_s) < 1e-3 and abs(report.scale - 1.0) < 0.02


@pytest.mark.parametrize("rates", [(12.0, 127.0), (60.0, 15.0), (100.0, 100.0)])
def test_slow_streams_and_gaps_are_aligned(rates):
    scene = make_scene(2, rates=rates)
    there = scene.rig.times_s % 4.0 > 1.0
    fit, _ = align(scene.foreign, MotionStream(scene.rig.times_s[there], scene.rig.positions[there]), search_s=0.1)
    error = errors(fit, scene)
    assert np.linalg.norm(error[6:9]) < 0.5e-3 and abs(error[9]) < 1e-3


def test_millimetres_are_named():
    scene = make_scene(1)
    foreign = MotionStream(scene.foreign.times_s, 1e3 * scene.foreign.positions, scene.foreign.rotations)
    verdict = calibrate_alignment(foreign, scene.rig, search_s=0.1).verdict
    assert not verdict.acceptable and "scale" in verdict.codes
    assert "not in metres" in next(finding.sentence for finding in verdict.findings if finding.code == "scale")


def test_things_that_are_not_rigidly_connected_are_refused():
    verdict = calibrate_alignment(make_scene(1).foreign, make_scene(2).rig).verdict
    assert not verdict.acceptable and "not_rigid" in verdict.codes


QUALISYS = Path(__file__).parents[3] / "shared" / "data" / "hand_motion" / "qualisys_hand_30s.tsv"


@pytest.mark.skipif(not QUALISYS.exists(), reason="the recorded hand is not here")
@pytest.mark.parametrize(("point", "rigid_on_it"), [("hand_top", True), ("middle_tip", False)])
def test_a_recorded_hand_is_aligned_and_a_bending_finger_refused(point, rigid_on_it):
    """The triad on the back of the hand in every other frame, and a marker in the frames between them."""
    tracks = read_qualisys(QUALISYS)
    triad = tracks.positions[:, [tracks.names.index(f"hand_{name}") for name in ("top", "left", "right")]]
    seen = tracks.positions[:, tracks.names.index(point)]
    known = np.isfinite(triad).all(axis=(1, 2)) & np.isfinite(seen).all(axis=1)
    even, odd = (known & (np.arange(len(known)) % 2 == rest) for rest in (0, 1))
    shape = triad[even][0] - triad[even][0].mean(axis=0)
    rig_from_foreign = random_pose(np.random.default_rng(0), 1.0)
    poses = np.array([inverse(rig_from_foreign) @ fit_rigid(shape, frame) for frame in triad[even]])
    report = calibrate_alignment(MotionStream.of_poses(tracks.times_s[even] - 0.037, poses),
                                 MotionStream(tracks.times_s[odd], seen[odd]))
    fit = report.fit
    assert report.verdict.acceptable == rigid_on_it and ("not_rigid" in report.verdict.codes) != rigid_on_it
    if rigid_on_it:  # the hand hardly turns, which the verdict says
        assert abs(fit.offset_s - 0.037) < 0.1e-3
        away = apply(fit.rig_from_foreign, apply(inverse(rig_from_foreign), fit.centre)) - fit.centre
        assert np.linalg.norm(away) < 0.5e-3 and np.linalg.norm(away) < 2.0 * report.place_sd_m
        assert {"no_rotation", "slow"} <= report.verdict.codes


def test_streams_that_do_not_overlap_are_refused():
    scene = make_scene(1)
    late = MotionStream(scene.rig.times_s + 100.0, scene.rig.positions)
    with pytest.raises(CalibrationError, match="do not overlap"):
        align(scene.foreign, late)
    with pytest.raises(CalibrationError, match="positions only"):
        align(scene.rig, scene.rig)


def test_outliers_are_found_by_their_neighbours():
    scene = make_scene(4, outliers=0.0)
    wild = np.random.default_rng(0).random(len(scene.rig.times_s)) < 0.1
    positions = scene.rig.positions + 0.1 * wild[:, None] * np.array([0.6, -0.8, 0.0])
    kept = consistent(scene.rig.times_s, positions, 10e-3)
    assert np.mean(kept[wild]) < 0.05 and np.mean(kept[~wild]) > 0.95


@pytest.mark.parametrize("times", [np.zeros(60), np.arange(20.0)])
def test_streams_that_are_none_are_refused(times):
    with pytest.raises(CalibrationError):
        MotionStream(times, np.zeros((len(times), 3)))


def pairs(scene, alignment, later):
    """Of the monitor: the rig's samples with the interpolated pose of the other tracker; `later`: a scene's change."""
    foreign = scene.foreign.without_outliers()
    place, _, rotation, _ = foreign.at(scene.rig.times_s - alignment.time_offset_s - later)
    for t_s, position, at, turn in zip(scene.rig.times_s, scene.rig.positions, place, rotation, strict=True):
        yield t_s, position, rigid(turn, at)


@cache
def aligned():
    """A scene's alignment, and a later recording with it: the same motion with other noise."""
    scene = make_scene(1)
    report = calibrate_alignment(scene.foreign, scene.rig, search_s=0.1)
    return scene, to_alignment(report)


def drift_after(change, late_s=0.0):
    scene, alignment = aligned()
    monitor, tests = DriftMonitor(alignment), []
    for number, (t_s, position, pose) in enumerate(pairs(scene, alignment, late_s)):
        monitor.add(t_s, change(position), pose)
        if number % 60 == 0 and 0.5 < t_s < scene.rig.times_s[-1] - 0.5:
            tests.append(monitor.test())
    return [test for test in tests if test is not None]


def test_a_true_alignment_is_not_called_stale():
    tests = drift_after(lambda position: position)
    assert len(tests) > 10 and not any(test.stale for test in tests)
    assert not any(test.sentence for test in tests)


def test_a_moved_camera_is_noticed_with_its_distance():
    tests = drift_after(lambda position: position + np.array([0.0, 3e-3, 0.0]))
    assert all(test.stale for test in tests)
    assert all(2.7e-3 < test.distance_m < 3.3e-3 for test in tests)
    assert "3." in tests[-1].sentence or "2." in tests[-1].sentence
    assert "was moved" in tests[-1].sentence


def test_a_turned_camera_and_a_drifting_clock_are_noticed():
    middle = aligned()[0].rig.positions.mean(axis=0)
    turn = exp_so3([0.0, 0.0, np.radians(2.0)])
    assert all(test.stale for test in drift_after(lambda position: middle + turn @ (position - middle)))
    late = drift_after(lambda position: position, late_s=0.01)
    assert all(test.stale for test in late)
    assert "clock has drifted by" in late[-1].sentence and abs(late[-1].offset_s + 0.01) < 2e-3


def test_a_lasting_error_of_half_a_millimetre_is_no_drift():
    assert not any(test.stale for test in drift_after(lambda position: position + np.array([0.5e-3, 0.0, 0.0])))


def test_the_file_holds_the_alignment(tmp_path):
    _, alignment = aligned()
    path = tmp_path / "vive.json"
    save_alignment(path, alignment)
    assert load_alignment(path) == alignment
    text = json.loads(path.read_text())
    for change, words in ((("covariance", [[1.0] * 9] * 9), "covariance"), (("noise_m", -1.0), "noise_m"),
                          (("version", 2), "version")):
        path.write_text(json.dumps({**text, change[0]: change[1]}))
        with pytest.raises(CalibrationError, match=words):
            load_alignment(path)


def write_csv(path, stream):
    """As `rhot calibrate alignment` reads it."""
    columns, header = [stream.times_s[:, None], stream.positions], "t,x,y,z"
    if stream.rotations is not None:
        columns.append(np.array([quaternion_from_rotation(one) for one in stream.rotations]))
        header += ",qw,qx,qy,qz"
    np.savetxt(path, np.hstack(columns), delimiter=",", header=header, comments="")


def test_the_command_writes_the_file(tmp_path, capsys):
    def command(*arguments):
        return main(["calibrate", "alignment", *map(str, arguments)]), *capsys.readouterr()
    scene = make_scene(1)
    foreign, rig, out = tmp_path / "vive.csv", tmp_path / "tip.csv", tmp_path / "vive.json"
    write_csv(foreign, scene.foreign)
    write_csv(rig, scene.rig)
    code, told, error = command("--foreign", foreign, "--rig-points", rig, "--out", out, "--json")
    assert code == 0, error
    said = json.loads(told)
    assert said["grade"] == "good" and abs(said["time_offset_ms"] - 37.0) < 1.0
    np.testing.assert_allclose(load_alignment(out).rig_from_foreign.matrix, scene.rig_from_foreign, atol=1e-3)
    code, told, error = command("--foreign", foreign, "--rig-points", rig, "--check", out)
    assert code == 0 and "holds" in told, error
    moved = tmp_path / "moved.csv"
    write_csv(moved, MotionStream(scene.rig.times_s, scene.rig.positions + np.array([0.0, 5e-3, 0.0])))
    code, _, error = command("--foreign", foreign, "--rig-points", moved, "--check", out)
    assert code == 2 and "stale" in error and "was moved" in error
    code, told, _ = command("--foreign", foreign, "--rig-points", moved, "--check", out, "--json")
    assert code == 2 and json.loads(told)["distance_mm"] == pytest.approx(5.0, abs=0.5)
    rows = foreign.read_text().splitlines()
    foreign.write_text("\n".join([*rows[:10], "1,2,oops", *rows[10:]]))
    code, _, error = command("--foreign", foreign, "--rig-points", rig)
    assert code == 2 and f"{foreign}, line 11" in error


@pytest.mark.parametrize(("text", "words"), [
    ("", "line 1"), ("a,b\n1,2\n", "line 1"), ("t,x,y,z\n1,2,3\n", "line 2"), ("t,x,y,z\n1,2,3,nan\n", "line 2"),
    ("t,x,y,z\n1,2,3,4\n0,2,3,4\n", "line 3.*Sort"), ("t,x,y,z\n1,2,3,4\n", "1 samples"),
])
def test_garbage_names_file_and_line(tmp_path, text, words):
    path = tmp_path / "points.csv"
    path.write_text(text)
    with pytest.raises(CalibrationError, match=words):
        read_stream(path, ("t", "x", "y", "z"))
    path.write_bytes(b"\xff\xfe\x00\x01" * 9)
    with pytest.raises(CalibrationError, match="this is no text"):
        read_stream(path, ("t", "x", "y", "z"))


def test_a_quaternion_that_is_none_names_its_line(tmp_path):
    path = tmp_path / "poses.csv"
    path.write_text("t,x,y,z,qw,qx,qy,qz\n0,0,0,0,1,0,0,0\n1,0,0,0,2,0,0,0\n")
    with pytest.raises(CalibrationError, match="line 3: the quaternion"):
        read_stream(path, ("t", "x", "y", "z", "qw", "qx", "qy", "qz"))
