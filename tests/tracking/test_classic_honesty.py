"""What the classic tracker says when it cannot see, or should not believe what it sees."""

from dataclasses import replace
from itertools import pairwise

import msgspec
import numpy as np
import pytest
from grasping_hand import GRASP, INFERRED, MEASURED, REST, RIG, UNKNOWN, states_of
from synthetic_rig import (
    EPOCH_NS,
    LOST,
    WIDE,
    Viewing,
    altered,
    compare,
    hidden,
    make_rig,
    observe,
    run,
    seconds,
    still_trajectory,
)

from rhot_app.geometry.camera import CameraModel
from rhot_app.hand.skeleton import JOINT_SLICES
from rhot_app.state import Condition, Knowledge
from rhot_app.tracking.scene import make_tracker
from rhot_node.wire.messages import MarkerFlag


def test_every_part_says_how_it_is_known():
    state = states_of(seconds=0.5)[-1]
    assert state.condition is Condition.TRACKING
    assert (state.marker_knowledge == MEASURED).all()
    assert state.joint_knowledge[0] == MEASURED and (state.joint_knowledge[1:] == INFERRED).all()
    assert (state.angle_knowledge == INFERRED).all()
    assert state.palm_knowledge is Knowledge.GUESSED
    assert state.epipolar_error_px.max() < 0.3
    assert np.isfinite(state.marker_covariances).all()


def test_a_hidden_marker_is_carried_on_then_unknown_and_its_finger_a_guess():
    states = run(make_tracker(RIG), altered(observe(RIG, WIDE, GRASP, 2.0, Viewing()), hidden(1, 1.0, camera=0)))
    knowledge = {round(seconds(s) - 1.0, 3): s.marker_knowledge[1] for s in states}
    assert all(known == MEASURED for t, known in knowledge.items() if -0.9 < t < -0.03)
    assert all(known == INFERRED for t, known in knowledge.items() if 0.03 < t < 0.2)
    assert all(known == UNKNOWN for t, known in knowledge.items() if t > 0.27)
    soon = next(s for s in states if seconds(s) > 1.05)
    assert np.linalg.norm(soon.marker_positions[1] - GRASP(np.array([seconds(soon)]))[0, 1]) < 0.02
    variances = [np.trace(s.marker_covariances[1]) for s in states if 1.03 < seconds(s) < 1.2]
    assert (np.diff(variances) > 0).all()
    last = states[-1]
    assert np.isnan(last.marker_positions[1]).all() and np.isnan(last.marker_raw_positions[1]).all()
    assert (last.joint_knowledge[JOINT_SLICES[1]] == Knowledge.GUESSED).all()
    assert (last.joint_knowledge[JOINT_SLICES[2]] == INFERRED).all()
    assert last.condition is Condition.PARTIAL
    assert np.isfinite(last.joint_positions).all()


@pytest.mark.parametrize("flag", [MarkerFlag.PARTIAL, MarkerFlag.EDGE, MarkerFlag.AMBIGUOUS])
def test_a_doubtful_sight_is_inferred_unless_two_others_are_clear(flag):
    def doubt(t, camera, _pixels, flags):
        if camera == 0 and t > 0.5:
            flags[2] |= int(flag)

    for cameras, expected in ((2, INFERRED), (3, MEASURED)):
        rig = make_rig(cameras=cameras)
        viewing = Viewing(phases=(0.0, 0.37, 0.71))
        last = run(make_tracker(rig), altered(observe(rig, WIDE, GRASP, 1.0, viewing), doubt))[-1]
        assert last.marker_knowledge[2] == expected
        assert (np.delete(last.marker_knowledge, 2) == MEASURED).all()
        assert np.linalg.norm(last.marker_positions[2] - GRASP(np.array([seconds(last)]))[0, 2]) < 3e-3


def shifted(camera, by_px, since_s=0.5):
    """Edits frames so that one camera shows the ring finger's marker elsewhere."""
    def shift(t, eye, pixels, _flags):
        if eye == camera and t > since_s:
            pixels[3] += by_px

    return shift


def test_rays_that_miss_each_other_are_not_measured():
    states = run(make_tracker(RIG), altered(observe(RIG, WIDE, GRASP, 1.2, Viewing()), shifted(1, [0.0, 9.0])))
    assert states[-1].marker_knowledge[3] == UNKNOWN
    assert states[-1].epipolar_error_px[3] == pytest.approx(4.5, abs=0.3)
    assert all(s.marker_knowledge[3] != MEASURED for s in states if seconds(s) > 0.53)


def test_rays_that_nearly_meet_are_inferred():
    """A marker hidden so slowly that no node noticed: its views disagree by more than calibrations do."""
    last = run(make_tracker(RIG), altered(observe(RIG, WIDE, GRASP, 1.0, Viewing()), shifted(1, [0.0, 3.0])))[-1]
    assert last.marker_knowledge[3] == INFERRED
    assert (np.delete(last.marker_knowledge, 3) == MEASURED).all()


def test_one_wrong_camera_of_three_is_given_up():
    rig = make_rig(cameras=3)
    frames = observe(rig, WIDE, GRASP, 1.0, Viewing(phases=(0.0, 0.37, 0.71)))
    last = run(make_tracker(rig), altered(frames, shifted(2, [-4.0, 9.0], since_s=-1.0)))[-1]
    assert last.marker_knowledge[3] == MEASURED
    assert np.linalg.norm(last.marker_positions[3] - GRASP(np.array([seconds(last)]))[0, 3]) < 2e-3


def test_a_marker_beyond_the_hands_reach_is_not_measured() -> None:
    elsewhere = REST[4] + np.array([-0.3, 0.15, 0.1])
    models = [CameraModel.from_rig(node.intrinsics, node.pose) for node in RIG.nodes]

    def jump(t, camera, pixels, flags):
        if t >= 0.5:
            pixels[4] = models[camera].project(elsewhere)[0]
            flags[4] = int(MarkerFlag.ACQUIRED) if t < 0.524 else 0

    states = run(make_tracker(RIG), altered(observe(RIG, WIDE, still_trajectory(REST), 2.0, Viewing()), jump))
    assert [s.marker_knowledge[4] for s in states if seconds(s) < 0.45][-1] == MEASURED
    assert all(s.marker_knowledge[4] != MEASURED for s in states if seconds(s) > 0.55)
    assert all((s.marker_knowledge[:4] == MEASURED).all() for s in states if seconds(s) > 0.05)


def test_an_impossible_jump_waits_for_three_states():
    """A free point: a hand's marker could not get there at all."""
    markers = list(RIG.markers.markers)
    markers[4] = msgspec.structs.replace(markers[4], role=None)
    rig = msgspec.structs.replace(RIG, markers=msgspec.structs.replace(RIG.markers, markers=tuple(markers)))
    elsewhere = REST[4] + np.array([-0.3, 0.15, 0.1])
    models = [CameraModel.from_rig(node.intrinsics, node.pose) for node in RIG.nodes]

    def jump(t, camera, pixels, flags):
        if 0.5 <= t < 0.54 or t >= 1.0:
            pixels[4] = models[camera].project(elsewhere)[0]
        if any(start <= t < start + 0.024 for start in (0.5, 0.54, 1.0)):
            flags[4] = int(MarkerFlag.ACQUIRED)

    frames = altered(observe(RIG, WIDE, still_trajectory(REST), 1.5, Viewing(phases=(0.0, 0.02))), jump)
    states = run(make_tracker(rig), frames)
    for state in states:
        if state.marker_knowledge[4] == MEASURED:
            place = elsewhere if seconds(state) > 1.0 else REST[4]
            assert np.linalg.norm(state.marker_positions[4] - place) < 0.01
    after = [s.marker_knowledge[4] for s in states if seconds(s) > 1.0]
    assert after.index(MEASURED) in (2, 3) and after[-1] == MEASURED
    glitch = [s.marker_knowledge[4] for s in states if 0.5 < seconds(s) < 0.54]
    assert glitch and MEASURED not in glitch


def test_conditions_from_nothing_to_tracking_to_lost():
    def empty(t, _camera, _pixels, flags):
        if t < 0.5 or t > 1.5:
            flags[:] = LOST

    tracker = make_tracker(RIG)
    assert tracker.solve() is None
    states = run(tracker, altered(observe(RIG, WIDE, GRASP, 3.0, Viewing()), empty))
    words = [s.condition for s in states]
    assert words[0] is Condition.SEARCHING and words[-1] is Condition.LOST
    changes = [words[0], *(b for a, b in pairwise(words) if a is not b)]
    assert changes == [Condition.SEARCHING, Condition.PARTIAL, Condition.TRACKING, Condition.PARTIAL, Condition.LOST] \
        or changes == [Condition.SEARCHING, Condition.TRACKING, Condition.PARTIAL, Condition.LOST]
    last = states[-1]
    assert np.isnan(last.marker_positions).all() and (last.marker_knowledge == UNKNOWN).all()
    assert np.isnan(last.joint_positions).all() and (last.joint_knowledge == UNKNOWN).all()
    assert last.palm_knowledge is UNKNOWN


def test_one_camera_alone_measures_nothing_and_says_lost():
    frames = [f for f in observe(RIG, WIDE, GRASP, 2.0, Viewing())
              if f.camera == 0 or f.t_row0_master_ns < EPOCH_NS + 10**9]
    states = run(make_tracker(RIG), frames)
    alone = [s for s in states if seconds(s) > 1.25]
    assert len(alone) > 20
    assert all(s.condition is Condition.LOST and (s.marker_knowledge >= INFERRED).all() for s in alone)
    assert (alone[-1].marker_knowledge == UNKNOWN).all()
    assert np.isfinite(alone[-1].camera_pixels[0]).all()


def test_a_rig_with_one_camera_searches_forever():
    rig = make_rig(cameras=1)
    states = states_of(Viewing(phases=(0.0,)), rig, seconds=1.0)
    assert states and all(s.condition is Condition.SEARCHING for s in states)


@pytest.mark.parametrize("seed", range(3))
def test_garbage_never_raises_and_is_never_measured(seed):
    rng = np.random.default_rng(seed)
    tracker = make_tracker(RIG)
    clean = observe(RIG, WIDE, GRASP, 3.0, Viewing())
    poison = np.array([np.nan, np.inf, -np.inf, 1e300, -1e9, 0.0])
    for f in clean:
        pixels, covariances, flags = f.pixels.copy(), f.covariances.copy(), f.flags.copy()
        pixels[rng.random(pixels.shape) < 0.15] = rng.choice(poison)
        covariances[rng.random(covariances.shape) < 0.1] = rng.choice(poison)
        flags[rng.random(6) < 0.1] |= np.uint16(rng.integers(0, 64))
        dirty = replace(f, pixels=pixels, covariances=covariances, flags=flags,
                        t_row0_master_ns=f.t_row0_master_ns + int(rng.choice([0, 0, 0, 0, 10**7, -10**10, 10**11])))
        tracker.ingest(dirty)
        state = tracker.solve()
        if state is not None:
            measured = state.marker_knowledge <= INFERRED
            assert np.isfinite(state.marker_positions[measured]).all()
            assert np.isfinite(state.marker_covariances[measured]).all()
            assert np.isnan(state.marker_positions[state.marker_knowledge == UNKNOWN]).all()
    tracker.reset()
    assert compare(RIG, run(tracker, clean), GRASP).marker_mm < 0.5
