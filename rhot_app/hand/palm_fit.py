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

from rhot_app.geometry.transforms import best_rotation, fit_rigid, rigid
from rhot_app.hand.dh import DhArrays
from rhot_app.hand.kinematics import forward
from rhot_app.hand.model import HandModel, neutral_pose
from rhot_app.hand.palm_descent import descend_arrays, judge_arrays
from rhot_app.hand.skeleton import HandPose

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
    before = previous or start
    cost, deviation, converged = fit_arrays(
        model.dh, model.limits, model.natural.mean, model.natural.information, wrist, tips, before.world_from_palm,
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


@njit(cache=True)
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
                   STEPS_WARM, world, angles)
