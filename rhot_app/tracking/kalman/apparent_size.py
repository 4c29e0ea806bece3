"""How far away a fingertip is that one camera sees, by how large it looks.

A single camera does not see distance, and what it leaves open is held to its course (`holding.py`). While two cameras
saw the hand it was learnt how large its fingertips are, and how much that varies (`hiding.py`). As they look larger or
smaller now, the hand is nearer or farther away.

A hand that is taken to be nearer than it is has its fingers bent more, to look as it does, and a fingertip that points
at the camera shows less of itself: how large a fingertip should look depends on the whole pose. Many things make a
fingertip look smaller - another finger before it, paint that ends, shade -, hardly any makes it look larger: one that
looks too small beside the others is believed less.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rhot_app.hand.kinematics import direction_jacobian
from rhot_app.lean import lean, room
from rhot_app.tracking.kalman.combine import dot
from rhot_app.tracking.kalman.estimate import (
    GOES_ON,
    MOST_MARKERS,
    MOST_NUMBERS,
    PALM_HELD,
    POSE,
    Estimate,
    displace,
)
from rhot_app.tracking.kalman.hiding import is_placed, shown_part
from rhot_app.tracking.kalman.markers import Cameras, Frame, Places, Worn
from rhot_app.tracking.kalman.sighted import line_of_sight

Array = NDArray[np.float64]

NEEDED = 3
"""A hand that only one camera sees is brought by so many fingertips of known size, not by fewer."""

EACH, ALL = 0.005, 0.005
"""Logarithms of widths are off by at least this, one standard deviation: each by itself, and all alike."""

LASTING = 2.0
"""Of this many times its variance a fingertip's width is weighed, and less the better it is known: what is wrong with
it is wrong in many frames, and what they all say is not known better for that."""

TOO_SMALL = 0.5
"""What looks too small by some part is believed as if this much of it were one standard deviation."""

UNLIKELY = 2.0
"""What is off by more than so many standard deviations is followed as if these were larger."""

ROUNDS = 5
"""Times that it is judged which fingertips look too small."""

END_ON = 0.03
"""Sine of the angle between a fingertip and the line of sight, at least: nobody knows it better."""


class Sizes(NamedTuple):
    """K fingertips: `larger` (K,) by how much the logarithm of each one's width is more than the estimate has it,
    `slope` (K, 27) what that is per pose number, `variance` (K,) of it by what fingertips are."""

    larger: Array
    slope: Array
    variance: Array


@lean
def weigh_sizes(worn: Worn, cameras: Cameras, frame: Frame, estimate: Estimate, places: Places) -> bool:
    """Correct the estimate of a hand whose distance is held (`holding.py`), because only this camera sees it, by how
    large its fingertips look; returns whether it was.

    To be called after `measure_sizes`. `places` as `place_markers` has them.
    """
    camera = frame.camera[0]
    if estimate.held[0] not in (PALM_HELD, GOES_ON) or is_placed(estimate, camera):
        return False
    sizes, sight = Sizes(room((MOST_MARKERS,)), room((MOST_MARKERS, POSE)), room((MOST_MARKERS,))), room((3,))
    sight[:] = 0.0
    used = _read(worn, cameras.pose[camera], frame, estimate, places, sizes, sight)
    if used < NEEDED:
        return False
    length = math.sqrt(sight[0] ** 2 + sight[1] ** 2 + sight[2] ** 2)
    for i in range(3):
        sight[i] /= length
    _doubt_small(estimate.covariance, sight, sizes, used)
    _correct(estimate, sizes, used)
    return True


@lean
def _read(worn: Worn, camera: Array, frame: Frame, estimate: Estimate, places: Places, out: Sizes, sight: Array) -> int:
    """Fill `out`, and add up the lines of sight in `sight` (3,); returns how many fingertips there are."""
    dh, used, points, jacobian = worn.dh, 0, places.points, places.jacobian
    line, bone, turning = room((3,)), room((3,)), room((3, POSE))
    for s in range(points.shape[0]):
        m = frame.label[s]
        if worn.slender[m] < 0.0 or not frame.plain[s] or not frame.sizes[s] > 0.0 or not estimate.width[m] > 0.0:
            continue
        distance = line_of_sight(camera, points[m], line)
        for i in range(3):
            bone[i] = places.frames[dh.point_row[m], i, 0]
        direction_jacobian(dh, estimate.world, places.frames, m, bone, turning)
        along = bone[0] * line[0] + bone[1] * line[1] + bone[2] * line[2]
        side = max(math.sqrt(max(1.0 - along * along, 0.0)), END_ON)
        shown = -0.5 * worn.slender[m] / (1.0 + worn.slender[m] * side) * along / side  # of the width, per `along`
        for j in range(POSE):
            farther, turned = 0.0, 0.0
            for i in range(3):
                farther += line[i] * jacobian[m, i, j]
            for i in range(3):
                turned += line[i] * turning[i, j] + bone[i] * (jacobian[m, i, j] - farther * line[i]) / distance
            out.slope[used, j] = shown * turned - farther / distance
        expected = estimate.width[m] * math.sqrt(shown_part(worn.slender[m], side))
        out.larger[used] = math.log(frame.sizes[s] / expected)
        out.variance[used] = EACH**2 + estimate.width_varies[m]
        for i in range(3):
            sight[i] += line[i]
        used += 1
    return used


@lean
def _doubt_small(covariance: Array, sight: Array, sizes: Sizes, used: int) -> None:
    """Widen the variance of what looks too small beside the others, which agree about how far away along `sight` (3,)
    the hand is, with all that is taken to go with it."""
    with_place = room((POSE,))
    for j in range(POSE):
        with_place[j] = sight[0] * covariance[0, j] + sight[1] * covariance[1, j] + sight[2] * covariance[2, j]
    variance = sight[0] * with_place[0] + sight[1] * with_place[1] + sight[2] * with_place[2]
    per_m, noise, short = room((MOST_MARKERS,)), room((MOST_MARKERS,)), room((MOST_MARKERS,))
    for k in range(used):
        total, short[k] = 0.0, 0.0
        per_m[k] = dot(sizes.slope[k], with_place) / variance
        for i in range(POSE):
            total += sizes.slope[k, i] * dot(covariance[i, :POSE], sizes.slope[k])
        noise[k] = sizes.variance[k] + max(total - per_m[k] * per_m[k] * variance, 0.0)
    for _ in range(ROUNDS):
        said, known = 0.0, 0.0
        for k in range(used):
            trust = per_m[k] / (noise[k] + (TOO_SMALL * short[k]) ** 2)
            said += trust * sizes.larger[k]
            known += trust * per_m[k]
        for k in range(used):
            short[k] = max(per_m[k] * said / known - sizes.larger[k], 0.0) if known > 0.0 else 0.0
    for k in range(used):
        sizes.variance[k] += (TOO_SMALL * short[k]) ** 2 + used * ALL**2


@lean
def _correct(estimate: Estimate, sizes: Sizes, used: int) -> None:
    """Weigh one fingertip after the other."""
    covariance, size = estimate.covariance, estimate.covariance.shape[0]
    step, seen = room((MOST_NUMBERS,)), room((MOST_NUMBERS,))
    step[:] = 0.0
    for k in range(used):
        seen[:] = 0.0
        for j in range(POSE):
            for i in range(size):
                seen[i] += sizes.slope[k, j] * covariance[j, i]
        known, residual = 0.0, sizes.larger[k]
        for j in range(POSE):
            known += sizes.slope[k, j] * seen[j]
            residual -= sizes.slope[k, j] * step[j]
        own = LASTING * sizes.variance[k]
        total = max(known + own * max(1.0, own / known), (residual / UNLIKELY) ** 2)
        for i in range(size):
            step[i] += seen[i] * residual / total
            for j in range(size):
                covariance[i, j] -= seen[i] * seen[j] / total
    displace(estimate, step, estimate)
