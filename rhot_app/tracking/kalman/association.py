"""Which of the hand's markers a sight is of: what the hand confirms, not what the colour says.

Two markers of like colours change names where they cross, and one that is hidden lends its name to another. The hand
knows where each must be. Asked only when sights are far from where they are expected, so it costs nothing otherwise.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rhot_app.lean import lean, room
from rhot_app.tracking.kalman.combine import dot
from rhot_app.tracking.kalman.estimate import BIAS, MOST_MARKERS, POSE, Estimate
from rhot_app.tracking.kalman.markers import Cameras, Frame, Places, Worn, project_marker
from rhot_app.tracking.kalman.median import median
from rhot_app.tracking.kalman.reappearing import AWAY_S
from rhot_app.tracking.kalman.sighted import since_seen

Array = NDArray[np.float64]

DOUBT_M = 0.006
"""A sight that lies farther, on the hand, from where it is expected than the whole hand does may be another's."""

FAR, NEAR = 30.0, 12.0
"""Squared normalised distances (2 degrees of freedom) of a sight from a marker that it is not of, and that it is of."""


@lean
def relabel(worn: Worn, cameras: Cameras, frame: Frame, estimate: Estimate, places: Places) -> int:
    """Set `frame.label` anew; returns how many sights are taken for another marker than they say. `places` as
    `place_markers` has them."""
    count, camera = worn.part.shape[0], frame.camera[0]
    for m in range(count):
        frame.label[m] = m
    expected, slopes, place = room((MOST_MARKERS, 2))[:count], room((MOST_MARKERS, 2, 3))[:count], room((3,))
    for m in range(count):
        late = frame.late_s[m] if frame.seen[m] else 0.0
        for i in range(3):
            place[i] = places.points[m, i] + estimate.bias[m, i] + late * dot(places.jacobian[m, i], estimate.velocity)
        if not project_marker(place, estimate.world, worn.half_axes[m], cameras.pose[camera],
                              cameras.intrinsics[camera], expected[m], slopes[m]):
            expected[m] = np.nan
    shift, doubt = room((2,)), False
    _common_shift(frame, expected, shift)
    for m in range(count):
        if frame.seen[m]:
            off = math.hypot(frame.pixels[m, 0] - expected[m, 0] - shift[0],
                             frame.pixels[m, 1] - expected[m, 1] - shift[1])
            doubt |= not off < DOUBT_M * math.hypot(slopes[m, 0, 0], slopes[m, 0, 1])
    if not doubt:
        return 0
    for m in range(count):
        expected[m, 0] += shift[0]
        expected[m, 1] += shift[1]
    return _rename(frame, estimate, expected, slopes, places.jacobian)


@lean
def _common_shift(frame: Frame, expected: Array, shift: Array) -> None:
    """Fill `shift` (2,) px: the median of what all sights are off."""
    off = room((MOST_MARKERS,))
    for k in range(2):
        count = 0
        shift[k] = 0.0
        for m in range(expected.shape[0]):
            if frame.seen[m] and not np.isnan(expected[m, k]):
                off[count] = frame.pixels[m, k] - expected[m, k]
                count += 1
        if count > 2:
            shift[k] = median(off[:count])


@lean
def _rename(frame: Frame, estimate: Estimate, expected: Array, slopes: Array, jacobian: Array) -> int:
    """Swap pairs that fit better swapped; give a sight that fits nowhere near its name to a marker that is not seen."""
    count, renamed = expected.shape[0], 0
    distance = room((MOST_MARKERS, MOST_MARKERS))  # of sight k from marker m
    for m in range(count):
        uu, uv, vv = _spread(estimate, slopes[m], jacobian[m], m)
        determinant = uu * vv - uv * uv
        for k in range(count):
            distance[k, m] = np.inf
            if frame.seen[k]:
                u, v = frame.pixels[k, 0] - expected[m, 0], frame.pixels[k, 1] - expected[m, 1]
                value = (vv * u * u - 2.0 * uv * u * v + uu * v * v) / determinant
                if value >= 0.0:
                    distance[k, m] = value
    for k in range(count):
        if not frame.seen[k] or frame.label[k] != k or distance[k, k] < FAR or not _placed(estimate, k):
            continue
        for m in range(count):
            if m == k or frame.label[m] != m or not distance[k, m] < NEAR or not _placed(estimate, m):
                continue
            if not frame.seen[m]:
                frame.label[k] = m
                renamed += 1
                break
            if distance[m, k] < NEAR and distance[m, m] > FAR:
                frame.label[k], frame.label[m] = m, k
                renamed += 2
                break
    return renamed


@lean
def _placed(estimate: Estimate, m: int) -> bool:
    """Whether the hand knows where marker `m` should be: what was out of sight for long is believed to be what it says.
    """
    return since_seen(estimate.unseen, m) < AWAY_S


@lean
def _spread(estimate: Estimate, slope: Array, jacobian: Array, m: int) -> tuple[float, float, float]:
    """Covariance px^2 of where marker `m` is expected, with 1 px^2 for its detection and motion."""
    u, v, covariance = room((POSE,)), room((POSE,)), estimate.covariance
    for j in range(POSE):
        u[j] = slope[0, 0] * jacobian[0, j] + slope[0, 1] * jacobian[1, j] + slope[0, 2] * jacobian[2, j]
        v[j] = slope[1, 0] * jacobian[0, j] + slope[1, 1] * jacobian[1, j] + slope[1, 2] * jacobian[2, j]
    uu, uv, vv = 1.0, 0.0, 1.0
    for i in range(POSE):
        pu, pv = dot(covariance[i, :POSE], u), dot(covariance[i, :POSE], v)
        uu += u[i] * pu
        uv += u[i] * pv
        vv += v[i] * pv
    for i in range(3):
        p = covariance[BIAS + 3 * m + i, BIAS + 3 * m + i]
        uu += slope[0, i] ** 2 * p
        uv += slope[0, i] * slope[1, i] * p
        vv += slope[1, i] ** 2 * p
    return uu, uv, vv
