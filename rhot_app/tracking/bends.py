"""What is told of how fingers have bent while a single camera saw them.

Fingers that bend towards one camera look as if they bent otherwise: from the knuckle, or from the joints before it. A
filter that linearises anew with every frame takes the sum of what it saw for knowledge of which. As far as a finger has
bent since two cameras saw the hand, it is told to be known less, in the ways that leave its tip in its line of sight.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rhot_app.lean import lean, room
from rhot_app.tracking.kalman.estimate import ANGLES, FINGERS, FIRST_FINGER, GROUP_OF, POSE, Estimate
from rhot_app.tracking.kalman.hiding import PLACED_BY
from rhot_app.tracking.kalman.sighted import count_seen, line_of_sight

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

OTHERWISE = 0.3
"""Of how far a finger has bent, its joints may each have bent otherwise, one standard deviation. (Looked
at in two of the twin's grasps: about 0.4. With it 0.98 of the axes of grasping fingertips are within three.)"""

ACROSS_M = 5e-4
"""Across its line of sight a fingertip is known to this anyway."""


@lean
def tell_of_bends(estimate: Estimate, cameras: Array, tips: Indices, points: Array, jacobian: Array,
                  covariance: Array) -> None:
    """Add to `covariance` (28, 28), as `fill_known` has it, what a hand that one camera sees may be bent otherwise.

    `cameras` (C, 3, 4) camera_from_world m; `tips` (5,) the markers on the fingertips, -1 where there is none, of those
    at `points` (M, 3) m with `jacobian` (M, 3, 27) per pose number.
    """
    eye = _only_eye(estimate.unseen)
    if eye < 0:
        return
    way, sight, across = room((POSE,)), room((3,)), room((2, POSE))
    for finger in range(FINGERS):
        if tips[finger] < 0:
            continue
        bent = 0.0
        way[:] = 0.0
        for i in range(ANGLES, POSE):
            if GROUP_OF[i] == FIRST_FINGER + finger:
                bent += (estimate.angles[i - ANGLES] - estimate.placed_angles[i - ANGLES]) ** 2
                way[i] = 1.0
        m = tips[finger]
        line_of_sight(cameras[eye], points[m], sight)
        _fill_across(sight, jacobian[m], way, across)
        _add(covariance, way, OTHERWISE * OTHERWISE * bent, across)


@lean
def _only_eye(unseen: Array) -> int:
    """The one camera that sees the hand, -1 if there are others or none; `unseen` (C, M) as in `Estimate`."""
    found = -1
    for camera in range(unseen.shape[0]):
        if count_seen(unseen, camera) >= PLACED_BY:
            if found >= 0:
                return -1
            found = camera
    return found


@lean
def _fill_across(sight: Array, jacobian: Array, way: Array, out: Array) -> None:
    """Fill `out` (2, 27) with how what has `jacobian` (3, 27) moves across a line of `sight` (3,), by the numbers of
    `way` (27,) alone."""
    one, two, least = room((3,)), room((3,)), 0
    for i in range(3):
        if abs(sight[i]) < abs(sight[least]):
            least = i
    for i in range(3):
        one[i] = (1.0 if i == least else 0.0) - sight[least] * sight[i]
    length = math.sqrt(one[0] ** 2 + one[1] ** 2 + one[2] ** 2)
    for i in range(3):
        one[i] /= length
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        two[i] = sight[j] * one[k] - sight[k] * one[j]
    for j in range(POSE):
        out[0, j] = way[j] * (one[0] * jacobian[0, j] + one[1] * jacobian[1, j] + one[2] * jacobian[2, j])
        out[1, j] = way[j] * (two[0] * jacobian[0, j] + two[1] * jacobian[1, j] + two[2] * jacobian[2, j])


@lean
def _add(covariance: Array, way: Array, variance: float, across: Array) -> None:
    """Add `variance` to every number of `way` (27,), of which two measurements `across` (2, 27) are known."""
    a = c = ACROSS_M * ACROSS_M
    b = 0.0
    for j in range(POSE):
        a += variance * across[0, j] * across[0, j]
        b += variance * across[0, j] * across[1, j]
        c += variance * across[1, j] * across[1, j]
    whole = a * c - b * b
    for i in range(ANGLES, POSE):
        one = variance * (c * across[0, i] - b * across[1, i]) / whole
        two = variance * (a * across[1, i] - b * across[0, i]) / whole
        for j in range(ANGLES, POSE):
            covariance[i, j] -= variance * (one * across[0, j] + two * across[1, j])
        covariance[i, i] += variance * way[i]
