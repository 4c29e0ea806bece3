"""Limits of every shape: the joint alone, and knuckles."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hand_samples import random_pose
from hypothesis import given, settings
from hypothesis import strategies as st

from rhot_app.hand.kinematics import forward
from rhot_app.hand.model import neutral_pose
from rhot_app.hand.skeleton import ANGLE_SLICES
from rhot_app.hand.solvers.finger_chain import Status
from rhot_app.hand.solvers.methods import Method, make_problem

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))

from fabrik_variants import Fabrik, solve
from joint_shapes import Shape, clamp_joint, excess, shape_knuckles, slice_flexion, swing, unswing

BOUNDS = np.radians([[-20.0, 35.0], [-30.0, 80.0]])
ROUND = (Shape.CONE, Shape.PARABOLA)


@settings(max_examples=150, deadline=None)
@given(shape=st.sampled_from(ROUND), abduction=st.floats(-1.5, 1.5), flexion=st.floats(-1.5, 1.5))
def test_clamped_joint_is_the_nearest_allowed(shape, abduction, flexion):
    found = clamp_joint(int(shape), BOUNDS, abduction, flexion)
    assert excess(int(shape), BOUNDS, *found) <= 1.0 + 1e-9
    if excess(int(shape), BOUNDS, abduction, flexion) <= 1.0:
        assert found == (abduction, flexion)
        return
    turn = np.linspace(0.0, 2.0 * np.pi, 4001)
    across, along = np.cos(turn), np.sin(turn)
    wide = np.where(across > 0, BOUNDS[0, 1], -BOUNDS[0, 0])
    high = np.where(along > 0, BOUNDS[1, 1], -BOUNDS[1, 0])
    if shape is Shape.CONE:
        border, here, there = (across * wide, along * high), swing(*found), swing(abduction, flexion)
    else:
        border = across * wide, np.sign(along) * high * (1.0 - across ** 2)
        here, there = found, (abduction, flexion)
    least = np.hypot(border[0] - there[0], border[1] - there[1]).min()
    assert np.hypot(here[0] - there[0], here[1] - there[1]) <= least + 1e-5


def test_equal_bounds_make_a_circular_cone():
    bounds, rng = np.radians([[-40.0, 40.0], [-40.0, 40.0]]), np.random.default_rng(1)
    for _ in range(100):
        abduction, flexion = clamp_joint(int(Shape.CONE), bounds, *rng.uniform(-1.5, 1.5, 2))
        assert np.degrees(np.arccos(np.cos(abduction) * np.cos(flexion))) <= 40.0 + 1e-6


def test_swing_and_back():
    rng = np.random.default_rng(2)
    for _ in range(50):
        angles = rng.uniform([-1.5, -3.0], [1.5, 3.0])
        np.testing.assert_allclose(unswing(*swing(*angles), 0.0), angles, atol=1e-9)


@pytest.mark.parametrize("shape", ROUND)
def test_slice_of_a_shape_is_what_it_allows_there(shape):
    for abduction in np.linspace(*BOUNDS[0], 9):
        low, high = slice_flexion(int(shape), BOUNDS, abduction)
        for flexion in np.linspace(low, high, 40):
            assert excess(int(shape), BOUNDS, abduction, flexion) <= 1.0 + 1e-9
        for beyond, end in ((low - 0.01, BOUNDS[1, 0]), (high + 0.01, BOUNDS[1, 1])):
            if abs(beyond) < abs(end):
                assert excess(int(shape), BOUNDS, abduction, beyond) > 1.0


@pytest.mark.parametrize("shape", ROUND)
@pytest.mark.parametrize("method", [Method.LEVENBERG, Fabrik.FABRIK])
def test_knuckles_keep_their_shape(right_hand, shape, method):
    rng = np.random.default_rng(5)
    for legal in (True, False) * 15:
        pose = random_pose(right_hand, rng, np.eye(4))
        for rows in ANGLE_SLICES[1:] if legal else ():
            root = slice(rows.start, rows.start + 2)
            pose.angles[root] = clamp_joint(int(shape), right_hand.limits[root], *pose.angles[root])
        problem = make_problem(right_hand, neutral_pose(), forward(right_hand, pose).marker_centres)
        solution = solve(method, shape_knuckles(problem, shape))
        for rows in ANGLE_SLICES[1:]:
            root = slice(rows.start, rows.start + 2)
            assert excess(int(shape), right_hand.limits[root], *solution.angles[root]) <= 1.0 + 1e-6
        assert not legal or (solution.statuses == Status.REACHED).all()


def test_knuckle_whose_range_leaves_out_the_straight_pose_is_refused(right_hand):
    problem = make_problem(right_hand, neutral_pose(), forward(right_hand, neutral_pose()).marker_centres)
    limits = problem.limits.copy()
    limits[6] = [0.2, 1.0]
    with pytest.raises(ValueError, match="index finger's MCP limits"):
        shape_knuckles(replace(problem, limits=limits), Shape.CONE)


