"""The residuals of markers, and how an estimate is displaced."""

import numpy as np
import pytest
from known_hand import MARKERS, SIZE, WEARING, blocks, difference, empty, moved, moving_estimate, twin

from rhot_app.tracking.kalman.estimate import ACCELERATION, BIAS, POSE, SCALE, VELOCITY
from rhot_app.tracking.kalman.marker_block import MarkerBlock
from rhot_app.tracking.kalman.rows import PALM_PART, Page, empty_rows
from rhot_app.tracking.kalman.share import Share

STEP = 1e-6


def residuals(block, estimate):
    rows = empty_rows(SIZE)
    block.linearise(Share(Page(estimate, rows)))
    return rows


def test_jacobian_is_the_change_of_what_is_expected_in_every_direction():
    block, estimate = blocks()[1], moving_estimate()
    assert np.ptp(block.frame.late_s) > 2e-3  # rows of a rolling shutter
    rows = residuals(block, estimate)
    count = rows.used[0]
    assert count == 2 * MARKERS
    numeric = np.empty((count, SIZE))
    for k in range(SIZE):
        step = np.zeros(SIZE)
        step[k] = STEP
        ahead, behind = (residuals(block, moved(estimate, sign * step)).residual[:count] for sign in (1.0, -1.0))
        numeric[:, k] = (behind - ahead) / (2.0 * STEP)
    analytic = rows.jacobian[:count]
    for part in (slice(0, 3), slice(3, POSE), slice(VELOCITY, ACCELERATION), slice(ACCELERATION, SCALE),
                 slice(SCALE, BIAS), slice(BIAS, SIZE)):
        largest = np.abs(numeric[:, part]).max()
        assert largest > 0.0
        assert np.abs(analytic - numeric)[:, part].max() < 2e-3 * largest


def test_rows_say_what_they_are_of():
    block, estimate = blocks()[0], moving_estimate()
    block.frame.label[:2] = 1, 0
    rows = residuals(block, estimate)
    count = rows.used[1]
    np.testing.assert_array_equal(rows.first[:count + 1], 2 * np.arange(count + 1))
    np.testing.assert_array_equal(rows.source[:count], [
        (block.observations.camera, sight, marker) for sight, marker in enumerate((1, 0, 2, 3, 4, 5))])
    assert rows.part[0] == 1 and rows.part[1] == 0 and rows.part[5] == PALM_PART
    assert (rows.noise[:2 * count, 0] >= np.repeat(block.frame.covariances[:, 0, 0], 2)).all()
    assert np.abs(rows.jacobian[:2, BIAS + 3:BIAS + 6]).max() > 100.0  # the sight labelled 1 moves with bias 1
    assert not rows.jacobian[:2, BIAS:BIAS + 3].any()


def test_a_lost_marker_has_no_rows():
    frame = blocks()[0].observations
    frame.pixels[2] = np.nan
    block = MarkerBlock(WEARING, frame)
    rows = residuals(block, moving_estimate())
    assert block.sights == MARKERS - 1 and rows.used[1] == MARKERS - 1
    assert 2 not in rows.source[:rows.used[1], 1]


def test_a_frame_told_of_as_of_another_instant_expects_a_hand_that_has_moved_on_to_look_the_same():
    block, estimate, later_s = blocks()[1], moving_estimate(), 5e-3
    estimate.acceleration[:] = 0.0
    late_s, t_ns, step = block.frame.late_s.copy(), block.t_ns, np.zeros(SIZE)
    step[:POSE] = later_s * estimate.velocity
    other = block.as_of(t_ns + round(1e9 * later_s))
    assert other.t_ns - t_ns == 5_000_000 and other.camera == block.camera
    rows, expected = residuals(other, moved(estimate, step)), residuals(block, estimate)
    np.testing.assert_allclose(rows.residual[:12], expected.residual[:12], atol=0.05)
    assert np.abs(residuals(block, moved(estimate, step)).residual[:12] - expected.residual[:12]).max() > 1.0
    other.frame.label[:2] = 1, 0
    assert block.frame.label[0] == 1  # what is decided about one is decided about both
    np.testing.assert_array_equal(block.frame.late_s, late_s)
    assert block.t_ns == t_ns


def test_a_frame_without_sights_is_of_its_middle_row():
    frame = blocks()[0].observations
    frame.pixels[:] = np.nan
    block = MarkerBlock(WEARING, frame)
    assert block.sights == 0
    assert block.t_ns == pytest.approx(frame.t_row0_master_ns + 239.5 * frame.row_time_ns, abs=2 * frame.row_time_ns)


def test_displacing_adds_a_step_and_the_difference_gives_it_back():
    estimate, step = moving_estimate(), 0.1 * np.random.default_rng(2).normal(size=SIZE)
    there = moved(estimate, step)
    np.testing.assert_allclose(difference(there, estimate), step, atol=1e-9)
    np.testing.assert_allclose(there.world[:3, :3] @ there.world[:3, :3].T, np.eye(3), atol=1e-12)


def test_a_copy_is_whole_and_its_own():
    estimate = moving_estimate()
    for array in estimate:
        array += 1 if array.dtype == np.int64 else 0.01
    other = twin(estimate)
    for field, source, target in zip(estimate._fields, estimate, other, strict=True):
        np.testing.assert_array_equal(source, target, err_msg=field)
        assert not np.shares_memory(source, target)
    assert [array.shape for array in empty()] == [array.shape for array in estimate]
