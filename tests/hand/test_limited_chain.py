"""Limits of every shape: the joint alone, chains within them, knuckles, and neighbouring fingers."""

from dataclasses import replace

import numpy as np
import pytest
from hand_samples import random_pose, rotation_about
from hypothesis import given, settings
from hypothesis import strategies as st

from rhot_app.hand.kinematics import forward
from rhot_app.hand.model import inter_finger, neutral_pose
from rhot_app.hand.skeleton import ANGLE_SLICES, HandPose
from rhot_app.hand.solvers.finger_chain import Status
from rhot_app.hand.solvers.joint_shapes import Shape, clamp_joint, excess, shape_knuckles, slice_flexion, swing, unswing
from rhot_app.hand.solvers.limited_chain import JointLimit, solve_limited_chain
from rhot_app.hand.solvers.methods import (
    NEIGHBOURS,
    Difference,
    Method,
    differences_of,
    share_out,
    solve,
    solve_neighbours,
    violation,
)
from rhot_app.hand.solvers.problem import make_problem

BOUNDS = np.radians([[-20.0, 35.0], [-30.0, 80.0]])
ROUND = (Shape.CONE, Shape.PARABOLA)
FINGER = (JointLimit(Shape.HINGE, (0.0, 1.9)), JointLimit(Shape.HINGE, (0.0, 1.5)))
LENGTHS = np.array([0.040, 0.025, 0.020])


def lay_out(angles, base=None, lengths=LENGTHS):
    """Joints of a chain from its abductions and flexions, written down a second time."""
    joints, frame = [np.array([0.1, 0.2, 0.3])], np.eye(3) if base is None else base
    for (abduction, flexion), length in zip(angles, lengths, strict=True):
        frame = frame @ rotation_about([0, 0, abduction]) @ rotation_about([0, flexion, 0])
        joints.append(joints[-1] + length * frame[:, 0])
    return np.array(joints)


def drawn(limits, rng):
    """Angles within the limits."""
    return [clamp_joint(int(limit.shape), np.array([limit.abduction, limit.flexion]),
                        rng.uniform(*limit.abduction), rng.uniform(*limit.flexion)) for limit in limits]


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


@pytest.mark.parametrize("root", [JointLimit(Shape.BOX, (-0.5, 1.5), (-0.3, 0.4)),
                                  JointLimit(Shape.CONE, (-0.5, 1.5), (-0.3, 0.4)),
                                  JointLimit(Shape.PARABOLA, (-0.5, 1.5), (-0.3, 0.4))])
def test_limited_chain_reaches_within_its_limits(root):
    rng, limits = np.random.default_rng(3), (root, *FINGER)
    missed, stopped = [], 0
    for _ in range(100):
        base = rotation_about(rng.normal(size=3))
        start, goal = lay_out(drawn(limits, rng), base), lay_out(drawn(limits, rng), base)[-1]
        solution = solve_limited_chain(start, goal, limits, base=base)
        np.testing.assert_allclose(solution.joints, lay_out(solution.angles, base), atol=1e-9)
        for limit, angles in zip(limits, solution.angles, strict=True):
            bounds = np.array([limit.abduction, limit.flexion])
            assert (angles >= bounds[:, 0] - 1e-9).all() and (angles <= bounds[:, 1] + 1e-9).all()
            assert limit.shape not in ROUND or excess(int(limit.shape), bounds, *angles) <= 1.0 + 1e-9
        assert (solution.status is Status.REACHED) == (solution.residual <= 1e-4)
        missed.append(solution.residual)
        stopped += solution.stopped is Status.LIMITED
    assert np.mean(np.array(missed) <= 1e-4) >= 0.95 and max(missed) < 3e-3
    assert stopped > 10  # which alone would have been the end of it


def test_wide_cones_are_no_hindrance():
    rng, limits = np.random.default_rng(4), (JointLimit(Shape.CONE, (-1.2, 1.2), (-1.2, 1.2)),) * 5
    lengths = np.full(5, 0.03)
    for _ in range(50):
        start, goal = (lay_out(drawn(limits, rng), lengths=lengths) for _ in range(2))
        solution = solve_limited_chain(start, goal[-1], limits, max_iterations=1000, hand_over=False)
        assert solution.stopped is Status.REACHED
        np.testing.assert_allclose(np.linalg.norm(np.diff(solution.joints, axis=0), axis=1), lengths)


def test_target_out_of_reach_stretches_a_limited_chain():
    limits = (JointLimit(Shape.BOX, (-0.5, 1.5), (-0.3, 0.4)), *FINGER)
    start = lay_out([(0.1, 0.2), (0.0, 0.8), (0.0, 0.5)])
    heading = np.array([np.cos(0.6) * np.cos(0.2), np.cos(0.6) * np.sin(0.2), -np.sin(0.6)])
    solution = solve_limited_chain(start, start[0] + 0.2 * heading, limits)
    assert solution.status is Status.UNREACHABLE
    np.testing.assert_allclose(solution.joints[-1], start[0] + LENGTHS.sum() * heading, atol=1e-5)


def test_locked_chain_says_so():
    stiff = (JointLimit(Shape.BOX, (0.0, 0.1), (0.0, 0.1)), JointLimit(Shape.HINGE, (0.0, 0.1)))
    start = lay_out([(0.0, 0.05), (0.0, 0.05)], lengths=LENGTHS[:2])
    solution = solve_limited_chain(start, start[0] + [0.0, 0.04, 0.0], stiff)
    assert solution.stopped is Status.LIMITED and solution.status is Status.LIMITED


@pytest.mark.parametrize(("change", "words"), [
    ({"limits": FINGER}, "3 bones need as many limits"),
    ({"limits": (JointLimit(Shape.HINGE, (1.0, 0.0)), *FINGER)}, "upside down"),
    ({"limits": (JointLimit(Shape.CONE, (0.1, 1.0)), *FINGER)}, "leaves out its own axis"),
    ({"target": [0.0, 0.0]}, "target must have shape"),
    ({"target": [0.0, np.nan, 0.0]}, "finite"),
    ({"joints": np.zeros((4, 3))}, "must have a length"),
    ({"joints": np.zeros((4, 2))}, "joints must have shape"),
])
def test_bad_chains_are_refused_in_words(change, words):
    asked = {"joints": lay_out([(0.0, 0.1)] * 3), "target": [0.1, 0.0, 0.0],
             "limits": (JointLimit(Shape.BOX, (0.0, 1.0), (0.0, 1.0)), *FINGER)} | change
    with pytest.raises(ValueError, match=words):
        solve_limited_chain(asked["joints"], asked["target"], asked["limits"])


@pytest.mark.parametrize("shape", ROUND)
@pytest.mark.parametrize("method", [Method.LEVENBERG, Method.FABRIK])
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


@pytest.mark.parametrize("method", [Method.LEVENBERG, Method.FABRIK])
def test_neighbours_bend_one_another(right_hand, method):
    rng, tight = np.random.default_rng(6), differences_of(*inter_finger(np.radians(25.0)))
    table = np.array(tight)
    broken, reached = 0, []
    for legal in (True, False) * 15:
        angles = random_pose(right_hand, rng, np.eye(4)).angles
        if legal:
            assert share_out(angles, right_hand.limits.copy(), table)
        targets = forward(right_hand, HandPose(np.eye(4), angles)).marker_centres
        problem = make_problem(right_hand, neutral_pose(), targets)
        broken += violation(solve(method, problem).angles, tight) > 0.0
        solution = solve_neighbours(method, problem, differences=tight)
        assert violation(solution.angles, tight) <= np.radians(0.1)
        assert (solution.angles >= right_hand.limits[:, 0]).all() and (solution.angles <= right_hand.limits[:, 1]).all()
        if legal:
            reached.append((solution.statuses == Status.REACHED).all())
    assert broken > 5 and np.mean(reached) > 0.9


def test_bent_index_finger_bends_the_middle_one(right_hand):
    angles = neutral_pose().angles.copy()
    angles[[6, 10]] = np.radians([85.0, 5.0])
    problem = make_problem(right_hand, neutral_pose(), forward(right_hand, HandPose(np.eye(4), angles)).marker_centres)
    assert violation(angles) == pytest.approx(np.radians(15.0)) and len(NEIGHBOURS) == 4
    solution = solve_neighbours(Method.LEVENBERG, problem)
    assert solution.angles[6] - solution.angles[10] <= np.radians(65.0) + 1e-9


def test_neighbours_that_limits_tear_apart_are_refused(right_hand):
    limits = right_hand.limits.copy()
    limits[6], limits[10] = np.radians([80.0, 90.0]), np.radians([0.0, 10.0])
    problem = make_problem(right_hand, neutral_pose(), forward(right_hand, neutral_pose()).marker_centres)
    with pytest.raises(ValueError, match="contradict"):
        solve_neighbours(Method.LEVENBERG, replace(problem, limits=limits), differences=(Difference(6, 10, -0.1, 0.1),))
