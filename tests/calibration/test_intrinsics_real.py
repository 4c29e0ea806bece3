"""The lens of a real camera, held against what others published for the same pictures."""

from __future__ import annotations

import numpy as np
import pytest
from stereo_pictures import BOARD, NUMBERS, needs_pictures, views_of

from rhot_app.calibration.lens.intrinsics import IntrinsicsResult, solve
from rhot_app.geometry.camera import PLAIN

pytestmark = needs_pictures


@pytest.fixture(scope="module")
def left() -> IntrinsicsResult:
    """The left camera, 13 views (all but 10), square pixels."""
    views = [view for number, view in zip(NUMBERS, views_of("left"), strict=True) if number != 10]
    return solve([view for view in views if view is not None], BOARD, square_pixels=True)


def test_the_left_camera_is_as_published(left: IntrinsicsResult) -> None:
    fx, fy, cx, cy = left.lens[:4]
    assert fx == fy == pytest.approx(535.9, abs=2.0)
    assert cx == pytest.approx(342.3, abs=3.0)
    assert cy == pytest.approx(235.6, abs=3.0)
    assert left.rms_px <= 0.40
    assert len(left.views) == 13 and not left.dropped


def test_it_is_better_than_published(left: IntrinsicsResult) -> None:
    assert left.rms_px < 0.09
    assert left.std[0] < 0.6 and left.std[2:4].max() < 0.7
    assert left.verdict.acceptable
    assert left.errors.typical_m < 1.0e-3


def test_halves_of_the_views_agree_within_what_is_stated() -> None:
    """The scatter of the corners alone would put them 3 to 4 standard deviations apart."""
    views = [view for view in views_of("left") if view is not None]
    first, second = solve(views[:7], BOARD), solve(views[7:], BOARD)
    apart = (first.lens - second.lens)[:PLAIN] / np.hypot(first.std, second.std)[:PLAIN]
    assert np.sqrt(np.mean(apart**2)) < 2.0
    assert min(first.error_inflation, second.error_inflation) > 1.5


def test_two_cameras_find_the_same_board() -> None:
    """Each camera's views alone say how the board is bent and printed; they agree to hundredths of a millimetre."""
    shapes = []
    for camera in ("left", "right"):
        report = solve([view for view in views_of(camera) if view is not None], BOARD)
        assert report.board_errors is not None
        shapes.append(report.board_errors.places)
    assert np.std(shapes[0], axis=0).max() > 0.07e-3
    assert np.std(shapes[0] - shapes[1], axis=0).max() < 0.03e-3
