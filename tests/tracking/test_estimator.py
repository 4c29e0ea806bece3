"""The estimator on observations without images: where it puts the hand, loss, association, and late frames."""

from dataclasses import replace

import msgspec
import numpy as np
import pytest
from modelled_hand import after_s, deviations, model_rig, moving, observations_of, states_of
from synthetic_rig import LOST, Viewing, altered, hand_trajectory, hidden, make_rig, run, seconds

from rhot_app.hand.anthropometry import scaled_hand
from rhot_app.hand.kinematics import empty_frames, forward_arrays
from rhot_app.hand.model import neutral_pose
from rhot_app.hand.skeleton import ANGLE_SLICES, ANGLES
from rhot_app.simulator.scene.motion import FACING
from rhot_app.state import Condition, Knowledge
from rhot_app.tracking.classic import ClassicTracker
from rhot_app.tracking.markers.estimator import Estimator
from rhot_app.tracking.markers.marker_model import compile_markers
from rhot_app.tracking.scene import make_tracker
from rhot_app.tracking.tracker import Tracker

RIG = model_rig()
SECONDS = 3.0
SLACK_RAD = np.radians(0.1)
HERE = (Condition.TRACKING, Condition.PARTIAL)


def in_limits(states, rig=RIG):
    limits = compile_markers(rig).limits
    angles = np.array([state.angles for state in states if state.condition in HERE])
    return (angles >= limits[:, 0] - SLACK_RAD).all() and (angles <= limits[:, 1] + SLACK_RAD).all()


@pytest.mark.parametrize("motion", ["rest", "grasp", "fast"])
def test_hand_is_where_it_is_and_the_covariances_say_how_well(motion):
    states = states_of(RIG, observations_of(RIG, moving(motion), SECONDS))
    found = deviations(after_s(states, 1.0), moving(motion))
    assert found.rms_mm < 1.5
    assert 0.01 < found.normalised.mean() < 2.0
    assert found.within >= 0.97
    assert np.mean([state.marker_knowledge == Knowledge.MEASURED for state in after_s(states, 1.0)]) > 0.9
    assert in_limits(states)


@pytest.mark.parametrize(("rig", "truth"), [
    (model_rig(side="left"), moving(side="left")), (model_rig("rhot8"), moving(markers="rhot8")),
    (model_rig(cameras=3), moving()), (model_rig(limits="thesis"), moving())], ids=["left", "rhot8", "three", "thesis"])
def test_other_hands_markers_cameras_and_limits(rig, truth):
    states = states_of(rig, observations_of(rig, truth, 2.0))
    assert deviations(after_s(states, 1.0), truth).rms_mm < 1.5
    assert in_limits(states, rig)


def test_two_knuckles_show_how_the_palm_is_turned_and_a_wrist_alone_does_not():
    def palm(markers):
        rig = model_rig(markers)
        last = states_of(rig, observations_of(rig, moving(markers=markers), 1.0))[-1]
        return last, np.sqrt(np.trace(last.palm_covariance[3:, 3:]))

    (bare, unsure), (full, sure) = palm("rhot6"), palm("rhot8")
    assert full.palm_knowledge is Knowledge.MEASURED and bare.palm_knowledge is not Knowledge.MEASURED
    assert unsure > 2.0 * sure


def test_coupled_hands_keep_their_couplings():
    rig = model_rig(variant="coupled")
    states = after_s(states_of(rig, observations_of(rig, moving(), 2.0)), 0.5)
    angles = np.array([state.angles for state in states])
    for finger in ("index", "middle", "ring", "little"):
        pip, dip = (angles[:, ANGLES.index(f"{finger}_{joint}_flexion")] for joint in ("pip", "dip"))
        assert np.abs(dip - pip * 2.0 / 3.0).max() < np.radians(0.3)
    assert in_limits(states, rig)


def test_a_hand_is_found_within_a_fifth_of_a_second():
    states = states_of(RIG, observations_of(RIG, moving(), 0.5))
    assert states[0].condition is Condition.SEARCHING and states[0].palm_knowledge is Knowledge.UNKNOWN
    first = next(state for state in states if state.condition in HERE)
    assert seconds(first) < 0.2
    assert deviations(after_s(states, 0.3), moving()).rms_mm < 5.0


def before_one_camera(rig, truth):
    """The states of a hand that one camera does not see from 1 s to 2 s."""
    return states_of(rig, altered(observations_of(rig, truth, SECONDS), hidden(slice(None), 1.0, 2.0, 0)))


def test_a_hand_before_one_camera_is_as_far_away_as_its_fingertips_look():
    rig = msgspec.structs.replace(make_rig(bodies=True), tracker=RIG.tracker)
    truth = hand_trajectory(rig, "rest", SECONDS)
    found = deviations(after_s(before_one_camera(rig, truth), 1.1, 2.0), truth)
    assert found.rms_mm < 12.0


@pytest.mark.xfail(strict=True, reason="markers without an apparent size do not show how far away they are")
def test_flat_markers_before_one_camera_stay_near():
    assert deviations(after_s(before_one_camera(RIG, moving("rest")), 1.1, 2.0), moving("rest")).rms_mm < 25.0


def test_one_blind_camera_does_not_end_the_tracking():
    states = before_one_camera(RIG, moving("rest"))
    assert all(state.condition in HERE for state in after_s(states, 0.5))
    dark = after_s(states, 1.1, 2.0)
    found = deviations(dark, moving("rest"))
    assert not any((state.marker_knowledge == Knowledge.MEASURED).all() for state in dark)
    sighted = deviations(after_s(states, 0.6, 1.0), moving("rest"))
    assert found.mm.mean() > sighted.mm.mean()
    assert deviations(after_s(states, 2.3), moving("rest")).rms_mm < 3.0


@pytest.mark.parametrize(("motion", "camera"), [
    ("rest", 0), ("rest", 1), ("grasp", 0), ("grasp", 1)])
def test_half_a_second_before_one_camera_is_bridged_and_not_called_measured(motion, camera):
    """From four moments on: how far the depth goes astray from one of them is chance."""
    frames, off_mm = observations_of(RIG, moving(motion), 2.8), []
    for begin in (0.9, 1.2, 1.5, 2.1):
        states = states_of(RIG, altered(frames, hidden(slice(None), begin, begin + 0.5, camera)))
        dark = after_s(states, begin, begin + 0.5)
        off_mm.append(deviations(dark, moving(motion)).rms_mm)
        assert all(state.condition in HERE for state in after_s(states, 0.5))
        late = after_s(dark, begin + 0.15)
        assert len(late) > 10
        assert not any((state.marker_knowledge == Knowledge.MEASURED).any() for state in late)
        assert not any(state.palm_knowledge == Knowledge.MEASURED for state in late)
        assert deviations(after_s(states, begin + 0.65), moving(motion)).rms_mm < 3.0
    assert np.sqrt(np.mean(np.square(off_mm))) < 25.0 and max(off_mm) < 40.0


@pytest.mark.parametrize("motion", ["rest", "grasp"])
def test_a_wrist_out_of_sight_stays_near_is_not_called_measured_and_comes_back_at_once(motion):
    wrist = RIG.markers.ids.index(next(marker.id for marker in RIG.markers.markers if marker.role == "wrist"))
    states = states_of(RIG, altered(observations_of(RIG, moving(motion), 2.0), hidden(wrist, 1.0, 1.5)))

    def off_mm(some):
        truth = moving(motion)(np.array([seconds(state) for state in some]))[:, wrist]
        return 1e3 * np.linalg.norm(np.array([state.marker_positions[wrist] for state in some]) - truth, axis=1)

    late = after_s(states, 1.15, 1.5)
    assert all(state.condition in HERE for state in after_s(states, 0.5)) and len(late) > 20
    assert np.sqrt(np.mean(off_mm(after_s(states, 1.0, 1.5)) ** 2)) < 25.0
    assert not any(state.marker_knowledge[wrist] == Knowledge.MEASURED for state in late)
    assert not any(state.palm_knowledge == Knowledge.MEASURED for state in late)
    assert deviations(late, moving(motion)).rms_mm < 3.0  # the fingertips are seen
    again = after_s(states, 1.6)
    assert off_mm(again).max() < 3.0
    assert all(state.marker_knowledge[wrist] == Knowledge.MEASURED for state in again)


def test_markers_hidden_in_turns():
    def hide(t, _camera, _pixels, flags):
        for marker in range(len(flags)):
            if (t + 0.31 * marker) % 1.0 < 0.3:
                flags[marker] = LOST

    states = after_s(states_of(RIG, altered(observations_of(RIG, moving("rest"), SECONDS), hide)), 1.0)
    found = deviations(states, moving("rest"))
    assert found.rms_mm < 6.0 and found.within >= 0.97
    unseen = np.array([state.camera_flags[:, :5] & LOST for state in states]).all(axis=1)
    measured = np.array([state.marker_knowledge[:5] for state in states]) == Knowledge.MEASURED
    assert unseen.mean() > 0.2 and (unseen & measured).mean() < 0.5 * unseen.mean()


def test_names_that_are_exchanged_are_put_right_by_the_hand():
    def swap(t, _camera, pixels, _flags):
        if t > 1.0:
            pixels[[1, 2]] = pixels[[2, 1]]

    states = states_of(RIG, altered(observations_of(RIG, moving(), SECONDS), swap))
    late = after_s(states, 1.0)
    assert deviations(late, moving()).rms_mm < 1.5
    assert np.mean([state.marker_knowledge[1:3] == Knowledge.MEASURED for state in late]) > 0.9


def test_a_lossy_network_and_doubled_and_late_frames():
    viewing = Viewing(frame_loss=0.1, marker_loss=0.02, delay_s=(0.001, 0.04), seed=3)
    frames = observations_of(RIG, moving(), SECONDS, viewing)
    twice = [frame for k, frame in enumerate(frames) for frame in ([frame] * (2 if k % 7 == 0 else 1))]
    arrivals = np.array([frame.t_row0_master_ns for frame in frames])
    assert (np.diff(arrivals) < 0).sum() > 10
    states = states_of(RIG, twice)
    assert len(states) == len(frames)
    assert deviations(after_s(states, 1.0), moving()).rms_mm < 2.0


def test_a_frame_that_comes_late_counts_as_if_it_had_come_in_time():
    frames, found = observations_of(RIG, moving(), 0.6), []
    late = max(k for k, frame in enumerate(frames[:-1]) if frame.camera != frames[-1].camera)
    for order in (frames, [*frames[:late], *frames[late + 1:], frames[late]]):
        found.append(states_of(RIG, order)[-1])
    in_time, afterwards = found
    for name in ("fingertip_positions", "marker_raw_positions", "fingertip_covariances"):
        np.testing.assert_allclose(getattr(afterwards, name), getattr(in_time, name), rtol=1e-4, atol=1e-5)


def test_a_frame_that_is_far_too_late_changes_nothing():
    frames = observations_of(RIG, moving(), 0.9)
    tracker = make_tracker(RIG)
    for frame in frames[1:]:
        tracker.ingest(frame)
        before = tracker.solve()
    shifted = replace(frames[0], pixels=frames[0].pixels + 5.0)
    tracker.ingest(replace(shifted, t_receive_ns=frames[-1].t_receive_ns + 1))
    after = tracker.solve()
    assert after is None or np.array_equal(after.angles, before.angles)


def test_a_hand_that_leaves_is_lost_and_found_again():
    states = states_of(RIG, altered(observations_of(RIG, moving(), SECONDS), hidden(slice(None), 1.0, 2.0)))
    assert all(state.condition in HERE for state in after_s(states, 0.2, 1.0))
    assert all(state.condition is Condition.PARTIAL for state in after_s(states, 1.1, 1.4))
    gone = after_s(states, 1.6, 2.0)
    assert all(state.condition is Condition.LOST for state in gone)
    assert np.isnan(gone[-1].joint_positions).all() and (gone[-1].joint_knowledge == Knowledge.UNKNOWN).all()
    assert all(state.condition in HERE for state in after_s(states, 2.25))
    assert deviations(after_s(states, 2.5), moving()).rms_mm < 3.0


def of_wrong_size(factor, markers="rhot6"):
    """A rig whose hand file has all lengths `factor` times too large, and whose size is estimated."""
    rig = model_rig(markers, float_scale=True)
    return msgspec.structs.replace(rig, hand=scaled_hand(rig.hand, factor))


def sizes_of(states):
    """(N, 2) logarithm of the hand's scale and its standard deviation."""
    return np.array([(np.log(state.hand_scale), state.hand_scale_sd) for state in states if state.condition in HERE])


@pytest.mark.parametrize(("factor", "markers"), [(1.1, "rhot6"), (0.9, "rhot6"), (1.05, "rhot8")])
def test_the_hands_size_is_found_while_it_moves_and_never_overstated(factor, markers):
    truth = moving("grasp", 8.0, markers)
    sizes = sizes_of(states_of(of_wrong_size(factor, markers), observations_of(model_rig(markers), truth, 7.0)))
    off = sizes[:, 0] + np.log(factor)
    assert np.abs(off[-1]) < 0.02 and 0.01 < sizes[-1, 1] < 0.025
    assert (np.abs(off) < 2.0 * sizes[:, 1]).all()


@pytest.mark.parametrize("factor", [1.1, 1.0, 0.9])
def test_a_still_hand_leaves_its_size_open(factor):
    sizes = sizes_of(states_of(of_wrong_size(factor), observations_of(RIG, moving("still"), SECONDS)))
    assert (sizes[:, 1] > 0.03).all()
    assert (np.abs(sizes[:, 0] + np.log(factor)) < 2.0 * sizes[:, 1]).all()


def test_a_hand_found_again_has_the_size_that_it_had_and_a_reset_forgets_it():
    tracker, frames = make_tracker(of_wrong_size(1.1)), observations_of(RIG, moving("grasp", 8.0), 7.0)
    states = run(tracker, altered(frames, hidden(slice(None), 5.0, 6.0)))
    assert any(state.condition is Condition.LOST for state in states)
    before, after = (sizes_of(after_s(states, *span)) for span in ((4.0, 5.0), (6.2, 7.0)))
    assert np.abs(after[0, 0] - before[-1, 0]) < 0.02 and after[0, 1] < before[0, 1] + 0.01
    tracker.reset()
    again = sizes_of(run(tracker, observations_of(RIG, moving(), 0.4)))
    assert np.abs(again[0, 0]) < 1e-6 and again[0, 1] > 0.05


def test_a_size_that_does_not_float_is_that_of_the_file():
    assert (sizes_of(states_of(RIG, observations_of(RIG, moving(), 1.0))) == 0.0).all()


def test_classic_and_estimator_are_exchangeable():
    kinds, found = (ClassicTracker, Estimator), []
    for rig, kind in zip((make_rig(), RIG), kinds, strict=True):
        tracker: Tracker = make_tracker(rig)
        assert type(tracker) is kind
        assert tracker.solve() is None and tracker.newest_frames() == (None, None)
        state = None
        for frame in observations_of(rig, moving(), 0.6):
            tracker.ingest(frame)
            state = tracker.solve() or state
        found.append(state)
        assert {frame.camera for frame in tracker.newest_frames()} == {0, 1}
        tracker.reset()
        assert tracker.solve() is None
    for name in type(found[0]).__dataclass_fields__:
        a, b = (getattr(state, name) for state in found)
        assert np.shape(a) == np.shape(b) if isinstance(a, np.ndarray) else type(a) is type(b), name


WORN = compile_markers(RIG)
THUMB = ANGLE_SLICES[0]
BACKWARDS, FORWARDS = np.radians([-17, -25, 0, -6, -9]), np.radians([-30, -7, -8, 34, 35])
STRAIGHT = np.radians([0, 4, 5, 3])


def bending(begin_s, lasts_s):
    """Where the markers are of a hand with straight fingers whose thumb goes from one bend to the other."""
    world, angles = np.eye(4), neutral_pose().angles
    world[:3, :3], world[:3, 3] = FACING, (0.03, 0.08, 0.6)
    for finger in ANGLE_SLICES[1:]:
        angles[finger] = STRAIGHT

    def truth(times_s):
        out = np.empty((len(times_s), len(WORN.roles), 3))
        for points, passed in zip(out, np.clip((times_s - begin_s) / lasts_s, 0.0, 1.0), strict=True):
            share = passed * passed * (3.0 - 2.0 * passed)
            angles[THUMB] = (1.0 - share) * BACKWARDS + share * FORWARDS
            forward_arrays(WORN.dh, world, angles, empty_frames(WORN.dh), points)
        return out

    return truth


@pytest.mark.xfail(strict=True, reason="the process expects no finger to turn so fast: 10 and 1.2 mm")
@pytest.mark.parametrize(("lasts_s", "most_mm"), [(0.12, 2.0), (0.35, 0.9)])
def test_a_thumb_that_bends_the_other_way_stays_where_both_cameras_see_it(lasts_s, most_mm):
    off_mm = []
    for begin_s in (1.0, 1.03):  # cameras take their turns otherwise
        truth = bending(begin_s, lasts_s)
        states = states_of(RIG, observations_of(RIG, truth, begin_s + 1.2))
        off_mm.append(deviations(after_s(states, 1.0), truth).mm[:, 0])
    assert np.sqrt(np.mean(np.concatenate(off_mm) ** 2)) < most_mm
