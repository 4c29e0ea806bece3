"""What the markers show of the hand just now: who was seen by whom, and what that leaves open."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rhot_app.lean import lean, room
from rhot_app.tracking.kalman.estimate import ANGLES, POSE, TURN_HELD, UNSEEN_S, Estimate
from rhot_app.tracking.kalman.rows import PALM_PART, Rows

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Mask = NDArray[np.bool_]

FRESH_S = 0.07
"""A camera that saw a marker this recently still sees it: it may take turns with another."""

KEPT_S = 3.0
"""A palm whose turn is held is known for so long by paint that fingers have covered since."""


@lean
def note_sights(estimate: Estimate, part: Indices, rows: Rows, believed: Mask) -> None:
    """Remember which markers were seen; `part` (M,) as in `Worn`. What no camera saw shows all markers of its part."""
    for observation in range(rows.used[1]):
        if not believed[observation]:
            continue
        camera, marker = rows.source[observation, 0], rows.source[observation, 2]
        if camera >= 0:
            estimate.unseen[camera, marker] = 0.0
        else:
            for m in range(part.shape[0]):
                if part[m] == rows.part[observation]:
                    estimate.unseen[:, m] = 0.0


@lean
def eyes_now(unseen: Array, marker: int, rows: Rows) -> tuple[int, int]:
    """As `eyes_on`, with what is seen just now, whether it will be believed or not."""
    eyes, eye = 0, -1
    for camera in range(unseen.shape[0]):
        seen = unseen[camera, marker] < FRESH_S
        for observation in range(rows.used[1]):
            seen |= rows.source[observation, 0] == camera and rows.source[observation, 2] == marker
        if seen:
            eyes, eye = eyes + 1, camera
    return eyes, eye


@lean
def eyes_on(unseen: Array, marker: int) -> tuple[int, int]:
    """How many cameras see a marker, and the last of them, -1 if none; `unseen` (C, M) as in `Estimate`."""
    eyes, eye = 0, -1
    for camera in range(unseen.shape[0]):
        if unseen[camera, marker] < FRESH_S:
            eyes, eye = eyes + 1, camera
    return eyes, eye


@lean
def fingers_away(estimate: Estimate, part: Indices, out: Array) -> None:
    """Fill `out` (5,) with the s since any camera saw any marker of each finger."""
    out[:] = UNSEEN_S
    for m in range(part.shape[0]):
        if part[m] != PALM_PART:
            for camera in range(estimate.unseen.shape[0]):
                out[part[m]] = min(out[part[m]], estimate.unseen[camera, m])


@lean
def since_seen(unseen: Array, marker: int) -> float:
    """s since any camera saw a marker; `unseen` (C, M) as in `Estimate`."""
    since = math.inf
    for camera in range(unseen.shape[0]):
        since = min(since, unseen[camera, marker])
    return since


@lean
def count_seen(unseen: Array, camera: int) -> int:
    """How many markers a camera sees."""
    count = 0
    for m in range(unseen.shape[1]):
        count += unseen[camera, m] < FRESH_S
    return count


@lean
def keep_shown(estimate: Estimate, part: Indices, palmar: Mask, cameras: Array, points: Array,
               jacobian: Array) -> None:
    """Leave in `jacobian` (M, 3, 27) of markers at `points` (M, 3) what is seen of them; `cameras` (C, 3, 4).

    Of a marker that one camera sees, its way across the line of sight; of one that none sees, on a finger, its way
    relative to the palm - a finger out of sight keeps its bend - and on the palm nothing, unless it is paint (`palmar`
    (M,) as in `Worn`) that was seen of late on a palm whose turn is held: that keeps its place.
    """
    sight = room((3,))
    for m in range(points.shape[0]):
        eyes, eye = eyes_on(estimate.unseen, m)
        if eyes == 0 and palmar[m] and estimate.held[0] == TURN_HELD and since_seen(estimate.unseen, m) < KEPT_S:
            continue
        if eyes == 0:
            jacobian[m, :, :ANGLES] = 0.0
            if part[m] == PALM_PART:
                jacobian[m] = 0.0
        elif eyes == 1:
            line_of_sight(cameras[eye], points[m], sight)
            for j in range(POSE):
                along = sight[0] * jacobian[m, 0, j] + sight[1] * jacobian[m, 1, j] + sight[2] * jacobian[m, 2, j]
                for i in range(3):
                    jacobian[m, i, j] -= along * sight[i]


@lean
def line_of_sight(camera: Array, point: Array, out: Array) -> float:
    """Fill `out` (3,) with the unit vector from a camera, (3, 4) camera_from_world, to a point (3,), world; returns how
    far apart they are."""
    square = 0.0
    for i in range(3):
        out[i] = point[i]
        for k in range(3):
            out[i] += camera[k, i] * camera[k, 3]
        square += out[i] ** 2
    distance = math.sqrt(square)
    for i in range(3):
        out[i] /= distance
    return distance
