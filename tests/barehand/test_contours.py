"""Contours of the capsule hand against ray-cast pictures, and their derivatives against finite differences."""

from __future__ import annotations

import numpy as np
import pytest
from bare_scenes import model_and_surface, poses, scene, state_of
from pictures import picture, two_cameras

from rhot_app.barehand.contour_residual import ContourFrame, Contours, slices_of
from rhot_app.barehand.contours import COLUMNS, INNER, SILHOUETTE, contour_points
from rhot_app.barehand.silhouette import log_odds_maps
from rhot_app.barehand.surface import FOREARM_TURN, Surface
from rhot_app.geometry.camera import CameraModel
from rhot_app.hand.motion.hand_process import FASTEST, PALM_SPREAD, HandProcess
from rhot_app.hand.motion.hand_state import MOTION, POSE, SHAPE, STATE
from rhot_node.detect.edges import EDGES_MAX, Edges, find_edges, noise_of
from rhot_node.detect.foreground import learn_background, skin_foreground


def process_of(side: str = "right") -> HandProcess:
    model, surface = model_and_surface(side)
    return HandProcess(surface.dh, model.limits, model.pose_prior.mean, np.linalg.inv(model.pose_prior.information),
                       PALM_SPREAD, np.full(3, FASTEST), FASTEST, np.zeros((SHAPE // 3, 3, 3)), 1e3)


def frame_of(surface: Surface, state: np.ndarray, camera: CameraModel) -> ContourFrame:
    points = contour_points(surface, state, camera.record)
    return slices_of(surface, state, 1e-6 * np.eye(process_of().size), camera.record, points, 0.0)


@pytest.mark.parametrize("side", ["right", "left"])
@pytest.mark.parametrize("motion", ["grasp", "cross"])
def test_silhouette_points_lie_between_hand_and_background(side: str, motion: str) -> None:
    _, surface = model_and_surface(side)
    pose = poses(motion, (0.6,), side)[0]
    for camera in two_cameras():
        bright = np.zeros((camera.height, camera.width, 3))
        drawn = picture(surface, pose.world_from_palm, pose.angles, camera, bright, 0, blur_px=0.0, noise=0.0)
        mask = drawn[..., 0] > 0
        points = contour_points(surface, state_of(pose), camera.record)
        silhouette = points.behind == SILHOUETTE
        assert np.count_nonzero(silhouette) > 80
        for side_px, expected, most in ((-2.0, True, 0.97), (2.0, False, 0.9)):  # gaps between fingers are narrow
            at = np.rint(points.pixel[silhouette] + side_px * points.normal[silhouette]).astype(int)
            assert np.mean(mask[at[:, 1], at[:, 0]] == expected) > most


def test_background_in_an_empty_image_says_nothing_and_unknown_pixels_neither() -> None:
    """Of a hand in it, both do: its own pixels and the background about it."""
    camera = two_cameras()[0]
    empty, hand = np.zeros((60, 80), np.float32), np.zeros((60, 80), np.float32)
    empty[0, 0] = np.nan
    hand[20:40, 30:50] = 1.0
    odds = log_odds_maps([empty], [camera])
    assert odds.inside[0, 0, 0] == odds.outside[0, 0, 0] == 0.0
    assert abs(odds.outside[0, 30, 40]) < 1e-9 and odds.inside[0, 30, 40] < -2.0
    odds = log_odds_maps([hand], [camera])
    assert odds.inside[0, 30, 40] > 1.5 and odds.outside[0, 30, 40] < -0.5
    assert odds.inside[0, 0, 0] < -2.0 and 0.0 < odds.outside[0, 0, 0] < 0.2


def test_contours_have_the_jacobian_of_finite_differences() -> None:
    _, surface = model_and_surface()
    process, pose = process_of(), poses("grasp", (0.9,))[0]
    camera, state = two_cameras()[1], state_of(pose)
    state[STATE.lasting] = np.random.default_rng(0).normal(0.0, 0.05, SHAPE)
    state[STATE.shape][FOREARM_TURN:] = 0.4, -0.2
    frame = frame_of(surface, state, camera)
    start, rows, good = frame.predict(state)
    assert good.all()
    assert np.abs(start).max() < 1e-3
    for column in range(COLUMNS):
        moved = []
        for sign in (-1.0, 1.0):
            step = np.zeros(process.size)
            step[column if column < POSE else MOTION + column - POSE] = sign * 2e-5
            moved.append(frame.predict(process.retract(state, step))[0])
        difference = (moved[1] - moved[0]) / 4e-5
        scale = max(np.abs(difference).max(), 1.0)
        assert np.abs(difference - rows[:, column]).max() < 2e-3 * scale, f"column {column}"


def _later(late_s: float) -> tuple[ContourFrame, np.ndarray]:
    """A frame `late_s` after its state, with edges a little off the contour, and the state."""
    frame, state = _observed((0.3,))
    frame.late_s = frame.late_s + late_s
    return frame, state


def test_contours_of_a_later_image_move_by_the_velocity() -> None:
    process, (frame, state) = process_of(), _later(0.013)
    here, rows, good = frame.predict(state)
    for axis in range(POSE):
        step = np.zeros(process.size)
        step[POSE + axis] = 1e-2
        moved, _, _ = frame.predict(process.retract(state, step))
        assert moved[good] - here[good] == pytest.approx(0.013 * 1e-2 * rows[good, axis], abs=1e-9)


def test_a_given_velocity_replaces_the_states_for_a_later_image() -> None:
    process, (frame, state) = process_of(), _later(0.013)
    step, velocity = np.zeros(process.size), np.zeros(POSE)
    step[POSE], velocity[0] = 0.3, 0.3
    own = Contours([frame]).linearise(process.retract(state, step))
    given = Contours([frame], (velocity, np.zeros((POSE, POSE)))).linearise(state)
    assert given.error == pytest.approx(own.error) and given.jacobian == pytest.approx(own.jacobian)
    assert np.abs(given.error - Contours([frame]).linearise(state).error).max() > 0.1


def test_a_later_image_has_the_velocitys_uncertainty_and_does_not_update_it() -> None:
    """An error of the velocity moves the pose meanwhile: its covariance adds to that of the pose."""
    frame, state = _later(0.013)
    root = np.diag(np.repeat([0.3, 2.0, 3.0], (3, 3, 21)))
    certain = Contours([frame], (np.zeros(POSE), np.zeros((POSE, POSE)))).linearise(state)
    uncertain = Contours([frame], (np.zeros(POSE), root @ root)).linearise(state)
    assert not certain.jacobian[:, POSE:2 * POSE].any() and not uncertain.jacobian[:, POSE:2 * POSE].any()
    known, found = (one.jacobian[:, :POSE].T @ one.jacobian[:, :POSE] for one in (certain, uncertain))
    reduced = 0.013 * root
    expected = known - known @ reduced @ np.linalg.solve(np.eye(POSE) + reduced @ known @ reduced, reduced @ known)
    assert found == pytest.approx(expected, rel=1e-3, abs=1e-4 * np.abs(known).max())
    assert uncertain.error @ uncertain.error < certain.error @ certain.error


def test_inner_edges_are_distinguished_from_the_silhouette() -> None:
    _, surface = model_and_surface()
    pose, camera = poses("grasp", (1.4,))[0], two_cameras()[0]
    points = contour_points(surface, state_of(pose), camera.record)
    assert np.any(points.behind == INNER)


def test_a_slice_without_edges_changes_nothing() -> None:
    _, surface = model_and_surface()
    camera, state = two_cameras()[0], state_of(poses("grasp", (0.9,))[0])
    frame = frame_of(surface, state, camera)
    empty = np.zeros((len(frame.slices), EDGES_MAX))
    frame.observe(Edges(np.zeros(len(empty), np.int64), *(empty.copy() for _ in range(5))))
    rows = frame.linearise(state)
    assert np.abs(rows.jacobian.T @ rows.error).max() < 1e-9
    assert np.abs(rows.jacobian).max() < 0.1  # as good as no information, per m and rad


def test_an_update_moves_the_hand_towards_the_edges() -> None:
    left = [_left_after_three_steps(motion, t) for motion, t in
            (("grasp", 0.9), ("grasp", 0.3), ("wave", 0.5), ("pinch", 0.9))]
    assert np.mean(left) < 0.5e-3  # of 2.7 mm


def _left_after_three_steps(motion: str, t: float) -> float:
    """m from the true place, after three Gauss-Newton steps of the place alone."""
    _, surface = model_and_surface()
    process, pose = process_of(), poses(motion, (t,))[0]
    cameras, images, walls = scene(pose)
    away = np.zeros(process.size)
    away[:3] = 0.002, -0.001, 0.0015
    state = process.retract(state_of(pose), away)
    known = [learn_background(skin_foreground(), [empty]) for empty in walls]
    for _ in range(3):
        frames = []
        for camera, image, foreground in zip(cameras, images, known, strict=True):
            frames.append(frame_of(surface, state, camera))
            frames[-1].observe(find_edges(image, frames[-1].slices, foreground, noise_of(image)))
        rows = Contours(frames).linearise(state)
        information, pull = rows.jacobian.T @ rows.jacobian, rows.jacobian.T @ rows.error
        step = np.zeros(process.size)
        step[:3] = np.linalg.solve(information[:3, :3], pull[:3])
        state = process.retract(state, step)
    return float(np.linalg.norm(process.difference(state, state_of(pose))[:3]))


def _observed(offsets_px: tuple[float, ...]) -> tuple[ContourFrame, np.ndarray]:
    """A frame whose every slice has equal edges at `offsets_px` from the contour, and its state."""
    _, surface = model_and_surface()
    state = state_of(poses("grasp", (0.9,))[0])
    frame = frame_of(surface, state, two_cameras()[0])
    frame.expected_sd[:] = 3.0
    empty = np.zeros((len(frame.slices), EDGES_MAX))
    edges = Edges(np.full(len(empty), len(offsets_px)), *(empty.copy() for _ in range(5)))
    for k, offset in enumerate(offsets_px):
        edges.offset[:, k], edges.sd[:, k], edges.strength[:, k], edges.inside[:, k] = offset, 0.3, 5.0, 1.0
    frame.observe(edges)
    return frame, state


def _information(frame: ContourFrame, state: np.ndarray) -> float:
    """px^-2: of the image along all slices together, were the hand to move along the first camera axis."""
    jacobian = frame.linearise(state).jacobian
    return float((jacobian.T @ jacobian)[0, 0] / frame.points.scale.mean() ** 2)


def test_two_equally_probable_edges_have_little_weight() -> None:
    one, two = (_information(*_observed(offsets)) for offsets in ((0.0,), (-3.0, 3.0)))
    assert two < 0.3 * one
