"""The residuals of markers: where one camera saw them, less where the estimated hand has them.

Each marker is seen at its own row's time, so its place is carried by the estimated velocities to that time. What the
hand may have accelerated between the two widens the noise.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rhot_app.geometry.camera import distort
from rhot_app.hand.dh import DhArrays
from rhot_app.hand.kinematics import forward_arrays, jacobian_arrays
from rhot_app.lean import lean, room
from rhot_app.tracking.kalman.combine import dot
from rhot_app.tracking.kalman.estimate import (
    ACCELERATION,
    BIAS,
    FIRST_FINGER,
    GROUPS,
    LINEAR,
    POSE,
    SCALE,
    TURN,
    VELOCITY,
    Estimate,
)
from rhot_app.tracking.kalman.motion import ACCELERATION_S, liveliness
from rhot_app.tracking.kalman.opening import Opening, empty_opening
from rhot_app.tracking.kalman.rows import Rows

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

FLOOR_PX = 0.02
"""No centroid is better than this, whatever a node says."""

NEAREST_M = 0.02
"""A marker this near to a camera's plane, or behind it, is not expected to be seen."""

_REACH_M, _FINGER_M = 0.12, 0.05  # mean levers of palm rotation and of a finger's angles


ONE_SIDED = -2.0
"""`Worn.slender` of paint on one side of a finger: how much of it a camera sees depends on where the camera stands."""


class Cameras(NamedTuple):
    """C cameras: `pose` (C, 3, 4) camera_from_world m and `intrinsics` (C, 9) as in `CameraModel`."""

    pose: Array
    intrinsics: Array


class Worn(NamedTuple):
    """The markers on the hand, M of them, unchanging.

    `dh`: the hand's table with one point per marker. `part` (M,): the finger, PALM_PART on the palm. `half_axes`
    (M, 3) m: their bodies' along the palm's axes (a ball has three equal ones), zero for flat ones. `palmar` (M,):
    paint of no known shape on the inner side of the palm, which closing fingers cover (`covering.py`). `slender` (M,):
    how much more of a fingertip is seen from its side than from its end, as a part of the latter; 0 for balls on
    fingertips, negative for other markers (`hiding.py`), ONE_SIDED for paint that does not go round its finger.
    """

    dh: DhArrays
    part: Indices
    half_axes: Array
    palmar: NDArray[np.bool_]
    slender: Array


class Places(NamedTuple):
    """Where the markers of a hand are: `points` (M, 3) m, world, without biases, and `jacobian` (M, 3, 27) per pose
    number; `frames` (R, 3, 4) world_from_row m of the hand's R rows."""

    points: Array
    jacobian: Array
    frames: Array


def empty_places(dh: DhArrays) -> Places:
    """Room for the points of a table."""
    count = len(dh.point_row)
    return Places(np.empty((count, 3)), np.empty((count, 3, POSE)), np.empty((len(dh.parent), 3, 4)))


class Outfit(NamedTuple):
    """What a hand wears before which cameras: `made` (M,) m^2, the variance of the markers' places by their making; and
    room to work in, which every function fills anew."""

    worn: Worn
    cameras: Cameras
    made: Array
    places: Places
    opening: Opening


def outfit_of(worn: Worn, cameras: Cameras, made: Array) -> Outfit:
    """An outfit with its room."""
    return Outfit(worn, cameras, made, empty_places(worn.dh), empty_opening(len(worn.part)))


class Frame(NamedTuple):
    """What one camera saw: `camera` (1,) its index; `seen` (M,) which markers count; `pixels` (M, 2) raw px with
    `covariances` (M, 2, 2); `late_s` (M,): when each was seen, s after the estimate's instant (before: negative).
    `label` (M,): which of the hand's markers the m-th sight is of. `widths` (M,) px: diameters of discs of their areas,
    0 where unknown, `sizes` (M,) m: those where the hand is (`sizes.py`); `row_s` (1,): from one row of the picture to
    the next; `plain` (M,): without any flag; `covered` (M,): shows too little of its marker to be weighed;
    `doubt` (M,) px^2: how far off, per axis, what is covered of it may have brought it; `own` (M,): the part of its
    stated variance that counts: what is this camera's alone, or what is left of a node's caution."""

    camera: Indices
    seen: NDArray[np.bool_]
    pixels: Array
    covariances: Array
    late_s: Array
    label: Indices
    widths: Array
    sizes: Array
    row_s: Array
    plain: NDArray[np.bool_]
    covered: NDArray[np.bool_]
    doubt: Array
    own: Array


@lean
def place_markers(dh: DhArrays, estimate: Estimate, out: Places) -> None:
    """Where a hand of any size has the points of a table; the frames are those of a hand of its file's size."""
    world, points, jacobian = estimate.world, out.points, out.jacobian
    scale = math.exp(estimate.log_scale[0])
    forward_arrays(dh, world, estimate.angles, out.frames, points)
    jacobian_arrays(dh, world, out.frames, points, jacobian)
    if scale != 1.0:
        for m in range(points.shape[0]):
            for i in range(3):
                points[m, i] = world[i, 3] + scale * (points[m, i] - world[i, 3])
                for j in range(3, POSE):
                    jacobian[m, i, j] *= scale


@lean
def project_marker(point: Array, world: Array, half_axes: Array, camera: Array, intrinsics: Array, pixel: Array,
                   slope: Array) -> bool:
    """Where the silhouette of a marker at `point` (3,) has its centre: `pixel` (2,) px and `slope` (2, 3) px/m.

    False when it is not before the camera. `geometry.silhouette` has the formula; its slope is that of a point.
    """
    local = room((3,))
    for i in range(3):
        local[i] = camera[i, 3]
        for k in range(3):
            local[i] += camera[i, k] * point[k]
    if not local[2] > NEAREST_M:
        return False
    xz, yz, zz = 0.0, 0.0, 0.0
    if half_axes[0] > 0.0:
        for axis in range(3):
            a, b, c = 0.0, 0.0, 0.0
            for k in range(3):
                a += camera[0, k] * world[k, axis]
                b += camera[1, k] * world[k, axis]
                c += camera[2, k] * world[k, axis]
            square = half_axes[axis] * half_axes[axis]
            xz += square * a * c
            yz += square * b * c
            zz += square * c * c
    depth = local[2] * local[2] - zz
    x, y = (local[0] * local[2] - xz) / depth, (local[1] * local[2] - yz) / depth
    xd, yd, xx, xy, yx, yy = distort(x, y, intrinsics[4:9])
    pixel[0] = intrinsics[0] * xd + intrinsics[2]
    pixel[1] = intrinsics[1] * yd + intrinsics[3]
    for k in range(3):
        dx = (camera[0, k] - x * camera[2, k]) / local[2]
        dy = (camera[1, k] - y * camera[2, k]) / local[2]
        slope[0, k] = intrinsics[0] * (xx * dx + xy * dy)
        slope[1, k] = intrinsics[1] * (yx * dx + yy * dy)
    return True


@lean
def append_markers(worn: Worn, cameras: Cameras, frame: Frame, estimate: Estimate, places: Places, rows: Rows) -> None:
    """Append one observation of two rows, px, for each marker of `frame` that was seen and is not covered. `places` as
    `place_markers` has them."""
    points, jacobian, velocity, acceleration = places.points, places.jacobian, estimate.velocity, estimate.acceleration
    camera, lively, way = frame.camera[0], room((GROUPS,)), room((POSE,))
    pixel, slope, place = room((2,)), room((2, 3)), room((3,))
    liveliness(estimate, lively)
    for sight in range(worn.part.shape[0]):
        if not frame.seen[sight] or frame.covered[sight]:
            continue
        m, late = frame.label[sight], frame.late_s[sight]
        for j in range(POSE):
            way[j] = late * (velocity[j] + 0.5 * late * acceleration[j])
        for i in range(3):
            place[i] = points[m, i] + estimate.bias[m, i] + dot(jacobian[m, i], way)
        row, observation = rows.used[0], rows.used[1]
        rows.jacobian[row:row + 2] = 0.0
        if not project_marker(place, estimate.world, worn.half_axes[m], cameras.pose[camera],
                              cameras.intrinsics[camera], pixel, slope):
            pixel[:] = np.nan
            slope[:] = 0.0
        strayed = straying(lively, worn.part[m]) * abs(late) ** 5 / (10.0 * ACCELERATION_S)
        for r in range(2):
            _fill(rows.jacobian[row + r], slope[r], jacobian[m], late, points[m], estimate, m)
            rows.residual[row + r] = frame.pixels[sight, r] - pixel[r]
            spread = slope[r, 0] ** 2 + slope[r, 1] ** 2 + slope[r, 2] ** 2
            rows.noise[row + r, 0] = (frame.own[sight] * frame.covariances[sight, r, r] + FLOOR_PX**2
                                      + frame.doubt[sight] + spread * strayed)
            rows.noise[row + r, 1] = frame.own[sight] * frame.covariances[sight, 0, 1]
        rows.part[observation] = worn.part[m]
        rows.source[observation, 0], rows.source[observation, 1], rows.source[observation, 2] = camera, sight, m
        rows.first[observation + 1] = row + 2
        rows.used[0], rows.used[1] = row + 2, observation + 1


@lean
def straying(lively: Array, part: int) -> float:
    """Variance of the acceleration of a marker on a finger or the palm (`Worn.part`), (m/s^2)^2, of a hand that is so
    `lively` (7,)."""
    finger = lively[FIRST_FINGER + part] * _FINGER_M**2 if part >= 0 else 0.0
    return float(lively[LINEAR] + lively[TURN] * _REACH_M**2 + finger)


@lean
def _fill(out: Array, slope: Array, jacobian: Array, late: float, point: Array, estimate: Estimate, m: int) -> None:
    """One row's Jacobian: the image's `slope` (3,) times that of the place, `jacobian` (3, 27)."""
    for j in range(POSE):
        value = slope[0] * jacobian[0, j] + slope[1] * jacobian[1, j] + slope[2] * jacobian[2, j]
        out[j] = value
        out[VELOCITY + j] = late * value
        out[ACCELERATION + j] = 0.5 * late * late * value
    for k in range(3):
        out[SCALE] += slope[k] * (point[k] - estimate.world[k, 3])
        out[BIAS + 3 * m + k] = slope[k]
