"""Markers of which one camera sees less than another does: something lies before a part of them.

What is left of a covered marker has its middle elsewhere, in one picture and not in the other, which looks like
centimetres of distance. A node notices when a marker's area changes from one frame to the next, not when a thumb slides
over a wristband slowly. Two cameras show the same marker at the same time: in plain view they agree about its area, and
its two rays meet. What light and paint do to its middle, both see alike.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rhot_app.lean import lean, room
from rhot_app.tracking.kalman.combine import dot
from rhot_app.tracking.kalman.estimate import (
    GROUPS,
    LOOK_AGE,
    LOOK_VARIANCE,
    LOOK_WIDTH,
    LOOK_X,
    LOOK_Y,
    POSE,
    VELOCITY,
    Estimate,
)
from rhot_app.tracking.kalman.markers import (
    ONE_SIDED,
    Cameras,
    Frame,
    Places,
    Worn,
    project_marker,
    straying,
)
from rhot_app.tracking.kalman.motion import liveliness
from rhot_app.tracking.kalman.sighted import FRESH_S, line_of_sight
from rhot_app.tracking.locate import EXACT_PX2

Array = NDArray[np.float64]

AGREE = 0.05
"""Areas of a marker in plain view differ by less than this part between two cameras, with few exceptions."""

ALIKE_COS = math.cos(math.radians(12.0))
"""Cosine of the angle between two lines of sight up to which they show equally much of markers that are no balls."""

LESS = 0.02
"""A sight that shows so much less is left out when its ray misses the other one's."""

MISS, MISS_PX = 4.0, 0.5
"""Rays miss each other when they are so many standard deviations apart, and so many px."""

SHIFT, BAND_SHIFT = 0.5, 2.0
"""By how many of its radii the middle of a marker's rest lies off, per part of its area that is covered. A centroid's
moves by one, that of a fitted outline by half of it; a band is longer than it is wide."""

OWN = 0.7
"""Part of the variance that a node states which is this camera's alone, while the whole hand is in plain view of
another one as well. The rest moves markers in all pictures alike: their biases, which the filter knows anyway.
(Measured: 0.1 to 0.6, which lasts for many frames in closing hands and wristbands.) What is half hidden is better
understood with caution."""

CALM_S = 0.5
"""So is what is seen this soon after a sight that had another name or was not believed as it was."""


class View(NamedTuple):
    """One camera's sight of a marker that the hand has at some place: `residual` (2,) px and `slope` (2, 3) px/m."""

    residual: Array
    slope: Array


@lean
def doubt_partial(worn: Worn, cameras: Cameras, frame: Frame, estimate: Estimate, places: Places) -> None:
    """Set `frame.doubt`, px^2, `frame.own` and `frame.covered`; remember what this camera sees, `estimate.looks`.

    To be called after `measure_sizes`. Sights with a flag are widened by their node, and are no standard, and
    neither are those that were not believed. `places` as `place_markers` has them.
    """
    camera, count = frame.camera[0], worn.part.shape[0]
    alike = estimate.untroubled[0] > CALM_S  # and everything is in plain view of two cameras
    for sight in range(count):
        frame.doubt[sight], frame.own[sight], frame.covered[sight] = 0.0, 1.0, False
        if not frame.sizes[sight] > 0.0:
            alike = False
            continue
        m, width = frame.label[sight], frame.sizes[sight]
        rival = -1 if worn.slender[m] == ONE_SIDED else _widest_other(cameras, estimate, camera, m, places.points[m])
        missing = 1.0 - (width / max(width, estimate.looks[rival, m, LOOK_WIDTH])) ** 2 if rival >= 0 else 0.0
        if missing > AGREE:
            shift = SHIFT if worn.half_axes[m, 0] == worn.half_axes[m, 1] else BAND_SHIFT
            frame.doubt[sight] = (0.5 * shift * frame.widths[sight]) ** 2 * (missing**2 - AGREE**2)
        if missing > LESS:
            frame.covered[sight] = _misses(worn, cameras, frame, estimate, sight, rival, places)
        alike &= rival >= 0 and frame.plain[sight] and missing <= AGREE and not frame.covered[sight]
        _remember(estimate.looks[camera, m], frame, sight)
    if alike:
        frame.own[:] = OWN


@lean
def _remember(look: Array, frame: Frame, sight: int) -> None:
    """Fill `look` (6,) with what a frame shows of a marker."""
    look[LOOK_WIDTH] = frame.sizes[sight] if frame.plain[sight] else 0.0
    look[LOOK_X], look[LOOK_Y] = frame.pixels[sight, 0], frame.pixels[sight, 1]
    look[LOOK_VARIANCE] = max(_variance(frame, sight), EXACT_PX2)  # zero is for what was never seen
    look[LOOK_AGE] = -frame.late_s[sight]


@lean
def _variance(frame: Frame, sight: int) -> float:
    """Of a sight, px^2, the mean of its axes."""
    return 0.5 * float(frame.covariances[sight, 0, 0] + frame.covariances[sight, 1, 1])


@lean
def _misses(worn: Worn, cameras: Cameras, frame: Frame, estimate: Estimate, sight: int, rival: int,
            places: Places) -> bool:
    """Whether no place of a marker that is about where `places` have it explains this sight and the last one of camera
    `rival`."""
    own, other = View(room((2,)), room((2, 3))), View(room((2,)), room((2, 3)))
    m, late = frame.label[sight], frame.late_s[sight]
    look, jacobian = estimate.looks[rival, m], places.jacobian[m]
    now, before, lively = room((3,)), room((3,)), room((GROUPS,))
    for i in range(3):
        speed = dot(jacobian[i], estimate.velocity)
        now[i] = places.points[m, i] + late * speed
        before[i] = places.points[m, i] - look[LOOK_AGE] * speed
    if not (_view(worn, cameras, estimate, m, frame.camera[0], now, frame.pixels[sight], own)
            and _view(worn, cameras, estimate, m, rival, before, look[LOOK_X:LOOK_Y + 1], other)):
        return False
    between = look[LOOK_AGE] + late
    liveliness(estimate, lively)
    strayed = (0.25 * between**4 * straying(lively, worn.part[m])
               + between**2 * _unsteadiness(estimate, jacobian))
    spread = own.slope[0, 0] ** 2 + own.slope[0, 1] ** 2 + own.slope[0, 2] ** 2
    variance = _variance(frame, sight) + look[LOOK_VARIANCE] + spread * strayed
    return disagreement(own, other) > MISS_PX + MISS * math.sqrt(variance)


@lean
def _unsteadiness(estimate: Estimate, jacobian: Array) -> float:
    """Variance per axis, (m/s)^2, of the speed of what has `jacobian` (3, 27), as if no velocities went together."""
    total = 0.0
    for j in range(POSE):
        lever = jacobian[0, j] ** 2 + jacobian[1, j] ** 2 + jacobian[2, j] ** 2
        total += lever * estimate.covariance[VELOCITY + j, VELOCITY + j]
    return total / 3.0


@lean
def _widest_other(cameras: Cameras, estimate: Estimate, camera: int, m: int, point: Array) -> int:
    """The other camera that sees most of marker `m`, at `point` (3,) m, just now and from nearly the same side; -1 if
    none does."""
    widest, which = 0.0, -1
    one, two = room((3,)), room((3,))
    line_of_sight(cameras.pose[camera], point, one)
    for other in range(estimate.looks.shape[0]):
        look = estimate.looks[other, m]
        since = max(look[LOOK_AGE] * estimate.pace[other], estimate.unseen[other, m])
        if other != camera and since < FRESH_S and look[LOOK_WIDTH] > widest:
            line_of_sight(cameras.pose[other], point, two)
            if one[0] * two[0] + one[1] * two[1] + one[2] * two[2] > ALIKE_COS:
                widest, which = look[LOOK_WIDTH], other
    return which


@lean
def _view(worn: Worn, cameras: Cameras, estimate: Estimate, m: int, camera: int, point: Array, pixel: Array,
          out: View) -> bool:
    """Fill `out` for a marker at `point` (3,) m that `camera` sees at `pixel` (2,); False when it is behind it."""
    expected, place = room((2,)), room((3,))
    for i in range(3):
        place[i] = point[i] + estimate.bias[m, i]
    if not project_marker(place, estimate.world, worn.half_axes[m], cameras.pose[camera], cameras.intrinsics[camera],
                          expected, out.slope):
        return False
    out.residual[0], out.residual[1] = pixel[0] - expected[0], pixel[1] - expected[1]
    return True


@lean
def disagreement(one: View, other: View) -> float:
    """How far off, px, two sights are that no place of the marker explains: of four numbers three are its place."""
    p, q, r, s = one.slope[0], one.slope[1], other.slope[0], other.slope[1]
    a, b, c, d = _minor(q, r, s), -_minor(p, r, s), _minor(p, q, s), -_minor(p, q, r)  # orthogonal to all columns
    length = math.sqrt(a * a + b * b + c * c + d * d)
    total = a * one.residual[0] + b * one.residual[1] + c * other.residual[0] + d * other.residual[1]
    return abs(total) / length if length > 0.0 else 0.0


@lean
def _minor(a: Array, b: Array, c: Array) -> float:
    """The determinant of three rows (3,)."""
    return float(a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0])
                 + a[2] * (b[0] * c[1] - b[1] * c[0]))
