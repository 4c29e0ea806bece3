"""The truth file: sampled densely enough, read back as written, refused when foreign."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rhot_app.errors import SimulatorError
from rhot_app.simulator.film.shot import make_shot
from rhot_app.simulator.film.truth import FrameTruth, Truth, load_truth, true_object
from rhot_app.simulator.render.body import HandBody
from rhot_app.simulator.scene.scene import make_scene, twin_defaults


def some_truth() -> Truth:
    shot = make_shot(make_scene(twin_defaults(), 1), "fast", 0.5)
    cameras = (FrameTruth(np.array([0.0, 0.1, 0.2]), np.array([[1.0, 0.5], [0.2, 1.0], [1.0, 1.0]])),
               FrameTruth(np.array([0.05, 0.15]), np.array([[0.9, 0.9], [0.8, 0.8]])))
    truth = true_object(shot.scene_object, shot.seconds, cameras)
    assert isinstance(truth, Truth)
    return truth


def test_between_samples_the_hand_is_where_the_motion_says() -> None:
    shot, truth = make_shot(make_scene(twin_defaults(), 1), "fast", 0.5), some_truth()
    times = np.random.default_rng(1).uniform(0.0, 0.5, 50)
    body = shot.scene_object.thing
    assert isinstance(body, HandBody)
    joints, markers = body.joints_and_markers(*shot.scene_object.source.sample(times))
    np.testing.assert_allclose(truth.joints_at(times), joints, atol=2e-5)
    np.testing.assert_allclose(truth.markers_at(times), markers, atol=2e-5)
    np.testing.assert_allclose(truth.angles_at(times), shot.scene_object.source.sample(times)[1], atol=1e-4)


def test_wrist_marker_is_the_wrist_joint_and_tips_lie_on_their_fingers() -> None:
    truth = some_truth()
    np.testing.assert_allclose(truth.markers[:, 5], truth.joints[:, 0], atol=1e-6)
    np.testing.assert_allclose(truth.world_from_palm[:, :3, 3], truth.joints[:, 0], atol=1e-6)
    for finger in range(5):
        to_tip = np.linalg.norm(truth.markers[:, finger] - truth.joints[:, 4 + 4 * finger], axis=1)
        assert to_tip.min() > 0.005 and to_tip.max() < 0.02


def test_visible_is_the_worst_camera_in_the_nearest_frames() -> None:
    seen = some_truth().visible_at(np.array([0.0, 0.09, 0.19]))
    np.testing.assert_allclose(seen, [[0.9, 0.5], [0.2, 0.9], [0.8, 0.8]])


@pytest.mark.parametrize("content", [None, b"", b"no truth at all"])
def test_foreign_files_are_named(tmp_path: Path, content: bytes | None) -> None:
    path = tmp_path / "truth.npz"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(SimulatorError, match=r"truth\.npz"):
        load_truth(path)
