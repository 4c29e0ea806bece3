"""Markers of which one camera sees less than another does: something lies before a part of them.

What is left of a covered marker has its middle elsewhere, in one picture and not in the other, which looks like
centimetres of distance. A node notices when a marker's area changes from one frame to the next, not when a thumb slides
over a wristband slowly. Two cameras show the same marker at the same time: in plain view they agree about its area, and
its two rays meet.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.tracking.kalman.estimate import (
    LINEAR,
    LOOK_AGE,
    LOOK_VARIANCE,
    LOOK_WIDTH,
    LOOK_X,
    LOOK_Y,
    POSE,
    Estimate,
)
from rhot_app.tracking.kalman.markers import NEAREST_M, Cameras, Frame, Worn, place_markers, project_marker
from rhot_app.tracking.kalman.motion import liveliness
from rhot_app.tracking.kalman.sighted import FRESH_S

Array = NDArray[np.float64]

AGREE = 0.05
"""Areas of a marker in plain view differ by less than this part between two cameras, with few exceptions."""

LESS = 0.02
"""A sight that shows so much less is left out when its ray misses the other one's."""

MISS, MISS_PX = 4.0, 0.5
"""Rays miss each other when they are so many standard deviations apart, and so many px."""

SHIFT, BAND_SHIFT = 1.0, 2.0
"""By how many of its radii the middle of a marker's rest lies off, per part of its area that is covered; a band is
longer than it is wide."""

class View(NamedTuple):
    """One camera's sight of a marker that the hand has at some place: `residual` (2,) px and `slope` (2, 3) px/m."""

    residual: Array
    slope: Array


@njit(cache=True)
def doubt_partial(worn: Worn, cameras: Cameras, frame: Frame, estimate: Estimate) -> None:
    """Set `frame.doubt`, px^2, and more of `frame.covered`; remember what this camera sees, `estimate.looks`.

    To be called when `frame.label` is known. Sights with a flag are widened by their node, and are no standard.
    """
    camera, count = frame.camera[0], worn.part.shape[0]
    points, jacobian = np.empty((count, 3)), np.empty((count, 3, POSE))
    place_markers(worn, estimate, points, jacobian)
    for sight in range(count):
        frame.doubt[sight] = 0.0
        if not frame.seen[sight] or not frame.widths[sight] > 0.0:
            continue
        m = frame.label[sight]
        width = frame.widths[sight] * _metres_per_px(cameras, camera, points[m])
        rival = _widest_other(estimate, camera, m)
        missing = 1.0 - (width / max(width, estimate.looks[rival, m, LOOK_WIDTH])) ** 2 if rival >= 0 else 0.0
        if missing > AGREE:
            shift = SHIFT if worn.half_axes[m, 0] == worn.half_axes[m, 1] else BAND_SHIFT
            frame.doubt[sight] = (0.5 * shift * frame.widths[sight]) ** 2 * (missing**2 - AGREE**2)
        if missing > LESS:
            speed = jacobian[m] @ estimate.velocity
            frame.covered[sight] |= _misses(worn, cameras, frame, estimate, sight, rival, points[m], speed)
        _remember(estimate.looks[camera, m], frame, sight, width)


@njit(cache=True)
def _remember(look: Array, frame: Frame, sight: int, width: float) -> None:
    """Fill `look` (5,) with what a frame shows of a marker."""
    look[LOOK_WIDTH] = width if frame.plain[sight] else 0.0
    look[LOOK_X], look[LOOK_Y] = frame.pixels[sight]
    look[LOOK_VARIANCE] = _variance(frame, sight)
    look[LOOK_AGE] = -frame.late_s[sight]


@njit(cache=True)
def _variance(frame: Frame, sight: int) -> float:
    """Of a sight, px^2, the mean of its axes."""
    return 0.5 * float(frame.covariances[sight, 0, 0] + frame.covariances[sight, 1, 1])


@njit(cache=True)
def _misses(worn: Worn, cameras: Cameras, frame: Frame, estimate: Estimate, sight: int, rival: int, point: Array,
            speed: Array) -> bool:
    """Whether no place of a marker that is about at `point` (3,) m, moving at `speed` (3,) m/s, explains this sight and
    the last one of camera `rival`."""
    own, other = View(np.empty(2), np.empty((2, 3))), View(np.empty(2), np.empty((2, 3)))
    m, late = frame.label[sight], frame.late_s[sight]
    look = estimate.looks[rival, m]
    if not (_view(worn, cameras, estimate, m, frame.camera[0], point + late * speed, frame.pixels[sight], own)
            and _view(worn, cameras, estimate, m, rival, point - look[LOOK_AGE] * speed, look[LOOK_X:LOOK_Y + 1],
                      other)):
        return False
    strayed_m = 0.5 * math.sqrt(liveliness(estimate)[LINEAR]) * (look[LOOK_AGE] + late) ** 2
    strayed_px = strayed_m * math.hypot(own.slope[0, 0], own.slope[0, 1])
    allowed = MISS_PX + MISS * math.sqrt(_variance(frame, sight) + look[LOOK_VARIANCE] + strayed_px**2)
    return disagreement(own, other) > allowed


@njit(cache=True)
def _metres_per_px(cameras: Cameras, camera: int, point: Array) -> float:
    """How large a pixel of a camera is at a point (3,) m; 0 behind the camera."""
    pose = cameras.pose[camera]
    depth = pose[2, 3] + pose[2, 0] * point[0] + pose[2, 1] * point[1] + pose[2, 2] * point[2]
    if depth < NEAREST_M:
        return 0.0
    return depth / math.sqrt(cameras.intrinsics[camera, 0] * cameras.intrinsics[camera, 1])


@njit(cache=True)
def _widest_other(estimate: Estimate, camera: int, m: int) -> int:
    """The other camera that sees most of marker `m` just now, -1 if none does."""
    widest, which = 0.0, -1
    for other in range(estimate.looks.shape[0]):
        look = estimate.looks[other, m]
        if other != camera and look[LOOK_AGE] < FRESH_S and look[LOOK_WIDTH] > widest:
            widest, which = look[LOOK_WIDTH], other
    return which


@njit(cache=True)
def _view(worn: Worn, cameras: Cameras, estimate: Estimate, m: int, camera: int, point: Array, pixel: Array,
          out: View) -> bool:
    """Fill `out` for a marker at `point` (3,) m that `camera` sees at `pixel` (2,); False when it is behind it."""
    expected = np.empty(2)
    if not project_marker(point + estimate.bias[m], estimate.world, worn.half_axes[m], cameras.pose[camera],
                          cameras.intrinsics[camera], expected, out.slope):
        return False
    out.residual[:] = pixel - expected
    return True


@njit(cache=True)
def disagreement(one: View, other: View) -> float:
    """How far off, px, two sights are that no place of the marker explains: of four numbers three are its place."""
    slopes, residuals = np.empty((4, 3)), np.empty(4)
    slopes[:2], slopes[2:], residuals[:2], residuals[2:] = one.slope, other.slope, one.residual, other.residual
    normal = np.empty(4)
    for k in range(4):  # orthogonal to all columns: the minors of the matrix, signs in turn
        rows = np.array([i for i in range(4) if i != k])
        a, b, c = slopes[rows[0]], slopes[rows[1]], slopes[rows[2]]
        minor = (a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0])
                 + a[2] * (b[0] * c[1] - b[1] * c[0]))
        normal[k] = minor if k % 2 == 0 else -minor
    length = math.sqrt(normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2 + normal[3] ** 2)
    total = 0.0
    for k in range(4):
        total += normal[k] * residuals[k]
    return abs(total) / length if length > 0.0 else 0.0
