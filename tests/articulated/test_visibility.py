"""Visibility orders: against a depth buffer, the rule of a joint, sorting, cycles."""

import math

import numpy as np
import pytest
from bare_scenes import model_and_surface
from depth_buffer import depth_labels
from hypothesis import given, settings
from hypothesis import strategies as st
from objects import box_on_hinge, object_of
from pictures import look_at
from scipy.spatial.transform import Rotation

from rhot_app.articulated.bodies import bodies_of, camera_rays, hand_bodies, place
from rhot_app.articulated.visibility import (
    NONE,
    revolute_relation,
    segment,
    sort_layers,
    visibility,
)

CAMERA = look_at(np.zeros(3), np.array([0.0, 0.0, 0.5]), focal=100.0, width=107, height=80)
RAYS = camera_rays(CAMERA)
RECORD = CAMERA.record
SAME_M = 1e-6


def differing(labels, depth):
    """Pixels whose label is not the nearest layer's."""
    best, own = depth.min(axis=2), np.take_along_axis(depth, np.maximum(labels, 0)[..., None], 2)[..., 0]
    return (labels != NONE) & (own > best + SAME_M)


def random_hand(rng):
    """A hand of the pose prior before the camera, turned anyhow."""
    model, surface = model_and_surface()
    bodies, _ = hand_bodies(surface)
    angles = np.clip(rng.multivariate_normal(model.pose_prior.mean, np.linalg.inv(model.pose_prior.information)),
                     model.limits[:, 0], model.limits[:, 1])
    root = np.eye(4)
    root[:3, :3] = Rotation.random(random_state=rng).as_matrix()
    root[:3, 3] = [0.0, 0.0, 0.5] - 0.09 * root[:3, 0]
    return bodies, place(bodies, root, angles)


def test_the_order_of_a_hand_is_that_of_a_depth_buffer():
    """At most one digit pixel in a hundred differs; `benchmarks/templates.py` does it with 10 000 poses."""
    rng, wrong, digits = np.random.default_rng(3), 0, 0
    for _ in range(12):
        bodies, placed = random_hand(rng)
        seen = visibility(bodies, placed, RECORD)
        labels = segment(bodies, placed, seen.order, RECORD, RAYS)
        nearest, depth = depth_labels(bodies, placed, CAMERA, RAYS)
        assert np.array_equal(labels == NONE, nearest == NONE)
        digit = (labels >= 0) & ((labels < 15) | (nearest < 15))
        wrong, digits = wrong + np.sum(differing(labels, depth) & digit), digits + np.sum(digit)
    assert wrong <= 0.01 * digits


@pytest.mark.parametrize("name", ["planar_arm", "two_fingers", "hinged_box"])
def test_the_order_of_planar_chains_and_a_box_is_that_of_a_depth_buffer(name):
    rng, (model, bodies, _) = np.random.default_rng(5), object_of(name)
    wrong = total = 0
    for _ in range(10):
        root = np.eye(4)
        root[:3, :3] = Rotation.random(random_state=rng).as_matrix()
        root[:3, 3] = [0.0, 0.0, 0.4] - 0.04 * root[:3, 0]
        placed = place(bodies, root, rng.uniform(*model.limits.T))
        seen = visibility(bodies, placed, RECORD)
        assert not seen.cyclic
        labels = segment(bodies, placed, seen.order, RECORD, RAYS)
        _, depth = depth_labels(bodies, placed, CAMERA, RAYS)
        wrong, total = wrong + np.sum(differing(labels, depth)), total + np.sum(labels != NONE)
    assert total > 900
    assert wrong <= 0.002 * total


def test_bodies_grown_by_a_margin_are_ordered_before_they_meet():
    _, bodies, _ = object_of("two_fingers")
    placed = place(bodies, np.eye(4), np.zeros(4))
    beside = look_at(np.array([0.04, -0.02, -0.4]), np.array([0.04, 0.0, 0.0]))
    apart = visibility(bodies, placed, beside.record).weight
    grown = visibility(bodies, placed, beside.record, margin_m=0.006).weight
    assert np.sum(np.abs(grown) > 0.0) > np.sum(np.abs(apart) > 0.0)
    np.testing.assert_array_equal(np.sign(grown)[apart != 0.0], np.sign(apart)[apart != 0.0])


@pytest.mark.parametrize(("view_deg", "angle_deg", "relation"), [
    (60, 30, 1), (60, 59, 1), (60, 61, 0), (60, 170, 0), (60, -30, -1), (60, -119, -1), (60, -121, 0),
    (-60, -30, 1), (-60, -61, 0), (-60, 30, -1), (-60, 119, -1), (-60, 121, 0)])
def test_links_of_a_joint_follow_equation_3_1(view_deg, angle_deg, relation):
    turn = Rotation.from_rotvec([0.3, -0.8, 0.5])

    def at(degrees, out_of_plane=0.0):
        return turn.apply([math.cos(math.radians(degrees)), math.sin(math.radians(degrees)), out_of_plane])

    assert revolute_relation(at(0), at(angle_deg), at(view_deg, 0.4), turn.apply([0.0, 0.0, 1.0])) == relation


@settings(deadline=None, max_examples=200)
@given(st.integers(1, 12), st.integers(0, 10_000), st.floats(0.0, 1.0))
def test_sorting_ends_and_keeps_every_relation_unless_it_says_so(count, seed, density):
    rng = np.random.default_rng(seed)
    weight = np.triu(rng.normal(size=(count, count)) * (rng.random((count, count)) < density), 1)
    weight -= weight.T
    order, cut = sort_layers(weight, rng.normal(size=count))
    assert sorted(order) == list(range(count))
    rank = np.argsort(order)
    broken = {int(j) for i, j in zip(*np.nonzero(weight > 0.0), strict=True) if rank[i] > rank[j]}
    assert broken == set(np.flatnonzero(cut))


def test_a_graph_without_a_cycle_is_sorted_without_a_cut():
    rng = np.random.default_rng(0)
    for _ in range(50):
        way = rng.permutation(8)
        weight = np.zeros((8, 8))
        for i in range(8):
            for j in range(i + 1, 8):
                if rng.random() < 0.4:
                    weight[way[i], way[j]], weight[way[j], way[i]] = 1.0, -1.0
        _, cut = sort_layers(weight, rng.normal(size=8))
        assert not cut.any()


def three_bars():
    """Three bars that lie on each other in a circle (Rehg 1995, fig. 3.12)."""
    rows, angles = [], []
    for k in range(3):
        rows += [{"name": f"to {k}", "parent": "foot", "theta_deg": 120.0 * k, "a_mm": 20.0},
                 {"name": f"across {k}", "parent": f"to {k}", "theta_deg": 90.0},
                 {"name": f"raised {k}", "parent": f"across {k}", "theta_deg": 0.0, "a_mm": -45.0, "alpha_deg": 90.0},
                 {"name": f"bar {k}", "parent": f"raised {k}", "theta_deg": 12.0, "a_mm": 90.0, "angle": f"tilt {k}",
                  "shape": {"kind": "capsule", "radius_mm": 4}}]
        angles.append({"name": f"tilt {k}"})
    return {"format": "rhot-articulated", "version": 1, "name": "bars", "root": {"name": "foot"}, "frames": rows,
            "angles": angles}


def test_a_cycle_has_a_defined_answer(tmp_path):
    _, bodies, _ = object_of(three_bars(), tmp_path)
    root = np.eye(4)
    root[:3, 3] = [0.0, 0.0, 0.4]
    first, second = (visibility(bodies, place(bodies, root, np.zeros(3)), RECORD) for _ in range(2))
    assert first.cyclic
    assert int(first.cut.sum()) == 1
    np.testing.assert_array_equal(first.order, second.order)


def test_a_lid_hides_the_box_from_above_and_is_hidden_from_below():
    model, bodies, names = box_on_hinge()
    for height, front in ((0.4, "lid"), (-0.4, "box")):
        camera = look_at(np.array([0.01, 0.05, height]), np.zeros(3), width=160, height=120, focal=150.0)
        seen = visibility(bodies, place(bodies, np.eye(4), np.radians([5.0])), camera.record)
        assert names[seen.order[0]] == front
    assert bodies_of(model)[1] == names
