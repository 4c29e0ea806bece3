"""What is known of a hand's pose as it is told, which is not quite what the filter works with.

Three things differ. The filter takes markers' seen middles to lie farther from their places than they turn out to: a
hand that trusts its fingertips too far follows them where its palm does not go. What is told takes them to lie as near
as they do.
How a palm is turned that only fingers show is believed to be known better than habit leaves it: it is told as no better
known. And no angle is known less than by habit. How fingers bend before one camera comes on top (`bends.py`).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rhot_app.hand.linear import factorise
from rhot_app.lean import lean, room, slots
from rhot_app.tracking.kalman.combine import add_rows, add_squares, scale
from rhot_app.tracking.kalman.estimate import (
    ANGLES,
    BIAS,
    LOOK_VARIANCE,
    MOST_MARKERS,
    PLACED,
    POSE,
    ROTATION,
    SCALE,
    Estimate,
)
from rhot_app.tracking.kalman.markers import NEAREST_M, Cameras

Array = NDArray[np.float64]

TOLD = POSE + 1
"""Numbers of what is told: the pose, and the logarithm of the hand's scale."""

_MOST_BIASES = 3 * MOST_MARKERS

COMMON = 0.4
"""Light and paint move a marker's middle in all pictures alike by so many of the standard deviations that nodes state
(measured: 0.4 to 0.7 where nothing hurries, 1.4 of thumbs and wristbands, whose paint is taken to lie farther off; in
`fast` less)."""


class Sheet(NamedTuple):
    """Room to work in: `factor` (3 M, 3 M) and `rows` (3 M, 28)."""

    factor: Array
    rows: Array


def empty_sheet(markers: int) -> Sheet:
    """For so many markers."""
    return Sheet(np.empty((3 * markers, 3 * markers)), np.empty((3 * markers, TOLD)))


@lean
def fill_known(estimate: Estimate, cameras: Cameras, paint: Array, made: Array, sheet: Sheet, out: Array) -> None:
    """Fill `out` (28, 28) with the covariance of the pose and, last, of the logarithm of the hand's scale, as markers
    in sight tell of it.

    `paint` (M,) m^2: variances of the markers' seen middles about their places, without what light does to them,
    infinite where nobody knows; `made` (M,) m^2: the same as the filter takes them to be in plain view. Of a palm that
    its own markers do not place nothing is told of these: what is wrong with its place is wrong with markers and
    fingers too, all together, and to know better of one of them would seem to be to know better of the place.
    """
    covariance = estimate.covariance
    for i in range(POSE):
        for j in range(POSE):
            out[i, j] = covariance[i, j]
        out[i, POSE], out[POSE, i] = covariance[i, SCALE], covariance[SCALE, i]
    out[POSE, POSE] = covariance[SCALE, SCALE]
    if estimate.held[0] < PLACED:
        tell_of_paint(estimate, cameras, paint, made, sheet, out)


@lean
def tell_of_open(estimate: Estimate, usual: Array, out: Array) -> None:
    """Add to `out`, as `fill_known` has it, so much of what habit leaves open that how the palm is turned is not told
    to be known better than it leaves it to a hand with its markers in their places; then no angle is told to be known
    less than by habit, `usual` (27,) the variances of the pose.

    A filter that linearises anew with every frame takes the sum of what it saw for more: fingers that sweep about their
    knuckles seem to show where these are, fingers that bend pass for a palm that turns. Markers in sight do not move in
    the open directions, to first order: how well these are known is not to be taken from `out` any more.
    """
    left = known = 0.0
    for i in range(ROTATION, ANGLES):
        left += estimate.left_open[i, i]
        known += out[i, i]
    if left > known:
        share = 1.0 - known / left
        for i in range(POSE):
            for j in range(POSE):
                out[i, j] += share * estimate.left_open[i, j]
    if estimate.held[0] < PLACED:
        for i in range(ANGLES, POSE):
            tell_of_habit(out, i, usual[i])


@lean
def tell_of_paint(estimate: Estimate, cameras: Cameras, paint: Array, made: Array, sheet: Sheet, out: Array) -> None:
    """Weigh in `out` (28, 28), the covariance of pose and size, that markers are nearer to their places than the filter
    takes them to be: a measurement of each bias, of no other value than it has."""
    covariance, count = estimate.covariance, 0
    numbers, noise = slots((_MOST_BIASES,)), room((_MOST_BIASES,))
    for m in range(paint.shape[0]):
        worked = estimate.bias_variance[m]
        told = paint[m] + _lit(estimate, cameras, m) + max(worked - made[m], 0.0)  # the last is what hides it
        if told < worked:
            for k in range(3):
                numbers[count], noise[count] = BIAS + 3 * m + k, 1.0 / (1.0 / told - 1.0 / worked)
                count += 1
    factor, rows = sheet.factor, sheet.rows
    for a in range(count):
        row = covariance[numbers[a]]
        for b in range(a + 1):
            factor[a, b] = row[numbers[b]]
        factor[a, a] += noise[a]
        for j in range(POSE):
            rows[a, j] = row[j]
        rows[a, POSE] = row[SCALE]
    factorise(factor[:count, :count])
    for a in range(count):
        add_rows(rows[a], factor[a, :a], rows, -1.0)
        scale(rows[a], 1.0 / factor[a, a])
    add_squares(out, rows[:count], -1.0)


@lean
def _lit(estimate: Estimate, cameras: Cameras, m: int) -> float:
    """How far light moves the middle of marker `m`, m^2 per axis; infinite while no camera tells what it sees."""
    most = 0.0
    for camera in range(cameras.pose.shape[0]):
        variance = estimate.looks[camera, m, LOOK_VARIANCE]
        if variance > 0.0:
            depth = cameras.pose[camera, 2, 3]
            for k in range(3):
                depth += cameras.pose[camera, 2, k] * estimate.world[k, 3]
            if depth > NEAREST_M:
                most = max(most, variance * (depth / cameras.intrinsics[camera, 0]) ** 2)
    return COMMON * COMMON * most if most > 0.0 else math.inf


@lean
def tell_of_habit(covariance: Array, i: int, usual: float) -> None:
    """Weigh so much of habit that number `i` is known to a variance of `usual`; nothing if it is already. What is known
    of it together with others, as of a marker's place, stays known."""
    excess = covariance[i, i] - usual
    if excess > 0.0:
        row, size = room((TOLD,)), covariance.shape[0]
        for j in range(size):
            row[j] = covariance[i, j] / covariance[i, i]
        for j in range(size):
            for k in range(size):
                covariance[j, k] -= excess * row[j] * row[k]
