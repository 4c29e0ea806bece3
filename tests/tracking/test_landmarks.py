"""Landmarks of a bare hand in the estimator: their rows, start, errors against triangulation, one camera, and paint."""

from collections import Counter
from dataclasses import replace
from functools import cache

import msgspec
import numpy as np
import pytest
from landmark_detector import (
    DISTANCE_M,
    EPOCH_NS,
    LandmarkErrors,
    detected_landmarks,
    landmark_rig,
    moving_hand,
)
from modelled_hand import states_of
from shipped_markers import LANDMARKS21, RHOT6

from rhot_app.geometry.camera import CameraModel
from rhot_app.hand.kinematics import forward
from rhot_app.hand.landmarks import NOISE_M
from rhot_app.hand.model import build_model
from rhot_app.hand.motion.palm_on_plane import PalmOnPlane
from rhot_app.hand.places import LANDMARK_ROLES
from rhot_app.hand.skeleton import JOINTS
from rhot_app.project import PalmPlane
from rhot_app.state import Condition
from rhot_app.tracking.markers import acquisition
from rhot_app.tracking.markers.marker_model import compile_markers
from rhot_app.tracking.markers.marker_residual import MarkerFrame
from rhot_app.tracking.scene import make_tracker
from rhot_node.wire.messages import MarkerFlag

FPS, SECONDS, SETTLED_S = 30.0, 2.5, 1.0
MOST_START_S = 0.5
RIG = landmark_rig()
TIPS = [JOINTS.index(f"{finger}_tip") for finger in ("thumb", "index", "middle", "ring", "little")]


@cache
def hand(motion="grasp", bone_sd=0.0):
    return moving_hand(RIG, motion, SECONDS, FPS, 1, bone_sd)


@cache
def tracked(motion="grasp", bone_sd=0.0):
    return states_of(RIG, detected_landmarks(RIG, hand(motion, bone_sd), 1))


def off(states, truth, begin=SETTLED_S):
    """Errors (N, 21, 3) m of the joints, their covariances, and the joints (N, 21, 3) that were triangulated."""
    chosen = [state for state in states if state.tracked and 1e-9 * (state.t_master_ns - EPOCH_NS) >= begin]
    rows = [round(1e-9 * (state.t_master_ns - EPOCH_NS) * FPS) for state in chosen]
    joints = truth.joints()[rows]
    return (np.array([state.joint_positions for state in chosen]) - joints,
            np.array([state.joint_covariances for state in chosen]),
            np.array([state.marker_raw_positions for state in chosen])[:, :21] - joints)


def rms_mm(errors):
    return 1e3 * float(np.sqrt(np.nanmean(np.sum(errors**2, axis=-1))))


def test_markers_and_landmarks_of_one_image_may_come_apart():
    """The hand networks work beside the search for paint, and their landmarks come later."""
    rig = msgspec.structs.replace(RIG, markers=type(RHOT6)((*LANDMARKS21.markers, RHOT6.markers[0])))
    whole = detected_landmarks(RIG, hand(), 1)[0]

    def frame(found):
        columns = {"pixels": np.where(found[:, None], [200.0, 200.0], np.nan),
                   "covariances": np.tile(np.eye(2), (22, 1, 1)), "diameters": np.full(22, 10.0),
                   "qualities": np.ones(22), "flags": np.where(found, 0, int(MarkerFlag.LOST)).astype(np.uint16)}
        return replace(whole, **columns)
    estimator, paint = make_tracker(rig), np.arange(22) == 21
    for found, taken in ((paint, True), (~paint, True), (paint, False), (~paint, False), (~paint & ~paint, False)):
        estimator.ingest(frame(found))
        assert (estimator.solve() is not None) == taken


def test_the_marker_set_has_the_joints_in_the_usual_order():
    assert LANDMARKS21.ids == JOINTS
    assert tuple(marker.role for marker in LANDMARKS21.markers) == LANDMARK_ROLES


def test_a_landmark_is_at_its_joint():
    rig = landmark_rig()
    model, truth = compile_markers(rig), moving_hand(rig, "grasp", 0.1, FPS, 1)
    process = model.process()
    state = process.start(truth.worlds[0], truth.angles[0], (0.01, 0.1))[0]
    frame = MarkerFrame(model, detected_landmarks(rig, truth, 1)[0])
    lens = CameraModel.from_rig(rig.nodes[0].intrinsics, rig.nodes[0].pose)
    np.testing.assert_allclose(frame.expected(state), lens.project(truth.joints()[0]), atol=1e-6)


def test_each_landmark_errs_by_itself_in_proportion_to_its_distance():
    """Whitened rows give the normal equations of each landmark's own noise, with a Jacobian by finite differences."""
    model, truth = compile_markers(RIG), hand()
    process, observations = model.process(), detected_landmarks(RIG, hand(), 1)[0]
    frame = MarkerFrame(model, observations)
    state = process.start(truth.worlds[0], truth.angles[0], (0.01, 0.1))[0]
    frame.add_landmark_noise(state)
    rows = frame.linearise(state)

    def seen(step):
        return frame.expected(process.retract(state, step)).ravel()

    size, small = process.size, 1e-6
    jacobian = np.array([(seen(small * unit) - seen(-small * unit)) / (2 * small) for unit in np.eye(size)]).T
    covariance = np.zeros((42, 42))
    for m in range(21):
        slope = jacobian[2 * m:2 * m + 2, :3]
        px_per_m = np.sqrt(np.linalg.norm(np.cross(slope[0], slope[1])))
        covariance[2 * m:2 * m + 2, 2 * m:2 * m + 2] = (
            observations.covariances[m] + (0.02**2 + (NOISE_M * px_per_m) ** 2) * np.eye(2))
    error = (observations.pixels - frame.expected(state)).ravel()
    np.testing.assert_allclose(rows.jacobian.T @ rows.jacobian,
                               jacobian.T @ np.linalg.solve(covariance, jacobian), rtol=1e-3, atol=1.0)
    np.testing.assert_allclose(rows.error @ rows.error, error @ np.linalg.solve(covariance, error), rtol=1e-3)


def test_a_frame_that_is_weighed_again_has_the_noise_of_its_detector_once(monkeypatch):
    """A start weighs the frames again that led to it."""
    widen, weighed = MarkerFrame.add_landmark_noise, []

    def widened(frame, state):
        weighed.append((frame.camera, frame.observations.t_row0_master_ns))
        np.testing.assert_array_equal(frame.covariances, frame.observations.covariances)
        widen(frame, state)
    monkeypatch.setattr(MarkerFrame, "add_landmark_noise", widened)
    tracker = make_tracker(RIG)
    for one in detected_landmarks(RIG, hand(), 1)[:30]:
        tracker.ingest(one)
        tracker.solve()
    assert max(Counter(weighed).values()) > 1, "no frame was weighed twice"


def test_the_hand_is_found_from_the_first_frames_of_two_cameras():
    first = next(state for state in tracked() if state.tracked)
    assert 1e-9 * (first.t_master_ns - EPOCH_NS) <= MOST_START_S


@pytest.mark.parametrize(("motion", "bone_sd"), [("grasp", 0.0), ("grasp", 0.05), ("rest", 0.05)])
def test_joints_are_better_than_triangulated_and_their_covariances_true(motion, bone_sd):
    errors, covariances, triangulated = off(tracked(motion, bone_sd), hand(motion, bone_sd))
    assert rms_mm(errors) < (1.0 if bone_sd else 0.9) * rms_mm(triangulated)
    nees = np.einsum("nji,njik,njk->nj", errors, np.linalg.inv(covariances), errors) / 3.0
    assert 0.1 < nees.mean() < (3.0 if bone_sd else 2.0)
    within = np.abs(errors) <= 3.0 * np.sqrt(np.einsum("njii->nji", covariances))
    assert within.mean() >= (0.95 if bone_sd else 0.97)


def test_one_camera_keeps_the_hand_and_says_that_it_knows_the_distance_less():
    frames = [frame for frame in detected_landmarks(RIG, hand(), 1)
              if frame.camera == 0 or frame.t_row0_master_ns < EPOCH_NS + 10**9]
    alone = [state for state in states_of(RIG, frames) if state.t_master_ns > EPOCH_NS + 17 * 10**8]
    assert alone and all(state.tracked for state in alone)
    errors, covariances, _ = off(alone, hand())
    line = CameraModel.from_rig(RIG.nodes[0].intrinsics, RIG.nodes[0].pose).camera_from_world[2, :3]
    along, across = line, np.array([0.0, 1.0, 0.0])
    depth = np.sqrt(np.einsum("i,njik,k->nj", along, covariances, along))
    assert depth.mean() > 1.5 * np.sqrt(np.einsum("i,njik,k->nj", across, covariances, across)).mean()
    assert (np.abs(errors @ along) <= 3.0 * depth).mean() >= 0.95
    assert np.abs(errors @ along).max() < 0.15 * DISTANCE_M


@pytest.mark.parametrize("hidden", [range(21), range(12)])
def test_a_hand_that_the_newest_frames_do_not_show_is_not_called_tracking(hidden):
    """Most of it at least: its motion is only predicted then."""
    end_ns, frames = EPOCH_NS + 10**9, []
    for frame in detected_landmarks(RIG, hand(), 1):
        lost = (np.arange(21)[:, None] == hidden).any(axis=1) & (frame.t_row0_master_ns > end_ns)
        frames.append(replace(frame, pixels=np.where(lost[:, None], np.nan, frame.pixels),
                              flags=np.where(lost, int(MarkerFlag.LOST), 0).astype(np.uint16)))
    after = [state.condition for state in states_of(RIG, frames) if state.t_master_ns > end_ns]
    assert Condition.TRACKING not in after[4:] and Condition.PARTIAL in after[:4]
    assert after[2:4] == [Condition.PARTIAL] * 2, "from their second frames on"


@pytest.mark.parametrize(("scale", "believed"), [(1.0, True), (0.4, False), (1.5, False)])
def test_a_hand_that_its_landmarks_contradict_is_not_called_tracking(scale, believed):
    """Cameras said to stand nearer or farther than they do, as with a wrong unit: no pose of this hand fits."""
    nodes = tuple(msgspec.structs.replace(node, pose=msgspec.structs.replace(
        node.pose, translation_m=tuple(scale * part for part in node.pose.translation_m))) for node in RIG.nodes)
    states = states_of(msgspec.structs.replace(RIG, nodes=nodes), detected_landmarks(RIG, hand(), 1))
    settled = [state.condition for state in states if 1e-9 * (state.t_master_ns - EPOCH_NS) >= SETTLED_S]
    called = np.mean([one is Condition.TRACKING for one in settled])
    assert called > 0.95 if believed else called == 0.0


def test_one_wrong_landmark_does_not_take_another_ones_place():
    """The index fingertip reported where the middle one is: a detector errs so, and no painted marker is confused."""
    truth, frames = hand("rest"), []
    for frame in detected_landmarks(RIG, hand("rest"), 1):
        pixels = frame.pixels.copy()
        if frame.t_row0_master_ns > EPOCH_NS + 15 * 10**8 and frame.camera == 0:
            pixels[TIPS[1]] = pixels[TIPS[2]] + 1.0
        frames.append(replace(frame, pixels=pixels))
    errors, _, _ = off(states_of(RIG, frames), truth, 2.0)
    right, _, _ = off(tracked("rest"), truth, 2.0)
    assert rms_mm(errors[:, TIPS[2]]) < rms_mm(right[:, TIPS[2]]) + 2.0


def mixed_rig():
    """Two painted fingertips, landmarks for all other joints."""
    painted = {marker.role: msgspec.structs.replace(marker, id=f"paint_{marker.id}", shape="disc", radius_mm=None)
               for marker in RHOT6.markers}
    rest = tuple(marker for marker in LANDMARKS21.markers if marker.id not in ("thumb_tip", "index_tip"))
    return landmark_rig(markers=msgspec.structs.replace(
        LANDMARKS21, markers=(*rest, painted["thumb_tip"], painted["index_tip"])))


def test_two_painted_fingertips_and_landmarks_are_better_than_either():
    rig, truth = mixed_rig(), hand()
    mixed, covariances, _ = off(states_of(rig, detected_landmarks(rig, truth, 1)), truth)
    alone, _, _ = off(tracked(), truth)
    two = TIPS[:2]
    assert rms_mm(mixed[:, two]) < 0.9 * rms_mm(alone[:, two])
    assert rms_mm(mixed) < rms_mm(alone)
    nees = np.einsum("nji,njik,njk->nj", mixed, np.linalg.inv(covariances), mixed) / 3.0
    assert nees.mean() < 2.0
    only = [replace(frame, flags=np.where(np.arange(len(frame.flags)) < 19, int(MarkerFlag.LOST), 0).astype(np.uint16),
                    pixels=np.where(np.arange(len(frame.flags))[:, None] < 19, np.nan, frame.pixels))
            for frame in detected_landmarks(rig, truth, 1)]
    assert not any(state.tracked for state in states_of(rig, only))  # two fingertips alone are no hand


def test_without_errors_the_hand_is_where_it_is():
    exact = LandmarkErrors(0.0, 0.0, 0.0, 0.0)
    errors, _, _ = off(states_of(RIG, detected_landmarks(RIG, hand(), 1, exact)), hand())
    assert rms_mm(errors) < 1.0


def on_its_plane(world):
    return PalmOnPlane(PalmPlane(tuple(world[:3, 2].tolist()), float(world[:3, 2] @ world[:3, 3])))


def test_landmarks_of_one_camera_begin_on_the_palms_plane(monkeypatch):
    model, truth = compile_markers(RIG), hand()
    plane, frame = on_its_plane(truth.worlds[0]), MarkerFrame(model, detected_landmarks(RIG, truth, 1)[0])
    before = frame.covariances.copy()
    pose = acquisition.pose_on_plane(plane, frame, model.process())
    joints = forward(build_model(RIG.hand), pose).joints
    assert np.median(np.linalg.norm(joints - truth.joints()[0], axis=1)) < 0.01
    assert np.array_equal(frame.covariances, before), "the detector's noise is added once, when the frame is weighed"
    tried = []

    def fail_sometimes(*arguments):
        tried.append(arguments)
        if len(tried) % 2:
            raise np.linalg.LinAlgError
        return update(*arguments)

    update = acquisition.update
    monkeypatch.setattr(acquisition, "update", fail_sometimes)
    assert acquisition.pose_on_plane(plane, frame, model.process()) is not None, "of the others, one is right"


def test_one_camera_alone_begins_with_a_hand_of_the_files_size():
    frames = [frame for frame in detected_landmarks(RIG, hand(), 1) if frame.camera == 0]
    states = states_of(RIG, frames)
    first = next(state for state in states if state.tracked)
    assert 1e-9 * (first.t_master_ns - EPOCH_NS) <= MOST_START_S
    errors, _, _ = off(states, hand())
    assert np.median(np.linalg.norm(errors - errors.mean(axis=1, keepdims=True), axis=2)) < 0.012
    line = CameraModel.from_rig(RIG.nodes[0].intrinsics, RIG.nodes[0].pose).camera_from_world[2, :3]
    assert np.abs(errors @ line).max() < 0.15 * DISTANCE_M


def test_what_one_camera_cannot_show_lies_along_its_own_rays():
    """The other one, 40 degrees aside, delivers frames without a hand; they are the newest half of the time."""
    blind = [replace(frame, pixels=np.full_like(frame.pixels, np.nan), flags=np.full_like(
        frame.flags, int(MarkerFlag.LOST))) if frame.camera else frame for frame in detected_landmarks(RIG, hand(), 1)]
    tracked = [state for state in states_of(RIG, blind) if state.tracked][-20:]
    assert len(tracked) == 20
    centre = np.array(RIG.nodes[0].pose.translation_m)
    for state in tracked:
        assert state.condition is Condition.PARTIAL
        away = state.joint_positions[0] - centre
        longest = np.linalg.eigh(state.joint_covariances[0])[1][:, -1]
        assert abs(longest @ away) > np.cos(np.radians(8.0)) * np.linalg.norm(away)


def test_a_hand_that_one_camera_sees_a_moment_before_the_other_is_tracking_with_both():
    frames = [frame for frame in detected_landmarks(RIG, hand(), 1)
              if frame.camera == 0 or frame.t_row0_master_ns > EPOCH_NS + 10**8]
    first = next(state for state in states_of(RIG, frames) if state.condition is Condition.TRACKING)
    assert 0.099 < 1e-9 * (first.t_master_ns - EPOCH_NS) < 0.14


def test_what_is_triangulated_does_not_follow_the_hand_file():
    """Exact landmarks of a hand whose bones the rig does not have: of frames taken at one moment they meet at its
    joints, wherever the estimate is."""
    exact = LandmarkErrors(anatomy=0.0, lasting=0.0, common=0.0, noise=0.0)
    other = hand("grasp", 0.15)
    states = states_of(RIG, detected_landmarks(RIG, other, 1, exact))
    errors, _, triangulated = off(states[1::2], other)  # after the second camera's frame
    assert rms_mm(errors) > 2.0
    assert np.nanpercentile(np.linalg.norm(triangulated, axis=2), 95) < 0.1e-3


@pytest.mark.parametrize("smooth", [False, True])
def test_a_hand_that_one_camera_has_begun_is_begun_anew_by_two(smooth):
    """A hand a tenth smaller than the rig's: its distance by one camera is centimetres off until the other one sees
    it. No such state is called TRACKING."""
    fingers = {name: msgspec.structs.replace(one, **{field: tuple(0.9 * np.array(getattr(one, field)))
                                                     for field in ("base_mm", "bones_mm")},
                                             marker_mm=0.9 * one.marker_mm) for name, one in RIG.hand.fingers.items()}
    small = moving_hand(msgspec.structs.replace(RIG, hand=msgspec.structs.replace(RIG.hand, fingers=fingers)), "grasp",
                        1.0, FPS, 1)
    frames = [frame for frame in detected_landmarks(RIG, small, 1)
              if frame.camera == 1 or frame.t_row0_master_ns > EPOCH_NS + 400_000_000]
    tracker, states = make_tracker(RIG, smooth=smooth), []
    for frame in frames:
        tracker.ingest(frame)
        states += tracker.states()
    states += tracker.finish()
    joints = small.joints()
    off_mm = {condition: [1e3 * np.median(np.linalg.norm(state.joint_positions - joints[round(
        1e-9 * (state.t_master_ns - EPOCH_NS) * FPS)], axis=1)) for state in states if state.condition is condition]
        for condition in (Condition.TRACKING, Condition.PARTIAL)}
    assert max(off_mm[Condition.PARTIAL]) > 30.0 and len(off_mm[Condition.PARTIAL]) >= 12
    assert max(off_mm[Condition.TRACKING]) < 20.0 and len(off_mm[Condition.TRACKING]) >= 30
