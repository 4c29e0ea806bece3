"""What is told of how well a hand is known, which is not quite what the filter works with."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from known_hand import MARKERS, RIG, WEARING, moving_estimate, next_frame, placed
from msgspec.structs import replace

from rhot_app.tracking.kalman.estimate import (
    ANGLES,
    BIAS,
    FREE,
    GOES_ON,
    LOOK_VARIANCE,
    PALM_HELD,
    PLACED,
    POSE,
    ROTATION,
    SCALE,
    TURN_HELD,
    Estimate,
)
from rhot_app.tracking.kalman.wearing import compile_wearing
from rhot_app.tracking.known import COMMON, TOLD, empty_sheet, fill_known, tell_of_habit, tell_of_open

ANY_HABIT = np.full(POSE, 1e9)
PAINT = WEARING.bias_variance / 16.0
INDEX = WEARING.roles.index("index_tip")
LOST_FOCUS_PX = 100.0


def told(estimate: Estimate, paint: np.ndarray = PAINT, usual: np.ndarray = ANY_HABIT) -> np.ndarray:
    out = np.empty((TOLD, TOLD))
    fill_known(estimate, WEARING.cameras, paint, WEARING.bias_variance, empty_sheet(MARKERS), out)
    tell_of_open(estimate, usual, out)
    return out


def worked_with(estimate: Estimate) -> np.ndarray:
    """(28, 28) of pose and size in the filter's covariance."""
    chosen = [*range(POSE), SCALE]
    return estimate.covariance[np.ix_(chosen, chosen)]


def seen_sharply(stated_px: float = 0.04) -> Estimate:
    """A hand before the cameras whose markers' biases go with its pose, all seen with the same standard deviation."""
    estimate = moving_estimate()
    estimate.bias_variance[:] = WEARING.bias_variance
    estimate.looks[:, :, LOOK_VARIANCE] = stated_px**2
    return estimate


def lit(estimate: Estimate, stated_px: float) -> float:
    """How far light moves a marker's middle, m^2: a pixel's width at the palm."""
    depth = [pose[2] @ [*estimate.world[:3, 3], 1.0] for pose in WEARING.cameras.pose]
    return max((COMMON * stated_px * z / f) ** 2 for z, f in zip(depth, WEARING.cameras.intrinsics[:, 0], strict=True))


def test_what_is_told_is_a_measurement_of_the_biases_by_what_paint_and_light_do():
    estimate = seen_sharply()
    chosen, biases = [*range(POSE), SCALE], np.arange(BIAS, BIAS + 3 * MARKERS)
    told_bias = np.repeat(PAINT + lit(estimate, 0.04), 3)
    worked = np.repeat(WEARING.bias_variance, 3)
    assert (told_bias < worked).all()
    measured = np.diag(1.0 / (1.0 / told_bias - 1.0 / worked))
    cross = estimate.covariance[np.ix_(chosen, biases)]
    expected = worked_with(estimate) - cross @ np.linalg.solve(
        estimate.covariance[np.ix_(biases, biases)] + measured, cross.T)
    np.testing.assert_allclose(told(estimate), expected, rtol=1e-9, atol=1e-12)


def test_a_fingertip_in_plain_view_is_told_to_be_known_better_than_the_filter_takes_it_to_be():
    estimate, _ = next_frame()
    estimate.looks[:, :, LOOK_VARIANCE] = 0.03**2
    estimate.left_open[:] = 0.0
    jacobian = placed(estimate)[1][INDEX]
    before, after = (jacobian @ known[:POSE, :POSE] @ jacobian.T
                     for known in (worked_with(estimate), told(estimate)))
    assert np.linalg.eigvalsh(before - after).min() > -1e-12
    smallest = [np.sqrt(np.linalg.eigvalsh(known)[0]) for known in (before, after)]
    assert smallest[1] < 0.8 * smallest[0]
    assert smallest[1] > np.sqrt(PAINT[INDEX])


@pytest.mark.parametrize("unknown", ["shape", "light", "blurred"])
def test_where_nobody_knows_what_paint_does_all_that_the_filter_doubts_is_told(unknown):
    estimate = seen_sharply()
    paint = PAINT
    if unknown == "shape":
        paint = np.full(MARKERS, np.inf)
    else:
        estimate.looks[:, :, LOOK_VARIANCE] = 0.0 if unknown == "light" else LOST_FOCUS_PX**2
    np.testing.assert_array_equal(told(estimate, paint), worked_with(estimate))


def test_only_shapes_that_were_measured_have_paint_that_is_known():
    for shape, known in (("capsule", True), ("sphere", False)):
        markers = tuple(replace(marker, shape=shape, radius_mm=8.0) for marker in RIG.markers.markers)
        wearing = compile_wearing(replace(RIG, markers=replace(RIG.markers, markers=markers)))
        assert np.isfinite(wearing.paint_variance).tolist() == [known] * MARKERS
        assert (wearing.paint_variance < wearing.bias_variance).all() or not known


@pytest.mark.parametrize(("how", "nothing_more"),
                         [(FREE, False), (TURN_HELD, False), (PLACED, True), (PALM_HELD, True), (GOES_ON, True)])
def test_of_a_palm_that_its_own_markers_do_not_place_nothing_is_told_but_what_the_filter_knows(how, nothing_more):
    estimate = seen_sharply()
    estimate.left_open[:] = 0.0
    estimate.held[0] = how
    usual = np.full(POSE, 1e-5)
    assert (np.diag(estimate.covariance)[:POSE] > usual).all()
    assert np.array_equal(told(estimate, usual=usual), worked_with(estimate)) == nothing_more


@pytest.mark.parametrize("how", [FREE, TURN_HELD])
def test_a_palm_that_only_fingers_show_is_told_to_be_turned_no_better_known_than_habit_leaves_it(how):
    estimate = moving_estimate()
    estimate.held[0] = how
    before = told(estimate)
    estimate.left_open[:] = np.diag(np.linspace(1.0, 2.0, POSE))
    estimate.left_open[ROTATION:ANGLES, ROTATION:ANGLES] = np.diag(np.linspace(2.0, 4.0, 3)) * turn(before)
    added = told(estimate) - before
    assert turn(before + added) == pytest.approx(turn(estimate.left_open), rel=1e-9)
    np.testing.assert_allclose(added[:POSE, :POSE], added[0, 0] * estimate.left_open, rtol=1e-9, atol=1e-15)
    assert not added[POSE].any()


def test_a_palm_that_is_known_no_better_than_habit_leaves_it_is_told_as_it_is():
    estimate = moving_estimate()
    before = told(estimate)
    estimate.left_open[:] = 0.99 * turn(before) / 3.0 * np.eye(POSE)
    np.testing.assert_array_equal(told(estimate), before)


def turn(known: np.ndarray) -> float:
    """How little is known of the palm's turn, rad^2: its variances together."""
    return float(np.trace(known[ROTATION:ANGLES, ROTATION:ANGLES]))


@given(seed=st.integers(0, 2**32 - 1), column=st.integers(0, 5), usual=st.floats(1e-3, 10.0))
def test_telling_of_habit_adds_knowledge_and_takes_none_away(seed, column, usual):
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(6, 6))
    known = rng.normal(size=6)
    known /= np.linalg.norm(known)
    root -= 0.999 * np.outer(known, known @ root)  # this combination is known well
    before = root @ root.T
    after = before.copy()
    tell_of_habit(after, column, usual)
    assert after[column, column] <= usual * (1 + 1e-9) or after[column, column] == before[column, column]
    assert np.linalg.eigvalsh(before - after).min() > -1e-9 * np.trace(before)
    assert np.linalg.eigvalsh(after).min() > -1e-9 * np.trace(before)
    assert known @ after @ known <= known @ before @ known + 1e-9 * np.trace(before)
