"""Paint on the inner side of the palm that closing fingers come to lie before: how much of it still shows.

What is left of half-covered paint has its middle elsewhere, by up to its radius, for as long as it is covered, and
differently for each camera. A node sees areas change and cannot tell a slow covering from a turn or a way. The master
knows the distance, so it remembers how large each paint is, and leaves out sights that show too little of it.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rhot_app.lean import lean, room
from rhot_app.tracking.kalman.combine import scale
from rhot_app.tracking.kalman.estimate import BIAS, Estimate
from rhot_app.tracking.kalman.markers import Cameras, Frame, Worn
from rhot_app.tracking.kalman.sighted import FRESH_S, KEPT_S, line_of_sight, since_seen

Array = NDArray[np.float64]

COVERED = 0.7
"""Paint that shows less than this part of its area is covered."""

LEARNT = 0.1
"""Of what paint is larger than it was known to be, a sight teaches this part: one frame's mistake is not believed."""

STRAYS_M_S = 0.007
"""Paint out of sight keeps its place on a palm held to its course, give or take this much per second."""


@lean
def leave_out_covered(worn: Worn, cameras: Cameras, frame: Frame, estimate: Estimate, points: Array,
                      made: Array) -> None:
    """Set more of `frame.covered`, learn sizes (`estimate.width`), and set the biases' variances of paint that was
    away.

    To be called after `measure_sizes`. `points` (M, 3) m as `place_markers` has them; `made` (M,) m^2: variance of the
    markers' places by their making.
    """
    for sight in range(worn.part.shape[0]):
        m = frame.label[sight]
        if frame.seen[sight] and worn.palmar[m] and frame.sizes[sight] > 0.0:
            frame.covered[sight] |= _is_covered(cameras, frame, estimate, sight, m, points[m])
            if not frame.covered[sight]:
                set_bias_variance(estimate, m, made[m])
    for m in range(worn.part.shape[0]):
        if worn.palmar[m]:
            away = since_seen(estimate.unseen, m)
            if away >= KEPT_S:
                set_bias_variance(estimate, m, made[m])
            elif away >= FRESH_S and not _shows(frame, m):
                set_bias_variance(estimate, m, made[m] + (STRAYS_M_S * away) ** 2)


@lean
def _shows(frame: Frame, m: int) -> bool:
    """Whether a marker is weighed in this frame."""
    for sight in range(frame.seen.shape[0]):
        if frame.label[sight] == m and frame.seen[sight] and not frame.covered[sight]:
            return True
    return False


@lean
def _is_covered(cameras: Cameras, frame: Frame, estimate: Estimate, sight: int, m: int, point: Array) -> bool:
    """Whether a sight shows too little of paint `m`, at `point` (3,) m; learns its size from a sight in plain view.

    Flat paint shows less of itself when the palm is turned away, round paint does not; which of the two it is nobody
    knows, so as much as flat paint would show is enough.
    """
    line, facing = room((3,)), 0.0
    line_of_sight(cameras.pose[frame.camera[0]], point, line)
    for k in range(3):
        facing += line[k] * estimate.world[k, 2]
    width, known = frame.sizes[sight], estimate.width[m]
    if frame.plain[sight] and width > known:
        estimate.width[m] = known + LEARNT * (width - known) if known > 0.0 else width
    return width * width < COVERED * abs(facing) * known * known


@lean
def set_bias_variance(estimate: Estimate, m: int, variance: float) -> None:
    """Let the bias of marker `m` have a prior variance of `variance`, m^2.

    Where it grows, nobody knows what was added; where it shrinks, the bias and what is not known of it shrink with it.
    """
    first, before = BIAS + 3 * m, estimate.bias_variance[m]
    estimate.bias_variance[m] = variance
    if variance > before:
        for k in range(3):
            estimate.covariance[first + k, first + k] += variance - before
    elif variance < before:
        share = math.sqrt(variance / before)
        for k in range(3):
            estimate.bias[m, k] *= share
            scale(estimate.covariance[first + k], share)
            for j in range(estimate.covariance.shape[0]):
                estimate.covariance[j, first + k] *= share
