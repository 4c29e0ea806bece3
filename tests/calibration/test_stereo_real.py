"""The stereo calibration on real pictures: the published geometry comes out, and every lie is named."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from stereo_pictures import BOARD, needs_pictures, rough, shared, views_of

from rhot_app.calibration.bundle.model import BundleState
from rhot_app.calibration.lens.fit import LensStart
from rhot_app.calibration.stereo.calibrate import KnownLengths, calibrate
from rhot_app.calibration.stereo.result import StereoFigures, StereoResult
from rhot_app.calibration.stereo.ruler import RulerReading
from rhot_app.calibration.verdict import Grade
from rhot_app.errors import CalibrationError

pytestmark = needs_pictures

FEW = 8  # shots, where the lie is what matters
UNPROVEN = {"lengths_unproven"}  # nothing else is found where no second length is given


def figures(report: StereoResult) -> StereoFigures:
    assert report.figures is not None
    return report.figures


@pytest.fixture(scope="module")
def truth() -> StereoResult:
    """All 14 pairs as they were taken."""
    return calibrate(shared(views_of("left"), views_of("right")), rough())


@pytest.fixture(scope="module")
def known(truth: StereoResult) -> list[LensStart]:
    """The lenses as files give them, with their standard deviations."""
    return [LensStart(camera.lens, camera.size, camera.lens_std) for camera in figures(truth).cameras]


def test_the_published_geometry_comes_out(truth: StereoResult) -> None:
    found = figures(truth)
    (pair,) = found.pairs
    assert truth.verdict.codes == UNPROVEN
    assert len(found.shots) == 14
    assert found.rms_px <= 0.45
    assert pair.translation_m * 1e3 == pytest.approx([-99.8, 1.1, 0.1], abs=0.6)
    assert pair.rotation_rad == pytest.approx([0.0067, 0.0045, -0.0035], abs=0.003)
    assert found.squares.mean_m == pytest.approx(0.030, abs=1e-4)
    assert found.squares.flatness_m < 5e-4
    assert pair.epipolar_px < 0.3
    assert 0.0 < found.error_m[0] < 2e-3
    assert np.all(pair.translation_std_m < 5e-4)


def test_given_lenses_give_the_same_geometry(known: list[LensStart], truth: StereoResult) -> None:
    views = shared(views_of("left"), views_of("right"))
    for refine in (False, True):
        found = calibrate(views, known, refine=refine)
        off = figures(found).pairs[0].translation_m - figures(truth).pairs[0].translation_m
        assert np.linalg.norm(off) < 1e-3
        assert found.verdict.codes == UNPROVEN


@pytest.mark.parametrize("camera", ["left", "right"])
@pytest.mark.parametrize("lenses", ["found", "given"])
def test_one_mirrored_camera_is_named(camera: str, lenses: str, known: list[LensStart]) -> None:
    sides = [views_of(name, mirrored=name == camera) for name in ("left", "right")]
    report = calibrate(shared(*sides), known if lenses == "given" else rough())
    assert report.verdict.codes == {"mirrored"}
    assert not report.verdict.acceptable
    assert f"The pictures of {camera} are mirrored" in report.verdict.findings[0].figure


def test_two_mirrored_cameras_are_refused(known: list[LensStart]) -> None:
    """On a plain chessboard they look as if left and right were swapped; lenses from before tell which it is."""
    views = shared(views_of("left", mirrored=True), views_of("right", mirrored=True), most=FEW)
    unaided = calibrate(views, rough())
    assert unaided.verdict.codes == {"swapped_or_mirrored"} | UNPROVEN
    assert figures(unaided).rms_px < 0.3  # the excellent figure of a wrong world
    assert "mirrored" in unaided.verdict.findings[0].cause
    assert calibrate(views, known).verdict.findings[0].code == "mirrored"
    assert calibrate(views, rough(), remembered=known).verdict.findings[0].code == "mirrored"


def test_swapped_cameras_are_refused(known: list[LensStart]) -> None:
    views = shared(views_of("right"), views_of("left"), most=FEW)
    unaided = calibrate(views, rough())
    assert unaided.verdict.codes == {"swapped_or_mirrored"} | UNPROVEN
    assert "the pictures of left come from the camera on the right" in unaided.verdict.findings[0].cause
    assert figures(unaided).pairs[0].translation_m[0] > 0.0
    assert calibrate(views, known).verdict.findings[0].code == "swapped"


def test_cameras_without_sides_may_stand_in_any_order() -> None:
    report = calibrate(shared(views_of("right"), views_of("left"), ("a", "b"), FEW), rough())
    assert report.verdict.codes == UNPROVEN


def test_swapped_intrinsics_are_named(known: list[LensStart]) -> None:
    report = calibrate(shared(views_of("left"), views_of("right"), most=FEW), known[::-1])
    assert "lenses_swapped" in report.verdict.codes
    assert not report.verdict.acceptable


def test_the_lens_of_the_other_camera_is_named(known: list[LensStart]) -> None:
    """One file of two, and a lens that differs by 15 px of centre alone: two poses nearly make up for it."""
    report = calibrate(shared(views_of("left"), views_of("right"), most=FEW), [known[1], rough()[1]])
    (finding,) = [each for each in report.verdict.findings if each.code == "lenses_swapped"]
    assert "given for left fit the pictures of right" in finding.figure
    assert not report.verdict.acceptable


def test_intrinsics_of_another_camera_are_noticed(known: list[LensStart]) -> None:
    strange = [replace(lens, lens=lens.lens * np.repeat([1.1, 1.0], [2, 10])) for lens in known]
    report = calibrate(shared(views_of("left"), views_of("right"), most=FEW), strange)
    assert "lens" in report.verdict.codes


def test_one_pair_out_of_order_is_left_out() -> None:
    right = list(views_of("right"))
    right[4], right[7] = right[7], right[4]
    report = calibrate(shared(views_of("left"), right), rough())
    assert [each.name for each in report.dropped] == ["05", "08"]
    assert "fits that of right in 08" in report.dropped[0].reason
    assert report.verdict.codes == {"order"} | UNPROVEN
    assert report.verdict.acceptable
    assert figures(report).pairs[0].translation_m * 1e3 == pytest.approx([-99.8, 1.1, 0.1], abs=0.6)


@pytest.mark.parametrize("offset", [1, -2])
def test_a_shifted_list_is_named_with_its_offset(offset: int) -> None:
    left, right = views_of("left"), views_of("right")
    views = shared(left, right[offset:]) if offset > 0 else shared(left[-offset:], right)
    report = calibrate(views, rough())
    assert report.verdict.codes == {"order"}
    assert not report.verdict.acceptable
    assert f"out of order by {abs(offset)}" in report.verdict.findings[0].figure


def test_a_scrambled_list_is_put_in_order_in_words() -> None:
    order = np.random.default_rng(0).permutation(14)
    report = calibrate(shared(views_of("left"), [views_of("right")[i] for i in order]), rough())
    assert report.verdict.codes == {"order"}
    where = int(np.flatnonzero(order == 0)[0]) + 1
    assert f"01 of left with {where:02d} of right" in report.verdict.findings[0].figure


def said(square_m: float) -> StereoResult:
    """With squares said to be `square_m`, a ruler of 240 mm seen in pair 3, and the baseline by hand."""
    left, right = views_of("left"), views_of("right")
    views = replace(shared(left, right, most=FEW), board=replace(BOARD, square_m=square_m))
    ends = np.array([np.round(view.grid(BOARD)[2, [0, 8]], 0) for view in (left[2], right[2]) if view is not None])
    return calibrate(views, rough(), known=KnownLengths(baseline_m=0.100, ruler=RulerReading(0.240, ends)))


@pytest.mark.parametrize("wrong", [0.9, 1.1])
def test_a_wrong_square_size_is_seen_with_a_second_length(wrong: float) -> None:
    report = said(0.030 * wrong)
    assert {finding.code: finding.grade for finding in report.verdict.findings} == {
        "square_size": Grade.POOR, "baseline": Grade.POOR}
    fits = figures(report).ruler
    assert fits is not None
    assert fits.ratio * wrong == pytest.approx(1.0, abs=0.01)  # the true size of the squares is named


def test_the_right_square_size_is_confirmed() -> None:
    report = said(0.030)
    assert report.verdict.codes == {"ruler", "baseline"}
    assert report.verdict.grade is Grade.GOOD


def test_views_all_alike_are_refused() -> None:
    """One shot, over and over, as a camera on a stand before a board on a stand takes it."""
    rng = np.random.default_rng(1)

    def again(views: Sequence[object], number: int) -> list[object]:
        return [replace(views[number], pixels=views[number].pixels + rng.normal(0, 0.1, (54, 2)))  # type: ignore
                for _ in range(10)]

    report = calibrate(shared(again(views_of("left"), 0), again(views_of("right"), 0)), rough())  # type: ignore
    assert "alike" in report.verdict.codes
    assert not report.verdict.acceptable


def test_pictures_of_another_size_are_refused(known: list[LensStart]) -> None:
    small = [replace(lens, size=(320, 240)) for lens in known]
    with pytest.raises(CalibrationError, match="640x480 px, the intrinsics are for 320x240"):
        calibrate(shared(views_of("left"), views_of("right")), small)


def test_scale_is_the_boards_alone(truth: StereoResult) -> None:
    state: BundleState = figures(truth).state
    views = replace(shared(views_of("left"), views_of("right")), board=replace(BOARD, square_m=0.060))
    twice = figures(calibrate(views, rough())).state
    assert twice.camera_from_world[1, :3, 3] == pytest.approx(2 * state.camera_from_world[1, :3, 3], rel=1e-5)
