"""Feature mode: slices across the links' axes and at the fingertips (Rehg 1995, 4.3).

Slices cross both edges of a link at the same positions along it. The radius is marginalised, so a pair of edges is one
point of the projected axis (eq. 2.17). One edge alone is extrapolated with the radius of the model. A fingertip is
found along its axis (eq. 2.19). In the thesis a person removed the features that other fingers hide; here the model
does. There are fewer slices than in contour mode and none on the palm: it is fast, and meant for open hands.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.barehand.contours import (
    END_BALL,
    OUTSIDE_M,
    ContourPoints,
    camera_centre,
    image_normal,
    link_behind,
    project,
    side_normals,
)
from rhot_app.barehand.surface import PALM, Surface, place_capsules
from rhot_app.hand.motion.hand_process import ANGLES, VELOCITY

Array = NDArray[np.float64]

PLACES = 2
"""Slices along each side of a link: two determine a line."""


def feature_points(surface: Surface, state: Array, size: Array, pose: Array, intrinsics: Array,
                   image_size: tuple[int, int]) -> ContourPoints:
    """The visible edges of all links and fingertips. Arguments are those of `contours.contour_points`."""
    most = len(surface.row) * (2 * PLACES + 1)
    ints, floats = np.empty((most, 3), np.int64), np.empty((most, 6))
    count = _features(surface, state, size, pose, intrinsics, float(image_size[0]), float(image_size[1]), ints, floats)
    ints, floats = ints[:count], floats[:count]
    return ContourPoints(ints[:, 0].copy(), ints[:, 1].copy(), floats[:, 0].copy(), ints[:, 2].copy(),
                         floats[:, 1:3].copy(), floats[:, 3:5].copy(), floats[:, 5].copy())


@njit(cache=True)
def _features(surface, state, size, pose, intrinsics, width, height, ints, floats):
    world, frames = np.eye(4), np.empty((surface.dh.parent.shape[0], 3, 4))
    world[:3] = state[:ANGLES].reshape(3, 4)
    count = surface.row.shape[0]
    centres, radii = np.empty((count, 2, 3)), np.empty((count, 2))
    place_capsules(surface, world, state[ANGLES:VELOCITY], size, frames, centres, radii)
    o, normals, n, u = np.empty(3), np.empty((2, 3)), np.empty(3), np.empty(3)
    pixel, slope, normal = np.empty(2), np.empty((2, 3)), np.empty(2)
    camera_centre(pose, o)
    used = 0
    for k in range(count):
        if surface.group[k] >= PALM:
            continue
        if not side_normals(centres[k, 0], centres[k, 1], radii[k, 0], radii[k, 1], o, normals):
            continue
        tip = k + 1 == count or surface.group[k + 1] != surface.group[k]
        for j in range(2 * PLACES + (1 if tip else 0)):
            if j < 2 * PLACES:
                kind, along = j // PLACES, (j % PLACES + 0.5) / PLACES
                n[:] = normals[kind]
            else:  # the most distal contour point, along the projected axis
                kind, along, far, dot, length = END_BALL, 1.0, 0.0, 0.0, 0.0
                for i in range(3):
                    u[i] = centres[k, 1, i] - o[i]
                    far += u[i] * u[i]
                far = math.sqrt(far)
                for i in range(3):
                    dot += (centres[k, 1, i] - centres[k, 0, i]) * u[i] / far
                for i in range(3):
                    n[i] = centres[k, 1, i] - centres[k, 0, i] - dot * u[i] / far
                    length += n[i] * n[i]
                sine = radii[k, 1] / far
                for i in range(3):
                    n[i] = math.sqrt(1.0 - sine * sine) * n[i] / math.sqrt(length) - sine * u[i] / far
            r, away = radii[k, 0] + along * (radii[k, 1] - radii[k, 0]), 0.0
            for i in range(3):
                u[i] = centres[k, 0, i] + along * (centres[k, 1, i] - centres[k, 0, i]) + r * n[i]
            if not project(u[0], u[1], u[2], pose, intrinsics, pixel, slope):
                continue
            if not (0.0 < pixel[0] < width - 1.0 and 0.0 < pixel[1] < height - 1.0):
                continue
            behind = link_behind(surface, centres, radii, o, u[0], u[1], u[2], n, OUTSIDE_M)
            if behind < 0:
                continue
            for i in range(3):
                u[i] -= o[i]
                away += u[i] * u[i]
            for i in range(3):
                u[i] /= math.sqrt(away)
            if not image_normal(slope, n, u, normal):
                continue
            scale = 0.0
            for i in range(3):
                scale += (normal[0] * slope[0, i] + normal[1] * slope[1, i]) * n[i]
            ints[used, 0], ints[used, 1], ints[used, 2] = k, kind, behind
            floats[used, 0], floats[used, 1], floats[used, 2] = along, pixel[0], pixel[1]
            floats[used, 3], floats[used, 4], floats[used, 5] = normal[0], normal[1], scale
            used += 1
    return used
