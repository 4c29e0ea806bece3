"""A hand before two cameras, states of it, and derivatives by central differences."""

from functools import cache

import numpy as np
from scipy.spatial.transform import Rotation
from synthetic_rig import WIDE, make_rig

from rhot_app.hand.kinematics import forward_arrays
from rhot_app.hand.motion.hand_process import HandProcess
from rhot_app.hand.motion.hand_state import POSE, STATE, tangent_size
from rhot_app.tracking.markers.marker_model import compile_markers

SPREAD = np.array([0.2, 0.6])
SLOWEST, FASTEST = np.array([2.0, 4.0, 3.0]), 25.0
BIAS_S = 1.0


@cache
def markers(bodies=False):
    """The markers of the rig without images: points, or bodies with a silhouette."""
    return compile_markers(make_rig(WIDE, bodies=bodies))


def make_process(bodies=False, slowest=SLOWEST, fastest=FASTEST):
    model = markers(bodies)
    prior = model.pose_prior
    return HandProcess(model.dh, model.limits, prior.mean, np.linalg.inv(prior.information), SPREAD, slowest,
                       fastest, np.tile(1e-6 * np.eye(3), (len(model.lasting_s), 1, 1)), BIAS_S)


def natural_state(rng, distance_m=0.6):
    """A hand at rest in a natural pose, turned any way."""
    prior, state = markers().pose_prior, np.zeros(STATE.motion.stop + 3 * len(markers().lasting_s))
    world = np.eye(4)
    world[:3, :3] = Rotation.random(random_state=rng).as_matrix()
    world[:3, 3] = rng.normal([0.03, 0.0, distance_m], 0.02)
    state[STATE.palm] = world[:3].ravel()
    state[STATE.angles] = rng.multivariate_normal(prior.mean, np.linalg.inv(prior.information))
    return state


def moving_state(rng, speed=1.0):
    """A natural pose that moves and turns as a waving hand; paint biases of a millimetre."""
    state = natural_state(rng)
    unit = speed * np.repeat([0.3, 2.0, 2.0], [3, 3, 21])
    state[STATE.velocity] = unit * rng.normal(size=POSE)
    state[STATE.acceleration] = 10.0 * unit * rng.normal(size=POSE)
    state[STATE.lasting] = rng.normal(0.0, 1e-3, len(state) - STATE.motion.stop)
    return state


def world_of(state):
    """world_from_palm (4, 4)."""
    return np.vstack([state[STATE.palm].reshape(3, 4), [0.0, 0.0, 0.0, 1.0]])


def points_of(dh, state):
    """(P, 3) m, the table's points of the hand in `state`, without biases."""
    frames, points = np.empty((len(dh.parent), 3, 4)), np.empty((len(dh.point_row), 3))
    forward_arrays(dh, world_of(state), state[STATE.angles], frames, points)
    return points


def slopes(process, look, state, step=1e-6):
    """(..., n) central differences of what `look` says of a state by its tangent."""
    columns = []
    for unit in np.eye(tangent_size(state)):
        columns.append((look(process.retract(state, step * unit)) - look(process.retract(state, -step * unit)))
                       / (2.0 * step))
    return np.stack(columns, axis=-1)


def assert_jacobian(process, residual, state, **tolerance):
    """The rows' Jacobian is the change of the predicted value, so minus the change of the error."""
    expected = -slopes(process, lambda moved: residual.linearise(moved).error, state)
    np.testing.assert_allclose(residual.linearise(state).jacobian, expected, **tolerance)
