"""How a hand moves between two observations.

Accelerations are nearly constant over a frame and forgotten within a tenth of a second (Singer 1970): muscles change
their pull smoothly. This matters with cameras that take turns. One camera alone does not see depth; were any
acceleration possible from one frame to the next, a wrong depth would pass for a hand that trembles sideways in time
with the cameras. How strong accelerations are differs between the palm's translation, its rotation and each finger,
and with time (`surprise.py`).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.tracking.kalman.combine import add_rows
from rhot_app.tracking.kalman.estimate import (
    ACCELERATION,
    ANGLES,
    BIAS,
    FINGERS,
    FIRST_FINGER,
    GROUP_OF,
    GROUPS,
    LINEAR,
    LOOK_AGE,
    PALM_HELD,
    POSE,
    ROTATION,
    TURN,
    VELOCITY,
    Estimate,
)
from rhot_app.tracking.kalman.sighted import FRESH_S, eyes_on, fingers_away

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

STILL = np.array([3e-4, 3e-3, 1e-2, 1e-2, 1e-2, 1e-2, 1e-2])
"""Standard deviation of the acceleration of a hand at rest, by group, m/s^2 and rad/s^2."""

AWAKE = np.array([0.5, 5.0, 15.0, 15.0, 15.0, 15.0, 15.0])
"""The same of one that moves at all."""

SLOW = np.array([0.02, 0.2, 0.5, 0.5, 0.5, 0.5, 0.5])
"""Speeds, m/s and rad/s, at which a group counts as half awake."""

PER_SPEED = np.array([5.0, 5.0, 6.0, 6.0, 6.0, 6.0, 6.0])
"""How much more acceleration there is per speed, 1/s: what moves fast will turn hard."""

HASTE_M_S = 1.0
"""A palm as fast as this is taken to turn twice as hard per speed: one that hurries to and fro at 2 m/s turns with
30 m/s^2."""

MOST = np.array([60.0**2, 200.0**2, 300.0**2, 300.0**2, 300.0**2, 300.0**2, 300.0**2])
"""Variance of the acceleration, by group, that is believed of a hand. Fingers that tap as fast as they can have twice
as much; were it believed, cameras that take turns could drive half-seen fingers on and on."""

ACCELERATION_S = 0.12
"""Accelerations change with this time constant."""

CALM_S = 0.15
"""What surprised (`surprise.py`) is forgotten with this time constant."""

VELOCITY_S = np.array([0.4] * 6 + [0.2] * 21)
"""(27,) Velocities decay with these time constants: nobody goes on as he does for longer."""

TURNING_S = 1.0
"""A palm that turned is taken to turn for this long."""

WIDTH_S = 300.0
"""How wide paint is, is forgotten with this time constant while two cameras see it, lest a wrong size stay."""

BIAS_S = 3.0
"""Markers' biases change with this time constant: they turn with the hand and its light."""

class Habits(NamedTuple):
    """What is known of a hand that is not seen.

    `rows` (K, 21) of factors and `values` (K,): beliefs about the angles, in standard deviations; `mean` (21,) and
    `information` (21, 21): the same as one Gaussian; `usual` (27, 27): the covariance of a pose that follows from it,
    with a palm that may be anywhere. `together` (27, 27): how the pose's numbers accelerate together, 1 for the
    liveliest of a group: fingers bend all their joints at once. `stiff` (R, 27): rows of what a finger does least, all
    but its abduction and its bending at all joints at once.
    """

    rows: Array
    values: Array
    mean: Array
    information: Array
    usual: Array
    together: Array
    stiff: Array


@njit(cache=True)
def predict(estimate: Estimate, dt: float, part: Indices, habits: Habits, bias_variance: Array) -> None:
    """Carry the estimate on by `dt` >= 0 s. `part` (M,) as in `Worn`; `bias_variance` (M,) m^2 is what
    each marker's bias tends to."""
    _move_mean(estimate, dt)
    _move_covariance(estimate, dt)
    estimate.agitation[:] *= math.exp(-dt / CALM_S)
    for camera in range(estimate.pace.shape[0]):
        estimate.unseen[camera] += dt * estimate.pace[camera]
    estimate.untroubled[0] += dt
    estimate.looks[:, :, LOOK_AGE] += dt
    estimate.turning[0] = max(estimate.turning[0] * math.exp(-dt / TURNING_S), speeds(estimate)[TURN])
    for m in range(estimate.width.shape[0]):
        if eyes_on(estimate.unseen, m)[0] > 1:
            estimate.width[m] *= math.exp(-dt / WIDTH_S)
    _keep_awake(estimate)
    _go_along(estimate, part)
    shake(estimate.covariance, liveliness(estimate), habits.together, dt)
    _fade_biases(estimate, dt, bias_variance)


@njit(cache=True)
def speeds(estimate: Estimate) -> Array:
    """(7,) speed of each group, m/s and rad/s, as far as it is no noise."""
    out = np.zeros(GROUPS)
    for i in range(POSE):
        out[GROUP_OF[i]] += estimate.velocity[i] ** 2 - 4.0 * estimate.covariance[VELOCITY + i, VELOCITY + i]
    return np.sqrt(np.maximum(out, 0.0))


@njit(cache=True)
def _keep_awake(estimate: Estimate) -> None:
    """What moves is awake."""
    moving = speeds(estimate)
    for group in range(FIRST_FINGER if estimate.held[0] == PALM_HELD else 0, GROUPS):
        awake = (moving[group] / (moving[group] + SLOW[group]) * AWAKE[group]) ** 2
        estimate.agitation[group] = max(estimate.agitation[group], awake)


@njit(cache=True)
def _go_along(estimate: Estimate, part: Indices) -> None:
    """A finger out of sight is taken to be as lively as those that are seen."""
    total, seen = 0.0, 0
    away = fingers_away(estimate, part)
    for finger in range(FINGERS):
        if away[finger] < FRESH_S:
            total += math.sqrt(estimate.agitation[FIRST_FINGER + finger])
            seen += 1
    if seen > 0:
        for finger in range(FINGERS):
            if away[finger] >= FRESH_S:
                group = FIRST_FINGER + finger
                estimate.agitation[group] = max(estimate.agitation[group], (total / seen) ** 2)


@njit(cache=True)
def liveliness(estimate: Estimate) -> Array:
    """(7,) variance of each group's acceleration: of one at rest, of one that is awake, and by its speed."""
    moving, out = speeds(estimate), np.empty(GROUPS)
    moving[LINEAR] *= 1.0 + moving[LINEAR] / HASTE_M_S
    for group in range(GROUPS):
        out[group] = min(STILL[group] ** 2 + estimate.agitation[group] + (PER_SPEED[group] * moving[group]) ** 2,
                         MOST[group])
    return out


@njit(cache=True)
def _transition(dt: float) -> tuple[Array, Array, float, float, float]:
    """How `dt` s carry on: per pose number the factors velocity to pose and velocity to velocity (27,), then those of
    acceleration to pose, to velocity and to itself."""
    decay = np.exp(-dt / VELOCITY_S)
    keep = math.exp(-dt / ACCELERATION_S)
    gained = ACCELERATION_S * (1.0 - keep)
    return VELOCITY_S * (1.0 - decay), decay, ACCELERATION_S * (dt - gained), gained, keep


@njit(cache=True)
def _move_mean(estimate: Estimate, dt: float) -> None:
    velocity, acceleration, world = estimate.velocity, estimate.acceleration, estimate.world
    way, decay, bend, gained, keep = _transition(dt)
    moved = np.empty(POSE)
    for i in range(POSE):
        moved[i] = way[i] * velocity[i] + bend * acceleration[i]
        velocity[i] = decay[i] * velocity[i] + gained * acceleration[i]
        acceleration[i] *= keep
    rotation = exponential(moved[3], moved[4], moved[5])
    world[:3, :3] = rotation @ np.ascontiguousarray(world[:3, :3])
    for i in range(3):
        world[i, 3] += moved[i]
    for i in range(21):
        estimate.angles[i] += moved[ANGLES + i]
    _turn(estimate.covariance, rotation)


@njit(cache=True)
def _turn(covariance: Array, rotation: Array) -> None:
    """Turn what is known of the palm's rotation with the palm."""
    block = covariance[ROTATION:ANGLES].copy()
    covariance[ROTATION:ANGLES] = 0.0
    for i in range(3):
        add_rows(covariance[ROTATION + i], rotation[i], block, np.arange(3))
    for row in covariance:
        x, y, z = row[ROTATION], row[ROTATION + 1], row[ROTATION + 2]
        for i in range(3):
            row[ROTATION + i] = rotation[i, 0] * x + rotation[i, 1] * y + rotation[i, 2] * z


@njit(cache=True)
def exponential(x: float, y: float, z: float) -> Array:
    """(3, 3) rotation by the rotation vector (x, y, z), rad."""
    angle = math.sqrt(x * x + y * y + z * z)
    a = math.sin(angle) / angle if angle > 1e-9 else 1.0
    b = (1.0 - math.cos(angle)) / (angle * angle) if angle > 1e-5 else 0.5
    out = np.empty((3, 3))
    out[0, 0], out[0, 1], out[0, 2] = 1.0 - b * (y * y + z * z), b * x * y - a * z, b * x * z + a * y
    out[1, 0], out[1, 1], out[1, 2] = b * x * y + a * z, 1.0 - b * (x * x + z * z), b * y * z - a * x
    out[2, 0], out[2, 1], out[2, 2] = b * x * z - a * y, b * y * z + a * x, 1.0 - b * (x * x + y * y)
    return out


@njit(cache=True)
def _move_covariance(estimate: Estimate, dt: float) -> None:
    """P becomes F P F^T."""
    covariance = estimate.covariance
    size = covariance.shape[0]
    way, decay, bend, gained, keep = _transition(dt)
    for i in range(POSE):
        pose, speed, pull = covariance[i], covariance[VELOCITY + i], covariance[ACCELERATION + i]
        for j in range(size):
            pose[j] += way[i] * speed[j] + bend * pull[j]
            speed[j] = decay[i] * speed[j] + gained * pull[j]
            pull[j] *= keep
    for i in range(size):
        row = covariance[i]
        for j in range(POSE):
            row[j] += way[j] * row[VELOCITY + j] + bend * row[ACCELERATION + j]
            row[VELOCITY + j] = decay[j] * row[VELOCITY + j] + gained * row[ACCELERATION + j]
            row[ACCELERATION + j] *= keep


@njit(cache=True)
def shake(covariance: Array, agitation: Array, together: Array, dt: float) -> None:
    """Add what white jerk does in `dt` s that keeps up accelerations of variance `agitation` (7,) by group.

    `together` as in `Habits`.
    """
    gains, strength, shaken = jerk_gains(dt), np.sqrt(agitation), np.empty(POSE)
    for i in range(POSE):
        if strength[GROUP_OF[i]] == 0.0:
            continue
        for j in range(POSE):
            shaken[j] = strength[GROUP_OF[i]] * strength[GROUP_OF[j]] * together[i, j]
        for a in range(3):
            for b in range(3):
                target, gain = covariance[VELOCITY * a + i, VELOCITY * b:VELOCITY * b + POSE], gains[a, b]
                for j in range(POSE):
                    target[j] += gain * shaken[j]


@njit(cache=True)
def jerk_gains(dt: float) -> Array:
    """(3, 3) covariance of pose, velocity and acceleration after `dt` s per variance of the acceleration."""
    q = 2.0 / ACCELERATION_S
    out = np.empty((3, 3))
    out[0, 0], out[1, 1], out[2, 2] = q * dt**5 / 20.0, q * dt**3 / 3.0, q * dt
    out[0, 1] = out[1, 0] = q * dt**4 / 8.0
    out[0, 2] = out[2, 0] = q * dt**3 / 6.0
    out[1, 2] = out[2, 1] = q * dt**2 / 2.0
    return out


@njit(cache=True)
def _fade_biases(estimate: Estimate, dt: float, variance: Array) -> None:
    covariance, fade = estimate.covariance, math.exp(-dt / BIAS_S)
    size = covariance.shape[0]
    covariance[BIAS:] *= fade
    for i in range(size):
        covariance[i, BIAS:] *= fade
    for i in range(BIAS, size):
        marker = (i - BIAS) // 3
        estimate.bias[marker, (i - BIAS) % 3] *= fade
        covariance[i, i] += (1.0 - fade * fade) * variance[marker]
