"""Distances of fingertip pads to objects, and contact flags that do not chatter."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "estimation"))


from rhot_app.estimation.se3 import exp_so3
from rhot_app.geometry.transforms import rigid
from rhot_app.hand.anatomy import load_hand
from rhot_app.hand.kinematics import forward
from rhot_app.hand.model import build_model, neutral_pose
from rhot_app.hand.shape import segments
from rhot_app.objects.contact import (
    END_SD,
    ContactMonitor,
    ContactTrigger,
    fingertip_pads,
    pad_distances,
    pad_points,
)
from rhot_app.objects.shape import Box, Sphere
from rhot_node.files import resource_path


def hand(side="right"):
    return build_model(load_hand(resource_path("hands", f"{side}.json")))


@pytest.mark.parametrize("side", ["left", "right"])
def test_pads_are_the_capsules_of_the_last_segments(side):
    model = hand(side)
    pose = neutral_pose(rigid(exp_so3([0.3, -0.5, 0.2]), [0.1, 0.0, 0.5]))
    capsules = segments(model, pose, forward(model, pose))
    tips = [k for k, name in enumerate(capsules.names) if name.endswith("_distal")]
    pads = fingertip_pads(model)
    points = pad_points(pads, pose.world_from_palm, pose.angles).reshape(5, 3, 3)
    np.testing.assert_allclose(points[:, 0], capsules.start[tips], atol=1e-12)
    np.testing.assert_allclose(points[:, 2], capsules.end[tips], atol=1e-12)
    np.testing.assert_allclose(pads.radii, capsules.radius[tips])


def test_the_distance_is_that_of_the_capsule_less_its_radius():
    model, pose = hand(), neutral_pose()
    pads = fingertip_pads(model)
    points = pad_points(pads, pose.world_from_palm, pose.angles)
    first, last = points[3], points[5]  # of the index
    ball = rigid(np.eye(3), last + (0.02 + pads.radii[1] + 0.002) * (last - first) / np.linalg.norm(last - first))
    found = pad_distances(pads, points, Sphere(0.02), ball)
    assert found.distance[1] == pytest.approx(0.002)
    np.testing.assert_allclose(np.linalg.norm(found.place - ball[:3, 3], axis=1), 0.02)
    np.testing.assert_allclose(np.einsum("fi,fi->f", found.normal, points[found.sphere] - ball[:3, 3]),
                               found.distance + pads.radii + 0.02)


SD_M = 0.5e-3


def switches(trigger, distance, rng, count=6000):
    """Changes of the flags of five fingers at `distance` under white noise; a hundred seconds at 60 Hz."""
    before, changes = None, 0
    for _ in range(count):
        flags = trigger.update(distance + SD_M * rng.normal(size=5), np.full(5, SD_M))
        changes += 0 if before is None else int(np.sum(flags != before))
        before = flags
    return changes


@pytest.mark.parametrize("hover_sd", [-2.0, 0.0, 0.25 * END_SD, 0.5 * END_SD, 0.75 * END_SD, END_SD, END_SD + 2.0])
def test_contact_does_not_chatter_under_noise(hover_sd):
    """A single threshold would change 1500 times a finger."""
    changes = switches(ContactTrigger(), hover_sd * SD_M * np.ones(5), np.random.default_rng(0))
    assert changes / 5 <= 12  # 6000 samples, each with a probability of 0.001 midway


def test_contact_begins_at_the_surface_and_ends_beyond_the_noise():
    trigger, sd = ContactTrigger(), np.full(5, SD_M)
    assert not trigger.update(np.full(5, 0.1e-3), sd).any()
    assert trigger.update(np.full(5, -0.1e-3), sd).all()
    assert trigger.update(np.full(5, 0.9 * END_SD * SD_M), sd).all()
    assert not trigger.update(np.full(5, 1.1 * END_SD * SD_M), sd).any()
    trigger.update(np.full(5, -1e-3), sd)
    assert not trigger.update(np.full(5, np.nan), sd).any()


def test_a_hand_around_a_ball_touches_it_where_its_pads_reach_the_surface():
    model, pose = hand(), neutral_pose()
    points = pad_points(fingertip_pads(model), pose.world_from_palm, pose.angles)
    world = rigid(np.eye(3), points[3:].mean(axis=0))
    found, sd, flags = ContactMonitor(model, Sphere(0.06)).update(
        pose.world_from_palm, pose.angles, np.tile(1e-6 * np.eye(3), (5, 1, 1)), world,
        np.diag([3e-6] * 3 + [0.0] * 3))
    np.testing.assert_allclose(sd, 2e-3)
    assert flags.any() and (flags == (found.distance <= 0.0)).all()


def test_a_turn_of_the_object_moves_its_surface():
    model, pose = hand(), neutral_pose()
    box, world = Box((0.2, 0.2, 0.02)), rigid(np.eye(3), [0.05, 0.0, -0.05])
    monitor = ContactMonitor(model, box)
    covariance = np.diag([0.0] * 3 + [1e-4] * 3)  # 0.01 rad
    _, sd, _ = monitor.update(pose.world_from_palm, pose.angles, np.zeros((5, 3, 3)), world, covariance)
    points = pad_points(monitor.pads, pose.world_from_palm, pose.angles)
    moved = np.zeros((5, 3))
    for axis in range(3):
        turned = [pad_distances(monitor.pads, points, box, world @ rigid(exp_so3(step * np.eye(3)[axis]), [0.0] * 3))
                  for step in (1e-6, -1e-6)]
        moved[:, axis] = (turned[0].distance - turned[1].distance) / 2e-6
    np.testing.assert_allclose(sd, 0.01 * np.linalg.norm(moved, axis=1), rtol=1e-4)
