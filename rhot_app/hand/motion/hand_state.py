"""What a hand's state has, and where (`estimation.layout`)."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rhot_app.estimation.layout import SE3, Layout, pose_matrix, set_pose
from rhot_app.hand.skeleton import ANGLES, HandPose

Array = NDArray[np.float64]

SHAPE = 36
"""Numbers of a bare hand's shape (`barehand.surface`)."""


class HandParts(NamedTuple):
    """Where the parts of a hand's state lie, or of its tangent space.

    `palm`: world_from_palm, m and rad along the world's axes. `angles` (21,) rad. `pose`: both. `velocity` and
    `acceleration` (27,). `motion`: all of these. `lasting`: everything after them. In a bare hand's state that is the
    `shape` (36,), then the `biases`: of M markers, m along the world's axes, and the cameras' turns, rad. The state of
    a hand without a shape has the biases alone, in `lasting`; `shape` and `biases` are not for it.
    """

    palm: slice
    angles: slice
    pose: slice
    velocity: slice
    acceleration: slice
    motion: slice
    lasting: slice
    shape: slice
    biases: slice


def _parts(of: Callable[..., slice]) -> HandParts:
    motion, shape = of("palm", "acceleration"), of("shape")
    return HandParts(of("palm"), of("angles"), of("palm", "angles"), of("velocity"), of("acceleration"), motion,
                     slice(motion.stop, None), shape, slice(shape.stop, None))


POSE = 6 + len(ANGLES)
"""Numbers of a pose's tangent space."""

_LAYOUT = Layout(palm=SE3, angles=len(ANGLES), velocity=POSE, acceleration=POSE, shape=SHAPE)
STATE, TANGENT = _parts(_LAYOUT.state), _parts(_LAYOUT.tangent)

MOTION = 3 * POSE
"""Numbers of the tangent space of a motion."""


def tangent_size(state: Array) -> int:
    """Numbers of the tangent space of a state (n,)."""
    return len(state) - STATE.motion.stop + MOTION


def state_at(world: Array, angles: Array, lasting: int = 0) -> Array:
    """The state of a hand at rest at `world` (4, 4) with `angles` (21,), and `lasting` zeros."""
    out = np.zeros(STATE.motion.stop + lasting)
    set_pose(out, world)
    out[STATE.angles] = angles
    return out


def pose_of(state: Array) -> HandPose:
    """The pose in a state (n,)."""
    return HandPose(pose_matrix(state), state[STATE.angles].copy())
