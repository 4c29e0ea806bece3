"""A hand that is not where it is seen: found from all its markers, or set back by a few of them."""

import numpy as np
import pytest
from modelled_hand import after_s, deviations, model_rig, moving, seconds, sights
from scipy.spatial.transform import Rotation
from synthetic_rig import LOST, altered

from rhot_app.hand.kinematics import empty_frames, forward_arrays
from rhot_app.hand.model import neutral_pose
from rhot_app.hand.skeleton import HandPose
from rhot_app.simulator.motion import FACING
from rhot_app.tracking import model_tracker
from rhot_app.tracking.kalman.hand_filter import HandFilter
from rhot_app.tracking.kalman.holding import strangeness
from rhot_app.tracking.kalman.wearing import compile_wearing
from rhot_app.tracking.make import make_tracker
from rhot_app.tracking.model_start import Starter
from rhot_app.tracking.model_tracker import _STRANGEST
from rhot_app.tracking.rig_arrays import compile_rig

RIG = model_rig()
WEARING = compile_wearing(RIG)
COUNT, INDEX, RING, WRIST = len(WEARING.roles), 1, 3, 5


def worn_at(pose, scale=1.0):
    points, dh = np.empty((COUNT, 3)), WEARING.worn.dh
    forward_arrays(dh, pose.world_from_palm, pose.angles, empty_frames(dh), points)
    return pose.world_from_palm[:3, 3] + scale * (points - pose.world_from_palm[:3, 3])


def hand(shift_m=(0.0, 0.0, 0.0), turn_deg=0.0):
    world = np.eye(4)
    world[:3, :3] = Rotation.from_rotvec([0.0, np.radians(turn_deg), 0.0]).as_matrix() @ FACING
    world[:3, 3] = np.array([0.03, 0.08, 0.6]) + shift_m
    return HandPose(world, neutral_pose().angles)


def only(markers, *kept):
    return np.where(np.isin(np.arange(COUNT), kept)[:, None], markers, np.nan)


@pytest.mark.parametrize("scale", [1.0, 1.1])
@pytest.mark.parametrize("seen", [(INDEX, RING, WRIST), (INDEX, RING), (WRIST,), tuple(range(COUNT))])
def test_a_few_markers_set_back_a_hand_that_was_known(seen, scale):
    moved = hand((0.02, -0.01, 0.015), 4.0)
    markers = worn_at(moved, scale)
    found = Starter(compile_rig(RIG), WEARING).pose_near(only(markers, *seen), hand(), 0.1, scale)
    assert found is not None
    off = np.linalg.norm(worn_at(found, scale) - markers, axis=1)
    assert off[list(seen)].max() < 1e-3 and off.max() < 0.04


def test_markers_that_no_hand_has_set_nothing_back():
    starter, markers = Starter(compile_rig(RIG), WEARING), worn_at(hand())
    markers[RING] += 0.2, 0.0, 0.0
    assert starter.pose_near(only(markers, INDEX, RING, WRIST), hand(), 0.1) is None
    assert starter.pose_near(np.full((COUNT, 3), np.nan), hand(), 0.1) is None


@pytest.mark.parametrize("seen", [tuple(range(COUNT)), (INDEX, RING, WRIST)])
@pytest.mark.parametrize("speed_m_s", [0.0, 6.0])
def test_a_hand_that_has_leapt_away_is_soon_set_back(seen, speed_m_s):
    """Also one that is believed to go on fast, which excuses nothing."""
    def hide(t_s, camera, pixels, flags):
        flags[[m for m in range(COUNT) if m not in seen and t_s > 1.0]] |= LOST

    tracker, states = make_tracker(RIG), []
    for frame in altered(sights(RIG, moving(), 1.8), hide):
        tracker.ingest(frame)
        states.append(tracker.solve())
        if len(states) > 1 and seconds(states[-1]) > 1.2 >= seconds(states[-2]):
            estimate = tracker._hand.estimate
            estimate.world[:3, 3] += 0.0, 0.15, 0.1
            estimate.velocity[:3] = 0.0, speed_m_s, 0.0
            estimate.covariance[:3, :3] = 1e-8 * np.eye(3)
    fingers = [m for m in seen if m != WRIST]
    assert deviations(after_s(states, 1.45), moving()).mm[:, fingers].max() < 10.0


@pytest.mark.parametrize(("lasting", "every", "begun"), [(3, 1, 1), (8, 1, 2), (40, 1, 2), (40, 2, 1)])
def test_a_hand_whose_fingers_stay_bent_as_nobodys_is_begun_anew(monkeypatch, lasting, every, begun):
    """Once: if it is bent so again, it is. Its markers are where they are seen all the time."""
    starts, left = [], [0]
    start = HandFilter.start
    monkeypatch.setattr(HandFilter, "start", lambda hand, *pose: (starts.append(pose), start(hand, *pose)))
    monkeypatch.setattr(HandFilter, "strangeness", property(
        lambda _: _STRANGEST + (1.0 if left[0] > 0 and left[0] % every == 0 else 0.0)))
    tracker, states = make_tracker(RIG), []
    for frame in sights(RIG, moving(), 1.3):
        tracker.ingest(frame)
        if len(states) == 60:
            left[0] = lasting
        states.append(tracker.solve())
        left[0] -= 1
    assert len(starts) == begun
    assert deviations(after_s(states, 1.1), moving()).mm.max() < 5.0


def test_a_strange_hand_that_cannot_be_begun_anew_just_now_is_so_as_soon_as_it_can(monkeypatch):
    poses, fails, starts = Starter.pose_of, [], []
    monkeypatch.setattr(HandFilter, "strangeness", property(lambda _: _STRANGEST + 1.0))
    tracker = make_tracker(RIG)
    frames = sights(RIG, moving(), 1.5)
    for frame in frames[:len(frames) // 2]:
        tracker.ingest(frame)
        tracker.solve()

    def pose_of(starter, markers, scale=1.0):
        if len(fails) < 3:
            fails.append(markers)
            return None
        starts.append(markers)
        return poses(starter, markers, scale)

    tracker._anew_ns = -10**18  # long ago
    monkeypatch.setattr(Starter, "pose_of", pose_of)
    monkeypatch.setattr(Starter, "pose_near", lambda *_: None)
    for frame in frames[len(frames) // 2:]:
        tracker.ingest(frame)
        tracker.solve()
    assert len(fails) == 3 and len(starts) == 1


def test_how_strange_fingers_are_is_their_distance_from_habit():
    habits = WEARING.habits
    spread = np.linalg.cholesky(np.linalg.inv(habits.information))
    for sd in (0.0, 1.0, 5.0):
        assert strangeness(habits.mean + sd * spread[:, 7], habits) == pytest.approx(sd**2, abs=1e-9)


def test_a_tracked_hand_is_as_strange_as_it_is_estimated_to_be():
    tracker = make_tracker(RIG)
    for frame in sights(RIG, moving(), 0.5):
        tracker.ingest(frame)
        state = tracker.solve()
    assert tracker._hand.strangeness == pytest.approx(strangeness(state.angles, WEARING.habits), rel=1e-6)
    assert tracker._hand.strangeness > 0.1


def test_a_thumb_that_was_bent_forwards_stays_so_when_a_frame_comes_late(monkeypatch):
    tracker, frames = make_tracker(RIG), sights(RIG, moving(), 1.3)
    late = frames.pop(-2)
    for frame in frames[:-1]:
        tracker.ingest(frame)
        tracker.solve()
    monkeypatch.setattr(model_tracker, "bent_backwards", lambda _: True)
    monkeypatch.setattr(model_tracker, "unbend", lambda estimate, *_: True)
    tracker.ingest(frames[-1])
    tracker.solve()
    dropped, angles = tracker._timeline.dropped, tracker._hand.estimate.angles.copy()
    tracker.ingest(late)
    tracker.solve()
    assert tracker._timeline.dropped == dropped + 1
    np.testing.assert_array_equal(tracker._hand.estimate.angles, angles)
