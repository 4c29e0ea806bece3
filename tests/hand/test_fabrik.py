"""FABRIK against the paper's own pseudocode, written down a second time in plain numpy."""

import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))

from fabrik_variants import solve_chain


def published(joints, target, tolerance, iterations):
    """Algorithm 1 of Aristidou and Lasenby 2011, line by line."""
    p = [np.array(joint, dtype=float) for joint in joints]
    n = len(p)
    d = [np.linalg.norm(p[i + 1] - p[i]) for i in range(n - 1)]
    if np.linalg.norm(p[0] - target) > sum(d):
        for i in range(n - 1):
            r = np.linalg.norm(target - p[i])
            p[i + 1] = (1 - d[i] / r) * p[i] + d[i] / r * target
        return np.array(p)
    b = p[0].copy()
    for _ in range(iterations):
        if np.linalg.norm(p[-1] - target) <= tolerance:
            break
        p[-1] = target
        for i in range(n - 2, -1, -1):
            share = d[i] / np.linalg.norm(p[i + 1] - p[i])
            p[i] = (1 - share) * p[i + 1] + share * p[i]
        p[0] = b
        for i in range(n - 1):
            share = d[i] / np.linalg.norm(p[i + 1] - p[i])
            p[i + 1] = (1 - share) * p[i] + share * p[i + 1]
    return np.array(p)


def solved(joints, target, tolerance=1e-4, iterations=100):
    """The chain solved, the iterations done, and the distance of its end from the target."""
    out, goal = np.array(joints, dtype=float), np.array(target, dtype=float)
    done, _ = solve_chain(out, goal, tolerance, iterations)
    return out, done, np.linalg.norm(out[-1] - goal)


@pytest.mark.parametrize("iterations", [1, 2, 3, 4, 5])
@pytest.mark.parametrize("scale", [1.0, 0.05, 50.0])  # metres, a finger in metres, a finger in millimetres
def test_joints_match_the_published_algorithm(iterations, scale):
    rng = np.random.default_rng(iterations)
    for _ in range(50):
        joints = scale * rng.normal(size=(rng.integers(2, 8), 3)).cumsum(axis=0)
        reach = np.linalg.norm(np.diff(joints, axis=0), axis=1).sum()
        heading = rng.normal(size=3)
        target = joints[0] + heading / np.linalg.norm(heading) * rng.uniform(0, 1.2) * reach
        found, done, residual = solved(joints, target, 0.0, iterations)
        np.testing.assert_allclose(found, published(joints, target, 0.0, iterations), atol=1e-9 * scale)
        if np.linalg.norm(target - joints[0]) <= reach:
            assert done == iterations or residual == 0.0


def test_free_chains_converge():
    rng = np.random.default_rng(0)
    for _ in range(200):
        joints = 0.03 * rng.normal(size=(4, 3)).cumsum(axis=0)
        lengths = np.linalg.norm(np.diff(joints, axis=0), axis=1)
        inner = max(2 * lengths.max() - lengths.sum(), 0)
        heading = rng.normal(size=3)
        distance = inner + rng.uniform(0.05, 0.95) * (lengths.sum() - inner)
        target = joints[0] + heading / np.linalg.norm(heading) * distance
        found, _, residual = solved(joints, target, 1e-5, 500)
        assert residual <= 1e-5
        np.testing.assert_allclose(np.linalg.norm(np.diff(found, axis=0), axis=1), lengths, rtol=1e-9)
        np.testing.assert_array_equal(found[0], joints[0])


def test_chain_within_tolerance_is_returned_unchanged():
    joints = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0.0]])
    found, done, _ = solved(joints, [1, 1, 5e-5])
    np.testing.assert_array_equal(found, joints)
    assert done == 0


def test_unreachable_target_stretches_the_chain_towards_it():
    joints = np.array([[1, 0, 0], [2, 0, 0], [2, 2, 0.0]])
    found, _, residual = solved(joints, [1, 0, 10])
    np.testing.assert_allclose(found, [[1, 0, 0], [1, 0, 1], [1, 0, 3]], atol=1e-12)
    assert residual == pytest.approx(7)


def test_a_straight_chain_cannot_bend():
    straight = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0.0]])
    assert solved(straight, [1, 0, 0])[2] > 0.5
    assert solved(straight, [1, 1e-3, 0], iterations=500)[2] <= 1e-4


coordinate = st.sampled_from([0.0, 0.0, 1.0, -1.0, 1e-300, 1e-12, 0.5, 1e6])


@settings(max_examples=300, deadline=None)
@given(joints=st.lists(st.tuples(coordinate, coordinate, coordinate), min_size=2, max_size=5),
       target=st.tuples(coordinate, coordinate, coordinate), iterations=st.integers(1, 6))
def test_degenerate_chains_stay_finite_and_keep_their_lengths(joints, target, iterations):
    joints = np.array(joints)
    found, _, _ = solved(joints, target, iterations=iterations)
    assert np.isfinite(found).all()
    np.testing.assert_allclose(np.linalg.norm(np.diff(found, axis=0), axis=1),
                               np.linalg.norm(np.diff(joints, axis=0), axis=1), rtol=1e-6, atol=1e-9)
