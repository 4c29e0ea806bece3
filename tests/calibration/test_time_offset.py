"""Times from waving: the truth comes back within its stated error, and recordings that cannot show it are refused."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest
from log_writing import write_log
from synthetic_rig import hand_trajectory, make_rig, still_trajectory
from waving import SIDEWAYS, collect, see, waving

from rhot_app.__main__ import main
from rhot_app.calibration.time.offset import calibrate_times
from rhot_app.calibration.time.tracks import interpolate
from rhot_app.calibration.verdict import Grade
from rhot_app.errors import CalibrationError
from rhot_app.project import CameraPose, load_rig, save_rig

RIG = make_rig()
SECONDS = 20.0
WIDE_ROW = 48_000


@pytest.fixture(scope="module")
def wave():
    return waving(RIG, SECONDS)


def report_of(trajectory, rig=RIG, *, late=(0.0, 0.003), rows=(WIDE_ROW, WIDE_ROW), said=(WIDE_ROW, WIDE_ROW),
              seconds=8.0, **seen):
    frames = see(rig, trajectory, seconds, late_s=late, row_times_ns=rows, said_ns=said, **seen)
    return calibrate_times(collect(rig, frames), rig)


@pytest.mark.parametrize("late_s", [0.0, 0.008, -0.070])
def test_offsets_come_back(wave, late_s: float) -> None:
    report = report_of(wave, late=(0.0, late_s), seconds=SECONDS)
    camera = report.cameras[1]
    assert camera.correction_s == pytest.approx(late_s, abs=0.1e-3)
    assert abs(camera.correction_s - late_s) < 4.0 * camera.sd_s < 0.2e-3
    assert report.verdict.grade is Grade.GOOD and report.row_times_agree
    assert report.apply(RIG).nodes[1].time_offset_s == pytest.approx(late_s, abs=0.1e-3)
    assert report.apply(RIG).nodes[1].time_offset_sd_s == camera.sd_s > 0.0
    assert report.cameras[0].reference and report.apply(RIG).nodes[0].time_offset_s == 0.0


@pytest.mark.parametrize("rows", [(WIDE_ROW, WIDE_ROW), (20_000, 35_000)])
def test_row_times_come_back_whatever_the_nodes_say(wave, rows: tuple[int, int]) -> None:
    report = report_of(wave, rows=rows, said=(0, 60_000), seconds=SECONDS)
    for camera, true_ns in zip(report.cameras, rows, strict=True):
        assert camera.row_time_observed
        assert camera.row_time_s == pytest.approx(1e-9 * true_ns, rel=0.1, abs=2e-6)
        assert abs(camera.row_time_s - 1e-9 * true_ns) < 3.0 * camera.row_time_sd_s
    assert report.cameras[1].with_row_time_s == pytest.approx(0.003, abs=0.2e-3)
    assert "row_time" in report.verdict.codes and report.verdict.grade is Grade.FAIR


def test_a_third_camera_is_timed_too() -> None:
    rig = make_rig(cameras=3)
    report = report_of(waving(rig, 8.0), rig, late=(0.0, -0.004, 0.011), rows=(WIDE_ROW,) * 3, said=(WIDE_ROW,) * 3)
    assert [camera.correction_s for camera in report.cameras] == pytest.approx([0.0, -0.004, 0.011], abs=0.2e-3)
    assert set(report.plots) == {1, 2}


def test_cameras_above_each_other_need_sideways_movement() -> None:
    nodes = (RIG.nodes[0], msgspec.structs.replace(RIG.nodes[1], pose=CameraPose(translation_m=(0.0, 0.075, 0.0))))
    rig = msgspec.structs.replace(RIG, nodes=nodes)
    good = report_of(waving(rig, 8.0, SIDEWAYS), rig)
    assert good.cameras[1].correction_s == pytest.approx(0.003, abs=0.2e-3)
    assert good.cameras[1].direction == "left and right"


def test_movement_along_the_epipolar_lines_shows_nothing_and_is_told_so() -> None:
    report = report_of(waving(RIG, 8.0, SIDEWAYS))
    (finding,) = [finding for finding in report.verdict.findings if finding.code == "weak_movement"]
    assert finding.grade is not Grade.GOOD and "Wave up and down" in finding.remedy
    still = hand_trajectory(RIG, "rest", 1.0)(np.zeros(1))[0]
    frozen = report_of(still_trajectory(still))
    assert not frozen.verdict.acceptable and "weak_movement" in frozen.verdict.codes


def test_a_soft_hand_does_not_pass_for_a_row_time() -> None:
    report = report_of(hand_trajectory(RIG, "grasp", SECONDS), seconds=SECONDS)
    assert not report.cameras[0].row_time_observed and report.row_times_agree
    assert report.verdict.acceptable and "row_time_not_seen" in report.verdict.codes
    assert report.cameras[1].correction_s == pytest.approx(0.003, abs=0.2e-3)


def test_one_marker_is_enough_for_offsets(wave) -> None:
    alone = msgspec.structs.replace(RIG, markers=msgspec.structs.replace(RIG.markers, markers=RIG.markers.markers[:1]))
    report = report_of(lambda times: wave(times)[:, :1], alone)
    assert report.cameras[1].correction_s == pytest.approx(0.003, abs=0.2e-3)
    assert not report.cameras[1].row_time_observed


def test_a_stale_geometry_does_not_bias_the_times(wave) -> None:
    frames = see(RIG, wave, 8.0, late_s=(0.0, 0.003), row_times_ns=(WIDE_ROW,) * 2, said_ns=(WIDE_ROW,) * 2)
    half = np.radians(0.3) / 2.0
    turned = msgspec.structs.replace(RIG.nodes[1], pose=CameraPose((float(np.cos(half)), float(np.sin(half)), 0.0, 0.0),
                                                                   (0.075, 0.0, 0.0)))
    rig = msgspec.structs.replace(RIG, nodes=(RIG.nodes[0], turned))
    report = calibrate_times(collect(rig, frames), rig)
    assert report.cameras[1].correction_s == pytest.approx(0.003, abs=0.2e-3)


def test_a_clock_that_wanders_is_noticed(wave) -> None:
    frames = see(RIG, wave, SECONDS, late_s=(0.0, 0.0), row_times_ns=(WIDE_ROW,) * 2, said_ns=(WIDE_ROW,) * 2)
    begun = frames[0].t_row0_master_ns
    drifting = [replace(f, t_row0_master_ns=f.t_row0_master_ns + round(2e-4 * (f.t_row0_master_ns - begun)))
                if f.camera else f for f in frames]
    report = calibrate_times(collect(RIG, drifting), RIG)
    assert "unsteady" in report.verdict.codes
    assert np.ptp(report.plots[1].drift_s) == pytest.approx(2e-4 * 15.0, rel=0.2)


def test_the_plot_is_a_line_whose_slope_is_the_delay(wave) -> None:
    plot = report_of(wave, late=(0.0, 0.008)).plots[1]
    assert plot.speed_px_s @ plot.before_px / (plot.speed_px_s @ plot.speed_px_s) == pytest.approx(-0.008, rel=0.05)
    assert np.std(plot.after_px) < 0.3 < np.std(plot.before_px)
    assert plot.offsets_s[np.nanargmin(plot.rms_px)] == pytest.approx(0.008, abs=2e-3)


def test_what_cannot_be_solved_is_refused_with_a_sentence(wave) -> None:
    frames = see(RIG, wave, 1.0, late_s=(0.0, 0.0), row_times_ns=(0, 0), said_ns=(0, 0))
    with pytest.raises(CalibrationError, match="camera 2 never saw"):
        calibrate_times(collect(RIG, [frame for frame in frames if frame.camera == 0]), RIG)
    alone = msgspec.structs.replace(RIG, nodes=RIG.nodes[:1])
    with pytest.raises(CalibrationError, match="one camera"):
        calibrate_times(collect(alone, []), alone)
    nowhere = msgspec.structs.replace(RIG, nodes=(RIG.nodes[0], msgspec.structs.replace(RIG.nodes[1],
                                                                                        pose=CameraPose())))
    with pytest.raises(CalibrationError, match="stereo geometry first"):
        calibrate_times(collect(nowhere, frames), nowhere)


def test_the_command_writes_the_rig_and_adds_up(tmp_path: Path, wave, capsys: pytest.CaptureFixture[str]) -> None:
    frames = see(RIG, wave, 8.0, late_s=(0.0, 0.005), row_times_ns=(WIDE_ROW,) * 2, said_ns=(WIDE_ROW,) * 2)
    log, rig_path = write_log(tmp_path / "wave.log", RIG, frames), tmp_path / "rig.json"
    save_rig(rig_path, RIG)
    arguments = ["calibrate", "time", "--log", str(log), "--rig", str(rig_path), "--out", str(rig_path), "--json"]
    assert main(arguments) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["cameras"][1]["time_offset_ms"] == pytest.approx(5.0, abs=0.2) and found["written"] == str(rig_path)
    assert main(arguments) == 0
    again = json.loads(capsys.readouterr().out)
    assert again["cameras"][1]["correction_ms"] == pytest.approx(0.0, abs=0.05)
    assert load_rig(rig_path).nodes[1].time_offset_s == pytest.approx(0.005, abs=0.2e-3)


def test_interpolation_keeps_to_one_track() -> None:
    times = np.arange(10.0)
    values = np.column_stack([times**3, 2.0 * times])
    joined = np.ones(10, bool)
    joined[[0, 6]] = False
    at = np.array([0.5, 1.5, 2.25, 5.5, 7.5, 8.5])
    found = interpolate(times, values, joined, at)
    np.testing.assert_allclose(found[[1, 2, 4]], np.column_stack([at**3, 2.0 * at])[[1, 2, 4]])
    assert np.isnan(found[[0, 3, 5]]).all()
