"""What is said of a hand without pictures agrees with what pictures show."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from rhot_app.errors import SimulatorError
from rhot_app.geometry.camera import point_rays
from rhot_app.simulator.film.ideal_observations import ObservationNoise, ideal_observations, spots
from rhot_app.simulator.film.shot import Shot, make_renderer, make_shot
from rhot_app.simulator.film.truth import true_object
from rhot_app.simulator.scene.scene import Scene, make_scene, node_settings, twin_defaults
from rhot_app.simulator.scene.scene_description import BoardShow
from rhot_node.detect.image import from_i420
from rhot_node.detectors import make_detector
from rhot_node.wire.messages import MarkerFlag

EXACT = ObservationNoise(white=0.0, common=0.0, own=0.0)


def shot(motion: str, seconds: float = 2.0, seed: int = 2) -> Shot:
    return make_shot(scene(seed), motion, seconds)


def scene(seed: int) -> Scene:
    return make_scene(twin_defaults(), seed)


def test_outlines_lead_back_to_the_markers_centres() -> None:
    taken = shot("rest", 1.0)
    frames, truth = ideal_observations(taken, 1, EXACT)
    camera = taken.scene.camera(1)
    true = true_object(taken.scene_object, 1.0, (truth, truth))
    radius = 1e-3 * taken.scene.markers.markers[1].radius_mm
    for number in (0, 20, 39):
        seen = frames[number][1]
        t_s = truth.times_s[number] + 1e-9 * taken.scene.row_time_ns * seen.y
        place = true.markers_at(np.array([t_s]))[0, 1]
        centre = np.empty((1, 2))
        near = place - np.array([0.0, 0.0, radius**2 / place[2]])
        point_rays(camera.undistort(np.array([[seen.x, seen.y]])), camera.camera_from_world[None, :3],
                   radius**2 * np.eye(3), near, centre)
        local = camera.camera_from_world[:3, :3] @ place + camera.camera_from_world[:3, 3]
        assert centre[0] == pytest.approx(local[:2] / local[2], abs=2e-6)


def test_hidden_parts_are_those_of_the_pictures() -> None:
    taken = shot("cross", 9.0)
    _, truth = ideal_observations(taken, 0)
    renderer = make_renderer(taken, 0)
    chosen = range(0, len(truth.times_s), 12)
    painted = np.array([renderer.radiance(taken.scene_object.source, truth.times_s[k], k)[2].copy() for k in chosen])
    sketched = truth.visible[list(chosen)]
    assert (painted < 0.8).sum() > 5, "something is hidden now and then"
    assert np.abs(painted - sketched).mean() < 0.04
    assert np.corrcoef(painted.ravel(), sketched.ravel())[0, 1] > 0.8


def test_fingertips_are_as_large_as_in_pictures_wherever_they_are_and_however_they_point() -> None:
    taken = shot("fast", 0.6)
    frames, truth = ideal_observations(taken, 0)
    renderer, detector = make_renderer(taken, 0), make_detector(node_settings(taken.scene, 0))
    width, height = taken.scene.preset.width, taken.scene.preset.height
    ratios = []
    for number, t_s in enumerate(truth.times_s):
        frame, _ = renderer.render(taken.scene_object.source, t_s, number)
        found = detector.detect(from_i420(frame, width, height))
        ratios += [one.diameter / other.diameter for one, other in zip(found[:5], frames[number], strict=False)
                   if one.flags == other.flags == 0]
    assert len(ratios) > 90
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.01)
    assert np.std(ratios) < 0.012, "motion smears the pictures' edges"


def test_what_is_half_hidden_is_said_to_be_and_what_is_hidden_is_lost() -> None:
    frames, truth = ideal_observations(shot("cross", 9.0), 0)
    for markers, parts in zip(frames, truth.visible, strict=True):
        for marker, part in zip(markers, parts, strict=True):
            if part < 0.4:
                assert marker.flags & MarkerFlag.LOST and np.isnan(marker.x)
            else:
                assert bool(marker.flags & MarkerFlag.PARTIAL) == (part < 0.9)
                assert (marker.cov_xx > 1.0) == (part < 0.9)


def test_noise_is_as_large_as_wanted_and_the_cameras_share_most_of_the_bias() -> None:
    taken = shot("still", 30.0)
    bias = [_offsets(taken, camera, ObservationNoise(white=0.0, common=0.05, own=0.02)) for camera in (0, 1)]
    assert np.sqrt(np.mean(np.square(bias))) == pytest.approx(np.hypot(0.05, 0.02), rel=0.15)
    assert np.abs(np.diff(bias[0], axis=0)).mean() < 0.02, "slowly"
    count = min(len(one) for one in bias)
    assert np.corrcoef(bias[0][:count].ravel(), bias[1][:count].ravel())[0, 1] > 0.7
    white = _offsets(taken, 0, ObservationNoise(white=0.03, common=0.0, own=0.0))
    assert white.std() == pytest.approx(0.03, rel=0.05)


def test_one_seed_says_the_same_again() -> None:
    assert ideal_observations(shot("grasp", 0.3), 0)[0] == ideal_observations(shot("grasp", 0.3), 0)[0]
    other = dataclasses.replace(EXACT, white=0.01)
    assert ideal_observations(shot("grasp", 0.3), 0, other)[0] != ideal_observations(shot("grasp", 0.3), 0)[0]


def test_spots_cover_the_disc_evenly() -> None:
    places = spots()
    assert np.abs(places.mean(axis=0)).max() < 1e-12
    assert np.linalg.norm(places, axis=1).max() < 1.0


def test_a_board_cannot_be_sketched() -> None:
    with pytest.raises(SimulatorError, match="show a hand"):
        ideal_observations(make_shot(scene(1), BoardShow(), 1.0), 0)


def _offsets(taken: Shot, camera: int, noise: ObservationNoise) -> np.ndarray:
    """(F, 5, 2) px of the fingertips: with noise, less without."""
    def places(one: ObservationNoise) -> np.ndarray:
        frames, _ = ideal_observations(taken, camera, one)
        return np.array([[(marker.x, marker.y) for marker in frame[:5]] for frame in frames])
    return places(noise) - places(EXACT)
