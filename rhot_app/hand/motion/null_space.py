"""The null space of a hand's markers: the directions of a pose that move no marker.

Six markers leave nine of the 27 freedoms open. A filter that linearises anew with every frame sees a slightly different
null space each time, and becomes overconfident in the open directions (Huang, Mourikis and Roumeliotis 2010). So they
are reset to the pose prior before every prediction: the markers' places are kept, and the pose is the most probable
one by these places and the prior, within the joint limits: an angle beyond its limit is drawn back to it.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from rhot_app.hand.kinematics import forward_arrays, jacobian_arrays, move
from rhot_app.hand.limits import LIMIT_SD_RAD
from rhot_app.hand.motion.hand_state import POSE
from rhot_app.hand.skeleton import FINGER_ANGLES

MARKER_PLACE_SD_M = 0.3e-3
"""m: standard deviation with which a marker's place is kept; paint is not known better (`marker_model.PAINT_SD_M`)."""

_PALM_INFORMATION = 0.1  # 1/m^2 and 1/rad^2: the prior says nothing of the palm, which may be metres away
_STEPS, _RESTART_STEPS = 2, 6  # of Gauss-Newton, and from a finger's natural bend
_MORE_PROBABLE = 2.0  # of -2 log probability: the natural bend is taken when it is e times as probable


@njit(cache=True, inline="always")
def most_probable_pose(dh, limits, mean, information, world, angles):
    """The most probable pose by the places that the markers have at `world` (4, 4) m and `angles` (21,) rad.

    `dh` has a point for each marker; `limits` (21, 2) rad; `mean` (21,) rad and `information` (21, 21) of the pose
    prior. A finger at its limits may be bent the other way: a thumb has two modes. So the descent is tried from its
    natural bend too, and the more probable pose is taken.

    Returns world and angles of that pose, the projection (27, 27) of a deviation onto what the markers observe, and the
    covariance (27, 27) of the null space by the prior.
    """
    places, observed = np.empty((dh.point_row.shape[0], 3)), np.empty((3 * dh.point_row.shape[0], POSE))
    _place_markers(dh, world, angles, places, observed)
    inverse, prior, rows, cost = _descend(dh, limits, mean, information, places, world, angles, int(_STEPS))
    for finger in range(5):
        own = slice(FINGER_ANGLES[finger, 0], FINGER_ANGLES[finger, 1])
        if np.all(angles[own] >= limits[own, 0]) and np.all(angles[own] <= limits[own, 1]):
            continue
        other_world, other = world.copy(), angles.copy()
        other[own] = mean[own]
        found = _descend(dh, limits, mean, information, places, other_world, other,
                         int(_RESTART_STEPS))
        if found[3] < cost - _MORE_PROBABLE:
            inverse, prior, rows, cost = found
            world, angles = other_world, other
    projection = np.dot(inverse, np.dot(rows.T, observed))
    return world, angles, projection, np.dot(inverse, np.dot(prior, inverse))


@njit(cache=True)
def _place_markers(dh, world, angles, points, rows):
    """Fill `points` (M, 3) m and `rows` (3 M, 27), their Jacobian in units of MARKER_PLACE_SD_M."""
    frames, jacobian = np.empty((dh.parent.shape[0], 3, 4)), np.empty((points.shape[0], 3, POSE))
    forward_arrays(dh, world, angles, frames, points)
    jacobian_arrays(dh, world, frames, points, jacobian)
    rows[:] = jacobian.reshape(rows.shape) / MARKER_PLACE_SD_M


@njit(cache=True)
def _descend(dh, limits, mean, information, places, world, angles, steps):
    """Move `world` and `angles` by Gauss-Newton steps to the most probable pose. An angle that would go beyond its
    limit is drawn to the limit as well.

    Returns the inverse of the information (27, 27), the part of it that is the prior's, the Jacobian of the markers,
    and -2 log probability, up to a constant.
    """
    count = dh.point_row.shape[0]
    frames, points, rows = np.empty((dh.parent.shape[0], 3, 4)), np.empty((count, 3)), np.empty((3 * count, POSE))
    moved, inverse, prior = np.empty((4, 4)), np.eye(POSE), np.eye(POSE)
    limit_information, limit = np.empty_like(mean), np.empty_like(mean)
    for _ in range(steps):
        _place_markers(dh, world, angles, points, rows)
        marker_information = np.dot(rows.T, rows)
        prior[:] = _PALM_INFORMATION * np.eye(POSE)
        prior[6:, 6:] = information
        inverse = np.ascontiguousarray(np.linalg.inv(marker_information + prior))
        after = angles + np.dot(inverse, _gradient(rows, places, points, information, mean, angles))[6:]
        limit_information[:] = 0.0
        for i in range(mean.shape[0]):
            if after[i] < limits[i, 0] or after[i] > limits[i, 1]:
                limit_information[i] = 1.0 / LIMIT_SD_RAD**2
                limit[i] = limits[i, 0] if after[i] < limits[i, 0] else limits[i, 1]
                prior[6 + i, 6 + i] += limit_information[i]
        if limit_information.max() > 0.0:
            inverse = np.ascontiguousarray(np.linalg.inv(marker_information + prior))
        gradient = _gradient(rows, places, points, information, mean, angles)
        for i in range(mean.shape[0]):
            if limit_information[i] > 0.0:
                gradient[6 + i] += limit_information[i] * (limit[i] - angles[i])
        move(world, angles, np.dot(inverse, gradient), moved, angles)
        world[:] = moved
        forward_arrays(dh, world, angles, frames, points)
    away, cost = mean - angles, np.sum(((places - points) / MARKER_PLACE_SD_M) ** 2)
    for i in range(mean.shape[0]):
        cost += (max(angles[i] - limits[i, 1], limits[i, 0] - angles[i], 0.0) / LIMIT_SD_RAD) ** 2
    return inverse, prior, rows, cost + np.dot(away, np.dot(information, away))


@njit(cache=True)
def _gradient(rows, places, points, information, mean, angles):
    """(27,) gradient of the log probability by the markers' places and the pose prior."""
    gradient = np.dot(rows.T, (places - points).ravel() / MARKER_PLACE_SD_M)
    gradient[6:] += np.dot(information, mean - angles)
    return gradient
