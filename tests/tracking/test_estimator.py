"""The estimator on observations without images: where it puts the hand, loss, association, and late frames."""

import numpy as np
import pytest
from modelled_hand import after_s, deviations, model_rig, moving, sights, states_of
from synthetic_rig import LOST, Sight, altered

from rhot_app.project import with_tracker
from rhot_app.tracking.state import Condition, Knowledge

RIG = with_tracker(model_rig(), "estimator")
SECONDS = 3.0
HERE = (Condition.TRACKING, Condition.PARTIAL)


@pytest.mark.parametrize("motion", ["rest", "fast"])
def test_hand_is_where_it_is_and_the_covariances_say_how_well(motion):
    states = states_of(RIG, sights(RIG, moving(motion), SECONDS))
    found = deviations(after_s(states, 1.0), moving(motion))
    assert found.rms_mm < 1.5 and found.within >= 0.97
    assert 0.01 < found.normalised.mean() < 2.0
    assert np.mean([state.marker_knowledge == Knowledge.MEASURED for state in after_s(states, 1.0)]) > 0.9


def test_names_that_are_exchanged_are_put_right_by_the_hand():
    def swap(t, _camera, pixels, _flags):
        if t > 1.0:
            pixels[[1, 2]] = pixels[[2, 1]]

    states = after_s(states_of(RIG, altered(sights(RIG, moving(), SECONDS), swap)), 1.0)
    assert deviations(states, moving()).rms_mm < 1.5


def test_a_lossy_network_and_doubled_and_late_frames():
    frames = sights(RIG, moving(), SECONDS, Sight(frame_loss=0.1, marker_loss=0.02, delay_s=(0.001, 0.04), seed=3))
    twice = [frame for k, frame in enumerate(frames) for frame in ([frame] * (2 if k % 7 == 0 else 1))]
    states = states_of(RIG, twice)
    assert len(states) == len(frames)
    assert deviations(after_s(states, 1.0), moving()).rms_mm < 2.0


def test_a_hand_that_leaves_is_lost_and_found_again():
    def leave(t, _camera, _pixels, flags):
        if 1.0 < t < 2.0:
            flags[:] = LOST

    states = states_of(RIG, altered(sights(RIG, moving(), SECONDS), leave))
    assert all(state.condition in HERE for state in after_s(states, 0.2, 1.0))
    gone = after_s(states, 1.6, 2.0)
    assert gone and all(state.condition is Condition.LOST for state in gone)
    assert np.isnan(gone[-1].joint_positions).all()
    assert all(state.condition in HERE for state in after_s(states, 2.25))
    assert deviations(after_s(states, 2.5), moving()).rms_mm < 3.0
