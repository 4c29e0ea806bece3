"""How far the shots disagree: nothing where corners err by themselves, a lot where the board bends in every picture."""

from __future__ import annotations

import numpy as np
import pytest
from board_rendering import LENS
from intrinsics_twin import BOARD, twin_views
from stereo_twin import stereo_twin

from rhot_app.calibration.board.corners import BoardView
from rhot_app.calibration.bundle.robust_error import in_words, what_is_reported
from rhot_app.calibration.lens.intrinsics import IntrinsicsResult, solve
from rhot_app.calibration.stereo.calibrate import calibrate
from rhot_app.geometry.camera import PLAIN

SHEET = BOARD.object_points()[:, :2] / BOARD.object_points().max()


def bending(seed: int) -> list[BoardView]:
    """Views of a sheet that is curved by a millimetre, otherwise in each."""
    random = np.random.default_rng([seed, 3])
    views: list[BoardView] = []
    for _ in range(14):
        along, across, twist = random.normal(0.0, 2e-3, 3)
        x, y = SHEET.T
        errors = np.column_stack([0 * x, 0 * x, along * x * x + across * y * y + twist * x * y])
        views += twin_views(random, count=1, noise_px=0.05, board_errors=errors)
    return views


@pytest.fixture(scope="module")
def bent() -> list[IntrinsicsResult]:
    return [solve(bending(seed), BOARD) for seed in range(3)]


def test_independent_errors_are_no_disagreement() -> None:
    found = [solve(twin_views(np.random.default_rng(seed), noise_px=0.1), BOARD).error_inflation for seed in range(2)]
    assert min(found) >= 1.0 and max(found) < 1.3
    figures = calibrate(stereo_twin().views(np.random.default_rng(0), 0.1), stereo_twin().starts()).figures
    assert figures is not None and figures.error_inflation < 1.5


def test_a_board_that_bends_in_every_picture_is_noticed(bent: list[IntrinsicsResult]) -> None:
    assert min(report.error_inflation for report in bent) > 1.5
    assert "bends from picture to picture" in in_words(bent[0].error_inflation)
    assert "apart" in what_is_reported(bent[0].error_inflation) and "apart" not in what_is_reported(1.1)


def test_what_is_stated_then_holds(bent: list[IntrinsicsResult]) -> None:
    off = np.concatenate([(report.lens - LENS)[:PLAIN] / report.std[:PLAIN] for report in bent])
    by_corners = np.concatenate([each * report.error_inflation
                                 for each, report in zip(off.reshape(-1, PLAIN), bent, strict=True)])
    assert np.sqrt(np.mean(off**2)) < 1.8
    assert np.sqrt(np.mean(by_corners**2)) > 2.5
