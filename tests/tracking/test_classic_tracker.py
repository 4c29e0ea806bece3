"""The whole classic tracker on synthetic sights: accuracy, times, and the work it takes."""

import time
from itertools import islice

import msgspec
import numpy as np
import pytest
from grasping_hand import GRASP, MEASURED, REST, RIG, states_of
from patience import quickest
from synthetic_rig import (
    FAST,
    WIDE,
    Viewing,
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
from rhot_app.project import FilterSettings, TrackerSettings
from rhot_app.state import LATENCY_STAGES, Knowledge
from rhot_app.tracking.scene import make_tracker


def test_a_grasping_hand_is_measured_to_a_fraction_of_a_millimetre():
    errors = compare(RIG, states_of(), GRASP)
    assert errors.marker_mm < 0.5 and errors.fingertip_mm < 0.6
    assert errors.measured == 1.0
    assert errors.rate_hz == pytest.approx(40.0, abs=0.5)


def test_a_hand_at_two_metres_per_second_is_met_although_the_cameras_are_not_synchronised():
    rig = make_rig(FAST, filters=FilterSettings(enabled=False))
    trajectory = hand_trajectory(rig, "fast", 4.0, distance_m=1.0)
    assert np.linalg.norm(trajectory(np.linspace(0, 4, 4000), 1), axis=2).max() > 1.5
    assert compare(rig, states_of(Viewing(noise_px=0.0), rig, FAST, trajectory), trajectory).marker_mm < 0.1
    wide = make_rig(filters=FilterSettings(enabled=False))
    trajectory = hand_trajectory(wide, "fast", 4.0)
    assert compare(wide, states_of(Viewing(noise_px=0.0), wide, WIDE, trajectory), trajectory).marker_mm < 0.6


@pytest.mark.parametrize("ik", ["transpose", "pseudo_inverse", "svd", "dls", "newton", "lm", "closed_form"])
def test_every_inverse_kinematics_solver_bends_the_fingers(ik):
    rig = msgspec.structs.replace(RIG, tracker=TrackerSettings(ik=ik))
    errors = compare(rig, states_of(rig=rig), GRASP)
    assert errors.fingertip_mm < 0.6 and errors.marker_mm < 0.5


def test_lost_and_late_frames_cost_little():
    errors = compare(RIG, states_of(Viewing(frame_loss=0.2, delay_s=(0.0, 0.06))), GRASP)
    assert errors.marker_mm < 1.0 and errors.fingertip_mm < 1.2
    assert errors.measured > 0.9


def test_three_cameras_measure_better_than_two():
    rig = make_rig(cameras=3)
    viewing = Viewing(phases=(0.0, 0.37, 0.71))
    assert compare(rig, states_of(viewing, rig), GRASP).marker_mm < 0.8 * compare(RIG, states_of(), GRASP).marker_mm


def test_the_outline_of_a_body_is_set_back_to_its_centre():
    rig = make_rig(bodies=True, filters=FilterSettings(enabled=False))
    points = REST.copy()
    radii = np.array([1e-3 * marker.radius_mm for marker in rig.markers.markers])
    seen = points.copy()
    seen[:5, 2] -= radii[:5] ** 2 / points[:5, 2]
    states = states_of(Viewing(noise_px=0.0), rig, WIDE, still_trajectory(seen), 0.5)
    assert np.abs(states[-1].marker_positions[:5] - points[:5]).max() < 1e-5
    # The band lies as the palm does: its flat side is turned to the cameras.
    assert 1e3 * (states[-1].marker_positions[5, 2] - seen[5, 2]) == pytest.approx(1e3 * 0.0212**2 / 0.6, abs=0.1)


def test_states_carry_their_numbers_times_and_last_sights():
    states = states_of(Viewing(noise_px=0.0), seconds=1.0, trajectory=still_trajectory(REST))
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


def test_a_flood_of_frames_is_taken_in_quickly():
    tracker = make_tracker(RIG)
    frames = observe(RIG, WIDE, GRASP, 5.0, Viewing())
    run(tracker, frames[:20])
    flood = iter(frames[20:])
    tenth = len(frames[20:]) // 10
    limit_s = 100e-6 * tenth  # 10 µs a frame on an idle machine
    assert quickest(lambda: [tracker.ingest(one) for one in islice(flood, tenth)], times=10,
                    clock=time.process_time) < limit_s
    for observations in flood:
        tracker.ingest(observations)
    state = tracker.solve()
    assert state is not None and (state.marker_knowledge == MEASURED).all()


def test_frames_of_an_older_session_time_do_not_confuse():
    """A tracker that is reset starts from nothing, whatever the new times are."""
    tracker = make_tracker(RIG)
    assert run(tracker, observe(RIG, WIDE, GRASP, 0.5, Viewing()))
    tracker.reset()
    assert tracker.solve() is None
    early = [frame(c, 0.025 * k - 100.0, np.full((6, 2), 200.0), np.zeros(6, np.uint16), 0.025 * k - 99.9)
             for k in range(10) for c in (0, 1)]
    assert run(tracker, early)
