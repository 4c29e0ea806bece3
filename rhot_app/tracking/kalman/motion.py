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
from numpy.typing import NDArray

from rhot_app.lean import lean, room
from rhot_app.tracking.kalman.combine import scale
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
    SCALE,
    TURN,
    VELOCITY,
    Estimate,
)
from rhot_app.tracking.kalman.habits import Habits
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


@lean
def predict(estimate: Estimate, dt: float, part: Indices, habits: Habits, bias_variance: Array) -> None:
    """Carry the estimate on by `dt` >= 0 s. `part` (M,) as in `Worn`; `bias_variance` (M,) m^2 is what
    each marker's bias tends to."""
    transition, moving = Transition(room((POSE,)), room((POSE,)), room((3,))), room((GROUPS,))
    _fill_transition(transition, dt)
    _move_mean(estimate, transition)
    _move_covariance(estimate.covariance, transition, math.exp(-dt / BIAS_S))
    scale(estimate.agitation, math.exp(-dt / CALM_S))
    for camera in range(estimate.pace.shape[0]):
        for m in range(estimate.width.shape[0]):
            estimate.unseen[camera, m] += dt * estimate.pace[camera]
            estimate.looks[camera, m, LOOK_AGE] += dt
    estimate.untroubled[0] += dt
    speeds(estimate, moving)
    estimate.turning[0] = max(estimate.turning[0] * math.exp(-dt / TURNING_S), moving[TURN])
    for m in range(estimate.width.shape[0]):
        if eyes_on(estimate.unseen, m)[0] > 1:
            estimate.width[m] *= math.exp(-dt / WIDTH_S)
    _keep_awake(estimate, moving)
    _go_along(estimate, part)
    lively = room((GROUPS,))
    liveliness(estimate, lively)
    shake(estimate.covariance, lively, habits.together, dt)
    _renew_biases(estimate, math.exp(-dt / BIAS_S), bias_variance)


@lean
def speeds(estimate: Estimate, out: Array) -> None:
    """Fill `out` (7,) with the speed of each group, m/s and rad/s, as far as it is no noise."""
    out[:] = 0.0
    for i in range(POSE):
        out[GROUP_OF[i]] += estimate.velocity[i] ** 2 - 4.0 * estimate.covariance[VELOCITY + i, VELOCITY + i]
    for group in range(GROUPS):
        out[group] = math.sqrt(max(out[group], 0.0))


@lean
def _keep_awake(estimate: Estimate, moving: Array) -> None:
    """What moves is awake; `moving` (7,) as `speeds` has it."""
    for group in range(FIRST_FINGER if estimate.held[0] == PALM_HELD else 0, GROUPS):
        awake = (moving[group] / (moving[group] + SLOW[group]) * AWAKE[group]) ** 2
        estimate.agitation[group] = max(estimate.agitation[group], awake)


@lean
def _go_along(estimate: Estimate, part: Indices) -> None:
    """A finger out of sight is taken to be as lively as those that are seen."""
    total, seen, away = 0.0, 0, room((FINGERS,))
    fingers_away(estimate, part, away)
    for finger in range(FINGERS):
        if away[finger] < FRESH_S:
            total += math.sqrt(estimate.agitation[FIRST_FINGER + finger])
            seen += 1
    if seen > 0:
        for finger in range(FINGERS):
            if away[finger] >= FRESH_S:
                group = FIRST_FINGER + finger
                estimate.agitation[group] = max(estimate.agitation[group], (total / seen) ** 2)


@lean
def liveliness(estimate: Estimate, out: Array) -> None:
    """Fill `out` (7,) with the variance of each group's acceleration: of one at rest, of one that is awake, and by its
    speed."""
    moving = room((GROUPS,))
    speeds(estimate, moving)
    moving[LINEAR] *= 1.0 + moving[LINEAR] / HASTE_M_S
    for group in range(GROUPS):
        out[group] = min(STILL[group] ** 2 + estimate.agitation[group] + (PER_SPEED[group] * moving[group]) ** 2,
                         MOST[group])


class Transition(NamedTuple):
    """How time carries on: per pose number the factors velocity to pose, `way` (27,), and velocity to velocity, `decay`
    (27,); `pull` (3,): those of acceleration to pose, to velocity and to itself."""

    way: Array
    decay: Array
    pull: Array


@lean
def _fill_transition(out: Transition, dt: float) -> None:
    """By `dt` s."""
    for i in range(POSE):
        out.decay[i] = math.exp(-dt / VELOCITY_S[i])
        out.way[i] = VELOCITY_S[i] * (1.0 - out.decay[i])
    keep = math.exp(-dt / ACCELERATION_S)
    gained = ACCELERATION_S * (1.0 - keep)
    out.pull[0], out.pull[1], out.pull[2] = ACCELERATION_S * (dt - gained), gained, keep


@lean
def _move_mean(estimate: Estimate, by: Transition) -> None:
    velocity, acceleration, world = estimate.velocity, estimate.acceleration, estimate.world
    moved, rotation, before = room((POSE,)), room((3, 3)), room((3,))
    for i in range(POSE):
        moved[i] = by.way[i] * velocity[i] + by.pull[0] * acceleration[i]
        velocity[i] = by.decay[i] * velocity[i] + by.pull[1] * acceleration[i]
        acceleration[i] *= by.pull[2]
    exponential(moved[3], moved[4], moved[5], rotation)
    for j in range(3):
        for i in range(3):
            before[i] = world[i, j]
        for i in range(3):
            world[i, j] = rotation[i, 0] * before[0] + rotation[i, 1] * before[1] + rotation[i, 2] * before[2]
    for i in range(3):
        world[i, 3] += moved[i]
    for i in range(21):
        estimate.angles[i] += moved[ANGLES + i]
    _turn(estimate.covariance, rotation)


@lean
def _turn(covariance: Array, rotation: Array) -> None:
    """Turn what is known of the palm's rotation with the palm."""
    one, two, three = covariance[ROTATION], covariance[ROTATION + 1], covariance[ROTATION + 2]
    a, b, c = rotation[0], rotation[1], rotation[2]
    for j in range(covariance.shape[0]):
        x, y, z = one[j], two[j], three[j]
        one[j] = a[0] * x + a[1] * y + a[2] * z
        two[j] = b[0] * x + b[1] * y + b[2] * z
        three[j] = c[0] * x + c[1] * y + c[2] * z
    for row in range(covariance.shape[0]):
        x, y, z = covariance[row, ROTATION], covariance[row, ROTATION + 1], covariance[row, ROTATION + 2]
        for i in range(3):
            covariance[row, ROTATION + i] = rotation[i, 0] * x + rotation[i, 1] * y + rotation[i, 2] * z


@lean
def exponential(x: float, y: float, z: float, out: Array) -> None:
    """Fill `out` (3, 3) with the rotation by the rotation vector (x, y, z), rad."""
    angle = math.sqrt(x * x + y * y + z * z)
    a = math.sin(angle) / angle if angle > 1e-9 else 1.0
    b = (1.0 - math.cos(angle)) / (angle * angle) if angle > 1e-5 else 0.5
    out[0, 0], out[0, 1], out[0, 2] = 1.0 - b * (y * y + z * z), b * x * y - a * z, b * x * z + a * y
    out[1, 0], out[1, 1], out[1, 2] = b * x * y + a * z, 1.0 - b * (x * x + z * z), b * y * z - a * x
    out[2, 0], out[2, 1], out[2, 2] = b * x * z - a * y, b * y * z + a * x, 1.0 - b * (x * x + y * y)


@lean
def _move_covariance(covariance: Array, by: Transition, fade: float) -> None:
    """P becomes F P F^T, where biases become a part `fade` of themselves."""
    size, way, decay = covariance.shape[0], by.way, by.decay
    bend, gained, keep = by.pull[0], by.pull[1], by.pull[2]
    for i in range(POSE):
        pose, speed, pull = covariance[i], covariance[VELOCITY + i], covariance[ACCELERATION + i]
        ahead, slower = way[i], decay[i]
        for j in range(size):
            pose[j] += ahead * speed[j] + bend * pull[j]
            speed[j] = slower * speed[j] + gained * pull[j]
            pull[j] *= keep
    for i in range(size):
        if i >= BIAS:
            scale(covariance[i], fade)
        row = covariance[i]
        pose, speed, pull = row[:POSE], row[VELOCITY:ACCELERATION], row[ACCELERATION:SCALE]
        for j in range(POSE):
            pose[j] += way[j] * speed[j] + bend * pull[j]
            speed[j] = decay[j] * speed[j] + gained * pull[j]
            pull[j] *= keep
        scale(row[BIAS:], fade)


@lean
def shake(covariance: Array, agitation: Array, together: Array, dt: float) -> None:
    """Add what white jerk does in `dt` s that keeps up accelerations of variance `agitation` (7,) by group.

    `together` as in `Habits`.
    """
    gains, strength, shaken = room((3, 3)), room((POSE,)), room((POSE,))
    jerk_gains(dt, gains)
    for i in range(POSE):
        strength[i] = math.sqrt(agitation[GROUP_OF[i]])
    for i in range(POSE):
        if strength[i] == 0.0:
            continue
        own, goes_along = strength[i], together[i]
        for j in range(POSE):
            shaken[j] = own * strength[j] * goes_along[j]
        for a in range(3):
            for b in range(3):
                target, gain = covariance[VELOCITY * a + i, VELOCITY * b:VELOCITY * b + POSE], gains[a, b]
                for j in range(POSE):
                    target[j] += gain * shaken[j]


@lean
def jerk_gains(dt: float, out: Array) -> None:
    """Fill `out` (3, 3) with the covariance of pose, velocity and acceleration after `dt` s per variance of the
    acceleration."""
    q = 2.0 / ACCELERATION_S
    out[0, 0], out[1, 1], out[2, 2] = q * dt**5 / 20.0, q * dt**3 / 3.0, q * dt
    out[0, 1] = out[1, 0] = q * dt**4 / 8.0
    out[0, 2] = out[2, 0] = q * dt**3 / 6.0
    out[1, 2] = out[2, 1] = q * dt**2 / 2.0


@lean
def _renew_biases(estimate: Estimate, fade: float, variance: Array) -> None:
    """What has faded of biases, and of what was known of them, may be anything of `variance` (M,) m^2."""
    for m in range(estimate.bias.shape[0]):
        for k in range(3):
            i = BIAS + 3 * m + k
            estimate.bias[m, k] *= fade
            estimate.covariance[i, i] += (1.0 - fade * fade) * variance[m]
