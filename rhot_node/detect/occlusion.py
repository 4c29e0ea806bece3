"""What one marker's paint hides of another's: a fingertip before its neighbour leaves that one most of its area.

Where two paints touch in a picture, one may be in front. Of a disc of radius R, behind another one that it overlaps by
the depth d, a lens of area A = 4/3 d sqrt(2 d r) is hidden, with r = R R' / (R + R') for the other's radius R'. The
centroid of the rest has moved away by m = A (R - d / 2) / (pi R^2 - A). The contact is then nearer to that centroid
than the radius of the visible area is, by h = d - m - (R - sqrt(R^2 - A / pi)). So h, which is measured, gives m: a
standard deviation along the way to the other marker, because fingertips are no discs.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_node.detect.image import GREY, YuvImage
from rhot_node.wire.messages import MarkerObservation

Array = NDArray[np.float64]

MIXED = 0.25
"""Share of a paint's colour: what lies farther beside all mixtures of two paints, in any light, is something else. A
pixel of one marker has no more of the other paint."""

DARK = 0.4
"""Share of a paint's brightness: what is darker is a gap between two markers."""

EDGE_PX = 0.4
"""px: standard deviation of the edge between two paints. Each is placed as if its own surroundings lay beyond it
(`python benchmarks/marker_errors.py --motions grasp`)."""

NEAR = 0.75  # of the sum of their diameters: markers farther apart do not touch
STEP = 0.5  # chroma px, of sampling along the way; across it is 1
GAP = 5  # steps from one paint to the other, at most: lens and chroma's 2x2 mean blur so far (`track.SHARP`)
LINES = 2  # lines of samples that cross a contact, at least


def widen_touching(image: YuvImage, seen: tuple[MarkerObservation, ...],
                   paint: Array) -> tuple[MarkerObservation, ...]:
    """The observations of one picture; the covariances of markers whose paints touch hold what each may hide of the
    other. `paint` (M, 3): Y, Cb and Cr (minus 128) of every marker's paint in it."""
    marks, added = np.array([(mark.x, mark.y, mark.diameter, mark.index) for mark in seen]), np.zeros((len(seen), 3))
    if not _touching(image.y, image.u, image.v, marks, paint, added):
        return seen
    return tuple([MarkerObservation(mark.index, mark.x, mark.y, mark.diameter, mark.cov_xx + xx, mark.cov_xy + xy,
                                    mark.cov_yy + yy, mark.quality, mark.flags) if xx + yy > 0.0 else mark
                  for mark, (xx, xy, yy) in zip(seen, added.tolist(), strict=True)])


@njit(cache=True)
def _touching(y, u, v, marks, paint, added):
    """Fill `added` (N, 3), variances xx, xy and yy, px^2, of `marks` (N, 4): x, y, diameter, px, and number of the
    paint. Returns whether any paints touch."""
    found = False
    for a in range(len(marks)):
        for b in range(a + 1, len(marks)):
            apart = math.hypot(marks[b, 0] - marks[a, 0], marks[b, 1] - marks[a, 1])
            if marks[a, 3] == marks[b, 3] or not 1.0 < apart < NEAR * (marks[a, 2] + marks[b, 2]):
                continue
            chord, distance = _contact(y, u, v, marks[a], marks[b], paint[int(marks[a, 3])], paint[int(marks[b, 3])])
            if not chord > 0.0:
                continue
            found = True
            way_x, way_y = (marks[b, 0] - marks[a, 0]) / apart, (marks[b, 1] - marks[a, 1]) / apart
            for one, other, at in ((a, b, distance), (b, a, apart - distance)):
                radius = 0.5 * marks[one, 2]
                moved = moved_centroid(radius, 0.5 * marks[other, 2], at)
                variance = moved * moved + (EDGE_PX * chord * at / (math.pi * radius * radius)) ** 2
                added[one, 0] += variance * way_x * way_x
                added[one, 1] += variance * way_x * way_y
                added[one, 2] += variance * way_y * way_y
    return found


@njit(cache=True)
def moved_centroid(radius, other, distance):
    """How far hiding by a disc of radius `other` has moved the centroid of a disc whose visible area is that of one of
    `radius`, when the contact is at `distance` from it."""
    nearer = radius - distance
    depth, moved = max(nearer, 0.0), 0.0
    for _ in range(10):  # a contraction: the whole radius and `moved` grow by less than the depth does
        depth = min(depth, radius)
        hidden = 4.0 / 3.0 * depth * math.sqrt(2.0 * depth * radius * other / (radius + other))
        whole = math.sqrt(radius * radius + hidden / math.pi)
        moved = hidden * (whole - 0.5 * depth) / (math.pi * radius * radius)
        depth = max(nearer + whole - radius + moved, 0.0)
    return moved


@njit(cache=True)
def _contact(y, u, v, one, other, mine, theirs):
    """Length of the contact of two markers, 0 without one, and its distance from the first along the way to the second,
    px. `mine` and `theirs` (3,): their paints."""
    ax, ay, bx, by = 0.5 * (one[0] - 0.5), 0.5 * (one[1] - 0.5), 0.5 * (other[0] - 0.5), 0.5 * (other[1] - 0.5)
    apart = math.hypot(bx - ax, by - ay)
    way_x, way_y = (bx - ax) / apart, (by - ay) / apart
    unmix = np.empty(9)
    if not _unmixing(mine, theirs, unmix):
        return 0.0, 0.0
    side, lines, total = int(0.5 * 0.5 * max(one[2], other[2])), 0, 0.0
    for k in range(-side, side + 1):
        at = _crossing(y, u, v, ax - k * way_y, ay + k * way_x, way_x, way_y, apart, unmix)
        if at >= 0.0:
            lines += 1
            total += at
    return (2.0 * lines, 2.0 * total / lines) if lines >= LINES else (0.0, 0.0)


@njit(cache=True)
def _unmixing(p, q, unmix):
    """Fill `unmix` (9,): three rows that give how much of paint `p` is in a colour (Y, Cb, Cr), how much of `q`, and
    how far it lies beside all mixtures of both, by the length of `q`. False for paints of like colour."""
    n0, n1, n2 = p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]
    square = n0 * n0 + n1 * n1 + n2 * n2
    own, length = p[0] ** 2 + p[1] ** 2 + p[2] ** 2, q[0] ** 2 + q[1] ** 2 + q[2] ** 2
    if not square > MIXED * MIXED * own * length:
        return False
    across = 1.0 / math.sqrt(square * length)
    unmix[0], unmix[1], unmix[2] = ((q[1] * n2 - q[2] * n1) / square, (q[2] * n0 - q[0] * n2) / square,
                                    (q[0] * n1 - q[1] * n0) / square)
    unmix[3], unmix[4], unmix[5] = ((n1 * p[2] - n2 * p[1]) / square, (n2 * p[0] - n0 * p[2]) / square,
                                    (n0 * p[1] - n1 * p[0]) / square)
    unmix[6], unmix[7], unmix[8] = n0 * across, n1 * across, n2 * across
    return True


@njit(cache=True)
def _crossing(y, u, v, x, y_at, way_x, way_y, apart, unmix):
    """How far along the way one paint becomes the other with nothing between, chroma px; -1 where it does not."""
    pure, place, before = -GAP - 1, -1.0, 0.0  # last sample of the first paint; where both are even; share before
    for step in range(int(apart / STEP) + 1):
        column, row = x + step * STEP * way_x, y_at + step * STEP * way_y
        i, j = math.floor(column), math.floor(row)
        if i < 0 or j < 0 or i + 1 >= u.shape[1] or j + 1 >= u.shape[0]:
            return -1.0
        luma, cb, cr = 0.0, -float(GREY), -float(GREY)
        for down in range(2):
            for right in range(2):
                weight = (1.0 - abs(column - i - right)) * (1.0 - abs(row - j - down))
                luma += weight * y[2 * (j + down), 2 * (i + right)]
                cb += weight * u[j + down, i + right]
                cr += weight * v[j + down, i + right]
        first = unmix[0] * luma + unmix[1] * cb + unmix[2] * cr
        second = unmix[3] * luma + unmix[4] * cb + unmix[5] * cr
        beside = unmix[6] * luma + unmix[7] * cb + unmix[8] * cr
        if first + second < DARK or abs(beside) > MIXED * (first + second):
            pure, place = -GAP - 1, -1.0
            continue
        share = second / (first + second)
        if share < MIXED:
            pure, place = step, -1.0
        elif share >= 0.5 and place < 0.0:
            place = STEP * (step - (share - 0.5) / max(share - before, share - 0.5, 1e-6))
        if share > 1.0 - MIXED and step - pure <= GAP:
            return place
        before = share
    return -1.0
