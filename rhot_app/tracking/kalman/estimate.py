"""What the filter estimates: one hand's pose, its velocities, its size and its markers' biases, on the manifold.

The error state has N = 82 + 3 M numbers, in this order: palm translation (3, m, world), palm rotation (3, rad, about
the palm's origin along the world's axes), 21 joint angles (rad), the velocities of these 27 (per s), their
accelerations (per s^2), the logarithm of the hand's scale, and for each of M markers where it sits off its nominal
place (3, m, world axes).
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rhot_app.hand.kinematics import move
from rhot_app.lean import lean, room

Array = NDArray[np.float64]

POSE = 27
ROTATION = 3
ANGLES = 6
HAND_ANGLES = 21
VELOCITY = 27
ACCELERATION = 54
SCALE = 81
BIAS = 82

MOST_CAMERAS, MOST_MARKERS = 16, 64
"""As many as a rig and a datagram can have."""

MOST_NUMBERS = BIAS + 3 * MOST_MARKERS
"""Size of the largest error state."""

GROUPS = 7
"""What accelerates on its own: the palm's translation, its rotation, and each finger's angles."""

LINEAR, TURN, FIRST_FINGER = 0, 1, 2
FINGERS = GROUPS - FIRST_FINGER

GROUP_OF = np.array([LINEAR] * 3 + [TURN] * 3 + [FIRST_FINGER] * 5 + [FIRST_FINGER + 1 + k // 4 for k in range(16)])
"""(27,) the group of each pose number."""


FREE, TURN_HELD, PLACED, PALM_HELD, GOES_ON = 0, 1, 2, 3, 4
"""How much of the hand an update holds to its course (`holding.py`); where a palm is that is placed, fingertips
show, and its turn is held; one that goes on is held at its distance, or place, while it turns."""

OPENING, FADING = 0, 1
"""The two times of `Estimate.unfaded`."""

UNSEEN_S = 3600.0
"""What was never seen counts as unseen for this long."""

ORDINARY_S = 1.0 / 30.0
"""Frame period that what is said of sights' age was made for; of a camera whose frames come more slowly they age more
slowly."""


LOOK_WIDTH, LOOK_X, LOOK_Y, LOOK_VARIANCE, LOOK_AGE, LOOK_HIDDEN = 0, 1, 2, 3, 4, 5
"""Columns of `Estimate.looks`."""


class Estimate(NamedTuple):
    """The mean and covariance at one instant; arrays are changed in place.

    `world` (4, 4) world_from_palm m; `angles` (21,) rad; `velocity` (27,) m/s and rad/s; `acceleration` (27,) m/s^2
    and rad/s^2; `log_scale` (1,); `bias` (M, 3) m. `covariance` (N, N). `agitation` (7,): variance of the acceleration,
    (m/s^2)^2 or (rad/s^2)^2, that surprised in each group of late. `trend` (27,): leaky mean of the normalised
    corrections of each velocity. `unfaded` (2,): s since open directions last went back to habit, and since
    knowledge last faded (`forgetting.py`). `unseen` (C, M): s since each camera was
    last believed to see each marker. `held` (1,): how the last update held the hand
    (`holding.py`). `turning` (1,): how fast the palm turned of late, rad/s. `width` (M,) m: how wide fingertips, and
    paint on the inner side of the palm, are known to be, 0 where nobody knows; `width_varies` (M,): variance of its
    logarithm in plain view; `placed_angles` (21,) rad: as they were when two cameras last saw the hand;
    `bias_variance` (M,) m^2: what the
    biases' variances tend to now (both: `covering.py`, `hiding.py`). `looks` (C, M, 6): what each camera saw of each
    marker last, its width m (0 where it says little), place px (2), variance px^2, s since then (`partial.py`), and the
    part of it that was hidden (`hiding.py`). `left_open` (27, 27): what habit leaves to
    the pose of a hand whose palm's turn only its fingers show, else zero (`forgetting.py`). `untroubled` (1,): s since
    a sight was renamed, or not believed as it was. `pace` (C,): how fast the time since a sight runs, less than
    1 for slow cameras. `memory`: all of these again, one after the other.
    """

    world: Array
    angles: Array
    velocity: Array
    acceleration: Array
    log_scale: Array
    bias: Array
    covariance: Array
    agitation: Array
    trend: Array
    unfaded: Array
    unseen: Array
    held: NDArray[np.int64]
    turning: Array
    width: Array
    width_varies: Array
    placed_angles: Array
    bias_variance: Array
    looks: Array
    left_open: Array
    untroubled: Array
    pace: Array
    memory: Array


def empty_estimate(cameras: int, markers: int) -> Estimate:
    """Room for an estimate; everything zero, the palm at the world's origin."""
    size = BIAS + 3 * markers
    shapes = {"world": (4, 4), "angles": (21,), "velocity": (POSE,), "acceleration": (POSE,), "log_scale": (1,),
              "bias": (markers, 3), "covariance": (size, size), "agitation": (GROUPS,), "trend": (POSE,),
              "unfaded": (2,), "unseen": (cameras, markers), "held": (1,), "turning": (1,), "width": (markers,),
              "width_varies": (markers,), "placed_angles": (21,),
              "bias_variance": (markers,), "looks": (cameras, markers, 6), "left_open": (POSE, POSE),
              "untroubled": (1,), "pace": (cameras,)}
    memory, end = np.zeros(sum(map(math.prod, shapes.values()))), 0
    arrays: dict[str, Any] = {}
    for name, shape in shapes.items():
        begin, end = end, end + math.prod(shape)
        arrays[name] = memory[begin:end].reshape(shape)
    arrays["held"] = arrays["held"].view(np.int64)
    estimate = Estimate(**arrays, memory=memory)
    estimate.world[:], estimate.unseen[:], estimate.pace[:] = np.eye(4), UNSEEN_S, 1.0
    return estimate


def copy_estimate(source: Estimate, target: Estimate) -> None:
    """Copy every array of `source` into `target`, 90 KB, as one block of memory."""
    target.memory[:] = source.memory


@lean
def displace(source: Estimate, step: Array, target: Estimate) -> None:
    """Fill the mean of `target` with that of `source` moved by an error state `step` (N,); they may be the same."""
    world, angles = room((4, 4)), room((HAND_ANGLES,))
    move(source.world, source.angles, step, world, angles)
    for i in range(4):
        for j in range(4):
            target.world[i, j] = world[i, j]
    for i in range(POSE - ANGLES):
        target.angles[i] = angles[i]
    for i in range(POSE):
        target.velocity[i] = source.velocity[i] + step[VELOCITY + i]
        target.acceleration[i] = source.acceleration[i] + step[ACCELERATION + i]
    target.log_scale[0] = source.log_scale[0] + step[SCALE]
    for m in range(source.bias.shape[0]):
        for k in range(3):
            target.bias[m, k] = source.bias[m, k] + step[BIAS + 3 * m + k]


@lean
def take_size(estimate: Estimate, size: Array) -> None:
    """Make the hand as large as `size` (2,) says, as well known as that. What goes with the size is known better as it
    is, but not worse all at once: the covariance must stay one."""
    covariance = estimate.covariance
    before = covariance[SCALE, SCALE]
    if before > size[1]:
        share = math.sqrt(size[1] / before)
        for i in range(covariance.shape[0]):
            covariance[SCALE, i] *= share
        for i in range(covariance.shape[0]):
            covariance[i, SCALE] *= share
    covariance[SCALE, SCALE] = size[1]
    estimate.log_scale[0] = size[0]
