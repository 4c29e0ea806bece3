"""Lenses of 100 degrees and more: eight coefficients where the views show them, and the word where they do not do."""

from __future__ import annotations

import json
from pathlib import Path

import msgspec
import numpy as np
import pytest
from board_rendering import LENS
from equidistant import focal_px, wide_views
from intrinsics_twin import BOARD, twin_views

from rhot_app.__main__ import main
from rhot_app.calibration.board.shared_views import SharedViews
from rhot_app.calibration.check.checks import check_cameras
from rhot_app.calibration.kinds.lens import report as said_of
from rhot_app.calibration.lens.fit import LensStart, find_lens
from rhot_app.calibration.lens.intrinsics import IntrinsicsResult, load_intrinsics, save_intrinsics, solve
from rhot_app.calibration.stereo.calibrate import KnownLengths, calibrate, calibrated_rig, lens_of
from rhot_app.calibration.verdict import Grade, Verdict
from rhot_app.errors import RigError
from rhot_app.geometry.camera import CameraModel, is_wide, lens_parameters
from rhot_app.project import load_rig, save_rig
from rhot_node.files import resource_path

CASE = Path(__file__).resolve().parents[3] / "shared" / "cases" / "fisheye"


def left_of(views: SharedViews) -> IntrinsicsResult:
    return solve([view for view in views.of_camera(0) if view is not None], BOARD)


@pytest.fixture(scope="module")
def wide() -> SharedViews:
    """120 degrees across."""
    return wide_views(np.random.default_rng(1), focal_px(120.0))


@pytest.fixture(scope="module")
def report(wide: SharedViews) -> IntrinsicsResult:
    return left_of(wide)


def test_a_lens_of_120_degrees_is_found(report: IntrinsicsResult) -> None:
    assert report.lens[0] == pytest.approx(focal_px(120.0), rel=0.003)
    assert report.lens[2:4] == pytest.approx([319.5, 239.5], abs=0.5)
    assert len(report.intrinsics.distortion) == 8 and report.verdict.grade is Grade.GOOD, report.verdict
    angle = np.radians([10.0, 30.0, 50.0])
    points = np.column_stack([np.sin(angle), np.zeros(3), np.cos(angle)])
    model = CameraModel.from_rig(report.intrinsics, load_rig(resource_path("rigs", "two_pis.json")).nodes[0].pose)
    assert model.project(points)[:, 0] == pytest.approx(319.5 + focal_px(120.0) * angle, abs=0.3)


@pytest.mark.parametrize("bent_m", [0.0, 2e-4])
def test_a_plain_lens_stays_plain(bent_m: float) -> None:
    """A board that is off makes no lens wide either."""
    rng = np.random.default_rng(3)
    errors = rng.normal(0.0, bent_m, (BOARD.count, 3))
    found = find_lens(twin_views(rng, count=12, noise_px=0.05, board_errors=errors), BOARD, "left")
    assert not is_wide(found.lens) and found.lens[:2] == pytest.approx(LENS[:2], rel=0.01)
    assert found.trouble is None


def test_two_cameras_of_120_degrees_are_put_together(wide: SharedViews, tmp_path: Path) -> None:
    lenses = [find_lens([view for view in wide.of_camera(camera) if view is not None], BOARD, name)
              for camera, name in enumerate(wide.cameras)]
    report = calibrate(wide, lenses, known=KnownLengths(0.075))
    assert report.figures is not None and report.verdict.grade is Grade.GOOD, report.verdict
    assert report.figures.pairs[0].baseline_m == pytest.approx(0.075, abs=2e-4)
    for camera in report.figures.cameras:
        assert camera.lens[:2] == pytest.approx([focal_px(120.0)] * 2, rel=0.003)

    rig = calibrated_rig(load_rig(resource_path("rigs", "two_pis.json")), report.figures)
    save_rig(tmp_path / "rig.json", rig)
    again = load_rig(tmp_path / "rig.json")
    assert again == rig and [len(node.intrinsics.distortion) for node in again.nodes] == [8, 8]
    assert all(finding.grade is not Grade.POOR and finding.code != "field_of_view" for finding in check_cameras(again))


def test_a_wide_lens_is_kept_in_a_file(report: IntrinsicsResult, wide: SharedViews, tmp_path: Path) -> None:
    save_intrinsics(tmp_path / "left.json", report)
    written = load_intrinsics(tmp_path / "left.json")
    assert written.intrinsics == report.intrinsics and {"k3", "k6"} <= set(written.std)
    assert written.lens.lens == pytest.approx(report.lens) and written.lens.std == pytest.approx(report.std)
    free = calibrate(wide, [written.lens, LensStart(report.lens, report.size)], refine=True).figures
    assert free is not None and free.pairs[0].baseline_m == pytest.approx(0.075, abs=5e-4)


def text_of(report: IntrinsicsResult) -> str:
    return json.dumps([said_of(report, None).to_json(), said_of(report, None).lines()], allow_nan=False)


def first_cause(verdict: Verdict) -> str:
    assert not verdict.acceptable
    return verdict.findings[0].code


def test_a_lens_that_no_model_describes_is_refused_by_its_name() -> None:
    """230 degrees: a third of the picture looks back."""
    views = wide_views(np.random.default_rng(2), focal_px(230.0), count=12)
    report = left_of(views)
    assert first_cause(report.verdict) == "too_wide" and "nan" not in text_of(report)
    assert "wider than the model" in report.verdict.findings[0].figure
    lenses = [find_lens(views.of_camera(0), BOARD, name) for name in views.cameras]
    assert first_cause(calibrate(views, lenses).verdict) == "too_wide"


RIG = resource_path("rigs", "two_pis.json")


def test_a_lens_that_reaches_the_end_of_its_model_is_called_a_fisheye() -> None:
    """215 degrees: nearly every place has a ray, which is none of the lens."""
    rig, report = load_rig(RIG), left_of(wide_views(np.random.default_rng(2), focal_px(215.0)))
    node = msgspec.structs.replace(rig.nodes[0], intrinsics=report.intrinsics)
    found = check_cameras(msgspec.structs.replace(rig, nodes=(node, *rig.nodes[1:])))
    first = next(finding for finding in found if finding.code != "nominal")
    assert first.grade is Grade.POOR and "fisheye" in first.cause and "another picture size" not in first.cause


def test_rigs_of_five_coefficients_are_written_as_they_were(tmp_path: Path) -> None:
    rig = load_rig(RIG)
    save_rig(tmp_path / "rig.json", rig)
    for before, after in zip(json.loads(RIG.read_text())["nodes"], json.loads((tmp_path / "rig.json").read_text())[
            "nodes"], strict=True):
        assert before["intrinsics"] == after["intrinsics"] and len(after["intrinsics"]["distortion"]) == 5
    node = rig.nodes[0]
    assert lens_of(node).lens == pytest.approx(lens_parameters(node.intrinsics))


@pytest.mark.parametrize("count", [4, 6, 7, 9])
def test_another_number_of_coefficients_is_a_sentence(tmp_path: Path, count: int) -> None:
    document = json.loads(RIG.read_text())
    document["nodes"][0]["intrinsics"]["distortion"] = [0.0] * count
    (tmp_path / "rig.json").write_text(json.dumps(document))
    with pytest.raises(RigError, match=r"rig\.json.*(distortion|length)"):
        load_rig(tmp_path / "rig.json")


def test_a_lens_that_ends_within_the_picture_is_named() -> None:
    rig = load_rig(RIG)
    lens = msgspec.structs.replace(rig.nodes[0].intrinsics, distortion=(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 60.0, 0.0))
    node = msgspec.structs.replace(rig.nodes[0], intrinsics=lens)
    found = {each.code: each for each in check_cameras(msgspec.structs.replace(rig, nodes=(node, *rig.nodes[1:])))}
    assert found["distortion"].grade is Grade.POOR


@pytest.mark.skipif(not CASE.is_dir(), reason=f"the pictures are not there ({CASE})")
def test_a_lens_of_167_degrees_is_found_from_pictures(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["calibrate", "intrinsics", "--images", str(CASE / "left" / "*.png"), "--board", "9x6",
                 "--square-mm", "25", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["fx"] == pytest.approx(219.8, abs=1.0) and answer["rms_px"] <= 0.09
    assert (answer["cx"], answer["cy"]) == pytest.approx((319.5, 239.5), abs=0.3)
