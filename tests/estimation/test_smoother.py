"""The smoother: the textbook's on a linear process, the same in chunks, and nearer to the truth where markers hide."""

from dataclasses import replace

import fault_injection as alter
import numpy as np
import pytest
from linear_motion import ConstantVelocity, kalman_update, place

from rhot_app.engine.offline.replay_summary import replay_states
from rhot_app.estimation.filter import ChunkedSmoother, FilteredState, IteratedFilter, smooth
from rhot_app.evaluation.compare import MOTIONS
from rhot_app.evaluation.data_sets import Order, data_set
from rhot_app.project import with_tracker
from rhot_app.simulator.film.node_log import T0_MASTER_NS
from rhot_app.simulator.scene.scene import make_scene, twin_defaults
from rhot_app.sources.replay import LogValidator
from rhot_app.state import Condition
from rhot_app.tracking.scene import make_tracker
from rhot_node.wire.messages import MarkerFlag

PROCESS = ConstantVelocity()
SECONDS = 4.0
HERE = Condition.TRACKING, Condition.PARTIAL


def filtered(count, gap_s=0.0, noise=0.2, seed=0):
    """The knots of a filter; every second measurement is much worse. `gap_s`: a pause in the middle."""
    rng = np.random.default_rng(seed)
    times = 0.0125 * (1 + np.arange(count)) + gap_s * (np.arange(count) >= count // 2)
    estimate, knots = IteratedFilter(PROCESS), []
    estimate.most = 2
    estimate.start(0.0, np.array([0.3, -0.2]), np.diag([1.0, 0.5]))
    for k, t in enumerate(times):
        knots.append(estimate.add(t, [place(np.sin(t) + rng.normal(0.0, noise), noise**2 * (1.0 if k % 2 else 25.0))]))
    return [FilteredState(knot.t_s, knot.state, knot.covariance, PROCESS, label=k) for k, knot in enumerate(knots)]


def textbook(knots):
    """Rauch, Tung and Striebel (1965), equations 3.29 to 3.31."""
    state, covariance = knots[-1].state, knots[-1].covariance
    found = [(state, covariance)]
    for here, after in zip(knots[-2::-1], knots[:0:-1], strict=True):
        move = PROCESS.transition(here.state, after.t_s - here.t_s)
        predicted = move @ here.covariance @ move.T + PROCESS.noise(after.t_s - here.t_s)
        gain = here.covariance @ move.T @ np.linalg.inv(predicted)
        state = here.state + gain @ (state - move @ here.state)
        covariance = here.covariance + gain @ (covariance - predicted) @ gain.T
        found.append((state, covariance))
    return found[::-1]


def test_a_linear_process_is_smoothed_as_by_the_textbook():
    knots = filtered(60, gap_s=0.8)
    for got, (state, covariance) in zip(smooth(knots), textbook(knots), strict=True):
        np.testing.assert_allclose(got.state, state, atol=1e-6)
        np.testing.assert_allclose(got.covariance, covariance, atol=1e-6)
        assert np.array_equal(got.covariance, got.covariance.T)


def test_a_smoothed_estimate_is_that_of_all_measurements_at_once():
    """Two knots: the first state given both measurements, by one update of the joint Gaussian."""
    knots = filtered(2)
    first, second = knots
    move = PROCESS.transition(first.state, 0.0125)
    joint = np.block([[first.covariance, first.covariance @ move.T],
                      [move @ first.covariance, move @ first.covariance @ move.T + PROCESS.noise(0.0125)]])
    mean = np.concatenate([first.state, move @ first.state])
    value = second.state  # the measurement that the second knot has come by
    prior = joint[2:, 2:]
    information = np.linalg.inv(second.covariance) - np.linalg.inv(prior)
    measured = np.linalg.inv(information + 1e-9 * np.eye(2))
    seen = np.linalg.solve(information + 1e-9 * np.eye(2), np.linalg.solve(second.covariance, value)
                           - np.linalg.solve(prior, mean[2:]))
    state, covariance = kalman_update(mean, joint, np.eye(4)[2:], seen, measured)
    got = smooth(knots)[0]
    np.testing.assert_allclose(got.state, state[:2], atol=1e-5)
    np.testing.assert_allclose(got.covariance, covariance[:2, :2], atol=1e-5)


def test_chunks_give_what_one_pass_gives():
    knots = filtered(800, noise=0.01)
    smoother, found, longest = ChunkedSmoother(), [], 0
    smoother.chunk_s, smoother.ahead_s = 2.0, 1.0
    for knot in knots:
        found += smoother.add(knot)
        longest = max(longest, len(smoother._waiting))
    found += smoother.finish()
    assert [one.label for one in found] == list(range(800)) and longest <= 242
    for got, whole in zip(found, smooth(knots), strict=True):
        sd = np.sqrt(np.diag(whole.covariance))
        assert (np.abs(got.state - whole.state) < 0.01 * sd).all()
        np.testing.assert_allclose(got.covariance, whole.covariance, rtol=0.01, atol=1e-2 * sd.prod())
    assert smoother.finish() == []


@pytest.mark.parametrize("variance", [1.0, -1e-3])
def test_a_covariance_with_a_negative_eigenvalue_ends_nothing(variance):
    knots = filtered(5)
    knots[2].covariance = np.array([[1.0, 1.1], [1.1, variance]])
    assert all(np.isfinite(one.state).all() and np.isfinite(one.covariance).all() for one in smooth(knots))


# -- hands -------------------------------------------------------------------------------------------------------------

@pytest.fixture(scope="module")
def grasp(tmp_path_factory):
    return data_set(Order(make_scene(twin_defaults(), 1), "grasp", SECONDS, sketched=True),
                tmp_path_factory.mktemp("takes"))


def both(one, records):
    """Filtered and smoothed states of the records."""
    rig = with_tracker(one.rig, "estimator")
    return (list(replay_states(records, LogValidator(rig), make_tracker(rig))),
            list(replay_states(records, LogValidator(rig), make_tracker(rig, smooth=True))))


def tips(one, states):
    """(N, 5) mm from the truth, (N, 5) standard deviation in mm, and whether no camera sees the marker."""
    here = [state for state in states if state.condition in HERE]
    times = 1e-9 * np.array([state.t_master_ns - T0_MASTER_NS for state in here])
    errors = np.array([state.fingertip_positions for state in here]) - one.truth.markers_at(times)[:, :5]
    variances = np.trace([state.fingertip_covariances for state in here], axis1=2, axis2=3)
    hidden = np.array([(state.camera_flags[:, :5] & int(MarkerFlag.LOST)) != 0 for state in here]).all(axis=1)
    return 1e3 * np.linalg.norm(errors, axis=2), 1e3 * np.sqrt(variances), hidden


def rms(values):
    return float(np.sqrt(np.mean(values**2)))


def test_smoothed_fingertips_are_nearer_to_the_truth_while_their_markers_are_hidden(grasp):
    hide = alter.hidden(0.25, SECONDS, (1, 2), len(grasp.rig.markers.ids), 3, together=True, lasting_s=(0.1, 0.4))
    states, smoothed = both(grasp, alter.changed(grasp.records(), hide))
    assert abs(len(smoothed) - len(states)) <= 2
    times = [state.t_master_ns for state in smoothed]
    assert times == sorted(times) and [state.sequence for state in smoothed] == list(range(len(smoothed)))
    (error, sd, hidden), (better, smaller, also) = tips(grasp, states), tips(grasp, smoothed)
    assert hidden.mean() > 0.1 and abs(hidden.sum() - also.sum()) < 20
    assert rms(better[also]) < 0.75 * rms(error[hidden]) and rms(better[~also]) < rms(error[~hidden])
    assert np.median(smaller[also]) < 0.6 * np.median(sd[hidden])
    assert all((np.linalg.eigvalsh(state.fingertip_covariances) > 0.0).all() for state in smoothed
               if state.condition in HERE)


def test_a_fast_hand_is_smoothed_as_well(tmp_path):
    """Between two frames it moves so far that what markers leave open changes."""
    one = data_set(Order(make_scene(twin_defaults(), 3), "fast", SECONDS, sketched=True), tmp_path)
    (error, _, _), (better, _, _) = (tips(one, states) for states in both(one, one.records()))
    assert rms(better[80:]) < 0.95 * rms(error[80:])


def test_what_cameras_triangulate_themselves_is_not_smoothed(grasp):
    states, smoothed = both(grasp, grasp.records())
    raw = {state.t_master_ns: state.marker_raw_positions for state in states if state.condition is Condition.TRACKING}
    same = [(raw[state.t_master_ns], state.marker_raw_positions) for state in smoothed if state.t_master_ns in raw]
    assert len(same) > 250
    for own, again in same[12:]:
        np.testing.assert_allclose(again, own, atol=2e-4)


def test_a_lost_hand_ends_a_segment(grasp):
    records = grasp.records()
    for node in (1, 2):
        records = alter.changed(records, alter.blind(node, 1.5, 2.5))
    states, smoothed = both(grasp, records)
    lost = [state for state in smoothed if state.condition is Condition.LOST]
    assert len(lost) > 20 and all(np.isnan(state.fingertip_positions).all() for state in lost)
    assert abs(len(smoothed) - len(states)) <= 16
    error, _, _ = tips(grasp, [state for state in smoothed if state.t_master_ns < T0_MASTER_NS + 1_450_000_000])
    assert rms(error) < 1.0
    before = alter.changed(grasp.records(), lambda t, node, seen: seen)
    cut = [record for record in before if alter.arrival_s(record) < 1.5]
    _, alone = both(grasp, cut)
    first = {state.t_master_ns: state for state in smoothed}
    for state in alone[-40:]:  # nothing after the loss tells of the time before
        if state.t_master_ns in first and state.condition in HERE:
            np.testing.assert_allclose(first[state.t_master_ns].fingertip_positions, state.fingertip_positions,
                                       atol=1e-3)


# -- what would make it worse than the filter --------------------------------------------------------------------------

def test_noise_that_is_added_between_knots_is_passed_over_by_the_pass_back():
    """By one more knot without a measurement: the textbook's step for noise that is added at one instant."""
    knots = filtered(20)
    jump = np.array([[4.0, 0.3], [0.3, 2.0]])
    for k in (5, 11):
        knots[k].inflated = knots[k].covariance + jump
    state, covariance = knots[-1].state, knots[-1].covariance
    for k in range(18, -1, -1):
        here = knots[k]
        begun = here.covariance if here.inflated is None else here.inflated
        move = PROCESS.transition(here.state, knots[k + 1].t_s - here.t_s)
        predicted = move @ begun @ move.T + PROCESS.noise(knots[k + 1].t_s - here.t_s)
        gain = begun @ move.T @ np.linalg.inv(predicted)
        state, covariance = (here.state + gain @ (state - move @ here.state),
                             begun + gain @ (covariance - predicted) @ gain.T)
        np.testing.assert_allclose(smooth(knots)[k].state, state, atol=1e-6)
        np.testing.assert_allclose(smooth(knots)[k].covariance, covariance, atol=1e-6)
        gain = here.covariance @ np.linalg.inv(begun)
        state, covariance = (here.state + gain @ (state - here.state),
                             here.covariance + gain @ (covariance - begun) @ gain.T)


class Liar(ConstantVelocity):
    """Says of its predictions that they are a thousand times better than they are."""

    def predict(self, state, covariance, dt_s):
        state, covariance = super().predict(state, covariance, dt_s)
        return state, 1e-6 * covariance


def test_a_pass_that_contradicts_its_filter_falls_back_to_it():
    knots = filtered(30)
    knots[12].process = Liar()
    found = smooth(knots)
    assert [one.label for one in found if one.contradicted] == [12]
    np.testing.assert_array_equal(found[12].state, knots[12].state)
    np.testing.assert_array_equal(found[12].covariance, knots[12].covariance)
    for got, (state, _) in zip(found[:12], textbook(knots[:13]), strict=False):
        np.testing.assert_allclose(got.state, state, atol=1e-6)


class Restless(ConstantVelocity):
    """Driven the harder, the faster it is estimated to move."""

    def __init__(self, speed=None):
        self.speed = speed

    def predict(self, state, covariance, dt_s):
        self.density = 1e-4 + 100.0 * min((state[1] if self.speed is None else self.speed) ** 2, 4.0)
        return super().predict(state, covariance, dt_s)

    def moving_as(self, *states):
        return Restless(max(abs(state[1]) for state in states))


def test_a_sudden_motion_is_smoothed_with_the_noise_of_a_motion():
    """At its first instant the filter still takes the process to rest, and so would one pass back."""
    rng, process, times = np.random.default_rng(1), Restless(), 0.0125 * np.arange(1, 1000)
    truth = 0.8 * np.clip(np.sin(3.0 * times), 0.0, 0.7) ** 2
    estimate, found = IteratedFilter(process), []
    estimate.most = 2
    estimate.start(0.0, np.zeros(2), np.diag([1.0, 0.01]))
    for t, value in zip(times, truth, strict=True):
        residuals = [place(value + rng.normal(0.0, 0.003), 9e-6)]
        knot = estimate.add(t, residuals)
        found.append(FilteredState(t, knot.state, knot.covariance, process, residuals=residuals))
    once = smooth([replace(one, residuals=()) for one in found])
    off, better = (np.abs([one.state[0] for one in some] - truth) for some in (once, smooth(found)))
    assert better.max() < 0.7 * off.max() and rms(better) < 0.8 * rms(off)


@pytest.mark.parametrize("motion", MOTIONS)
def test_smoothed_is_no_worse_than_filtered(motion, tmp_path):
    one = data_set(Order(make_scene(twin_defaults(), 3), motion, SECONDS, sketched=True), tmp_path)
    error, better = (tips(one, states)[0][80:] for states in both(one, one.records()))
    assert np.median(better) < np.median(error) and np.percentile(better, 95) < np.percentile(error, 95)
