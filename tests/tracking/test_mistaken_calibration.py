"""The estimator where the rig is mistaken about how a camera is turned, from the start or after a knock."""

from dataclasses import replace

import msgspec
import numpy as np
import pytest
from knocked_rig import moved
from modelled_hand import after_s, deviations, model_rig, moving, observations_of, states_of
from synthetic_rig import seconds

from rhot_app.calibration.check.camera_calibration import with_lens
from rhot_app.estimation.quantiles import chi_squared
from rhot_app.geometry.turns import HELD_SD_RAD
from rhot_app.hand.anthropometry import scaled_hand
from rhot_app.project import CameraCalibration
from rhot_app.state import Knowledge
from rhot_app.tracking.markers.marker_model import DRIFT_SD_RAD, TURN_SD_RAD, compile_markers
from rhot_app.tracking.scene import make_tracker
from rhot_app.tracking.tracker import states_after

RIG = model_rig()
SECONDS = 3.0
KNOCK_S = 1.5


BASE_M, AT_M = 0.075, 0.6
EXACT = CameraCalibration("exact", error_m=0.0)


def calibrated(turn_rad, rig=RIG):
    """The rig, which says that its calibration turns places by so much."""
    record = CameraCalibration("board", "ruler", turn_rad * AT_M**2 / BASE_M, AT_M)
    return msgspec.structs.replace(rig, calibration=record)


def published(rig, frames):
    tracker = make_tracker(rig)
    return [state for frame in frames for state in states_after(tracker, frame)]


def within_3_sd(states, truth):
    """The share of fingertips whose error the published covariance holds with 99.73 %."""
    return np.mean(3.0 * deviations(states, truth).normalised < chi_squared(0.9973, 3))


def mistaken(turn, rig=RIG, camera=1):
    """The rig, with another turn (3,) rad of one camera."""
    nodes = list(rig.nodes)
    nodes[camera] = msgspec.structs.replace(
        nodes[camera], pose=moved(nodes[camera].pose, np.array([*turn, 0.0, 0.0, 0.0])))
    return msgspec.structs.replace(rig, nodes=tuple(nodes))


def knocked(frames, down_px):
    """The frames, where the second camera sees everything `down_px` lower after KNOCK_S."""
    begin, down = frames[0].t_row0_master_ns + 1e9 * KNOCK_S, np.array([0.0, down_px])
    return [replace(one, pixels=one.pixels + down) if one.camera == 1 and one.t_row0_master_ns > begin else one
            for one in frames]


def shake_mm(states):
    """Third differences of the joints: motion is left out, root mean square."""
    joints = np.array([state.joint_positions for state in states])
    return 1e3 * np.sqrt(np.mean(np.sum(np.diff(joints, 3, axis=0)**2, axis=2)) / 20.0)


def share_measured(states):
    return np.mean([state.marker_knowledge == Knowledge.MEASURED for state in states])


@pytest.mark.parametrize("turn", [(1e-3, 0.0, 0.0), (-3.5e-3, 0.0, 0.0), (0.0, 0.0, 3.5e-3)], ids=str)
def test_cameras_that_contradict_each_other_do_not_shake_the_hand(turn):
    frames, truth = observations_of(RIG, moving("rest"), SECONDS), moving("rest")
    exact, states = (after_s(states_of(rig, frames), 1.0) for rig in (RIG, mistaken(turn)))
    assert shake_mm(states) < 1.25 * shake_mm(exact)
    assert share_measured(states) > 0.95
    assert deviations(states, truth).rms_mm < deviations(exact, truth).rms_mm + 2.0


@pytest.mark.parametrize(("down_px", "record"), [(0.5, None), (2.0, None), (6.0, None), (2.0, EXACT), (6.0, EXACT)],
                         ids=["0.5", "2", "6", "exact, 2", "exact, 6"])
def test_a_camera_that_is_knocked_is_turned_back(down_px, record):
    rig = msgspec.structs.replace(RIG, calibration=record)
    states = states_of(rig, knocked(observations_of(RIG, moving("rest"), SECONDS), down_px))
    before, after = after_s(states, 0.5, KNOCK_S), after_s(states, KNOCK_S + 1.0)
    assert share_measured(after) > 0.9
    assert shake_mm(after) < 1.5 * shake_mm(before)
    assert deviations(after, moving("rest")).rms_mm < deviations(before, moving("rest")).rms_mm + 1.5


def test_turns_are_against_the_first_camera_that_is_tracked_with():
    rig = model_rig(cameras=3)
    nodes = [*rig.nodes]
    nodes[0] = msgspec.structs.replace(nodes[0], pose=nodes[1].pose, pose_known=False)
    rig = msgspec.structs.replace(rig, nodes=tuple(nodes))
    truth = moving("rest")
    frames = observations_of(model_rig(cameras=3), truth, SECONDS)
    exact, states = (after_s(states_of(one, frames), 1.0) for one in (rig, mistaken((1e-3, 0.0, 0.0), rig, 2)))
    assert share_measured(states) > 0.95
    assert shake_mm(states) < 1.25 * shake_mm(exact)
    assert deviations(exact, truth).rms_mm < 1.5
    assert deviations(states, truth).rms_mm < 3.0


def test_bones_do_not_decide_how_far_the_hand_is():
    """A hand file 3 % too large: the cameras' vergence is believed, not the bones, and the hand stays where it is."""
    larger = msgspec.structs.replace(RIG, hand=scaled_hand(RIG.hand, 1.03))
    truth = moving("rest")
    states = after_s(states_of(larger, observations_of(RIG, truth, SECONDS)), 1.0)
    found = np.array([state.fingertip_positions[:, 2].mean() for state in states])
    there = truth(np.array([seconds(state) for state in states]))[:, :5, 2].mean(axis=1)
    assert 1e3 * np.abs(found - there).max() < 3.0


# -- what the rig says of its calibration ------------------------------------------------------------------------------

@pytest.mark.parametrize(("rig", "sd_rad"), [
    (RIG, TURN_SD_RAD), (msgspec.structs.replace(RIG, calibration=EXACT), HELD_SD_RAD),
    (calibrated(2e-3), np.hypot(2e-3, DRIFT_SD_RAD)), (calibrated(1e-5), np.hypot(1e-5, DRIFT_SD_RAD)),
    (with_lens(calibrated(1e-5), RIG.nodes[0].name, RIG.nodes[0].intrinsics), TURN_SD_RAD)],
    ids=["unsaid", "exact", "poorly", "well", "newer lens"])
def test_cameras_are_believed_as_far_as_the_rig_says(rig, sd_rad):
    assert compile_markers(rig).turn_sd[1] == pytest.approx(sd_rad)


@pytest.mark.parametrize("turn", [(0.0, 1e-3, 0.0), (0.0, -2.5e-3, 0.0), (1e-3, 1e-3, 1e-3)], ids=str)
def test_published_covariances_hold_what_the_rig_says_of_its_calibration(turn):
    """A turn towards the other camera contradicts nothing: only the rig can say that there may be one."""
    frames, truth = observations_of(RIG, moving("rest"), SECONDS), moving("rest")
    rig = mistaken(turn, calibrated(1e-3))
    states = after_s(published(rig, frames), 1.0)
    assert within_3_sd(states, truth) == 1.0
    assert within_3_sd(after_s(states_of(rig, frames), 1.0), truth) < 0.5, "without it they do not"
    assert share_measured(states) > 0.95


@pytest.mark.parametrize("record", [None, EXACT], ids=["unsaid", "exact"])
def test_cameras_that_are_found_to_be_turned_make_places_uncertain(record):
    """Towards the other one as well, which cannot be found."""
    frames, truth = observations_of(RIG, moving("rest"), SECONDS), moving("rest")
    rig = msgspec.structs.replace(mistaken((2e-3, 1.5e-3, 2e-3)), calibration=record)
    assert within_3_sd(after_s(published(rig, frames), 1.5), truth) > 0.99


def test_an_exact_rig_pays_nothing_for_what_others_may_be():
    frames, truth = observations_of(RIG, moving("rest"), SECONDS), moving("rest")
    rig = msgspec.structs.replace(RIG, calibration=EXACT)
    inner, outer = (after_s(states, 1.0) for states in (states_of(rig, frames), published(rig, frames)))
    assert deviations(outer, truth).rms_mm == pytest.approx(deviations(inner, truth).rms_mm, rel=1e-9)
    sds = [np.sqrt(np.trace(state.fingertip_covariances[1])) for state in (inner[-1], outer[-1])]
    assert sds[1] < 1.1 * sds[0]
