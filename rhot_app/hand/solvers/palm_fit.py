"""Palm pose and joint angles from the wrist and the fingertip markers, as well as these show them.

One wrist marker fixes where the hand is but not how it is turned. The fingertips bind rotation and finger angles
together, and the natural pose and the previous one decide between the hands that would hold the tips there. The
rotation is therefore a guess, and comes with its standard deviation. A hidden wrist makes the palm's place a guess too:
the fingertips that are seen carry the hand along.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.estimation.se3 import pose_difference
from rhot_app.geometry.transforms import best_rotation, fit_rigid, rigid
from rhot_app.hand.dh import DhArrays
from rhot_app.hand.kinematics import TWIST, forward, forward_arrays, jacobian_arrays, move
from rhot_app.hand.linear import factorise, solve_in_box, substitute
from rhot_app.hand.model import HandModel, neutral_pose
from rhot_app.hand.skeleton import ANGLES, JOINTS, HandPose

Array = NDArray[np.float64]

SHORTEST_S = 1e-3
"""Poses nearer in time are weighed as if this far apart."""

STEPS_WARM = 8
STEPS_COLD = 40

TIPS_WITHOUT_WRIST = 4
"""With fewer tips than these, no wrist and no previous pose nothing can be said."""


@dataclass(frozen=True, slots=True)
class PalmFit:
    """The most plausible hand. `rotation_std_rad`: standard deviation of the palm's rotation, all axes together, from
    this instant's markers and the natural pose alone; `cost`: half the sum of squared, normalised residuals, without
    the previous pose's."""

    pose: HandPose
    rotation_std_rad: float
    cost: float
    converged: bool


def fit_palm(model: HandModel, wrist: Array, tips: Array, previous: HandPose | None, dt_s: float) -> PalmFit | None:
    """Fit the hand to its markers: `wrist` (3,) m and `tips` (5, 3) m, world; NaN where missing.

    `previous` is the pose `dt_s` seconds ago, None to start from nothing. None is returned when nothing can be said:
    with no marker at all, and without a previous pose with the wrist alone or with less than four tips alone.
    """
    if previous is not None:
        return (_fit_from(model, wrist, tips, previous, previous, dt_s, STEPS_WARM)
                if any_marker(wrist, tips) else None)
    if np.isfinite(tips).all(axis=1).sum() < (1 if np.isfinite(wrist).all() else TIPS_WITHOUT_WRIST):
        return None
    fits = [_fit_from(model, wrist, tips, start, None, dt_s, STEPS_COLD) for start in start_poses(model, wrist, tips)]
    return min(fits, key=lambda fit: fit.cost)


def start_poses(model: HandModel, wrist: Array, tips: Array) -> list[HandPose]:
    """Hands to begin from when nothing is known: open, relaxed, closing and closed, laid on the markers (Kabsch)."""
    markers = np.vstack([wrist, tips])
    seen = np.logical_and.reduce(np.isfinite(markers), axis=1)
    poses = []
    for closing in (0.0, 1.0, 2.0, 3.0):
        angles = neutral_pose().angles.copy()
        angles[4:] *= closing
        angles = np.clip(angles, *model.limits.T)
        at_rest = forward(model, HandPose(np.eye(4), angles))
        shape = np.vstack([at_rest.joints[0], at_rest.marker_centres])
        if seen[0]:  # the wrist is where the hand is: turn about it
            turn = best_rotation((markers[seen] - wrist).T @ (shape[seen] - shape[0]))
            world = rigid(turn, wrist - turn @ shape[0])
        else:
            world = fit_rigid(shape[seen], markers[seen])
        poses.append(HandPose(world, angles))
        # The same hand turned about its long axis: few tips, or tips in a row, do not show which side is the back.
        tip = markers[1:][seen[1:]].mean(axis=0)
        axis = (tip - world[:3, 3]) / np.linalg.norm(tip - world[:3, 3])
        turned = world.copy()
        turned[:3, :3] = (2.0 * np.outer(axis, axis) - np.eye(3)) @ world[:3, :3]
        poses.append(HandPose(turned, angles))
    return poses


def _fit_from(model: HandModel, wrist: Array, tips: Array, start: HandPose, previous: HandPose | None, dt_s: float,
              steps: int) -> PalmFit:
    world = np.array(start.world_from_palm)
    if np.isfinite(wrist).all():
        world[:3, 3] = wrist
    angles = np.clip(start.angles, *model.limits.T)
    before, prior = previous or start, model.pose_prior
    cost, deviation, converged = fit_arrays(
        model.dh, model.limits, prior.mean, prior.information, wrist, tips, before.world_from_palm,
        before.angles, max(dt_s, SHORTEST_S) if previous is not None else math.inf, steps, world, angles)
    return PalmFit(HandPose(world, angles), deviation, cost, converged)


@njit(cache=True)
def fit_arrays(dh: DhArrays, limits: Array, mean: Array, information: Array, wrist: Array, tips: Array,
               previous_world: Array, previous_angles: Array, dt: float, steps: int, world: Array,
               angles: Array) -> tuple[float, float, bool]:
    """`descend_arrays`; returns cost, rotation's standard deviation (rad) and whether the last step was small."""
    converged = descend_arrays(dh, limits, mean, information, wrist, tips, previous_world, previous_angles, dt, steps,
                               world, angles)
    cost, deviation = judge_arrays(dh, world, angles, mean, information, wrist, tips)
    return cost, deviation, converged


@njit(cache=True)
def any_marker(wrist: Array, tips: Array) -> bool:
    """Whether `wrist` (3,) and `tips` (5, 3), NaN where missing, say anything about a hand whose pose was known."""
    for finger in range(tips.shape[0]):
        if not math.isnan(tips[finger, 0] + tips[finger, 1] + tips[finger, 2]):
            return True
    return not math.isnan(wrist[0] + wrist[1] + wrist[2])


@njit(cache=True, inline="always")
def track_arrays(dh: DhArrays, limits: Array, mean: Array, information: Array, wrist: Array, tips: Array, dt_s: float,
                 world: Array, angles: Array) -> None:
    """`fit_palm` from a previous pose `dt_s` seconds ago, `world` (4, 4) and `angles` (21,), in place and without its
    judgement, which costs as much as two steps."""
    previous_world, previous_angles = world.copy(), angles.copy()
    if not math.isnan(wrist[0] + wrist[1] + wrist[2]):
        for i in range(3):
            world[i, 3] = wrist[i]
    for i in range(angles.shape[0]):
        angles[i] = min(max(angles[i], limits[i, 0]), limits[i, 1])
    descend_arrays(dh, limits, mean, information, wrist, tips, previous_world, previous_angles, max(dt_s, SHORTEST_S),
                   int(STEPS_WARM), world, angles)


# -- the descent of the palm fit ---------------------------------------------------------------------------------------

WRIST_SD = 1.0e-3
TIP_SD = 1.5e-3
"""Standard deviations of the markers' positions, m: measurement, and what the model's bones get wrong."""

ROTATION_DRIFT = 0.6
ANGLE_DRIFT = 0.8
TRANSLATION_DRIFT = 0.15
"""Random walks of palm rotation and joint angles, rad/sqrt(s), and of the palm's place, m/sqrt(s): standard
deviations of the change since the previous pose. A walk weighs the past alike at every frame rate."""

STEP_MAX = 0.6
"""Largest change of a rotation or angle in one step, rad."""

SIZE = TWIST + len(ANGLES)
FIRST_MARKER = len(JOINTS)


@njit(cache=True)
def descend_arrays(dh: DhArrays, limits: Array, mean: Array, information: Array, wrist: Array, tips: Array,
                   previous_world: Array, previous_angles: Array, dt: float, steps: int, world: Array,
                   angles: Array) -> bool:
    """Levenberg-Marquardt from `world` (4, 4) and `angles` (21,), in place; dt is inf without a previous pose.

    Returns whether the last step was small. Unknowns: palm twist in world axes (see kinematics.TWIST), then the
    angles.
    """
    frames, points = np.empty((dh.parent.shape[0], 3, 4)), np.empty((dh.point_row.shape[0], 3))
    jacobian = np.empty((points.shape[0], 3, SIZE))
    matrix, damped, right = np.empty((SIZE, SIZE)), np.empty((SIZE, SIZE)), np.empty(SIZE)
    low, high, step = np.empty(SIZE), np.empty(SIZE), np.empty(SIZE)
    trial_world, trial_angles = world.copy(), angles.copy()
    forward_arrays(dh, world, angles, frames, points)
    cost = _cost(points, world, angles, mean, information, wrist, tips, previous_world, previous_angles, dt)
    damping, converged = 1e-4, False
    for _ in range(steps):
        jacobian_arrays(dh, world, frames, points, jacobian)
        _normal_equations(points, jacobian, world, angles, mean, information, wrist, tips, previous_world,
                          previous_angles, dt, matrix, right)
        for i in range(SIZE):
            low[i], high[i] = -STEP_MAX, STEP_MAX
            if i >= TWIST:
                low[i] = max(low[i], min(limits[i - TWIST, 0] - angles[i - TWIST], 0.0))
                high[i] = min(high[i], max(limits[i - TWIST, 1] - angles[i - TWIST], 0.0))
        accepted = False
        for _ in range(6):
            damped[:] = matrix
            for i in range(SIZE):
                damped[i, i] *= 1.0 + damping
            solve_in_box(damped, right, low, high, step)
            move(world, angles, step, trial_world, trial_angles)
            forward_arrays(dh, trial_world, trial_angles, frames, points)
            trial_cost = _cost(points, trial_world, trial_angles, mean, information, wrist, tips, previous_world,
                               previous_angles, dt)
            if trial_cost <= cost:
                accepted = True
                break
            damping = max(10.0 * damping, 1e-3)
        if not accepted:
            converged = True
            break
        gain, cost = cost - trial_cost, trial_cost
        world[:], angles[:] = trial_world, trial_angles
        damping = max(0.1 * damping, 1e-9)
        if np.abs(step).max() < 1e-4 or gain < 1e-5 * (1.0 + cost):
            converged = True
            break
    return converged


@njit(cache=True)
def judge_arrays(dh: DhArrays, world: Array, angles: Array, mean: Array, information: Array, wrist: Array,
           tips: Array) -> tuple[float, float]:
    """Cost and rotation's standard deviation without the previous pose, whose error is not independent."""
    frames, points = np.empty((dh.parent.shape[0], 3, 4)), np.empty((dh.point_row.shape[0], 3))
    jacobian = np.empty((points.shape[0], 3, SIZE))
    matrix, right = np.empty((SIZE, SIZE)), np.empty(SIZE)
    forward_arrays(dh, world, angles, frames, points)
    cost = _cost(points, world, angles, mean, information, wrist, tips, world, angles, np.inf)
    jacobian_arrays(dh, world, frames, points, jacobian)
    _normal_equations(points, jacobian, world, angles, mean, information, wrist, tips, world, angles, np.inf, matrix,
                      right)
    for i in range(3):  # without wrist the tips may not fix the place: keep the matrix invertible
        matrix[i, i] += 1.0
        matrix[i + 3, i + 3] += 1.0 / math.pi ** 2
    factorise(matrix)
    variance = 0.0
    for axis in range(3, TWIST):
        right[:] = 0.0
        right[axis] = 1.0
        substitute(matrix, right, right)
        variance += right[axis]
    return cost, math.sqrt(variance)


@njit(cache=True)
def _cost(points: Array, world: Array, angles: Array, mean: Array, information: Array, wrist: Array, tips: Array,
          previous_world: Array, previous_angles: Array, dt: float) -> float:
    total = 0.0
    for marker in range(6):
        point = points[0] if marker == 5 else points[FIRST_MARKER + marker]
        measured = wrist if marker == 5 else tips[marker]
        deviation = WRIST_SD if marker == 5 else TIP_SD
        if not math.isnan(measured[0] + measured[1] + measured[2]):
            for i in range(3):
                total += ((point[i] - measured[i]) / deviation) ** 2
    for i in range(angles.shape[0]):
        for j in range(angles.shape[0]):
            total += (angles[i] - mean[i]) * information[i, j] * (angles[j] - mean[j])
    if dt < np.inf:
        moved = pose_difference(world, previous_world)
        for i in range(3):
            total += (moved[3 + i] / (ROTATION_DRIFT * math.sqrt(dt))) ** 2
            total += (moved[i] / (TRANSLATION_DRIFT * math.sqrt(dt))) ** 2
        for i in range(angles.shape[0]):
            total += ((angles[i] - previous_angles[i]) / (ANGLE_DRIFT * math.sqrt(dt))) ** 2
    return 0.5 * total


@njit(cache=True)
def _normal_equations(points: Array, jacobian: Array, world: Array, angles: Array, mean: Array, information: Array,
                      wrist: Array, tips: Array, previous_world: Array, previous_angles: Array, dt: float,
                      matrix: Array, right: Array) -> None:
    """Fill the Gauss-Newton `matrix` (27, 27) and `right` (27,), the negative gradient of `_cost`."""
    count = angles.shape[0]
    matrix[:], right[:] = 0.0, 0.0
    for i in range(count):
        for j in range(count):
            matrix[TWIST + i, TWIST + j] = information[i, j]
            right[TWIST + i] += information[i, j] * (mean[j] - angles[j])
    for marker in range(6):
        row = 0 if marker == 5 else FIRST_MARKER + marker
        measured = wrist if marker == 5 else tips[marker]
        weight = 1.0 / (WRIST_SD if marker == 5 else TIP_SD) ** 2
        if math.isnan(measured[0] + measured[1] + measured[2]):
            continue
        first, last = 0, 0  # this finger's columns; all others but the twist's are zero
        if marker < 5:
            first, last = (TWIST if marker == 0 else TWIST + 1 + 4 * marker), TWIST + 5 + 4 * marker
        for i in range(3):
            _add_residual(jacobian[row, i], measured[i] - points[row, i], weight, first, last, matrix, right)
    if dt < np.inf:
        moved = pose_difference(world, previous_world)
        for i in range(TWIST):
            _pull(i, -moved[i], (TRANSLATION_DRIFT if i < 3 else ROTATION_DRIFT) * math.sqrt(dt), matrix, right)
        for i in range(count):
            _pull(TWIST + i, previous_angles[i] - angles[i], ANGLE_DRIFT * math.sqrt(dt), matrix, right)


@njit(cache=True)
def _add_residual(slope: Array, residual: float, weight: float, first: int, last: int, matrix: Array,
                  right: Array) -> None:
    """Add one residual whose Jacobian row is zero but for the twist and the columns first..last."""
    for i in range(TWIST):
        right[i] += weight * slope[i] * residual
        for j in range(TWIST):
            matrix[i, j] += weight * slope[i] * slope[j]
    for i in range(first, last):
        right[i] += weight * slope[i] * residual
        for j in range(TWIST):
            cross = weight * slope[i] * slope[j]
            matrix[i, j] += cross
            matrix[j, i] += cross
        for j in range(first, last):
            matrix[i, j] += weight * slope[i] * slope[j]


@njit(cache=True)
def _pull(column: int, residual: float, deviation: float, matrix: Array, right: Array) -> None:
    matrix[column, column] += 1.0 / deviation ** 2
    right[column] += residual / deviation ** 2
