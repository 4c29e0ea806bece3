"""A state predicted to an instant after it, from the state alone."""

from dataclasses import replace

import numpy as np
import pytest
from modelled_hand import model_rig, moving, observations_of, states_of
from synthetic_rig import EPOCH_NS, seconds

from rhot_app.estimation.track import LOST_NS
from rhot_app.project import with_tracker
from rhot_app.state import Condition
from rhot_app.tracking.extrapolation import FARTHEST_AHEAD_S, Extrapolator

RIG = model_rig()
AHEAD_NS = 20_000_000


@pytest.fixture(scope="module")
def fast():
    return states_of(RIG, observations_of(RIG, moving("fast"), 2.0))


def test_prediction_is_nearer_to_what_comes_than_the_newest_state(fast):
    extrapolator, here, there, inside = Extrapolator(RIG), [], [], []
    for state in (state for state in fast if seconds(state) > 1.0):
        later = extrapolator.at(state, state.t_master_ns + AHEAD_NS)
        assert later.t_master_ns == state.t_master_ns + AHEAD_NS and later.condition is state.condition
        tips = moving("fast")(np.array([seconds(later)]))[0, :5]
        here.append(np.linalg.norm(state.fingertip_positions - tips, axis=1))
        there.append(np.linalg.norm(later.fingertip_positions - tips, axis=1))
        inside.append(there[-1] < 3.0 * np.sqrt(np.trace(later.fingertip_covariances, axis1=1, axis2=2)))
        np.testing.assert_allclose(later.fingertip_positions, later.marker_positions[:5], atol=1e-9)
    assert np.mean(there) < 0.3 * np.mean(here) and np.mean(inside) > 0.99


def test_everything_of_the_hand_moves_and_is_known_less_well(fast):
    state = fast[-1]
    later = Extrapolator(RIG).at(state, state.t_master_ns + AHEAD_NS)
    for name in ("joint_positions", "fingertip_positions", "marker_positions", "angles", "world_from_palm"):
        assert not np.array_equal(getattr(later, name), getattr(state, name)), name
    for name in ("joint_covariances", "fingertip_covariances", "marker_covariances", "palm_covariance"):
        assert (np.trace(getattr(later, name), axis1=-2, axis2=-1)
                > np.trace(getattr(state, name), axis1=-2, axis2=-1)).all(), name
        assert (np.linalg.eigvalsh(getattr(later, name)) > 0.0).all(), name
    assert (later.angle_sd > state.angle_sd).all()
    np.testing.assert_array_equal(later.joint_knowledge, state.joint_knowledge)
    again = Extrapolator(RIG).at(later, later.t_master_ns + AHEAD_NS)
    at_once = Extrapolator(RIG).at(state, state.t_master_ns + 2 * AHEAD_NS)
    np.testing.assert_allclose(again.joint_positions, at_once.joint_positions, atol=2e-3)
    bones = [np.linalg.norm(np.diff(one.joint_positions[1:5], axis=0), axis=1) for one in (state, later)]
    np.testing.assert_allclose(*bones, atol=1e-9)


def test_the_shape_of_a_state_stays_that_of_the_state(fast):
    """A bare hand's phalanges have lengths of their own, not the file's."""
    state = fast[-1]
    way = np.array([0.0, 0.0, 0.01])
    longer = replace(state, joint_positions=state.joint_positions + way,
                     fingertip_positions=state.fingertip_positions + way)
    t_ns, extrapolator = state.t_master_ns + AHEAD_NS, Extrapolator(RIG)
    for name in ("joint_positions", "fingertip_positions"):
        apart = getattr(extrapolator.at(longer, t_ns), name) - getattr(extrapolator.at(state, t_ns), name)
        np.testing.assert_allclose(apart, np.broadcast_to(way, apart.shape), atol=1e-9)


def test_the_velocity_is_that_of_the_places(fast):
    step_ns = 1_000_000
    extrapolator = Extrapolator(RIG)
    for state in fast[60::10]:
        later = extrapolator.at(state, state.t_master_ns + step_ns)
        rate = (later.world_from_palm[:3, 3] - state.world_from_palm[:3, 3]) / (1e-9 * step_ns)
        np.testing.assert_allclose(rate, state.velocity[:3], atol=0.05 * np.linalg.norm(state.velocity[:3]) + 0.05)


def test_there_is_no_prediction_far_ahead_and_of_a_hand_that_is_gone(fast):
    extrapolator, state = Extrapolator(RIG), fast[-1]
    assert extrapolator.at(state, state.t_master_ns - 10**7).t_master_ns == state.t_master_ns
    far = extrapolator.at(state, state.t_master_ns + 3 * 10**8)
    assert seconds(far) == pytest.approx(seconds(state) + FARTHEST_AHEAD_S)
    assert extrapolator.at(state, state.t_master_ns + round(1.01 * LOST_NS)) is None
    assert extrapolator.at(replace(state, condition=Condition.LOST), state.t_master_ns) is None
    assert extrapolator.at(fast[0], EPOCH_NS) is None, "before a hand is found"


def test_a_state_without_a_velocity_stays_where_it_is():
    rig = with_tracker(RIG, "classic")
    state = states_of(rig, observations_of(rig, moving("grasp"), 1.0))[-1]
    later = Extrapolator(rig).at(state, state.t_master_ns + AHEAD_NS)
    np.testing.assert_array_equal(later.joint_positions, state.joint_positions)


def test_a_hand_at_rest_may_have_moved_a_little_until_it_is_seen():
    state = states_of(RIG, observations_of(RIG, moving("still"), 2.0))[-1]
    extrapolator = Extrapolator(RIG)
    grown = [np.trace(extrapolator.at(state, state.t_master_ns + ahead_ns).fingertip_covariances, axis1=1, axis2=2)
             for ahead_ns in (0, 30_000_000, 60_000_000)]
    assert (grown[0] < grown[1]).all() and (grown[1] < grown[2]).all()
