"""The log odds of a posed hand by the foreground of small images: a fast score for many poses.

The score is the logarithm of a likelihood ratio: pixels on the hand are foreground and pixels in a ring about it are
background, against images in which every pixel is foreground with the same probability. Where the forearm may be there
is no ring, because the wrist bends. A bare forearm is scored as the hand is; one that scores below 0 is taken to be
sleeved and left out. Other foreground does not count.

A capsule is drawn as the hull of two circles: a score takes 30 us, while the exact contour of `contours` takes 300.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.barehand.surface import FOREARM, Surface, posed_in
from rhot_app.estimation.se3 import retract
from rhot_app.estimation.vectors import along, axis_of, dot, origin_of, turned
from rhot_app.geometry.camera import CameraModel, pixels_per_metre_facing, project_point
from rhot_app.hand.motion.hand_state import STATE

Array = NDArray[np.float64]
ForegroundMaps = Sequence[NDArray[np.float32] | None]
"""Foreground probabilities (h, w) of every STEP-th pixel of each camera, None of a camera without an image."""

STEP = 8
"""px: spacing of the pixels of the foreground map."""

MISLABELLED = 0.05
"""Probability that a pixel of foreground probability 0 or 1 is mislabelled: shadows, sleeves, other skin."""

RING_M = 0.012
"""m: width of the ring: half a finger's breadth."""

ARM_M, ARM_SPREAD = 0.5, 0.35
"""m, and radius per m: the cone behind the wrist in which a forearm may lie, about 20 degrees to every side."""

FOREARM_M, FOREARM_SPREAD = 0.25, 0.07
"""m, and radius per m: a forearm from wrist to elbow, where it is 1.6 times as thick (ANSUR II: 263 mm; girths 175 and
280 mm)."""

BENDS = np.array([[0.0, 0.0], [0.6, 0.0], [-0.6, 0.0], [0.0, 0.35], [0.0, -0.35]])
"""rad: flexions and deviations of the wrist at which the forearm is scored (`tracker.FOREARM_SD`)."""

_NEAR_M = 0.1  # where the cone of the forearm ends before the camera
_SECTIONS = 16  # of the forearm
_ACROSS = 0.4 * np.arange(-2, 3)  # radii from the forearm's axis


class LogOddsMaps(NamedTuple):
    """Of every STEP-th pixel of C images: log likelihood ratios (C, h, w) of lying `inside` and `outside` a hand or a
    bare forearm against lying anywhere; `poses` (C, 3, 4) and `intrinsics` (C, 13) of their cameras. Smaller images are
    padded with 0."""

    inside: Array
    outside: Array
    poses: Array
    intrinsics: Array


def log_odds_maps(maps: ForegroundMaps, cameras: Sequence[CameraModel], rate: float | None = None) -> LogOddsMaps:
    """Of the cameras that have a map; 0 where it is NaN, not known. `rate`: probability that a pixel anywhere is
    foreground; by default that of the whole image."""
    given = [(one, camera) for one, camera in zip(maps, cameras, strict=True) if one is not None]
    height, width = np.max([one.shape for one, _ in given], axis=0)
    inside, outside = np.zeros((2, len(given), height, width))
    for number, (one, _) in enumerate(given):
        own = np.s_[number, :one.shape[0], :one.shape[1]]
        foreground = MISLABELLED + (1.0 - 2.0 * MISLABELLED) * np.asarray(one, dtype=np.float64)
        part = rate if rate is not None else float(np.nanmean(one)) if np.isfinite(one).any() else 0.5
        unknown = part * foreground + (1.0 - part) * (1.0 - foreground)
        inside[own] = np.nan_to_num(np.log(foreground / unknown))
        outside[own] = np.nan_to_num(np.log((1.0 - foreground) / unknown))
    return LogOddsMaps(inside, outside, np.array([camera.camera_from_world[:3] for _, camera in given]),
                       np.array([camera.intrinsics for _, camera in given]))


@njit(cache=True)
def _project_capsule(centres, radii, pose, intrinsics, step, circles):
    """Fill `circles` (3, 3): centre and radius, px of the map, of both ends of a capsule; and what is scratch. False
    where it is not in front of the camera."""
    pixel, slope = circles[2], circles[3:]
    for end in range(2):
        if not project_point(centres[end, 0], centres[end, 1], centres[end, 2], pose, intrinsics, pixel, slope):
            return False
        circles[end, 0], circles[end, 1] = (pixel[0] + 0.5) / step - 0.5, (pixel[1] + 0.5) / step - 0.5
        circles[end, 2] = radii[end] * pixels_per_metre_facing(slope, pose) / step
    return True


@njit(cache=True)
def _cone(circles):
    """A projected capsule for `_from_axis`: the start of its axis, its direction and 1 / its squared length; the radius
    at the start, and how much it grows."""
    du, dv = circles[1, 0] - circles[0, 0], circles[1, 1] - circles[0, 1]
    return (circles[0, 0], circles[0, 1], du, dv, 1.0 / max(du * du + dv * dv, 1e-9), circles[0, 2],
            circles[1, 2] - circles[0, 2])


@njit(cache=True)
def _from_axis(cone, column, row):
    """Of a pixel: its squared distance from the axis of a projected capsule, and its place along that, 0..1."""
    x, y = column - cone[0], row - cone[1]
    t = min(max((x * cone[2] + y * cone[3]) * cone[4], 0.0), 1.0)
    x, y = x - t * cone[2], y - t * cone[3]
    return x * x + y * y, t


@njit(cache=True)
def _rasterise(circles, rings, mask, box):
    """Rasterise a projected capsule: mark its pixels in `mask` (h, w) with 1, and those of the ring about it that are
    not yet 1 with 2. `rings` (2,): the ring's width at both ends, px. `box` (4,) grows to the first and last row and
    column marked."""
    wide0, wide1 = circles[0, 2] + rings[0], circles[1, 2] + rings[1]
    left = max(int(min(circles[0, 0] - wide0, circles[1, 0] - wide1)), 0)
    right = min(int(max(circles[0, 0] + wide0, circles[1, 0] + wide1)) + 1, mask.shape[1] - 1)
    top = max(int(min(circles[0, 1] - wide0, circles[1, 1] - wide1)), 0)
    bottom = min(int(max(circles[0, 1] + wide0, circles[1, 1] + wide1)) + 1, mask.shape[0] - 1)
    box[0], box[1] = min(box[0], top), max(box[1], bottom)
    box[2], box[3] = min(box[2], left), max(box[3], right)
    cone = _cone(circles)
    for row in range(top, bottom + 1):
        for column in range(left, right + 1):
            if mask[row, column] == 1:
                continue
            square, t = _from_axis(cone, column, row)
            r = cone[5] + t * cone[6]
            wide = r + rings[0] + t * (rings[1] - rings[0])
            if square <= r * r:
                mask[row, column] = 1
            elif square <= wide * wide:
                mask[row, column] = 2


@njit(cache=True)
def rasterise(centres, radii, pose, intrinsics, step, margin, mask):
    """Mark in `mask` (h, w), every `step`-th pixel of an image, the pixels of capsules and `margin` mask pixels about
    them."""
    circles, box = np.empty((5, 3)), np.array([mask.shape[0], -1, mask.shape[1], -1])
    for k in range(len(radii)):
        if _project_capsule(centres[k], radii[k], pose, intrinsics, step, circles):
            _rasterise(circles, (margin, margin), mask, box)


@njit(cache=True)
def _arm(wrist, direction, thick, inside, pose, intrinsics, mask):
    """Sum of the log odds on a forearm from `wrist` (3,) along `direction` (3,), where the hand does not hide it."""
    pixel, slope, total, u0, v0 = np.empty(2), np.empty((2, 3)), 0.0, 0.0, 0.0
    for k in range(_SECTIONS + 1):
        s = FOREARM_M * k / _SECTIONS
        x, y, z = along(wrist, s, direction)
        if not project_point(x, y, z, pose, intrinsics, pixel, slope):
            break
        u, v = (pixel[0] + 0.5) / STEP - 0.5, (pixel[1] + 0.5) / STEP - 0.5
        if k:
            du, dv = u - u0, v - v0
            length = np.sqrt(du * du + dv * dv)
            wide = pixels_per_metre_facing(slope, pose) * (thick + s * FOREARM_SPREAD) / STEP
            for part in _ACROSS:
                across = part * wide / max(length, 1e-9)
                row, column = int(np.floor(v + across * du + 0.5)), int(np.floor(u - across * dv + 0.5))
                if 0 <= row < mask.shape[0] and 0 <= column < mask.shape[1] and mask[row, column] != 1:
                    total += (_ACROSS[1] - _ACROSS[0]) * wide * length * inside[row, column]
        u0, v0 = u, v
    return total


@njit(cache=True)
def _score(surface, state, odds, mask, parts):
    """Log odds of the hand in a state. Fill `parts` (C, 3): for each camera the sum of log odds on the hand, the number
    of its pixels with known foreground, and the sum of log odds in the ring. `mask` (h, w) must be 0 and is 0 again
    afterwards."""
    hand, total, arms = posed_in(surface, state), 0.0, np.zeros(len(BENDS))
    thick = np.max(np.where(surface.group == FOREARM, hand.radii[:, 0], 0.0))
    wrist, behind = origin_of(hand.world), axis_of(hand.world, 0)
    ends, radii, circles = np.empty((2, 3)), np.empty(2), np.empty((5, 3))
    for camera in range(len(odds.inside)):
        pose, lens, inside = odds.poses[camera], odds.intrinsics[camera], odds.inside[camera]
        box = np.array([mask.shape[0], -1, mask.shape[1], -1])
        for k in range(len(surface.row)):
            if surface.group[k] != FOREARM and _project_capsule(hand.centres[k], hand.radii[k], pose, lens, STEP,
                                                                circles):
                _rasterise(circles, (circles[0, 2] * RING_M / hand.radii[k, 0],
                                     circles[1, 2] * RING_M / hand.radii[k, 1]), mask, box)
        end, depth = 1.0, dot(pose[2], wrist) + pose[2, 3]
        elbow_depth = depth - ARM_M * dot(pose[2], behind)
        if elbow_depth < _NEAR_M < depth:
            end = (depth - _NEAR_M) / (depth - elbow_depth)
        ends[0], ends[1] = wrist, along(wrist, -end * ARM_M, behind)
        radii[0], radii[1] = thick, thick + end * ARM_M * ARM_SPREAD
        arm = _project_capsule(ends, radii, pose, lens, STEP, circles)
        cone = _cone(circles)
        for n in range(len(BENDS)):
            flexion, deviation = BENDS[n]
            direction = (-np.cos(flexion) * np.cos(deviation), -np.sin(deviation), np.sin(flexion))
            arms[n] += _arm(wrist, turned(hand.world, direction), thick, inside, pose, lens, mask)
        own = ring = area = 0.0
        for row in range(box[0], box[1] + 1):
            for column in range(box[2], box[3] + 1):
                value = mask[row, column]
                mask[row, column] = 0
                if value == 1 and inside[row, column] != 0.0:  # 0: not known
                    own += inside[row, column]
                    area += 1.0
                elif value == 2:
                    if arm:
                        square, t = _from_axis(cone, column, row)
                        if square <= (cone[5] + t * cone[6]) ** 2:
                            continue
                    ring += odds.outside[camera, row, column]
        parts[camera, 0], parts[camera, 1], parts[camera, 2] = own, area, ring
        total += own + ring
    return total + max(arms.max(), 0.0)  # a sleeved forearm is background and costs nothing


def score(surface: Surface, state: Array, odds: LogOddsMaps) -> tuple[float, Array]:
    """Log odds of the hand in `state` (`hand_state`, with shape); and (C, 3) of each camera.

    The three are the sum of log odds on the hand, the number of its pixels with known foreground, and the sum of log
    odds in the ring.
    """
    parts, mask = np.zeros((len(odds.inside), 3)), np.zeros(odds.inside.shape[1:], np.uint8)
    return float(_score(surface, state, odds, mask, parts)), parts


@njit(cache=True, nogil=True)  # it takes long, and a thread must receive frames meanwhile
def score_steps(surface, state, steps, limits, odds):
    """(N,) scores of the hand in `state` moved by `steps` (N, 27) of twist and angles; angles stay within `limits`
    (21, 2)."""
    mask, parts = np.zeros(odds.inside.shape[1:], np.uint8), np.zeros((len(odds.inside), 3))
    scores = np.empty(len(steps))
    for n in range(len(steps)):
        scores[n] = _score(surface, moved_by(state, steps[n], limits), odds, mask, parts)
    return scores


@njit(cache=True)
def moved_by(state, step, limits):
    """The state moved by `step` (27,) of twist and angles, the angles within `limits` (21, 2)."""
    moved = retract(state, step)
    angles = moved[STATE.angles]
    for i in range(len(limits)):
        angles[i] = min(max(angles[i], limits[i, 0]), limits[i, 1])
    return moved
