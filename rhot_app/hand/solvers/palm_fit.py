"""Palm pose and joint angles from the wrist and the fingertip markers, as well as these show them.

One wrist marker fixes where the hand is but not how it is turned. The fingertips bind rotation and finger angles
together, and the natural pose and the previous one decide between the hands that would hold the tips there. The
rotation is therefore a guess, and comes with its standard deviation. A hidden wrist makes the palm's place a guess too:
the fingertips that are seen carry the hand along.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.estimation.least_squares import Stop, descend
from rhot_app.estimation.linear import factorise, substitute
from rhot_app.estimation.se3 import exp_so3
from rhot_app.geometry.transforms import best_rotation, fit_rigid, rigid
from rhot_app.hand.dh import DhArrays
from rhot_app.hand.kinematics import TWIST, forward
from rhot_app.hand.model import HandModel, neutral_pose
from rhot_app.hand.skeleton import ANGLES, JOINTS, HandPose
from rhot_app.hand.solvers.pose_descent import SIZE, WORLD, PoseProblem, linearise_pose, pose_state

Array = NDArray[np.float64]

SHORTEST_S = 1e-3
"""Poses nearer in time are weighed as if this far apart."""

TIPS_WITHOUT_WRIST = 4
"""With fewer tips than these, no wrist and no previous pose nothing can be said."""

WRIST_SD = 1.0e-3
TIP_SD = 1.5e-3
"""Standard deviations of the markers' positions, m: measurement, and what the model's bones get wrong."""

TRANSLATION_DRIFT, ROTATION_DRIFT, ANGLE_DRIFT = 0.15, 0.6, 0.8
"""Random walks of the palm's place, m/sqrt(s), its rotation and the joint angles, rad/sqrt(s): standard deviations of
the change since the previous pose. A walk weighs the past alike at every frame rate."""

STEPS_WARM, STEPS_COLD = 8, 40
_GAIN, _STILL_RAD = 1e-5, 1e-4
_DRIFT = np.array([TRANSLATION_DRIFT] * 3 + [ROTATION_DRIFT] * 3 + [ANGLE_DRIFT] * len(ANGLES))


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
        return _fit_from(model, wrist, tips, previous, dt_s) if any_marker(wrist, tips) else None
    if np.isfinite(tips).all(axis=1).sum() < (1 if np.isfinite(wrist).all() else TIPS_WITHOUT_WRIST):
        return None
    fits = [_fit_from(model, wrist, tips, start, math.inf) for start in start_poses(model, wrist, tips)]
    return min(fits, key=lambda fit: fit.cost)


def start_poses(model: HandModel, wrist: Array, tips: Array) -> list[HandPose]:
    """Hands to begin from when nothing is known: open, relaxed, closing and closed, laid on the markers (Kabsch)."""
    markers = np.vstack([wrist, tips])
    seen = np.logical_and.reduce(np.isfinite(markers), axis=1)
    poses = []
    for closing in range(4):
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


def _fit_from(model: HandModel, wrist: Array, tips: Array, start: HandPose, dt_s: float) -> PalmFit:
    world, angles, prior = np.array(start.world_from_palm), np.array(start.angles), model.pose_prior
    converged = track_arrays(model.dh, model.limits, prior.mean, prior.information, wrist, tips, dt_s, world, angles)
    cost, deviation = _judge(_problem(model.dh, model.limits, prior.mean, prior.information, wrist, tips),
                             pose_state(world, angles))
    return PalmFit(HandPose(world, angles), deviation, cost, converged)


@njit(cache=True)
def any_marker(wrist: Array, tips: Array) -> bool:
    """Whether `wrist` (3,) and `tips` (5, 3), NaN where missing, say anything about a hand whose pose was known."""
    for finger in range(tips.shape[0]):
        if not math.isnan(tips[finger, 0] + tips[finger, 1] + tips[finger, 2]):
            return True
    return not math.isnan(wrist[0] + wrist[1] + wrist[2])


@njit(cache=True)
def track_arrays(dh: DhArrays, limits: Array, mean: Array, information: Array, wrist: Array, tips: Array, dt_s: float,
                 world: Array, angles: Array) -> bool:
    """`fit_palm` from the pose `dt_s` seconds ago, `world` (4, 4) and `angles` (21,), in place and without its
    judgement, which costs as much as two steps; inf: that pose says nothing. Returns whether it has converged."""
    problem = _problem(dh, limits, mean, information, wrist, tips)
    problem.previous[:] = pose_state(world, angles)
    problem.drift[:] = 1.0 / (_DRIFT**2 * max(dt_s, SHORTEST_S))
    if not math.isnan(wrist[0] + wrist[1] + wrist[2]):
        for i in range(3):
            world[i, 3] = wrist[i]
    for i in range(angles.shape[0]):
        angles[i] = min(max(angles[i], limits[i, 0]), limits[i, 1])
    state = pose_state(world, angles)
    stop = Stop(int(STEPS_WARM) if math.isfinite(dt_s) else int(STEPS_COLD), _GAIN, _STILL_RAD, 0.0)
    _, _, converged = descend(problem, state, int(SIZE), stop)
    world[:3], angles[:] = state[:WORLD].reshape(3, 4), state[WORLD:]
    return converged


@njit(cache=True)
def _problem(dh: DhArrays, limits: Array, mean: Array, information: Array, wrist: Array, tips: Array) -> PoseProblem:
    count = dh.point_row.shape[0]
    places, weights = np.full((count, 3), math.nan), np.zeros((count, 3, 3))
    places[0], places[len(JOINTS):] = wrist, tips
    for m in range(count):
        for i in range(3):
            weights[m, i, i] = 1.0 / (WRIST_SD if m == 0 else TIP_SD) ** 2
    return PoseProblem(dh, limits, mean, information, places, weights, 1.0, 0.0, np.zeros(WORLD + len(ANGLES)),
                       np.zeros(SIZE))


@njit(cache=True)
def _judge(problem: PoseProblem, state: Array) -> tuple[float, float]:
    """Cost and rotation's standard deviation without the previous pose, whose error is not independent."""
    matrix, right, bounds = np.empty((SIZE, SIZE)), np.empty(SIZE), np.empty((2, SIZE))
    cost = linearise_pose(problem, state, matrix, right, bounds[0], bounds[1])
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


# -- a palm before one camera ------------------------------------------------------------------------------------------

def palms_before_camera(points: Array, rays: Array, camera_from_world: Array) -> list[Array]:
    """world_from_palm (4, 4) of a palm whose `points` (P, 3) m, palm's frame, at least three, a camera of pose
    `camera_from_world` (3, 4) sees along `rays` (P, 2), undistorted, at depth 1. A palm is nearly flat, so each is
    followed by its mirror image along the line of sight, which looks alike (Terzakis and Lourakis 2020: SQPnP).
    None when all rays are one."""
    try:
        _, turns, shifts, _ = cv2.solvePnPGeneric(points, rays, np.eye(3), None, flags=cv2.SOLVEPNP_SQPNP)
    except cv2.error:  # all rays are one
        return []
    rotation, shift = camera_from_world[:, :3], camera_from_world[:, 3]
    places = []
    for vector, away in zip(turns, shifts, strict=True):
        turn, away = exp_so3(vector.ravel()), away.ravel()
        middle = turn @ points.mean(axis=0) + away
        line = middle / np.linalg.norm(middle)
        mirrored = (np.eye(3) - 2.0 * np.outer(line, line)) @ turn @ np.diag([1.0, 1.0, -1.0])
        for one in (turn, mirrored):
            places.append(rigid(rotation.T @ one, rotation.T @ (middle - one @ points.mean(axis=0) - shift)))
    return [place for place in places if np.isfinite(place).all()]
