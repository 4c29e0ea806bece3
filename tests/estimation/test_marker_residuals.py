"""Jacobians and whitening of the rows of markers and joint limits, by central differences."""

import numpy as np
import pytest
from hand_states import (
    assert_jacobian,
    make_process,
    markers,
    moving_state,
    natural_state,
    points_of,
    slopes,
)

from rhot_app.hand.motion.hand_state import MOTION, POSE, STATE
from rhot_app.tracking.markers.marker_residual import MarkerFrame
from rhot_app.tracking.tracker import CameraObservations
from rhot_node.wire.messages import MarkerFlag

ROW_TIME_NS = 48_000
COUNT = 6


def frame_of(state, camera=1, *, bodies=False, sizes=(), lost=(), covariance=((0.09, 0.03), (0.03, 0.04)), noise=0.5):
    """A frame in which the hand of `state` is seen about `noise` px from where it is."""
    model, rng = markers(bodies), np.random.default_rng(3)
    pixels = np.random.default_rng(1).uniform(100.0, 400.0, (COUNT, 2))
    flags = np.zeros(COUNT, np.uint16)
    flags[list(lost)] = int(MarkerFlag.LOST)

    def seen(pixels):
        return MarkerFrame(model, CameraObservations(
            camera, 10**15, ROW_TIME_NS, 1e-5, 10**15, 0.0, 0.0, pixels, np.tile(np.array(covariance), (COUNT, 1, 1)),
            np.full(COUNT, 16.0), np.ones(COUNT), flags))

    pixels = seen(pixels).expected(state) + noise * rng.normal(size=(COUNT, 2))
    pixels[list(lost)] = np.nan
    frame = seen(pixels)
    frame.log_width[list(sizes)] = np.log(0.017)
    return frame


@pytest.mark.parametrize("camera", [0, 1])
@pytest.mark.parametrize("seed", range(4))
def test_centroids_follow_a_hand_at_rest(camera, seed):
    """With acceleration zero and velocity zero, every column is exact: pose, motion until the row's time, and bias."""
    process, state = make_process(), natural_state(np.random.default_rng(seed))
    state[STATE.lasting] = 1e-3
    frame = frame_of(state, camera)
    assert np.ptp(frame.late_s) > 1e-3
    assert len(frame.linearise(state).error) == 2 * COUNT
    assert_jacobian(process, frame, state, rtol=1e-4, atol=1e-4)


@pytest.mark.parametrize("seed", range(4))
def test_centroids_follow_a_moving_hand(seed):
    """How the direction of motion turns with the pose is left out: a few hundredths over the rows of a frame."""
    process, state = make_process(), moving_state(np.random.default_rng(seed))
    frame = frame_of(state)
    jacobian = frame.linearise(state).jacobian
    expected = -slopes(process, lambda moved: frame.linearise(moved).error, state)
    np.testing.assert_allclose(jacobian[:, POSE:], expected[:, POSE:], rtol=1e-4, atol=1e-4)
    for got, wanted in zip(jacobian[:, :POSE].T, expected[:, :POSE].T, strict=True):
        assert np.linalg.norm(got - wanted) <= 0.05 * np.linalg.norm(expected[:, :POSE], axis=0).max()
    assert np.abs(expected[:, POSE:MOTION]).max() > 0.1


def test_centroids_of_bodies_follow_their_silhouettes():
    """The slope is that of a point at the silhouette's centre: right to a hundredth of what a point would do."""
    process, state = make_process(bodies=True), natural_state(np.random.default_rng(5))
    frame = frame_of(state, bodies=True)
    expected = -slopes(process, lambda moved: frame.linearise(moved).error, state)
    np.testing.assert_allclose(frame.linearise(state).jacobian, expected, atol=0.02 * np.abs(expected[:, :6]).max())


def test_a_marker_s_rows_are_whitened_by_its_covariance():
    state = natural_state(np.random.default_rng(6))
    covariance = np.array([[0.5, 0.3], [0.3, 0.4]])
    frame = frame_of(state, covariance=covariance)
    rows = frame.linearise(state)
    offset = frame.pixels - frame.expected(state)
    expected = np.einsum("mi,ij,mj->m", offset, np.linalg.inv(covariance), offset)
    got = np.add.reduceat(rows.error**2 / rows.noise, rows.first)
    np.testing.assert_allclose(got, expected, rtol=0.01)  # and the floor of FLOOR_PX


def test_where_the_markers_are_expected_is_where_a_still_hand_s_points_are_projected():
    state, model = natural_state(np.random.default_rng(7)), markers()
    frame = frame_of(state, camera=1, noise=0.0)
    local = points_of(model.dh, state) @ model.poses[1, :, :3].T + model.poses[1, :, 3]
    x, y = local[:, 0] / local[:, 2], local[:, 1] / local[:, 2]
    fx, fy, cx, cy, k1 = model.intrinsics[1, :5]
    radial = 1.0 + k1 * (x * x + y * y)
    np.testing.assert_allclose(frame.pixels, np.stack([fx * x * radial + cx, fy * y * radial + cy], axis=1), atol=1e-6)
    np.testing.assert_allclose(frame.linearise(state).error, 0.0, atol=1e-6)


def test_a_row_read_later_sees_the_hand_where_it_has_moved_to():
    """Along a constant velocity of the palm."""
    process, state = make_process(), natural_state(np.random.default_rng(8))
    state[STATE.velocity][:3] = 0.4, -0.2, 0.3
    frame = frame_of(state)
    frame.late_s = np.full(COUNT, 0.005)
    step = np.zeros(process.size)
    step[:3] = 0.005 * state[STATE.velocity][:3]
    moved = process.retract(state, step)
    later = frame.expected(state)
    frame.late_s = np.zeros(COUNT)
    np.testing.assert_allclose(later, frame.expected(moved), atol=1e-6)


def test_lost_markers_have_no_rows():
    state = natural_state(np.random.default_rng(9))
    every, some = frame_of(state), frame_of(state, lost=(1, 4))
    rows = some.linearise(state)
    assert len(rows.error) == 2 * (COUNT - 2)
    assert len(rows.first) == COUNT - 2
    assert np.all(rows.jacobian[:, MOTION + 3:MOTION + 6] == 0.0)
    assert len(frame_of(state, lost=range(COUNT)).linearise(state).error) == 0
    assert len(every.linearise(state).error) == 2 * COUNT


def assert_sizes_follow(process, frame, state, share):
    """The size rows' pose columns are right to a share of their largest number. How the rolling shutter stretches a
    marker that moves is corrected by the estimated velocity and is no observation of it."""
    rows = frame.linearise(state)
    expected = -slopes(process, lambda moved: frame.linearise(moved).error[2 * COUNT:], state)[:, :POSE]
    got = rows.jacobian[2 * COUNT:, :POSE]
    assert len(rows.first) == COUNT + len(got)
    for one, wanted in zip(got, expected, strict=True):
        np.testing.assert_allclose(one, wanted, atol=share * np.abs(wanted).max())


@pytest.mark.parametrize("seed", range(6))
def test_apparent_sizes_follow_the_pose(seed):
    """Off the axis a silhouette's area grows as distance / depth^3. The lens's distortion there may be left out."""
    process, state = make_process(bodies=True), natural_state(np.random.default_rng(seed))
    frame = frame_of(state, bodies=True, sizes=range(5))
    assert len(frame.linearise(state).error) == 2 * COUNT + 5
    assert_sizes_follow(process, frame, state, 0.1)


@pytest.mark.parametrize("tip", range(5))
def test_on_the_optical_axis_apparent_sizes_follow_exactly(tip):
    """The size then depends on the distance and on the direction of the fingertip alone."""
    process, model = make_process(bodies=True), markers(bodies=True)
    state, step = natural_state(np.random.default_rng(11)), np.zeros(process.size)
    step[:2] = -points_of(model.dh, state)[tip, :2]
    there = process.retract(state, step)
    assert_sizes_follow(process, frame_of(there, camera=0, bodies=True, sizes=(tip,)), there, 1e-3)


@pytest.mark.parametrize("seed", range(3))
def test_predicted_pixels_have_the_covariance_of_the_centroids_rows(seed):
    process, rng = make_process(), np.random.default_rng(seed)
    state = natural_state(rng)
    root = 1e-3 * rng.normal(size=(process.size, process.size))
    covariance = root @ root.T
    frame = frame_of(state)
    frame.late_s = np.zeros(COUNT)
    pixels, spread = frame.predict_pixels(state, covariance)
    np.testing.assert_allclose(pixels, frame.expected(state), atol=1e-9)
    slope = slopes(process, frame.expected, state)
    np.testing.assert_allclose(spread, slope @ covariance @ slope.swapaxes(1, 2), rtol=1e-4, atol=1e-6)
