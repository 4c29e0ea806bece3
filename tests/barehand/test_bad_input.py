"""Pictures that show no hand, or hardly one: the follower says that there is none, rather than a wrong one."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from bare_scenes import DISTANCE_M, model_and_surface, near, poses, rig_of
from pictures import person, picture, taken, two_cameras, wall

from rhot_app.hand.kinematics import forward
from rhot_app.hand.skeleton import HandPose
from rhot_app.state import HandState
from rhot_app.tracking.contours.follower import HandFollower
from rhot_node.detect.foreground import Foreground, learn_background, skin_foreground

IMAGES = 12  # a hand that holds its start pose in so many is followed
FPS = 30.0
WRONG_M = 0.02  # neighbouring knuckles are so far apart
Draw = Callable[..., np.ndarray]


CAMERAS = two_cameras(distance=DISTANCE_M)
WALLS = [wall(camera, 10 * k + 1, False) for k, camera in enumerate(CAMERAS)]


@cache
def learnt() -> list[Foreground]:
    return [learn_background(skin_foreground(), [taken(empty, 90 + k) for k in range(8)]) for empty in WALLS]


def states(draw: Draw, known: bool, shown: HandPose | None = None) -> list[HandState]:
    """What the follower says of pictures `draw(camera, wall, number)`, with a learnt background or by skin alone, while
    a pose is `shown`."""
    follower = HandFollower(rig_of(CAMERAS, shown=[shown or near(pose_of(0))]), learnt() if known else None,
                            known_size=True)
    return [follower.step([draw(camera, empty, number) for camera, empty in zip(CAMERAS, WALLS, strict=True)],
                          [round(1e9 * number / FPS)] * 2) for number in range(IMAGES)]


def pose_of(number: int, distance_m: float = DISTANCE_M) -> HandPose:
    pose = poses("grasp", (number / FPS,))[0]
    world = pose.world_from_palm.copy()
    world[2, 3] += distance_m - DISTANCE_M
    return HandPose(world, pose.angles)


def hand(camera, empty, number, distance_m=DISTANCE_M, exposure=1.0) -> np.ndarray:
    _, surface = model_and_surface()
    pose = pose_of(number, distance_m)
    return picture(surface, pose.world_from_palm, pose.angles, camera, empty, number, exposure=exposure)


def wrong(found: list[HandState], distance_m: float = DISTANCE_M) -> list[int]:
    """Numbers of the states that have a hand which is not there."""
    model, _ = model_and_surface()
    return [number for number, state in enumerate(found) if state.tracked and np.linalg.norm(
        state.joint_positions - forward(model, pose_of(number, distance_m)).joints, axis=1).mean() > WRONG_M]


@pytest.mark.study("rhot_app/barehand", "rhot_app/tracking/contours", "rhot_node/detect/foreground.py")
@pytest.mark.parametrize("known", [True, False])
@pytest.mark.parametrize("distance_m", [0.5, 0.55, 0.6, 0.7])
def test_a_face_is_no_hand_in_the_pose_that_is_shown(distance_m: float, known: bool) -> None:
    place = np.array([0.0, -0.02, distance_m])
    found = states(lambda camera, empty, k: taken(person(camera, empty, place), k), known)
    assert not any(state.tracked for state in found)


@pytest.mark.parametrize("what", ["forearm", "upside down", "aside", "farther away"])
def test_a_hand_that_has_not_taken_the_pose_is_followed_where_it_is_or_not_at_all(what: str) -> None:
    shown = pose_of(0, DISTANCE_M + 0.12 * (what == "farther away"))
    world = shown.world_from_palm.copy()
    world[:3, 3] += {"forearm": 0.2 * world[:3, 0], "aside": 0.1 * world[:3, 1]}.get(what, 0.0)
    if what == "upside down":
        world[:3, 3] += 0.17 * world[:3, 0]
        world[:3, :2] *= -1.0
    model, surface = model_and_surface()
    found = states(lambda camera, empty, k: picture(surface, world, shown.angles, camera, empty, k), True)
    true = forward(model, HandPose(world, shown.angles)).joints
    assert all(np.linalg.norm(state.joint_positions - true, axis=1).mean() < WRONG_M
               for state in found if state.tracked)


def test_a_hand_that_passes_by_is_not_followed() -> None:
    """It is in the pose that is shown for a tenth of a second."""
    def draw(camera, empty, number) -> np.ndarray:
        pose = pose_of(0)
        world = pose.world_from_palm.copy()
        world[:3, 3] += 0.04 * max(abs(number - 5) - 1, 0) * world[:3, 1]
        return picture(model_and_surface()[1], world, pose.angles, camera, empty, number)

    assert not any(state.tracked for state in states(draw, True))


@pytest.mark.study("rhot_app/barehand", "rhot_app/tracking/contours", "rhot_node/detect/foreground.py")
def test_a_hand_before_a_person_is_followed_in_the_right_pose_or_not_at_all() -> None:
    place = np.array([0.12, -0.05, 0.95])
    found = states(lambda camera, empty, k: hand(camera, person(camera, empty, place), k), True)
    assert wrong(found) == []


@pytest.mark.study("rhot_app/barehand", "rhot_app/tracking/contours", "rhot_node/detect/foreground.py")
@pytest.mark.parametrize("known", [True, False])
def test_a_hand_that_fills_the_image_is_followed_in_the_right_pose_or_not_at_all(known: bool) -> None:
    found = states(lambda camera, empty, k: hand(camera, empty, k, 0.16), known, near(pose_of(0, 0.16)))
    assert wrong(found, 0.16) == []


@pytest.mark.parametrize("known", [True, False])
@pytest.mark.parametrize("exposure", [0.03, 0.12, 8.0])
def test_no_hand_is_followed_in_a_dark_or_saturated_image(exposure: float, known: bool) -> None:
    found = states(lambda camera, empty, k: hand(camera, empty, k, exposure=exposure), known)
    assert not any(state.tracked for state in found)


@pytest.mark.parametrize("known", [True, False])
def test_a_hand_that_holds_the_pose_is_followed(known: bool) -> None:
    found = states(hand, known)
    assert found[-1].tracked and wrong(found) == []


def test_a_hand_whose_pose_somebody_has_given_is_followed_by_its_skin() -> None:
    follower = HandFollower(rig_of(CAMERAS), None, known_size=True)
    follower.follow(near(pose_of(0)), 0)
    found = [follower.step([hand(camera, empty, number) for camera, empty in zip(CAMERAS, WALLS, strict=True)],
                           [round(1e9 * number / FPS)] * 2) for number in range(3)]
    assert all(state.tracked for state in found) and wrong(found) == []
    assert all(model.informative for model in follower.hand.foreground)
