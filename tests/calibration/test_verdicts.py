"""What all verdicts have in common, and single checks of which no other test gives a bad input."""

from __future__ import annotations

from dataclasses import replace

import msgspec
import numpy as np
import pytest
from intrinsics_twin import BOARD, twin_views
from stereo_twin import LENSES, RIGHT_FROM_LEFT, SIZE, Twin, stereo_twin
from synthetic_rig import make_rig

from rhot_app.calibration.board.boards import Chessboard
from rhot_app.calibration.board.corners import BoardView
from rhot_app.calibration.board.shared_views import BoardShot, SharedViews
from rhot_app.calibration.lens.fit import LensStart
from rhot_app.calibration.lens.intrinsics import solve
from rhot_app.calibration.stereo.calibrate import calibrate, rig_findings
from rhot_app.calibration.stereo.ruler import RulerResult, ruler_finding
from rhot_app.calibration.verdict import Grade, Verdict, told_apart
from rhot_app.estimation.se3 import exp_so3
from rhot_app.geometry.camera import full_lens
from rhot_app.geometry.transforms import rigid


@pytest.mark.parametrize(("value", "limit", "decimals", "text"), [
    (0.34, 0.3, 1, "0.34"), (0.3000001, 0.3, 1, "0.300000"), (0.4, 0.3, 1, "0.4"), (54.96, 55.0, 0, "54.96"),
    (3.2, 3.2, 1, "3.2"), (float("inf"), 1.0, 1, "inf")])
def test_a_figure_is_never_printed_like_the_limit_that_it_exceeds(value: float, limit: float, decimals: int,
                                                                  text: str) -> None:
    assert told_apart(value, limit, decimals) == text


@pytest.mark.parametrize(("measured_m", "std_m", "code", "grade"), [
    (0.300, 0.001, "ruler", Grade.GOOD), (0.310, 0.001, "square_size", Grade.POOR),
    (0.304, 0.0005, "square_size", Grade.FAIR), (0.300, 0.02, "ruler_vague", Grade.FAIR),
    (0.330, 0.02, "ruler_vague", Grade.FAIR)])
def test_a_ruler_that_could_not_say_no_confirms_nothing(measured_m: float, std_m: float, code: str,
                                                        grade: Grade) -> None:
    result = RulerResult(0.3, measured_m, std_m)
    finding = ruler_finding(result, 0.03)
    assert (finding.code, finding.grade) == (code, grade) and result.tells == (code != "ruler_vague")


# -- lenses ------------------------------------------------------------------------------------------------------------

SMALL = Chessboard(9, 6, 0.006)
MIDDLE = Chessboard(9, 6, 0.012)


def lens_verdict(views: list[BoardView], board: Chessboard = BOARD) -> Verdict:
    return solve(views, board).verdict


def seen(seed: int = 5, **options: object) -> list[BoardView]:
    return twin_views(np.random.default_rng(seed), **{"noise_px": 0.05, **options})  # type: ignore[arg-type]


def waved(amplitude_px: float) -> list[BoardView]:
    """Seen through a picture that a program has warped."""
    return [replace(view, pixels=view.pixels + amplitude_px * np.column_stack(
        [np.sin(view.pixels[:, 1] / 40.0), np.sin(view.pixels[:, 0] / 50.0)])) for view in seen(count=20)]


def in_the_middle(lens: np.ndarray, reach_px: float) -> list[BoardView]:
    """Twelve views of a small board, all of them in the middle of the picture."""
    views: list[BoardView] = []
    for seed in range(1000):
        views += [view for view in seen(seed, board=MIDDLE, lens=lens)
                  if np.abs(view.pixels - [320.0, 240.0]).max() < reach_px]
        if len(views) >= 12:
            return views[:12]
    raise AssertionError("the board is never in the middle")


def test_good_views_of_a_good_lens_are_good() -> None:
    assert lens_verdict(seen()).codes == frozenset()


@pytest.mark.parametrize(("cx", "grade"), [(420.0, Grade.FAIR), (520.0, Grade.POOR)])
def test_a_cropped_picture_is_said(cx: float, grade: Grade) -> None:
    verdict = lens_verdict(seen(lens=full_lens([535.0, 535.0, cx, 238.0, -0.1, 0.02, 0.0, 0.0])))
    assert verdict.codes == {"off_centre"} and verdict.grade is grade


def test_a_picture_scaled_in_one_direction_is_said() -> None:
    verdict = lens_verdict(seen(lens=full_lens([535.0, 550.0, 320.0, 238.0, -0.1, 0.02, 0.0, 0.0])))
    assert verdict.codes == {"not_square"} and verdict.grade is Grade.FAIR


def test_a_warped_picture_is_said() -> None:
    assert "pattern" in lens_verdict(waved(0.6)).codes
    assert "pattern" not in lens_verdict(waved(0.0)).codes


def test_a_board_of_tiny_squares_is_said() -> None:
    verdict = lens_verdict(seen(board=SMALL), SMALL)
    assert {"small_squares", "open_distortion"} <= verdict.codes and verdict.grade is not Grade.GOOD


@pytest.mark.parametrize(("options", "grade"), [({"noise_px": 1.0}, Grade.FAIR),
                                                ({"noise_px": 0.3, "tilt": 0.1, "count": 10}, Grade.POOR)])
def test_views_that_leave_the_lens_open_are_said(options: dict[str, float], grade: Grade) -> None:
    verdict = lens_verdict(seen(**options))
    assert {"focal_length", "principal_point", "expected_error"} <= verdict.codes and verdict.grade is grade


def test_a_lens_without_rays_for_most_of_the_picture_is_refused() -> None:
    verdict = lens_verdict(in_the_middle(full_lens([535.0, 535.0, 320.0, 240.0, -2.0, 0.0, 0.0, 0.0]), 110.0), MIDDLE)
    assert {"blind", "expected_error"} <= verdict.codes and not verdict.acceptable


# -- cameras together --------------------------------------------------------------------------------------------------


def stereo_verdict(views: SharedViews, lenses: list[LensStart]) -> Verdict:
    return calibrate(views, lenses).verdict


def test_a_camera_that_is_loose_makes_no_rig() -> None:
    twin, rng = stereo_twin(), np.random.default_rng(3)
    assert stereo_verdict(twin.views(rng, 0.1), twin.starts()).codes == {"lengths_unproven"}
    shots = []
    for number, board in enumerate(twin.world_from_board[:12]):
        shaken = RIGHT_FROM_LEFT @ rigid(exp_so3(rng.normal(0.0, 0.15, 3)), rng.normal(0.0, 0.03, 3))
        moment = Twin(twin.names, twin.board, LENSES, np.array([np.eye(4), shaken]), board[None])
        shots.append(BoardShot(f"{number:02d}", moment.views(rng, 0.1).shots[0].views))
    verdict = stereo_verdict(SharedViews(twin.names, twin.board, tuple(shots)), twin.starts())
    assert "incoherent" in verdict.codes and not verdict.acceptable


def test_a_board_that_stretched_is_said() -> None:
    twin = stereo_twin()
    points = twin.board.object_points()
    stretched = replace(twin, board_errors_m=points * [0.02, -0.02, 0.0])
    assert "squares" in stereo_verdict(stretched.views(np.random.default_rng(0), 0.1), twin.starts()).codes


def test_a_camera_that_took_no_part_is_named() -> None:
    rig = make_rig()
    third = msgspec.structs.replace(rig.nodes[0], node_id=3, name="third", udp_port=47991)
    three = msgspec.structs.replace(rig, nodes=(*rig.nodes, third))
    cameras = [node.name for node in rig.nodes]
    found = {finding.code: finding.sentence for finding in rig_findings(three, cameras)}
    assert "third" in found["not_calibrated"]
    assert "not_calibrated" not in {finding.code for finding in rig_findings(rig, cameras)}


def test_noisy_views_of_unknown_lenses_are_uncertain() -> None:
    twin = stereo_twin()
    unknown = [LensStart(lens.copy(), SIZE, None, "views") for lens in twin.lenses]
    assert "uncertain" in stereo_verdict(twin.views(np.random.default_rng(0), 0.5), unknown).codes
    assert "uncertain" not in stereo_verdict(twin.views(np.random.default_rng(0), 0.05), unknown).codes
