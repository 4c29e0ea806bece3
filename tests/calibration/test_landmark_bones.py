"""Bones as medians of landmarks: of a drawn hand of other proportions, of a recorded one, and of what is no hand."""

import msgspec
import numpy as np
import pytest
from landmark_detector import landmark_rig, moving_hand
from recorded_landmarks import FITTED, JUDGED, needs_recording, recording

from rhot_app.calibration.hand.bones import solve_bones
from rhot_app.calibration.hand.marker_places import tracks_of
from rhot_app.calibration.verdict import Grade
from rhot_app.errors import CalibrationError
from rhot_app.hand.anatomy import load_hand
from rhot_app.hand.skeleton import FINGERS
from rhot_node.files import resource_path

FPS = 30.0
RIG = landmark_rig()
ROLES = {marker.id: marker.role for marker in RIG.markers.markers}


def solved(places, hand=RIG.hand):
    return solve_bones(tracks_of(np.arange(len(places)) / FPS, places, RIG.markers.ids, ROLES), hand)


@pytest.fixture(scope="module")
def drawn():
    return moving_hand(RIG, "grasp", 4.0, FPS, 1, 0.08)


def test_the_bones_of_another_hand_are_found(drawn):
    noise = np.random.default_rng(1).normal(0.0, 2e-3, drawn.joints().shape)
    report = solved(drawn.joints() + noise)
    assert report.verdict.grade is Grade.GOOD and report.method == "landmarks"
    found = np.array([report.hand.fingers[name].bones_mm for name in FINGERS])
    assert np.abs(found - 1e3 * drawn.model.bones).max() < 1.0  # noise makes a distance longer
    deviations = [report.hand.fingers[name].bones_sd_mm for name in FINGERS]
    assert 1.0 < np.median(deviations) < 6.0
    roots = [np.linalg.norm(report.hand.fingers[name].base_mm) for name in FINGERS]
    np.testing.assert_allclose(roots, 1e3 * np.linalg.norm(drawn.model.base, axis=1), atol=1.0)


@pytest.mark.parametrize("side", ["right", "left"])
def test_a_palm_of_another_width_is_found(side):
    true = load_hand(resource_path("hands", f"{side}.json"))
    narrow = {name: msgspec.structs.replace(one, base_mm=(one.base_mm[0], 0.8 * one.base_mm[1], one.base_mm[2]))
              for name, one in true.fingers.items()}
    joints = moving_hand(msgspec.structs.replace(RIG, hand=true), "grasp", 4.0, FPS, 1).joints()
    noise = np.random.default_rng(1).normal(0.0, 2e-3, joints.shape)
    found = solved(joints + noise, msgspec.structs.replace(true, fingers=narrow)).hand
    for one in FINGERS:
        for other in FINGERS:
            apart, expected = (np.linalg.norm(np.subtract(hand.fingers[one].base_mm, hand.fingers[other].base_mm))
                               for hand in (found, true))
            assert abs(apart - expected) < 1.0


def test_hidden_joints_are_left_out(drawn):
    places = drawn.joints()
    places[10:60, 6:8] = np.nan
    assert solved(places).verdict.grade is Grade.GOOD
    places[25:, 6:8] = np.nan
    with pytest.raises(CalibrationError, match="index finger"):
        solved(places)


def test_what_is_no_hand_is_not_usable(drawn):
    """Joints in another order, two hands in turn, and noise."""
    rng = np.random.default_rng(2)
    assert "unusual_bone" in solved(drawn.joints()[:, ::-1]).verdict.codes
    for places in (drawn.joints() * rng.choice([0.5, 1.0], (len(drawn.joints()), 1, 1)),
                   drawn.joints() + rng.normal(0.0, 0.03, drawn.joints().shape)):
        report = solved(places)
        assert report.verdict.grade is Grade.POOR and "large_spread" in report.verdict.codes
    assert "unusual_size" in solved(1.3 * drawn.joints()).verdict.codes
    assert not solved(1.3 * drawn.joints()).verdict.acceptable
    assert "too_short" in solved(drawn.joints()[:30]).verdict.codes


@needs_recording
def test_two_parts_of_a_recorded_hand_agree():
    one, other = (solved(recording().places[part], recording().rig.hand) for part in (FITTED, JUDGED))
    lengths = np.array([[bone.length_mm for bone in report.bones] for report in (one, other)])
    assert one.verdict.acceptable and np.abs(lengths[0] - lengths[1]).max() < 3.0


@needs_recording
def test_cameras_in_the_wrong_order_are_not_usable():
    report = solved(recording().triangulated(swapped=True), recording().rig.hand)
    assert not report.verdict.acceptable and "large_spread" in report.verdict.codes


@needs_recording
def test_a_recorded_hand_is_tracked_nearer_to_triangulation_with_its_own_bones():
    shipped, fitted = recording().errors(), recording().errors(solved(recording().places[FITTED]).hand)
    assert np.median(fitted) < 3.3 and np.percentile(fitted, 95) < 7.5
    assert np.median(fitted) < 0.6 * np.median(shipped)


@needs_recording
@pytest.mark.parametrize("camera", range(2))
def test_one_camera_goes_on_alone_where_the_bones_were_measured_by_two(camera):
    hand = solved(recording().places[FITTED]).hand
    assert np.median(recording().errors(hand, alone=camera)) < 20.0


@needs_recording
def test_smoothed_landmarks_are_about_as_near_as_filtered_ones_and_calmer():
    hand = solved(recording().places[FITTED]).hand
    filtered, smoothed = recording().errors(hand), recording().errors(hand, smooth=True)
    assert np.median(smoothed) < 1.1 * np.median(filtered)
    assert np.percentile(smoothed, 95) < 1.15 * np.percentile(filtered, 95)
    assert recording().jitter(hand, smooth=True) < 0.4 * recording().jitter(hand)


@needs_recording
@pytest.mark.parametrize("frame", range(JUDGED.start + 5, JUDGED.stop, 12))
def test_a_hand_that_is_held_still_is_found_with_all_its_fingers(frame):
    """One frame for a second, with the shipped bones: no finger stays where it began."""
    off = recording().held_still(frame)
    assert np.median(off) < 10.0 and off.max() < 30.0
