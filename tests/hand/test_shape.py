"""The hand's capsules: markers sit where the kinematics says, and nothing floats."""

import numpy as np
from hand_samples import random_pose

from rhot_app.hand.kinematics import forward
from rhot_app.hand.shape import segments
from rhot_app.hand.skeleton import FINGERS


def _by_name(capsules):
    return {name: k for k, name in enumerate(capsules.names)}


def test_painted_segments_are_centred_on_the_markers(right_hand, left_hand):
    rng = np.random.default_rng(1)
    for model in (right_hand, left_hand):
        pose = random_pose(model, rng)
        points = forward(model, pose)
        capsules = segments(model, pose, points)
        at = _by_name(capsules)
        for f, finger in enumerate(FINGERS):
            k = at[f"{finger}_distal"]
            np.testing.assert_allclose((capsules.start[k] + capsules.end[k]) / 2, points.marker_centres[f], atol=1e-12)
            reach = np.linalg.norm(capsules.end[k] - points.joints[4 + 4 * f]) - capsules.radius[k]
            assert abs(reach) < 1e-3  # ends at the tip
        band = at["wrist_band"]
        np.testing.assert_allclose((capsules.start[band] + capsules.end[band]) / 2, points.joints[0], atol=1e-12)


def test_every_capsule_touches_another(right_hand):
    pose = random_pose(right_hand, np.random.default_rng(2))
    capsules = segments(right_hand, pose, forward(right_hand, pose))
    t = np.linspace(0, 1, 30)[:, None]
    lines = [s + t * (e - s) for s, e in zip(capsules.start, capsules.end, strict=True)]
    for k, line in enumerate(lines):
        gaps = [np.linalg.norm(line[:, None] - other[None], axis=2).min() - capsules.radius[k] - capsules.radius[j]
                for j, other in enumerate(lines) if j != k]
        assert min(gaps) < 0, capsules.names[k]


def test_left_hand_has_its_thumb_on_the_other_side(right_hand, left_hand):
    pose = random_pose(right_hand, np.random.default_rng(3), world=np.eye(4))
    right = segments(right_hand, pose, forward(right_hand, pose))
    left = segments(left_hand, pose, forward(left_hand, pose))
    pairs = np.sort(np.stack([left.start * [1, -1, 1], left.end * [1, -1, 1]]), axis=0)
    np.testing.assert_allclose(pairs, np.sort(np.stack([right.start, right.end]), axis=0), atol=1e-12)
