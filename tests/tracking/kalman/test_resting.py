"""What is held of a hand comes to rest, and its size is held beside all else."""

import numpy as np
import pytest
from known_hand import moving_estimate, twin

from rhot_app.tracking.kalman.estimate import (
    ACCELERATION,
    BIAS,
    FIRST_FINGER,
    FREE,
    LINEAR,
    PALM_HELD,
    PLACED,
    SCALE,
    TURN,
    TURN_HELD,
    VELOCITY,
)
from rhot_app.tracking.kalman.gain import MOST_HELD
from rhot_app.tracking.kalman.holding import ARRIVE_S, HURRIES_M_S, REST_S, hold_size, rest
from rhot_app.tracking.kalman.withholding import empty_held

NOWHERE = np.zeros(3)


def rested(how, dt=0.0125, sight=NOWHERE):
    before = moving_estimate()
    before.held[0], before.agitation[:] = how, 1.0
    after = twin(before)
    rest(after, sight, dt)
    return before, after


def test_a_turn_that_is_held_comes_to_rest_and_its_covariance_with_it():
    before, after = rested(TURN_HELD)
    share = np.exp(-0.0125 / REST_S)
    slower = np.ones(len(before.covariance))
    slower[[*range(VELOCITY + 3, VELOCITY + 6), *range(ACCELERATION + 3, ACCELERATION + 6)]] = share
    np.testing.assert_allclose(after.velocity, slower[VELOCITY:ACCELERATION] * before.velocity)
    np.testing.assert_allclose(after.acceleration, slower[VELOCITY:ACCELERATION] * before.acceleration)
    np.testing.assert_allclose(after.covariance, before.covariance * np.outer(slower, slower), atol=1e-15)
    assert after.agitation[TURN] == 0.0 and after.agitation[LINEAR] == 1.0
    assert (after.agitation[FIRST_FINGER:] == 1.0).all()
    twice = rested(TURN_HELD, 0.00625)[1]
    rest(twice, NOWHERE, 0.00625)
    np.testing.assert_allclose(twice.covariance, after.covariance, atol=1e-15)


def test_a_palm_that_is_held_is_not_shaken_and_other_hands_do_not_rest():
    assert (rested(PALM_HELD)[1].agitation[[LINEAR, TURN]] == 0.0).all()
    placed = rested(PLACED)[1].agitation
    assert placed[LINEAR] == 1.0 and placed[TURN] == 0.0
    for before, after in zip(*rested(FREE), strict=True):
        np.testing.assert_array_equal(before, after)


@pytest.mark.parametrize(("part", "arrives"), [(0.9, True), (-0.9, True), (1.1, False), (-1.1, False)])
def test_a_slow_way_along_the_line_of_sight_ends_and_is_known_no_better_for_it(part, arrives):
    sight, before = np.array([0.6, 0.0, 0.8]), moving_estimate()
    across = np.array([0.8, 0.3, -0.6])
    before.held[0], before.velocity[:3], before.acceleration[:3] = PALM_HELD, part * HURRIES_M_S * sight + across, sight
    after = twin(before)
    rest(after, sight, 0.05)
    share = np.exp(-0.05 / ARRIVE_S) if arrives else 1.0
    np.testing.assert_allclose(after.velocity[:3], share * part * HURRIES_M_S * sight + across)
    np.testing.assert_allclose(after.acceleration[:3], share * sight)
    np.testing.assert_array_equal(after.covariance[VELOCITY:VELOCITY + 3, VELOCITY:VELOCITY + 3],
                                  before.covariance[VELOCITY:VELOCITY + 3, VELOCITY:VELOCITY + 3])


def test_a_size_is_held_where_it_is_in_doubt_and_beside_all_else():
    for doubt, expected in ((0.0, 0), (0.01, 1)):
        covariance, held = np.zeros((BIAS, BIAS)), empty_held(BIAS)
        covariance[SCALE, SCALE], held.used[0] = doubt, MOST_HELD - 1
        hold_size(covariance, held)
        assert held.used[0] == MOST_HELD - 1 + expected
        assert held.directions.sum() == expected == held.directions[-1, SCALE]
