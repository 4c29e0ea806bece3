"""One camera's lens from synthetic views: the truth comes back, and what views cannot show is said."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from board_rendering import LENS, corners_px, pose
from intrinsics_twin import BOARD, seen, twin_views

from rhot_app.calibration.board.boards import CharucoBoard
from rhot_app.calibration.lens.intrinsics import IntrinsicsResult, solve
from rhot_app.calibration.lens.intrinsics_checks import expected_errors
from rhot_app.calibration.lens.misfit import residual_field
from rhot_app.calibration.verdict import Grade
from rhot_app.errors import CalibrationError
from rhot_app.geometry.camera import full_lens

NOISE_PX = 0.05


@pytest.fixture(scope="module")
def noisy() -> IntrinsicsResult:
    """Fifteen views with noise."""
    return solve(twin_views(np.random.default_rng(5), noise_px=NOISE_PX), BOARD)


def test_exact_corners_give_the_lens_back() -> None:
    report = solve(twin_views(np.random.default_rng(1)), BOARD)
    np.testing.assert_allclose(report.lens[:4], LENS[:4], rtol=1e-6)
    np.testing.assert_allclose(report.lens[4:8], LENS[4:8], rtol=1e-6, atol=1e-9)
    assert abs(report.lens[8]) < 1e-6  # the true k3 is 0
    assert report.rms_px < 1e-6 and report.verdict.grade is Grade.GOOD


def test_noise_is_estimated_and_the_truth_lies_in_the_intervals(noisy: IntrinsicsResult) -> None:
    assert noisy.rms_px == pytest.approx(NOISE_PX * np.sqrt(2), rel=0.1)
    assert np.all(np.abs(noisy.lens - LENS) <= 3.5 * noisy.std)
    assert 0.05 < noisy.std[0] < 1.0
    assert noisy.verdict.acceptable and not noisy.dropped and not noisy.undetermined
    assert noisy.board_errors is None, "a perfect board was bent"


def test_the_report_holds_every_corner(noisy: IntrinsicsResult) -> None:
    assert len(noisy.views) == 15 and noisy.views[0].source == "view01" and noisy.views[0].corners == 54
    assert noisy.field.residuals.shape == (15 * 54, 2)
    assert noisy.field.count.sum() == 15 * 54
    assert noisy.field.pattern_px < 0.02
    per_view = [np.sqrt(np.mean(np.sum(noisy.field.residuals[noisy.field.view == i] ** 2, axis=1))) for i in range(15)]
    np.testing.assert_allclose(per_view, [view.rms_px for view in noisy.views])
    lens = noisy.intrinsics
    assert (lens.width, lens.height, lens.fx) == (640, 480, noisy.lens[0])


def test_square_pixels_are_square() -> None:
    report = solve(twin_views(np.random.default_rng(5), noise_px=NOISE_PX), BOARD, square_pixels=True)
    assert report.lens[0] == pytest.approx(report.lens[1], rel=1e-12)
    assert report.std[0] == report.std[1]


def test_a_bent_board_is_straightened() -> None:
    points = BOARD.object_points()
    bend = np.zeros_like(points)
    bend[:, 2] = 0.4e-3 * ((points[:, 1] / 0.075 - 1.0) ** 2 - 0.4)
    bend[:, :2] = np.random.default_rng(9).normal(0.0, 0.05e-3, (len(points), 2))
    views = twin_views(np.random.default_rng(6), noise_px=NOISE_PX, board_errors=bend)
    report = solve(views, BOARD)
    assert report.rms_px < 1.3 * NOISE_PX * np.sqrt(2)
    assert np.all(np.abs(report.lens - LENS) <= 3.5 * report.std)
    assert report.board_errors is not None
    found = report.board_errors.places
    assert np.std(found[:, 2] - bend[:, 2]) < 0.4 * np.std(bend[:, 2])
    assert "board_errors" in report.verdict.codes


def test_a_view_that_does_not_fit_is_left_out_and_explained() -> None:
    views = twin_views(np.random.default_rng(5), noise_px=NOISE_PX)
    mixed = views[3].pixels.reshape(6, 9, 2)[:, ::-1].copy()
    mixed[2:] += 9.0
    views[3] = replace(views[3], pixels=mixed.reshape(-1, 2))
    views[7] = replace(views[7], pixels=views[7].pixels + np.random.default_rng(1).normal(0, 1.2, (54, 2)), blur_px=4.0)
    report = solve(views, BOARD)
    reasons = {each.name: each.reason for each in report.dropped}
    assert set(reasons) == {"view04", "view08"}
    assert "mixed up" in reasons["view04"] and "blurred" in reasons["view08"]
    assert np.all(np.abs(report.lens - LENS) <= 3.5 * report.std)


def test_part_of_a_charuco_board_counts() -> None:
    board = CharucoBoard(10, 7, 0.03, 0.022)
    random = np.random.default_rng(4)
    views = []
    for view in twin_views(random, board=board, noise_px=NOISE_PX):
        kept = np.sort(random.choice(board.count, 30, replace=False))
        views.append(replace(view, pixels=view.pixels[kept], ids=view.ids[kept]))
    report = solve(views, board)
    assert np.all(np.abs(report.lens - LENS) <= 3.5 * report.std)
    assert report.views[0].corners == 30


def flat_view(depth: float, x: float = 0.0):
    return seen(corners_px(BOARD, pose((0.0, 0.0, 0.0), (x, 0.0, depth), BOARD), LENS), BOARD)


@pytest.mark.parametrize("views", [[flat_view(0.6)] * 8, [flat_view(0.6, 0.01 * i) for i in range(8)],
                                   [flat_view(0.4 + 0.03 * i) for i in range(8)]],
                         ids=["the same view", "all face on, aside", "all face on, nearer and farther"])
def test_views_all_alike_are_no_calibration(views) -> None:
    random = np.random.default_rng(0)
    noisy = [replace(view, pixels=view.pixels + random.normal(0, NOISE_PX, (54, 2))) for view in views]
    report = solve(noisy, BOARD)
    assert not report.verdict.acceptable and "alike" in report.verdict.codes
    assert np.isfinite(report.lens).all() and np.isfinite(report.std).all()


def test_few_views_and_little_coverage_are_said() -> None:
    views = [view for view in twin_views(np.random.default_rng(8), count=60, noise_px=NOISE_PX)
             if np.ptp(view.pixels[:, 0]) < 220][:3]
    report = solve(views, BOARD)
    assert {"few_views", "coverage"} <= report.verdict.codes and not report.verdict.acceptable


def test_too_few_views_are_a_sentence() -> None:
    with pytest.raises(CalibrationError, match="3 are the least"):
        solve(twin_views(np.random.default_rng(1), count=2), BOARD)
    views = twin_views(np.random.default_rng(1), count=4)
    with pytest.raises(CalibrationError, match="different sizes"):
        solve([*views, replace(views[0], width=320, height=240)], BOARD)


def test_noise_instead_of_corners_is_not_usable() -> None:
    random = np.random.default_rng(2)
    views = [seen(random.uniform(20, 460, (54, 2)), BOARD) for _ in range(6)]
    try:
        report = solve(views, BOARD)
    except CalibrationError:
        return
    assert not report.verdict.acceptable and np.isfinite(report.lens).all()


def test_work_can_be_watched_and_stopped() -> None:
    shown: list[float] = []
    solve(twin_views(np.random.default_rng(1), count=6), BOARD, progress=lambda text, done: shown.append(done))
    assert shown == sorted(shown) and shown[-1] > 0.9

    def stop(text: str, done: float) -> None:
        if done > 0.1:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        solve(twin_views(np.random.default_rng(1), count=6), BOARD, progress=stop)


def test_certainty_in_millimetres_is_what_lenses_from_the_covariance_do(noisy: IntrinsicsResult) -> None:
    """A wrong principal point is nearly a turn of the camera; a wrong focal length is felt at the rim."""
    tenth = np.zeros((12, 12))
    tenth[2, 2] = 4.0
    turned = expected_errors(LENS, tenth, (640, 480), 0.6)
    assert turned.typical_m < 0.6 * 2.0 / LENS[0] / 3
    focal = np.zeros((12, 12))
    focal[0, 0] = focal[1, 1] = focal[0, 1] = focal[1, 0] = (0.01 * LENS[0]) ** 2
    stretched = expected_errors(full_lens(LENS[:4]), focal, (640, 480), 0.6)
    corner = np.hypot(322.3 / 535, 238.1 / 535)
    assert stretched.map_m[0, 0] == pytest.approx(0.01 * 0.6 * corner / (1.0 + corner**2), rel=0.35)
    assert stretched.map_m.shape == (12, 16)


def test_the_residual_field_shows_a_pattern_and_no_noise() -> None:
    random = np.random.default_rng(3)
    places = random.uniform(0, [640, 480], (2000, 2))
    noise = random.normal(0, 0.1, (2000, 2))
    view = np.zeros(2000, np.intp)
    assert residual_field(places, noise, view, (640, 480)).pattern_px < 0.02
    swirl = 0.001 * (places - [320, 240])[:, ::-1] * [1, -1]
    assert residual_field(places, noise + swirl, view, (640, 480)).pattern_px > 0.1
