"""The solvers side by side: targets met, limits kept, what stopped them said, formulas as numpy has them."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hand_samples import natural_angles, random_pose, random_world
from hypothesis import given, settings
from hypothesis import strategies as st

from rhot_app.hand.anatomy import DIP_PER_PIP
from rhot_app.hand.kinematics import forward
from rhot_app.hand.model import neutral_pose
from rhot_app.hand.skeleton import ANGLE_SLICES, HandPose
from rhot_app.hand.solvers.finger_chain import Status, chain_points
from rhot_app.hand.solvers.inverse import damped_step, svd_step
from rhot_app.hand.solvers.methods import Effort, Method, make_problem
from rhot_app.hand.solvers.newton import chain_axes

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))

from fabrik_variants import COARSE, EFFORT, Fabrik, solve, solve_chain

MICROMETRE = 1e-6
TENTH_DEGREE = np.radians(0.1)
EXACT = (Method.DAMPED, Method.NEWTON, Method.LEVENBERG)
ALL = (*Method, *Fabrik)
LIMITED = tuple(method for method in ALL if method is not Fabrik.FABRIK_FREE)


def problem_of(model, angles, start=None):
    pose = HandPose(np.eye(4), angles)
    return make_problem(model, HandPose(np.eye(4), start) if start is not None else neutral_pose(),
                        forward(model, pose).marker_centres)


def coupled(model, rng):
    """Angles that the closed form knows: DIP = 2/3 PIP, the thumb's last two joints alike."""
    angles = rng.uniform(*model.limits.T)
    angles[3] = angles[4] = rng.uniform(max(model.limits[3:5, 0]), min(model.limits[3:5, 1]))
    for rows in ANGLE_SLICES[1:]:
        angles[rows.start + 2] = rng.uniform(0.0, model.limits[rows.start + 2, 1])
        angles[rows.start + 3] = DIP_PER_PIP * angles[rows.start + 2]
    return angles


def aimed(model, finger, target, start=None):
    """The problem of one finger with its `target` in its own frame."""
    blank = make_problem(model, neutral_pose(), np.full((5, 3), np.nan))
    targets = blank.targets.copy()
    targets[finger] = target
    return replace(blank, targets=targets, start=blank.start if start is None else start)


def ends(problem, angles):
    """Where the fingers of `angles` end, in their frames."""
    found = np.empty((5, 3))
    for finger, rows in enumerate(ANGLE_SLICES):
        joints = np.empty((4, 3))
        chain_points(np.ascontiguousarray(angles[rows]), problem.lengths[finger], joints,
                     np.empty((3, rows.stop - rows.start)))
        found[finger] = joints[3]
    return found


@settings(max_examples=60, deadline=None)
@given(shares=st.lists(st.floats(0, 1), min_size=21, max_size=21), method=st.sampled_from(EXACT))
def test_exact_solvers_meet_any_reachable_target(right_hand, shares, method):
    low, high = right_hand.limits.T
    problem = problem_of(right_hand, low + np.array(shares) * (high - low))
    solution = solve(method, problem)
    assert (solution.statuses == Status.REACHED).all() and solution.residuals.max() <= MICROMETRE
    np.testing.assert_allclose(ends(problem, solution.angles), problem.targets, atol=MICROMETRE)
    assert (solution.angles >= low).all() and (solution.angles <= high).all()


def test_solved_hands_have_their_markers_where_they_were_told(model):
    rng = np.random.default_rng(1)
    for _ in range(20):
        pose = random_pose(model, rng, random_world(rng))
        targets = forward(model, pose).marker_centres
        solution = solve(Method.LEVENBERG, make_problem(model, neutral_pose(pose.world_from_palm), targets))
        found = forward(model, HandPose(pose.world_from_palm, solution.angles)).marker_centres
        np.testing.assert_allclose(found, targets, atol=MICROMETRE)
        assert not solution.handed_over.any()


@pytest.mark.parametrize("method", LIMITED)
def test_limits_are_kept_and_the_status_tells_the_truth(right_hand, method):
    rng = np.random.default_rng(2)
    low, high = right_hand.limits.T
    for scale in (1.0, 1.0, 1.0, 0.6, 1.3) * 6:  # as far as a pose puts them, and out of place
        problem = problem_of(right_hand, rng.uniform(low, high), rng.uniform(low, high))
        problem = replace(problem, targets=scale * problem.targets)
        solution = solve(method, problem)
        beyond = np.maximum(low - solution.angles, solution.angles - high).max()
        assert beyond <= TENTH_DEGREE
        missed = np.linalg.norm(ends(problem, solution.angles) - problem.targets, axis=1)
        np.testing.assert_allclose(solution.residuals, missed, atol=1e-12)
        np.testing.assert_allclose(solution.joints[:, 3], ends(problem, solution.angles), atol=1e-12)
        np.testing.assert_array_equal(solution.statuses == Status.REACHED, missed <= EFFORT[method].tolerance)


@pytest.mark.parametrize("method", [*EXACT, Method.CLOSED_FORM, Fabrik.FABRIK])
def test_target_beyond_reach_stretches_the_finger_towards_it(right_hand, method):
    heading = np.array([np.cos(0.6), 0.0, -np.sin(0.6)])
    reach = right_hand.chain[2].sum()
    solution = solve(method, aimed(right_hand, 2, 1.3 * reach * heading))
    assert solution.statuses[2] == Status.UNREACHABLE
    slow = method is Method.DAMPED  # its damping follows the miss, which stays large
    assert solution.residuals[2] == pytest.approx(0.3 * reach, rel=1e-2 if slow else 1e-4)
    np.testing.assert_allclose(solution.angles[9:13], [0.0, 0.6, 0.0, 0.0], atol=0.2 if slow else 0.02)


def test_target_inside_the_fold_is_unreachable(right_hand):
    solution = solve(Method.LEVENBERG, aimed(right_hand, 1, [1e-3, 0.0, -1e-3]))
    assert solution.statuses[1] == Status.UNREACHABLE


@pytest.mark.parametrize("method", [*EXACT, Method.CLOSED_FORM, Fabrik.FABRIK])
def test_straight_finger_is_pulled_in_along_its_own_line(right_hand, method):
    straight = neutral_pose().angles.copy()
    straight[9:13] = [0.0, 0.5, 0.0, 0.0]
    target = 0.97 * right_hand.chain[2].sum() * np.array([np.cos(0.5), 0.0, -np.sin(0.5)])
    solution = solve(method, aimed(right_hand, 2, target, straight))
    assert solution.statuses[2] == Status.REACHED
    assert solution.handed_over[2] == (method is Fabrik.FABRIK)


@pytest.mark.parametrize("method", [Method.TRANSPOSE, Method.SVD, Fabrik.FABRIK_ALONE])
def test_those_that_cannot_leave_the_straight_pose_say_so(right_hand, method):
    limits = right_hand.limits.copy()
    limits[9:13] = [[-0.5, 0.5], [-0.5, 1.5], [-0.5, 1.5], [-0.5, 1.5]]
    straight = neutral_pose().angles.copy()
    straight[9:13] = [0.0, 0.5, 0.0, 0.0]
    problem = aimed(right_hand, 2, 0.97 * right_hand.chain[2].sum() * np.array([np.cos(0.5), 0.0, -np.sin(0.5)]),
                    straight)
    solution = solve(method, replace(problem, limits=limits), Effort(COARSE, 300))
    assert solution.statuses[2] == Status.STALLED


def test_locked_fabrik_says_that_limits_stopped_it_and_hands_over(right_hand):
    rng = np.random.default_rng(4)
    stopped = 0
    for _ in range(40):
        problem = problem_of(right_hand, rng.uniform(*right_hand.limits.T))
        alone, whole = solve(Fabrik.FABRIK_ALONE, problem), solve(Fabrik.FABRIK, problem)
        locked = alone.statuses != Status.REACHED
        assert set(alone.statuses[locked]) <= {Status.LIMITED, Status.STALLED, Status.EXHAUSTED}
        assert whole.handed_over[locked].all() and (whole.statuses == Status.REACHED).all()
        stopped += (alone.statuses == Status.LIMITED).sum()
    assert stopped > 0


def test_closed_form_finds_the_coupled_finger_itself(right_hand):
    rng = np.random.default_rng(5)
    for _ in range(100):
        angles = coupled(right_hand, rng)
        start = np.clip(angles + rng.normal(0.0, 0.02, 21), *right_hand.limits.T)
        start[2] = angles[2]  # the thumb's MCP abduction is the one angle that the closed form leaves alone
        solution = solve(Method.CLOSED_FORM, problem_of(right_hand, angles, start))
        np.testing.assert_allclose(solution.residuals, 0.0, atol=1e-12)
        np.testing.assert_allclose(solution.angles, angles, atol=1e-5)


def test_closed_form_knows_the_finger_bent_backwards(right_hand):
    """Both branches reach the target; the one nearer to the start is taken."""
    limits = right_hand.limits.copy()
    limits[9:13] = [[-0.5, 0.5], [-1.0, 1.5], [-1.5, 1.5], [-1.5, 1.5]]
    for bend in (0.9, -0.9):
        angles = neutral_pose().angles.copy()
        angles[9:13] = [0.1, 0.3, bend, DIP_PER_PIP * bend]
        start = angles.copy()
        start[11:13] *= 0.5
        problem = replace(problem_of(right_hand, angles, start), limits=limits)
        np.testing.assert_allclose(solve(Method.CLOSED_FORM, problem).angles[9:13], angles[9:13], atol=1e-9)


def test_closed_form_stopped_by_limits_ends_nearest(right_hand):
    """Against every coupled pose on a grid."""
    rng = np.random.default_rng(6)
    low, high = right_hand.limits[5:9].T
    grid = np.array(np.meshgrid(np.linspace(low[0], high[0], 25), np.linspace(low[1], high[1], 60),
                                np.linspace(0.0, high[2], 60))).reshape(3, -1)
    a, f, q = grid
    out = sum(length * np.cos(f + part * q) for length, part in zip(right_hand.chain[1], (0, 1, 5 / 3), strict=True))
    down = sum(length * np.sin(f + part * q) for length, part in zip(right_hand.chain[1], (0, 1, 5 / 3), strict=True))
    reachable = np.column_stack([out * np.cos(a), out * np.sin(a), -down])
    for _ in range(20):
        target = rng.uniform([-0.02, -0.05, -0.06], [0.08, 0.05, 0.05])
        solution = solve(Method.CLOSED_FORM, aimed(right_hand, 1, target))
        nearest = np.linalg.norm(reachable - target, axis=1).min()
        assert solution.residuals[1] <= nearest + 1e-6


def test_exact_solvers_agree_where_there_is_one_answer(right_hand):
    """A finger whose DIP joint is held has as many joints as its target has coordinates."""
    rng = np.random.default_rng(7)
    for angles in natural_angles(right_hand, rng, 20):
        angles[[*range(7, 21, 4)]] = np.maximum(angles[[*range(7, 21, 4)]], 0.3)
        limits = right_hand.limits.copy()
        for held in (2, 8, 12, 16, 20):
            limits[held] = angles[held]
        start = np.clip(angles + rng.normal(0.0, 0.03, 21), *limits.T)
        problem = replace(problem_of(right_hand, angles, start), limits=limits)
        for method in (*EXACT, Method.PSEUDO_INVERSE):
            np.testing.assert_allclose(solve(method, problem, Effort(1e-11, 100)).angles[5:], angles[5:], atol=1e-6)


def test_free_fabrik_is_the_published_one(right_hand):
    rng = np.random.default_rng(8)
    problem = problem_of(right_hand, rng.uniform(*right_hand.limits.T))
    for iterations in range(1, 6):
        solution = solve(Fabrik.FABRIK_FREE, problem, Effort(0.0, iterations))
        for finger, rows in enumerate(ANGLE_SLICES):
            joints, length = np.empty((4, 3)), problem.lengths[finger]
            chain_points(problem.start[rows].copy(), length, joints, np.empty((3, rows.stop - rows.start)))
            solve_chain(joints, problem.targets[finger], 0.0, iterations)
            np.testing.assert_allclose(solution.joints[finger], joints, atol=1e-12)
            assert solution.iterations[finger] == iterations


def test_finger_without_target_stays(right_hand):
    problem = problem_of(right_hand, neutral_pose().angles)
    targets = problem.targets.copy()
    targets[3] = np.nan
    for method in ALL:
        solution = solve(method, replace(problem, targets=targets))
        assert solution.statuses[3] == Status.MISSING and np.isnan(solution.residuals[3])
        np.testing.assert_array_equal(solution.angles[13:17], problem.start[13:17])


def test_steps_are_those_of_the_formulas():
    rng = np.random.default_rng(9)
    for _ in range(50):
        jacobian, error, step = 0.05 * rng.normal(size=(3, 4)), 0.01 * rng.normal(size=3), np.empty(4)
        damped_step(jacobian, error, 3e-4, step)
        expected = np.linalg.solve(jacobian.T @ jacobian + 3e-4 * np.eye(4), jacobian.T @ error)  # eq. 2.23
        np.testing.assert_allclose(step, expected, atol=1e-12)
        damped_step(jacobian, error, 0.0, step)
        np.testing.assert_allclose(step, np.linalg.pinv(jacobian) @ error, rtol=1e-5, atol=1e-9)  # eq. 2.16
        jacobian[2] = jacobian[0] - 0.5 * jacobian[1] + 1e-7 * rng.normal(size=4)
        svd_step(jacobian, error, 1e-3, step)
        np.testing.assert_allclose(step, np.linalg.pinv(jacobian, rcond=1e-3) @ error, atol=1e-7)  # eq. 2.20


@pytest.mark.parametrize("finger", [0, 1])
def test_axes_turn_the_end_as_the_jacobian_says(right_hand, finger):
    """v x (s - p), the columns of eq. 2.9, from the axes that Newton's second derivatives use."""
    rows = ANGLE_SLICES[finger]
    angles = np.random.default_rng(10).uniform(*right_hand.limits[rows].T)
    joints, jacobian, axes = np.empty((4, 3)), np.empty((3, len(angles))), np.empty((len(angles), 3))
    chain_points(angles, right_hand.chain[finger], joints, jacobian)
    chain_axes(angles, axes)
    origin = [0, 0, 1, 1, 2] if finger == 0 else [0, 0, 1, 2]
    np.testing.assert_allclose(np.cross(axes, joints[3] - joints[origin]).T, jacobian, atol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(axes, axis=1), 1.0)
