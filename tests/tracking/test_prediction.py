"""The hand at an instant after the newest frame."""

import numpy as np
import pytest
from modelled_hand import model_rig, moving, seconds, sights
from synthetic_rig import EPOCH_NS

from rhot_app.tracking.make import make_tracker
from rhot_app.tracking.model_tracker import FARTHEST_AHEAD_S, RESTLESS_M_S, ModelTracker

RIG = model_rig()


def test_prediction_is_nearer_to_what_comes_than_the_newest_state():
    truth, ahead_s = moving("fast"), 0.02
    tracker = make_tracker(RIG)
    assert isinstance(tracker, ModelTracker) and tracker.state_at(EPOCH_NS) is None
    here, there = [], []
    for frame in sights(RIG, truth, 2.0):
        tracker.ingest(frame)
        state = tracker.solve()
        if state is not None and seconds(state) > 1.0:
            later = tracker.state_at(state.t_master_ns + round(1e9 * ahead_s))
            assert seconds(later) == pytest.approx(seconds(state) + ahead_s)
            tips = truth(np.array([seconds(later)]))[0, :5]
            here.append(np.linalg.norm(state.fingertip_positions - tips, axis=1))
            there.append(np.linalg.norm(later.fingertip_positions - tips, axis=1))
            assert np.trace(later.fingertip_covariances[1]) > np.trace(state.fingertip_covariances[1])
    assert np.mean(there) < 0.3 * np.mean(here)
    far = tracker.state_at(state.t_master_ns + 3 * 10**8)
    assert seconds(far) == pytest.approx(seconds(state) + FARTHEST_AHEAD_S) and far.sequence == state.sequence
    assert tracker.state_at(state.t_master_ns + 10**9) is None, "nobody knows where a hand is that was not seen since"


def test_a_hand_at_rest_may_have_moved_a_little_until_it_is_seen():
    tracker = make_tracker(RIG)
    for frame in sights(RIG, moving("still"), 2.0):
        tracker.ingest(frame)
        state = tracker.solve()
    later = tracker.state_at(state.t_master_ns + 30_000_000)
    grown = later.fingertip_covariances - state.fingertip_covariances
    assert (np.trace(grown, axis1=1, axis2=2) > 3.0 * (RESTLESS_M_S * 0.03) ** 2).all()
