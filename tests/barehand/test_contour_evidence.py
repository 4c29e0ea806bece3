"""Parts of the live contour tracker: recorded slices, the finder's search, markers on a hand of another size."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest
from bare_scenes import DISTANCE_M, poses, rig_of, scene, state_of
from pictures import two_cameras

from rhot_app.barehand.contours import SILHOUETTE, STEP_M
from rhot_app.barehand.observations import EdgeFrame, SliceRequest
from rhot_app.barehand.surface import HAND_SIZE
from rhot_app.barehand.tracker import SAME_POSE_S, BareHandTracker
from rhot_app.hand.anthropometry import scaled_hand
from rhot_app.hand.motion.hand_state import MOTION, SHAPE, STATE
from rhot_app.hand.skeleton import HandPose
from rhot_app.project import Rig
from rhot_app.tracking.contours.finder import Finder, Maps
from rhot_app.tracking.contours.markers import MarkersOfHand, SizedMarkerResidual
from rhot_app.tracking.contours.requests import Requests, matched_contour, requested_contour
from rhot_app.tracking.markers.marker_model import compile_markers
from rhot_app.tracking.markers.marker_residual import MarkerFrame
from rhot_app.tracking.tracker import CameraObservations
from rhot_node.detect.edges import find_edges, noise_of
from rhot_node.detect.foreground import learn_skin, skin_foreground
from rhot_node.files import resource_path
from rhot_node.markers import load_markers


@pytest.fixture
def hand() -> BareHandTracker:
    return BareHandTracker(rig_of(two_cameras(distance=DISTANCE_M)))


def test_recorded_slices_that_do_not_cross_the_hand_are_left_out(hand: BareHandTracker) -> None:
    """A log with another calibration or another hand has such slices. It may be replayed twice."""
    pose = poses("grasp", (0.5,))[0]
    _, images, _ = scene(pose)
    covariance = 1e-6 * np.eye(hand.process.size)
    slices = requested_contour(hand, 0, state_of(pose), covariance, STEP_M).slices
    off_hand = slices[::2] * [1.0, 1.0, 1.0, 1.0, 0.2] + [250.0, 0.0, 0.0, 0.0, 0.0]
    request = SliceRequest(0, np.vstack([off_hand, slices]))
    edges = find_edges(images[0], request.slices, skin_foreground(), 2.0)
    frame, before = EdgeFrame(0, 0, 0, 0, 0.0, 0.0, request, edges), [column.copy() for column in edges]
    contour = matched_contour(hand, frame, state_of(pose), covariance)
    assert contour is not None and contour.edges is not None
    assert all(np.array_equal(column, kept) for column, kept in zip(edges, before, strict=True))
    assert len(contour.slices) == pytest.approx(len(slices), rel=0.03)
    contour.linearise(state_of(pose))
    found, expected = contour.slice_counts.sum(axis=0)
    assert found > 0.75 * expected, "the hand is found on the slices across it"
    edges = find_edges(images[0], off_hand, skin_foreground(), 2.0)
    assert matched_contour(hand, EdgeFrame(0, 0, 0, 0, 0.0, 0.0, SliceRequest(0, off_hand), edges), state_of(pose),
                   covariance) is None


def test_more_slices_than_a_request_has_are_thinned_out(hand: BareHandTracker) -> None:
    pose, covariance = poses("grasp", (0.5,))[0], 1e-6 * np.eye(hand.process.size)
    every = requested_contour(hand, 0, state_of(pose), covariance, STEP_M)
    requests = Requests(hand, lambda _: (state_of(pose), covariance), lambda _: None, 100)
    requests.request_slices(0, 0)
    request, = requests.take()
    assert 50 < len(request.slices) <= 100 < len(every.slices)
    edges = find_edges(scene(pose)[1][0], request.slices, skin_foreground(), 2.0)
    contour = requests.contour(EdgeFrame(0, 0, 0, 0, 0.0, 0.0, request, edges))
    assert contour is not None, "the answer belongs to the request"
    assert set(contour.points.capsule) == set(every.points.capsule), "all of the hand is searched"


def test_edges_before_an_unknown_background_have_consistent_standard_deviations(hand: BareHandTracker) -> None:
    pose, squares = poses("grasp", (0.5,))[0], []
    for camera, image in enumerate(scene(pose)[1]):
        contour = requested_contour(hand, camera, state_of(pose), 1e-6 * np.eye(hand.process.size), STEP_M)
        true, _, good = contour.predict(state_of(pose))
        edges = find_edges(image, contour.slices, learn_skin(image), noise_of(image))
        for s in np.flatnonzero(good & (contour.points.behind == SILHOUETTE) & (edges.number > 0)):
            off = edges.offset[s, :edges.number[s]] - true[s]
            nearest = int(np.argmin(np.abs(off)))
            if abs(off[nearest]) < 3.0:
                squares.append((off[nearest] / edges.sd[s, nearest]) ** 2)
    assert len(squares) > 300 and 0.5 < np.mean(squares) < 1.5, "shading displaces them by half a pixel"


def test_updates_by_markers_do_not_change_the_share_of_the_partial_update_of_phalanges(hand: BareHandTracker) -> None:
    hand.start(poses("grasp", (0.5,))[0], 0)
    hand.prepare_update([0, 1], 0.0)
    hand.prepare_update((), 0.1)
    assert hand.filter.partial.share == 0.0, "their markers explain them, but do not move them"
    hand.prepare_update([0, 1], 0.1)
    assert hand.filter.partial.share == pytest.approx(0.1 / SAME_POSE_S)


def test_a_search_that_ends_after_its_track_gives_no_pose(hand: BareHandTracker,
                                                          monkeypatch: pytest.MonkeyPatch) -> None:
    finder = Finder(hand)

    def taken(*_: object) -> HandPose:
        finder.reset()
        return poses("grasp", (0.5,))[0]

    monkeypatch.setattr(hand, "taken", taken)
    finder.look(Maps(1, [None, None]))
    finder.wait()
    assert finder.found() is None


@pytest.mark.parametrize("markers", ["landmarks21", "rhot6"])
def test_markers_lie_on_a_hand_of_the_states_shape_with_its_jacobian(markers: str) -> None:
    rig = msgspec.structs.replace(rig_of(two_cameras(distance=DISTANCE_M)), markers=load_markers(
        resource_path("markers", f"{markers}.json")))
    hand, pose, factor = BareHandTracker(rig, known_size=False), poses("grasp", (0.5,))[0], 1.1
    MarkersOfHand(rig, hand)
    state = np.zeros(STATE.shape.stop + 3 * (len(rig.markers.ids) + len(rig.nodes) - 1))
    state[:STATE.shape.stop] = state_of(pose)
    state[STATE.shape][HAND_SIZE] = np.log(factor)
    model = compile_markers(rig)
    frame = MarkerFrame(model, observations(pixels_of(rig, pose, factor)))
    residual = SizedMarkerResidual(frame, model, hand.surface.bone, (state, hand.process.stationary), 0)
    assert np.abs(residual.linearise(state).error).max() < 1.0, "mm of paint and of creases beside"
    state[STATE.shape] += np.random.default_rng(0).normal(0.0, 0.02, SHAPE)
    rows, size = residual.linearise(state), hand.process.size
    for column in range(MOTION, MOTION + SHAPE):
        step = np.zeros(size)
        step[column] = 1e-6
        moved = residual.linearise(hand.process.retract(state, step)).error
        np.testing.assert_allclose((rows.error - moved) / 1e-6, rows.jacobian[:, column], rtol=1e-3,
                                   atol=2e-2 * np.abs(rows.jacobian[:, MOTION]).max())


def pixels_of(rig: Rig, pose: HandPose, factor: float) -> np.ndarray:
    """(M, 2) where the first camera sees the markers of a hand `factor` times as large."""
    large = msgspec.structs.replace(rig, hand=scaled_hand(rig.hand, factor))
    model = compile_markers(large)
    blank = MarkerFrame(model, observations(np.zeros((len(model.finger), 2))))
    return blank.expected(np.concatenate([state_of(pose)[STATE.motion], np.zeros(3 * len(model.lasting_s))]))


def observations(pixels: np.ndarray) -> CameraObservations:
    count = len(pixels)
    return CameraObservations(0, 0, 0, 0.0, 0, 0.0, 0.0, pixels, np.tile(np.eye(2), (count, 1, 1)), np.ones(count),
                              np.ones(count), np.zeros(count, np.uint16))
