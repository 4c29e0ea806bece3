"""What a finger's covariance learns when it surprises: of one camera once, of two that are weighed together always."""

import numpy as np
import pytest
from known_hand import SIZE, WEARING, moving_estimate, sighting

from rhot_app.tracking.kalman.estimate import ANGLES
from rhot_app.tracking.kalman.motion import AWAKE
from rhot_app.tracking.kalman.surprise import appraise

MIDDLE, PART = 2, WEARING.worn.part
OFF_PX, PX_PER_RAD = 3.0, 50.0


def surprised(cameras, agitation):
    """(believed, widening, the growth of the finger's first angle's variance) when it is seen elsewhere."""
    estimate, rows = moving_estimate(), sighting(*((camera, MIDDLE) for camera in cameras))
    estimate.covariance[:] = 1e-6 * np.eye(SIZE)
    estimate.trend[:], estimate.velocity[:] = 0.0, 0.0
    estimate.agitation[:] = agitation
    number = ANGLES + 1 + 4 * PART[MIDDLE]
    for row in range(rows.used[0]):
        rows.jacobian[row, number] = PX_PER_RAD
        rows.residual[row], rows.noise[row, 0] = OFF_PX, 0.1**2
    believed, widening = np.empty(len(cameras), np.bool_), np.empty(len(cameras))
    appraise(rows, estimate, WEARING.habits.together, np.zeros(5, np.bool_), believed, widening)
    return believed, widening, estimate.covariance[number, number] - 1e-6


@pytest.mark.parametrize(("cameras", "awake", "told"), [((0,), False, True), ((0,), True, False),
                                                        ((0, 1), False, True), ((0, 1), True, True)])
def test_what_surprised_is_told_once_of_one_camera_and_always_of_two(cameras, awake, told):
    believed, widening, grown = surprised(cameras, AWAKE**2 if awake else 0.0)
    if told:
        assert grown > (0.01 * OFF_PX / PX_PER_RAD) ** 2
        assert believed.all() and (widening < 4.0).all()
    else:
        assert grown == pytest.approx(0.0, abs=1e-12)
        assert not believed.any()
