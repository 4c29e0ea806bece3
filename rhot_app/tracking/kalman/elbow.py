"""A thumb that bends backwards, looked at again: the same tip, the same palm, and the bones between them mirrored.

A nearly straight thumb has its tip in the same place whether its joints bend a little forwards or a little backwards.
The way from one to the other leads through the straight thumb, whose tip is elsewhere, so a filter that has once taken
the wrong one stays there, and when the thumb goes on to bend forwards is led away from what both cameras see. Thumbs
seldom bend backwards.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rhot_app.hand.finger_ik import solve_finger
from rhot_app.hand.kinematics import TWIST, forward, jacobian
from rhot_app.hand.model import HandModel
from rhot_app.hand.skeleton import ANGLE_SLICES, JOINTS, TIP_ROLES, HandPose
from rhot_app.tracking.kalman.estimate import ANGLES, PLACED, Estimate
from rhot_app.tracking.kalman.reappearing import forget_course, forget_finger
from rhot_app.tracking.kalman.sighted import eyes_on
from rhot_app.tracking.kalman.wearing import Wearing

Array = NDArray[np.float64]

BACKWARDS_RAD = np.radians(5.0)
"""Sum of the outer two joints' angles beyond which a thumb counts as bent backwards."""

_AT_END_RAD, _CLIPPED = np.radians(1.0), 2.0
"""Outer joints this near to the end of their way back would go on if they could: that counts as so much strain."""

_STAYS_M = 1e-4
"""The tip is as well known afterwards as before, and this much less."""

_THUMB = ANGLE_SLICES[0]
_ROOT, _OUTER = 1, slice(3, 5)
_LEVERS = np.array([1.2, 0.6])  # what the root turns for a tip that stays, per angle of the outer joints mirrored


def bent_backwards(estimate: Estimate) -> bool:
    """Whether the thumb's outer joints bend the unusual way."""
    return sum(estimate.angles[_OUTER].tolist()) < -BACKWARDS_RAD


def unbend(estimate: Estimate, wearing: Wearing) -> bool:
    """Bend the thumb forwards if that is more natural and leaves its tip in place; returns whether it was. One that
    is about as natural is preferred to a thumb at the end of its way back.

    Of the joints nothing is known afterwards but what is usual, and of how they change nothing. A tip that two cameras
    see is known as well as before; what is believed of another may have been led astray with its joints.
    """
    model, usual = wearing.model, wearing.habits.usual
    world, angles = estimate.world, estimate.angles[_THUMB].copy()
    target = forward(model, HandPose(world, estimate.angles)).marker_centres[0]
    before = _leverage(estimate, model)
    mirrored = angles.copy()
    mirrored[_OUTER] *= -1.0
    mirrored[_ROOT] += _LEVERS @ angles[_OUTER]
    found = solve_finger(model, 0, world, mirrored, target)
    strain, ends = _strain(model, angles), model.limits[_THUMB][_OUTER, 0]
    if np.all(angles[_OUTER] < ends + _AT_END_RAD):
        strain += _CLIPPED
    if not found.reached or found.angles[_OUTER].sum() < 0.0 or _strain(model, found.angles) >= strain:
        return False
    estimate.angles[_THUMB] = found.angles
    if _is_located(estimate, wearing.marker_of(TIP_ROLES[0])):
        _carry_over(estimate, before, _leverage(estimate, model), usual[ANGLES:, ANGLES:][_THUMB, _THUMB])
        forget_course(estimate, 0)
    else:
        forget_finger(estimate, 0, usual)
    return True


def _is_located(estimate: Estimate, marker: int) -> bool:
    """Whether two cameras or more show where a marker is, -1 for none, on a hand that they show the place of."""
    return marker >= 0 and eyes_on(estimate.unseen, marker)[0] > 1 and estimate.held[0] < PLACED


def _leverage(estimate: Estimate, model: HandModel) -> Array:
    """(3, 5) m per rad: how the thumb's marker goes with its angles."""
    pose = HandPose(estimate.world, estimate.angles)
    return jacobian(model, pose)[len(JOINTS), :, TWIST:][:, _THUMB]


def _carry_over(estimate: Estimate, before: Array, after: Array, usual: Array) -> None:
    """What was known of the thumb's angles by way of its tip, for joints that are bent otherwise.

    The new angles move the tip as the old ones did, each by as much as it usually takes part; what leaves the tip in
    place is as free as it usually is. So the covariance of the tip stays what it was, with all that it has to do with
    the palm.
    """
    gain = usual @ after.T @ np.linalg.inv(after @ usual @ after.T + _STAYS_M ** 2 * np.eye(3))
    carried, free = gain @ before, np.eye(len(usual)) - gain @ after
    rows, covariance = slice(ANGLES + _THUMB.start, ANGLES + _THUMB.stop), estimate.covariance
    covariance[rows] = carried @ covariance[rows]
    covariance[:, rows] = covariance[:, rows] @ carried.T
    covariance[rows, rows] += free @ usual @ free.T + _STAYS_M ** 2 * gain @ gain.T


def _strain(model: HandModel, angles: Array) -> float:
    """How unnatural the thumb's `angles` (5,) are, in squared standard deviations."""
    away = angles - model.natural.mean[_THUMB]
    return float(away @ model.natural.information[_THUMB, _THUMB] @ away)
