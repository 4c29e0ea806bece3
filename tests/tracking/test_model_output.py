"""What the model tracker tells of how well it knows things."""

import numpy as np
from modelled_hand import model_rig, moving, sights, states_of
from synthetic_rig import LOST, altered

from rhot_app.tracking.kalman.wearing import compile_wearing
from rhot_app.tracking.state import Knowledge

RIG = model_rig()


def test_no_angle_is_known_less_than_by_habit_however_little_is_seen():
    def one_fingertip(t, _camera, _pixels, flags):
        if t > 0.5:
            flags[1:] = LOST

    last = states_of(RIG, altered(sights(RIG, moving(), 2.5), one_fingertip))[-1]
    usual = np.sqrt(np.diag(compile_wearing(RIG).habits.usual)[6:])
    assert (last.angle_sd <= 1.001 * usual).all() and (last.angle_sd > 0.5 * usual).any()
    assert np.sqrt(np.trace(last.fingertip_covariances[3])) < 1.0


def test_markers_in_plain_view_stay_measured_while_the_joints_behind_them_are_open():
    states = states_of(RIG, sights(RIG, moving("rest"), 1.0))[10:]
    usual = np.sqrt(np.diag(compile_wearing(RIG).habits.usual)[6:])
    assert any((state.angle_sd > 0.999 * usual).any() for state in states)
    measured = np.array([state.marker_knowledge == Knowledge.MEASURED for state in states])
    assert measured.mean() > 0.98  # a thumb that is bent the other way is known by the next frame
