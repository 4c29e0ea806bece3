"""Random and natural hand poses for the tests of this room."""

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


def natural_angles(model, rng, count):
    """(count, 21) draws of the natural pose, within the limits."""
    spread = np.linalg.cholesky(np.linalg.inv(model.pose_prior.information))
    low, high = model.limits.T
    return np.clip(model.pose_prior.mean + rng.normal(size=(count, 21)) @ spread.T, low + 0.01, high - 0.01)


def natural_motion(model, rng, frames, frames_per_pose=100):
    """(frames, 21) angles that glide from one natural pose to the next."""
    poses = natural_angles(model, rng, frames // frames_per_pose + 2)
    at = np.arange(frames) / frames_per_pose
    before = at.astype(int)
    share = (at - before)[:, None]
    share = share * share * (3 - 2 * share)
    return poses[before] * (1 - share) + poses[before + 1] * share
