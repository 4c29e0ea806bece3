"""Joint limits as constraints on a step."""

import numpy as np
import pytest
from known_hand import SIZE, WEARING, moving_estimate

from rhot_app.tracking.kalman.estimate import ANGLES, POSE, VELOCITY
from rhot_app.tracking.kalman.gain import contract, empty_gain
from rhot_app.tracking.kalman.limits import FASTEST_RAD_S, project

LIMITS, NO_GAINS = WEARING.limits, np.empty((0, SIZE))
SMALL = 1e-8  # rad


def within(angles, step):
    values = angles + step[ANGLES:POSE]
    return (values >= LIMITS[:, 0] - SMALL).all() and (values <= LIMITS[:, 1] + SMALL).all()


def projected(estimate, step, gains=NO_GAINS):
    out = step.copy()
    project(estimate.angles, estimate.velocity, estimate.covariance, gains, LIMITS, out)
    return out


@pytest.mark.parametrize("seed", range(4))
def test_limits_are_kept_exactly_whatever_the_step(seed):
    estimate = moving_estimate(seed)
    step = np.random.default_rng(seed).normal(size=SIZE)
    assert not within(estimate.angles, step)
    assert within(estimate.angles, projected(estimate, step))


def test_a_step_within_the_limits_is_not_touched():
    estimate = moving_estimate()
    estimate.angles[:] = LIMITS.mean(axis=1)
    step = 0.01 * np.random.default_rng(0).normal(size=SIZE)
    np.testing.assert_array_equal(projected(estimate, step), step)


@pytest.mark.parametrize("speed", [-40.0, -FASTEST_RAD_S, 11.9, 15.0])
def test_a_finger_bends_no_faster_than_fingers_do_and_is_where_that_leaves_it(speed):
    estimate, joint = moving_estimate(), 6
    estimate.angles[:], estimate.velocity[:] = LIMITS.mean(axis=1), 0.0
    estimate.covariance[:] = 1e-2 * np.eye(SIZE)
    at, fast = ANGLES + joint, VELOCITY + ANGLES + joint
    estimate.covariance[at, fast] = estimate.covariance[fast, at] = 1e-4
    step = np.zeros(SIZE)
    step[fast] = speed
    end, kept = projected(estimate, step), np.clip(speed, -FASTEST_RAD_S, FASTEST_RAD_S)
    assert end[fast] == kept and end[at] == pytest.approx(0.01 * (kept - speed))
    np.testing.assert_array_equal(np.delete(end, [at, fast]), 0.0)


def test_the_correction_goes_where_least_is_known():
    """A direction that was measured well hardly moves; one that is known badly and goes with the angle does."""
    estimate = moving_estimate()
    estimate.angles[:] = LIMITS.mean(axis=1)
    at, sharp, loose = ANGLES + 6, ANGLES + 7, ANGLES + 10
    covariance = np.diag(np.full(SIZE, 1e-2))
    covariance[sharp, sharp] = 1e-8
    covariance[at, sharp] = covariance[sharp, at] = 0.5e-5
    covariance[at, loose] = covariance[loose, at] = 5e-3
    estimate.covariance[:] = covariance
    step = np.zeros(SIZE)
    step[at] = LIMITS[6, 1] - estimate.angles[6] + 0.1
    end = projected(estimate, step)
    assert end[at] == pytest.approx(step[at] - 0.1, abs=1e-9)
    assert end[loose] == pytest.approx(-0.05, abs=1e-6)
    assert abs(end[sharp]) < 1e-4
    untouched = np.delete(np.arange(SIZE), [at, sharp, loose, VELOCITY + at])
    np.testing.assert_allclose(end[untouched], 0.0, atol=1e-9)


def test_gains_count_as_if_the_covariance_were_contracted_already():
    estimate = moving_estimate()
    rng = np.random.default_rng(1)
    gain = empty_gain(3, SIZE)
    gain.used[1], gain.rows[:3] = 3, 2e-3 * rng.normal(size=(3, SIZE))
    step = 0.3 * rng.normal(size=SIZE)
    ahead = projected(estimate, step, gain.rows[:3])
    contract(estimate.covariance, gain)
    np.testing.assert_allclose(ahead, projected(estimate, step), atol=1e-9)


def test_a_joint_at_its_limit_does_not_move_on():
    estimate = moving_estimate()
    estimate.angles[:], estimate.velocity[:] = LIMITS.mean(axis=1), 0.0
    estimate.velocity[ANGLES + 6] = 4.0
    estimate.covariance[:] = np.diag(np.full(SIZE, 1e-2))
    step = np.zeros(SIZE)
    step[ANGLES + 6] = LIMITS[6, 1] - estimate.angles[6] + 0.1
    end = projected(estimate, step)
    assert estimate.velocity[ANGLES + 6] + end[VELOCITY + ANGLES + 6] == pytest.approx(0.0, abs=1e-9)
    estimate.velocity[ANGLES + 6] = -4.0
    assert projected(estimate, step)[VELOCITY + ANGLES + 6] == pytest.approx(0.0, abs=1e-9)
