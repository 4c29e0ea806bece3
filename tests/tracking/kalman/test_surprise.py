"""What a finger's covariance learns when it surprises: of one camera once, of two that are weighed together always."""

import numpy as np
import pytest
from known_hand import SIZE, WEARING, moving_estimate, sighting

from rhot_app.tracking.kalman.estimate import ANGLES, GROUP_OF
from rhot_app.tracking.kalman.motion import AWAKE, MOST
from rhot_app.tracking.kalman.surprise import appraise

MIDDLE, PART = 2, WEARING.worn.part
NUMBER = ANGLES + 1 + 4 * PART[MIDDLE]
GROUP = GROUP_OF[NUMBER]
OFF_PX, PX_PER_RAD = 3.0, 50.0


def surprised(cameras, agitation, off_px=OFF_PX):
    """(believed, widening, the growth of the finger's first angle's variance, the finger's agitation) when it is seen
    elsewhere."""
    estimate, rows = moving_estimate(), sighting(*((camera, MIDDLE) for camera in cameras))
    estimate.covariance[:] = 1e-6 * np.eye(SIZE)
    estimate.trend[:], estimate.velocity[:] = 0.0, 0.0
    estimate.agitation[:] = agitation
    for row in range(rows.used[0]):
        rows.jacobian[row, NUMBER] = PX_PER_RAD
        rows.residual[row], rows.noise[row, 0] = off_px, 0.1**2
    believed, widening = np.empty(len(cameras), np.bool_), np.empty(len(cameras))
    appraise(rows, estimate, WEARING.habits.together, np.zeros(5, np.bool_), believed, widening)
    grown = estimate.covariance[NUMBER, NUMBER] - 1e-6
    return believed, widening, grown, estimate.agitation[GROUP]


@pytest.mark.parametrize(("cameras", "awake", "told"), [((0,), False, True), ((0,), True, False),
                                                        ((0, 1), False, True), ((0, 1), True, True)])
def test_what_surprised_is_told_once_of_one_camera_and_always_of_two(cameras, awake, told):
    believed, widening, grown, _ = surprised(cameras, AWAKE**2 if awake else 0.0)
    if told:
        assert grown > (0.01 * OFF_PX / PX_PER_RAD) ** 2
        assert believed.all() and (widening < 4.0).all()
    else:
        assert grown == pytest.approx(0.0, abs=1e-12)
        assert not believed.any()


def test_what_surprises_is_henceforth_as_lively_as_makes_it_plausible():
    """Twice as far off takes four times the variance of the acceleration, however asleep the finger was; it is looked
    for in steps."""
    lively = [surprised((0, 1), 0.0, off_px)[3] for off_px in (1.0, 2.0, 4.0)]
    assert lively[0] > 4.0 * AWAKE[GROUP] ** 2
    assert lively[1] / lively[0] > 2.0
    assert lively[2] == MOST[GROUP]


def test_what_is_lively_enough_and_surprises_becomes_twice_as_lively():
    before = 0.4 * MOST[GROUP]
    assert surprised((0, 1), before, 1.0)[3] == pytest.approx(2.0 * before)
