"""Random and natural hand poses for the tests of this room."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from rhot_app.hand.skeleton import HandPose


def rotation_about(vector):
    return Rotation.from_rotvec(vector).as_matrix()


def random_world(rng):
    world = np.eye(4)
    world[:3, :3] = Rotation.random(random_state=rng).as_matrix()
    world[:3, 3] = rng.uniform([-0.3, -0.3, 0.3], [0.3, 0.3, 0.9])
    return world


def random_pose(model, rng, world=None):
    """Any pose within the limits."""
    return HandPose(random_world(rng) if world is None else world, rng.uniform(*model.limits.T))
