"""What the model tracker tells of how well it knows things."""

import numpy as np
import pytest
from modelled_hand import model_rig, moving, sights, states_of
from msgspec.structs import replace
from synthetic_rig import LOST, altered

from rhot_app.tracking.kalman.estimate import LOOK_AGE, LOOK_HIDDEN
from rhot_app.tracking.kalman.hiding import slightly_moved
from rhot_app.tracking.kalman.wearing import LASTING_BAND, LASTING_OTHERS, compile_wearing
from rhot_app.tracking.make import make_tracker
from rhot_app.tracking.model_output import (
    CHANGES_M_S,
    FIRST_MARKER,
    FIRST_TIP,
    Report,
    empty_report,
    subject_of,
    tell_of_lasting,
)
from rhot_app.tracking.state import Knowledge

RIG = model_rig()


def test_no_angle_is_known_less_than_by_habit_however_little_is_seen():
    def one_fingertip(t, _camera, _pixels, flags):
        if t > 0.5:
            flags[1:] = LOST

    last = states_of(RIG, altered(sights(RIG, moving(), 2.5), one_fingertip))[-1]
    usual = np.sqrt(np.diag(compile_wearing(RIG).habits.usual)[6:])
    assert (last.angle_sd <= 1.001 * usual).all() and (last.angle_sd > 0.5 * usual).any()
    assert np.sqrt(np.trace(last.fingertip_covariances[3])) < 1.0


def test_markers_in_plain_view_stay_measured_while_the_joints_behind_them_are_open():
    states = states_of(RIG, sights(RIG, moving("rest"), 1.0))[10:]
    usual = np.sqrt(np.diag(compile_wearing(RIG).habits.usual)[6:])
    assert any((state.angle_sd > 0.999 * usual).any() for state in states)
    measured = np.array([state.marker_knowledge == Knowledge.MEASURED for state in states])
    assert measured.mean() > 0.98  # a thumb that is bent the other way is known by the next frame


WEARING = compile_wearing(RIG)
TIPS = [WEARING.roles.index(f"{finger}_tip") for finger in ("thumb", "index", "middle", "ring", "little")]
WRIST = WEARING.roles.index("wrist")


def test_what_habit_leaves_open_moves_no_marker_that_two_cameras_see():
    def one_hidden(t, camera, _pixels, flags):
        if t > 0.3 and camera == 0:
            flags[TIPS[2]] = LOST

    tracker = make_tracker(RIG)
    for frame in altered(sights(RIG, moving(), 0.6), one_hidden):
        tracker.ingest(frame)
        tracker.solve()
    estimate, t_ns = tracker._hand.estimate, tracker._timeline.t_ns
    told = []
    for left_open in (0.0, 0.5**2):  # m^2 and rad^2: more than any hand leaves open
        estimate.left_open[:] = left_open * np.eye(len(estimate.left_open))
        told.append(tracker.state_at(t_ns))
    seen = [marker for marker in range(len(WEARING.roles)) if marker != TIPS[2]]
    fingers = [finger for finger in range(5) if finger != 2]
    np.testing.assert_array_equal(told[0].marker_covariances[seen], told[1].marker_covariances[seen])
    np.testing.assert_array_equal(told[0].fingertip_covariances[fingers], told[1].fingertip_covariances[fingers])
    assert np.trace(told[1].marker_covariances[TIPS[2]]) > 100.0 * np.trace(told[0].marker_covariances[TIPS[2]])
    assert np.trace(told[1].fingertip_covariances[2]) > 100.0 * np.trace(told[0].fingertip_covariances[2])
    assert np.trace(told[1].joint_covariances[6]) > 100.0 * np.trace(told[0].joint_covariances[6])
    assert np.trace(told[1].palm_covariance[3:, 3:]) > 2.0 * np.trace(told[0].palm_covariance[3:, 3:])


def test_what_hides_a_little_of_a_fingertip_is_told_of_it_alone():
    tracker = make_tracker(RIG)
    for frame in sights(RIG, moving(), 0.6):
        tracker.ingest(frame)
        tracker.solve()
    estimate, t_ns = tracker._hand.estimate, tracker._timeline.t_ns
    estimate.width[TIPS[2]] = 0.014
    plain = tracker.state_at(t_ns)
    estimate.looks[0, TIPS[2], [LOOK_AGE, LOOK_HIDDEN]] = 0.0, 0.05
    told = tracker.state_at(t_ns)
    moved = slightly_moved(estimate, TIPS[2]) * np.eye(3)
    assert moved[0, 0] > 1e-9
    np.testing.assert_allclose(told.fingertip_covariances[2] - plain.fingertip_covariances[2], moved, rtol=1e-9)
    np.testing.assert_allclose(told.marker_covariances[TIPS[2]] - plain.marker_covariances[TIPS[2]], moved, rtol=1e-9)
    np.testing.assert_array_equal(told.fingertip_covariances[:2], plain.fingertip_covariances[:2])


def told_of_lasting(located: np.ndarray, speed_m_s: float = 0.0) -> Report:
    """What is told of a hand that is known exactly but for errors that last; its markers move alike."""
    count = len(WEARING.roles)
    report, jacobian, velocity = empty_report(count), np.zeros((count, 3, 27)), np.zeros(27)
    report.covariances[:], report.palm_covariance[:] = 0.0, 0.0
    jacobian[:, 0, 0], velocity[0] = 1.0, speed_m_s
    tell_of_lasting(velocity, subject_of(WEARING), jacobian, located, report)
    return report


def test_what_lasts_of_one_cameras_errors_is_told_of_markers_and_of_what_wears_them():
    rng = np.random.default_rng(1)
    located = np.array([root @ root.T for root in rng.normal(size=(len(WEARING.roles), 3, 3))])
    located[TIPS[1]] = np.nan  # two cameras do not see it
    report = told_of_lasting(located)
    expected = WEARING.lasting[:, None, None] ** 2 * np.nan_to_num(located)
    np.testing.assert_allclose(report.covariances[FIRST_MARKER:], expected)
    np.testing.assert_allclose(report.covariances[FIRST_TIP:FIRST_MARKER], expected[TIPS])
    np.testing.assert_allclose(report.covariances[0], expected[WRIST])
    np.testing.assert_allclose(report.palm_covariance[:3, :3], expected[WRIST])
    assert not report.covariances[1:FIRST_TIP].any() and not report.palm_covariance[3:].any()


def test_of_a_wristband_more_lasts_than_of_a_fingertip():
    markers = tuple(replace(marker, shape="band", length_mm=20.0) if marker.role == "wrist" else marker
                    for marker in RIG.markers.markers)
    wearing = compile_wearing(replace(RIG, markers=replace(RIG.markers, markers=markers)))
    assert wearing.lasting[WRIST] == LASTING_BAND > LASTING_OTHERS
    assert (np.delete(wearing.lasting, WRIST) == LASTING_OTHERS).all()


def test_a_marker_in_motion_looks_otherwise_with_every_frame_and_less_lasts():
    located = np.tile(np.eye(3), (len(WEARING.roles), 1, 1))
    for speed, share in ((0.0, 1.0), (CHANGES_M_S, 0.5), (4.0 * CHANGES_M_S, 1.0 / 17.0)):
        assert told_of_lasting(located, speed).covariances[FIRST_MARKER + TIPS[0], 0, 0] == pytest.approx(
            share * LASTING_OTHERS**2)
