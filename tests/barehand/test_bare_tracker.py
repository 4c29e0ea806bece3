"""The tracker on drawn pictures: follows, mixes kinds, goes on with one camera, begins in a pose that is shown."""

from __future__ import annotations

import numpy as np
import pytest
from bare_scenes import model_and_surface, near, poses, rig_of, scene, state_of

from rhot_app.barehand.surface import FOREARM
from rhot_app.barehand.tracker import BareHandTracker
from rhot_app.errors import TrackingError
from rhot_app.estimation.residual import Rows
from rhot_app.export.overlay import overlay
from rhot_app.hand.kinematics import forward
from rhot_app.hand.motion.hand_state import tangent_size
from rhot_app.state import Condition
from rhot_node.detect.foreground import learn_background, learn_skin, skin_foreground

FPS = 60.0
TIMES = tuple(k / FPS for k in range(5))


@pytest.fixture(scope="module")
def film() -> list[tuple[list, list, list]]:
    return [scene(pose, k) for k, pose in enumerate(poses("grasp", TIMES))]


def errors_mm(tracker: BareHandTracker, pose) -> np.ndarray:
    model, _ = model_and_surface()
    return 1e3 * np.linalg.norm(tracker.state().joint_positions - forward(model, pose).joints, axis=1)


def test_a_hand_is_tracked_from_a_given_start(film) -> None:
    tracker = BareHandTracker(rig_of(film[0][0]))
    moving = poses("grasp", TIMES)
    tracker.start(moving[0], 0)
    for t, pose, (_, images, _) in zip(TIMES, moving, film, strict=True):
        state = tracker.step(images, [round(1e9 * t)] * 2)
        assert errors_mm(tracker, pose).mean() < 1.5
    assert state.condition is Condition.TRACKING
    assert state.joint_covariances.shape == (21, 3, 3)
    found, expected = tracker.slice_counts[:, :FOREARM].sum(axis=0).T
    assert (found > 0.5 * expected)[expected > 0.0].all()


def test_one_camera_has_a_larger_depth_deviation_than_two(film) -> None:
    pose = poses("grasp", TIMES)[0]
    spread = []
    for second in (True, False):
        tracker = BareHandTracker(rig_of(film[0][0]))
        tracker.start(pose, 0)
        state = tracker.step([film[0][1][0], film[0][1][1] if second else None], [0, 0])
        spread.append(float(np.sqrt(state.palm_covariance[2, 2])))
    assert spread[1] > 2.0 * spread[0]


def test_other_residuals_are_used_in_the_same_update(film) -> None:
    class Place:
        def linearise(self, state: np.ndarray) -> Rows:
            jacobian = np.zeros((1, tangent_size(state)))
            jacobian[0, 0] = 1.0
            return Rows(np.array([0.5 - state[3]]), jacobian, np.array([1e-12]))

    tracker = BareHandTracker(rig_of(film[0][0]))
    tracker.start(poses("grasp", TIMES)[0], 0)
    knot = tracker.update({0: film[0][1][0]}, 0, [Place()])
    assert abs(knot.state[3] - 0.5) < 1e-3


def test_a_step_without_a_start_raises_an_error_with_advice(film) -> None:
    tracker = BareHandTracker(rig_of(film[0][0]))
    with pytest.raises(TrackingError, match="start"):
        tracker.step(film[0][1], [0, 0])


@pytest.mark.parametrize("known", [True, False], ids=["before a learnt background", "by its skin"])
def test_a_hand_that_takes_the_start_pose_is_tracked(film, known) -> None:
    cameras, images, walls = film[0]
    pose = poses("grasp", TIMES)[0]
    learnt = [learn_skin(image, learn_background(skin_foreground(), [empty]) if known else None)
              for image, empty in zip(images, walls, strict=True)]
    tracker = BareHandTracker(rig_of(cameras, shown=[near(pose)]), foreground=learnt)
    assert tracker.begin(images, 0)
    assert tracker.step(images, [0, 0]).condition is Condition.TRACKING
    assert np.median(errors_mm(tracker, pose)) < 2.0


def test_no_hand_is_taken_for_one_in_an_empty_scene(film) -> None:
    cameras, _, walls = film[0]
    tracker = BareHandTracker(rig_of(cameras, shown=[poses("grasp", TIMES)[0]]),
                              foreground=[learn_background(skin_foreground(), [empty]) for empty in walls])
    assert not tracker.begin(walls, 0)


def test_the_overlay_draws_the_contour(film) -> None:
    pose = poses("grasp", TIMES)[0]
    tracker = BareHandTracker(rig_of(film[0][0]))
    tracker.start(pose, 0)
    tracker.step(film[0][1], [0, 0])
    frame = tracker.frames[0]
    assert frame is not None
    shown = overlay(film[0][1][0], frame, state_of(pose))
    assert shown.shape == (480, 640, 3)
    assert np.any(shown != film[0][1][0])
