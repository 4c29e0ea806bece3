"""The whole classic tracker on synthetic sights: accuracy, and what it says when it cannot see."""

import time
from dataclasses import replace
from itertools import pairwise

import msgspec
import numpy as np
import pytest
from synthetic_rig import (
    EPOCH_NS,
    FAST,
    LOST,
    WIDE,
    Sight,
    compare,
    frame,
    hand_trajectory,
    make_rig,
    observe,
    run,
    still_trajectory,
)

from rhot_app.geometry.camera import CameraModel
from rhot_app.hand.skeleton import JOINT_SLICES
from rhot_app.project import FilterSettings
from rhot_app.tracking.make import make_tracker
from rhot_app.tracking.state import LATENCY_STAGES, Condition, Knowledge
from rhot_node.wire.messages import MarkerFlag

RIG = make_rig()
GRASP = hand_trajectory(RIG, "grasp", 5.0)
REST = GRASP(np.array([0.0]))[0]
MEASURED, INFERRED, UNKNOWN = Knowledge.MEASURED, Knowledge.INFERRED, Knowledge.UNKNOWN


def states_of(sight=Sight(), rig=RIG, preset=WIDE, trajectory=GRASP, seconds=4.0):  # noqa: B008 - frozen
    return run(make_tracker(rig), observe(rig, preset, trajectory, seconds, sight))


def seconds(state):
    return (state.t_master_ns - EPOCH_NS) * 1e-9


def altered(frames, change):
    """Frames whose pixels and flags `change(t_s, camera, pixels, flags)` has edited in place."""
    out = []
    for f in frames:
        pixels, flags = f.pixels.copy(), f.flags.copy()
        change((f.t_row0_master_ns - EPOCH_NS) * 1e-9, f.camera, pixels, flags)
        pixels[(flags & LOST) != 0] = np.nan
        out.append(replace(f, pixels=pixels, flags=flags))
    return out


def test_a_grasping_hand_is_measured_to_a_fraction_of_a_millimetre():
    errors = compare(RIG, states_of(), GRASP)
    assert errors.marker_mm < 0.5 and errors.fingertip_mm < 0.6
    assert errors.measured == 1.0
    assert errors.rate_hz == pytest.approx(40.0, abs=0.5)


def test_a_hand_at_two_metres_per_second_is_met_although_the_cameras_are_not_synchronised():
    rig = make_rig(FAST, filters=FilterSettings(enabled=False))
    trajectory = hand_trajectory(rig, "fast", 4.0, distance_m=1.0)
    assert np.linalg.norm(trajectory(np.linspace(0, 4, 4000), 1), axis=2).max() > 1.5
    assert compare(rig, states_of(Sight(noise_px=0.0), rig, FAST, trajectory), trajectory).marker_mm < 0.1
    wide = make_rig(filters=FilterSettings(enabled=False))
    trajectory = hand_trajectory(wide, "fast", 4.0)
    assert compare(wide, states_of(Sight(noise_px=0.0), wide, WIDE, trajectory), trajectory).marker_mm < 0.6


def test_lost_and_late_frames_cost_little():
    errors = compare(RIG, states_of(Sight(frame_loss=0.2, delay_s=(0.0, 0.06))), GRASP)
    assert errors.marker_mm < 1.0 and errors.fingertip_mm < 1.2
    assert errors.measured > 0.9


def test_three_cameras_measure_better_than_two():
    rig = make_rig(cameras=3)
    sight = Sight(phases=(0.0, 0.37, 0.71))
    assert compare(rig, states_of(sight, rig), GRASP).marker_mm < 0.8 * compare(RIG, states_of(), GRASP).marker_mm


def test_the_outline_of_a_body_is_set_back_to_its_centre():
    rig = make_rig(bodies=True, filters=FilterSettings(enabled=False))
    points = REST.copy()
    radii = np.array([1e-3 * marker.radius_mm for marker in rig.markers.markers])
    seen = points.copy()
    seen[:5, 2] -= radii[:5] ** 2 / points[:5, 2]
    states = states_of(Sight(noise_px=0.0), rig, WIDE, still_trajectory(seen), 0.5)
    assert np.abs(states[-1].marker_positions[:5] - points[:5]).max() < 1e-5
    # The band lies as the palm does: its flat side is turned to the cameras.
    assert 1e3 * (states[-1].marker_positions[5, 2] - seen[5, 2]) == pytest.approx(1e3 * 0.0212**2 / 0.6, abs=0.1)


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
    def hide(t, camera, _pixels, flags):
        if camera == 0 and t > 1.0:
            flags[1] = LOST

    states = run(make_tracker(RIG), altered(observe(RIG, WIDE, GRASP, 2.0, Sight()), hide))
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
        sight = Sight(phases=(0.0, 0.37, 0.71))
        last = run(make_tracker(rig), altered(observe(rig, WIDE, GRASP, 1.0, sight), doubt))[-1]
        assert last.marker_knowledge[2] == expected
        assert (np.delete(last.marker_knowledge, 2) == MEASURED).all()
        assert np.linalg.norm(last.marker_positions[2] - GRASP(np.array([seconds(last)]))[0, 2]) < 3e-3


def test_rays_that_miss_each_other_are_not_measured():
    def shift(t, camera, pixels, _flags):
        if camera == 1 and t > 0.5:
            pixels[3, 1] += 9.0

    states = run(make_tracker(RIG), altered(observe(RIG, WIDE, GRASP, 1.2, Sight()), shift))
    assert states[-1].marker_knowledge[3] == UNKNOWN
    assert states[-1].epipolar_error_px[3] == pytest.approx(4.5, abs=0.3)
    assert all(s.marker_knowledge[3] != MEASURED for s in states if seconds(s) > 0.53)


def test_one_wrong_camera_of_three_is_given_up():
    def shift(_t, camera, pixels, _flags):
        if camera == 2:
            pixels[3] += [-4.0, 9.0]

    rig = make_rig(cameras=3)
    sight = Sight(phases=(0.0, 0.37, 0.71))
    last = run(make_tracker(rig), altered(observe(rig, WIDE, GRASP, 1.0, sight), shift))[-1]
    assert last.marker_knowledge[3] == MEASURED
    assert np.linalg.norm(last.marker_positions[3] - GRASP(np.array([seconds(last)]))[0, 3]) < 2e-3


def test_an_impossible_jump_waits_for_three_states():
    elsewhere = REST[4] + np.array([-0.3, 0.15, 0.1])
    models = [CameraModel.from_rig(node.intrinsics, node.pose) for node in RIG.nodes]

    def jump(t, camera, pixels, flags):
        if 0.5 <= t < 0.54 or t >= 1.0:
            pixels[4] = models[camera].project(elsewhere)[0]
        if any(start <= t < start + 0.024 for start in (0.5, 0.54, 1.0)):
            flags[4] = int(MarkerFlag.ACQUIRED)

    frames = altered(observe(RIG, WIDE, still_trajectory(REST), 1.5, Sight(phases=(0.0, 0.02))), jump)
    states = run(make_tracker(RIG), frames)
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
    states = run(tracker, altered(observe(RIG, WIDE, GRASP, 3.0, Sight()), empty))
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
    frames = [f for f in observe(RIG, WIDE, GRASP, 2.0, Sight())
              if f.camera == 0 or f.t_row0_master_ns < EPOCH_NS + 10**9]
    states = run(make_tracker(RIG), frames)
    alone = [s for s in states if seconds(s) > 1.25]
    assert len(alone) > 20
    assert all(s.condition is Condition.LOST and (s.marker_knowledge >= INFERRED).all() for s in alone)
    assert (alone[-1].marker_knowledge == UNKNOWN).all()
    assert np.isfinite(alone[-1].camera_pixels[0]).all()


def test_a_rig_with_one_camera_searches_forever():
    rig = make_rig(cameras=1)
    states = states_of(Sight(phases=(0.0,)), rig, seconds=1.0)
    assert states and all(s.condition is Condition.SEARCHING for s in states)


@pytest.mark.parametrize("seed", range(3))
def test_garbage_never_raises_and_is_never_measured(seed):
    rng = np.random.default_rng(seed)
    tracker = make_tracker(RIG)
    clean = observe(RIG, WIDE, GRASP, 3.0, Sight())
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


def test_states_carry_their_numbers_times_and_last_sights():
    states = states_of(Sight(noise_px=0.0), seconds=1.0, trajectory=still_trajectory(REST))
    assert [s.sequence for s in states] == list(range(len(states)))
    assert (np.diff([s.t_master_ns for s in states]) > 0).all()
    for state in states:
        assert set(state.latency_s) <= set(LATENCY_STAGES)
        assert all(np.isfinite(value) and value >= 0 for value in state.latency_s.values())
        assert state.t_receive_ns > state.t_master_ns
    models = [CameraModel.from_rig(node.intrinsics, node.pose) for node in RIG.nodes]
    np.testing.assert_allclose(states[-1].camera_pixels, [m.project(REST) for m in models], atol=1e-9)
    assert (states[-1].camera_flags == 0).all()


def test_a_marker_without_a_place_on_the_hand_is_a_free_point():
    markers = tuple(msgspec.structs.replace(marker, role=None if k in (1, 5) else marker.role)
                    for k, marker in enumerate(RIG.markers.markers))
    rig = msgspec.structs.replace(RIG, markers=msgspec.structs.replace(RIG.markers, markers=markers))
    last = states_of(rig=rig, seconds=0.6)[-1]
    assert (last.marker_knowledge == MEASURED).all()
    assert (last.joint_knowledge[JOINT_SLICES[1]] >= Knowledge.GUESSED).all()


def test_time_offsets_of_the_rig_are_applied():
    shift = 0.006
    second = msgspec.structs.replace(RIG.nodes[1], time_offset_s=shift)
    moved = msgspec.structs.replace(RIG, nodes=(RIG.nodes[0], second))
    frames = [replace(f, t_row0_master_ns=f.t_row0_master_ns - round(1e9 * shift)) if f.camera == 1 else f
              for f in observe(RIG, WIDE, GRASP, 3.0, Sight())]
    assert compare(moved, run(make_tracker(moved), frames), GRASP).marker_mm < 0.5
    assert compare(RIG, run(make_tracker(RIG), frames), GRASP).marker_mm > 0.7


def test_a_flood_of_frames_is_taken_in_quickly():
    tracker = make_tracker(RIG)
    frames = observe(RIG, WIDE, GRASP, 5.0, Sight())
    run(tracker, frames[:20])
    begun = time.perf_counter()
    for observations in frames[20:]:
        tracker.ingest(observations)
    assert (time.perf_counter() - begun) / len(frames[20:]) < 100e-6  # 10 µs on an idle machine
    state = tracker.solve()
    assert state is not None and (state.marker_knowledge == MEASURED).all()


def test_frames_of_an_older_session_time_do_not_confuse():
    """A tracker that is reset starts from nothing, whatever the new times are."""
    tracker = make_tracker(RIG)
    assert run(tracker, observe(RIG, WIDE, GRASP, 0.5, Sight()))
    tracker.reset()
    assert tracker.solve() is None
    early = [frame(c, 0.025 * k - 100.0, np.full((6, 2), 200.0), np.zeros(6, np.uint16), 0.025 * k - 99.9)
             for k in range(10) for c in (0, 1)]
    assert run(tracker, early)
