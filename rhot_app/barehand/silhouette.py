"""The log odds of a posed hand by the foreground of small images: a fast score for many poses, and a search with it.

The score is the logarithm of a likelihood ratio: pixels on the hand are foreground and pixels in a ring about it are
background, against images in which every pixel is foreground with the same probability. Where the forearm may be there
is no ring, because the wrist bends. A bare forearm is scored as the hand is; one that scores below 0 is taken to be
sleeved and left out. Other foreground does not count. The search samples poses from a Gaussian and adapts it to the
better ones (CMA-ES, Hansen, "The CMA Evolution Strategy: A Tutorial", arXiv:1604.00772).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.barehand.contours import project
from rhot_app.barehand.surface import FOREARM, Surface, place_capsules
from rhot_app.geometry.camera import pixels_per_metre_facing
from rhot_app.hand.kinematics import move

Array = NDArray[np.float64]

MISLABELLED = 0.05
"""Probability that a pixel of foreground probability 0 or 1 is mislabelled: shadows, sleeves, other skin."""

CORRELATED = 8.0
"""Pixels that count as one observation: errors of the model's contour and of the foreground are correlated along a
finger's breadth."""

RING_M = 0.012
"""m: width of the ring: half a finger's breadth."""

ARM_M, ARM_SPREAD = 0.5, 0.35
"""m, and radius per m: the cone behind the wrist in which a forearm may lie, about 20 degrees to every side."""

FOREARM_M, FOREARM_SPREAD = 0.25, 0.07
"""m, and radius per m: a forearm from wrist to elbow, where it is 1.6 times as thick (ANSUR II: 263 mm; girths 175 and
280 mm)."""

BENDS = np.array([[0.0, 0.0], [0.6, 0.0], [-0.6, 0.0], [0.0, 0.35], [0.0, -0.35]])
"""rad: flexions and deviations of the wrist at which the forearm is scored (`tracker.FOREARM_SD`)."""

DRAWS = 14
"""Population size of CMA-ES: Hansen's default for 27 dimensions, 4 + 3 ln 27, rounded up."""

START_STEP = 0.5
"""Initial step size of CMA-ES in standard deviations of the prior. Chosen: with 1, fewer starts are good."""


_U0, _V0, _U1, _V1, _R0, _R1, _DU, _DV, _PER_SQUARE = range(9)
"""Indices into a projected capsule: centres and radii of its ends, their difference, and 1 / its squared length; px."""


class LogOddsMaps(NamedTuple):
    """Of every `step`-th pixel of C images: log likelihood ratios (C, h, w) of lying `inside` and `outside` a hand or a
    bare forearm against lying anywhere; `poses` (C, 3, 4) and `intrinsics` (C, 13) of their cameras. Smaller images are
    padded with 0."""

    inside: Array
    outside: Array
    step: int
    poses: Array
    intrinsics: Array


def log_odds_maps(maps: Sequence[NDArray[np.float32]], step: int, poses: Sequence[Array], intrinsics: Sequence[Array],
                  rate: float | None = None) -> LogOddsMaps:
    """From foreground probabilities (h, w) of each camera (`foreground_map`); 0 where these are NaN, not known.
    `rate`: probability that a pixel anywhere is foreground; by default that of the whole image."""
    height, width = max(one.shape[0] for one in maps), max(one.shape[1] for one in maps)
    inside, outside = np.zeros((2, len(maps), height, width))
    for camera, one in enumerate(maps):
        own = np.s_[camera, :one.shape[0], :one.shape[1]]
        foreground = MISLABELLED + (1.0 - 2.0 * MISLABELLED) * np.asarray(one, dtype=np.float64)
        part = rate if rate is not None else float(np.nanmean(one)) if np.isfinite(one).any() else 0.5
        unknown = part * foreground + (1.0 - part) * (1.0 - foreground)
        inside[own] = np.nan_to_num(np.log(foreground / unknown))
        outside[own] = np.nan_to_num(np.log((1.0 - foreground) / unknown))
    return LogOddsMaps(inside, outside, step, np.array(poses), np.array(intrinsics))


@njit(cache=True)
def _project_capsule(c0, c1, r0, r1, pose, intrinsics, step, a, b, slope, circles):
    """Fill `circles` (9,) with a capsule's projection, px of the map, at the indices _U0 and so on. False where it is
    not in front of the camera."""
    if not (project(c0[0], c0[1], c0[2], pose, intrinsics, a, slope)):
        return False
    circles[_R0] = r0 * pixels_per_metre_facing(slope, pose) / step
    if not (project(c1[0], c1[1], c1[2], pose, intrinsics, b, slope)):
        return False
    circles[_R1] = r1 * pixels_per_metre_facing(slope, pose) / step
    circles[_U0], circles[_V0] = (a[0] + 0.5) / step - 0.5, (a[1] + 0.5) / step - 0.5
    circles[_U1], circles[_V1] = (b[0] + 0.5) / step - 0.5, (b[1] + 0.5) / step - 0.5
    circles[_DU], circles[_DV] = circles[_U1] - circles[_U0], circles[_V1] - circles[_V0]
    circles[_PER_SQUARE] = 1.0 / max(circles[_DU] * circles[_DU] + circles[_DV] * circles[_DV], 1e-9)
    return True


@njit(cache=True)
def _rasterise(circles, ring, ring_slope, mask, box):
    """Rasterise a projected capsule: mark its pixels in `mask` (h, w) with 1, and those of the ring about it that are
    not yet 1 with 2. The ring is `ring` px wide at the first end, `ring_slope` wider at the last. `box` (4,) grows to
    the first and last row and column marked."""
    u0, v0, u1, v1, s0, s1 = circles[_U0], circles[_V0], circles[_U1], circles[_V1], circles[_R0], circles[_R1]
    du, dv, inverse = circles[_DU], circles[_DV], circles[_PER_SQUARE]
    wide0, wide1 = s0 + ring, s1 + ring + ring_slope
    left = max(int(min(u0 - wide0, u1 - wide1)), 0)
    right = min(int(max(u0 + wide0, u1 + wide1)) + 1, mask.shape[1] - 1)
    top = max(int(min(v0 - wide0, v1 - wide1)), 0)
    bottom = min(int(max(v0 + wide0, v1 + wide1)) + 1, mask.shape[0] - 1)
    box[0], box[1] = min(box[0], top), max(box[1], bottom)
    box[2], box[3] = min(box[2], left), max(box[3], right)
    for row in range(top, bottom + 1):
        for column in range(left, right + 1):
            if mask[row, column] == 1:
                continue
            t = min(max(((column - u0) * du + (row - v0) * dv) * inverse, 0.0), 1.0)
            x, y, r = column - u0 - t * du, row - v0 - t * dv, s0 + t * (s1 - s0)
            square, wide = x * x + y * y, r + ring + t * ring_slope
            if square <= r * r:
                mask[row, column] = 1
            elif square <= wide * wide:
                mask[row, column] = 2


@njit(cache=True)
def _covers(circles, column, row):
    """Whether a pixel lies on a projected capsule (`_project_capsule`)."""
    x, y = column - circles[_U0], row - circles[_V0]
    t = min(max((x * circles[_DU] + y * circles[_DV]) * circles[_PER_SQUARE], 0.0), 1.0)
    x, y, r = x - t * circles[_DU], y - t * circles[_DV], circles[_R0] + t * (circles[_R1] - circles[_R0])
    return x * x + y * y <= r * r


@njit(cache=True)
def _arm(world, wrist, thick, bend, inside, step, pose, intrinsics, mask, a, b, slope):
    """Sum of the log odds on the forearm, where the hand does not hide it; `bend` (2,) rad: the wrist's flexion and
    deviation."""
    along, p = np.empty(3), np.empty(3)
    x, y, z = -np.cos(bend[0]) * np.cos(bend[1]), -np.sin(bend[1]), np.sin(bend[0])
    for i in range(3):
        along[i] = world[i, 0] * x + world[i, 1] * y + world[i, 2] * z
    total, begun, count = 0.0, False, 16
    for k in range(count + 1):
        s = FOREARM_M * k / count
        for i in range(3):
            p[i] = wrist[i] + s * along[i]
        if not project(p[0], p[1], p[2], pose, intrinsics, a, slope):
            break
        u, v = (a[0] + 0.5) / step - 0.5, (a[1] + 0.5) / step - 0.5
        if begun:
            du, dv = u - b[0], v - b[1]
            length = np.sqrt(du * du + dv * dv)
            wide = pixels_per_metre_facing(slope, pose) * (thick + s * FOREARM_SPREAD) / step
            for j in range(-2, 3):
                across = 0.4 * j * wide / max(length, 1e-9)
                row, column = int(np.floor(v + across * du + 0.5)), int(np.floor(u - across * dv + 0.5))
                if 0 <= row < mask.shape[0] and 0 <= column < mask.shape[1] and mask[row, column] != 1:
                    total += 0.4 * wide * length * inside[row, column]
        b[0], b[1], begun = u, v, True
    return total


@njit(cache=True)
def _score(surface, world, angles, size, inside, outside, step, poses, intrinsics, mask, parts):
    """Log odds of a pose. Fill `parts` (C, 3): for each camera the sum of log odds on the hand, the number of its
    pixels with known foreground, and the sum of log odds in the ring. `mask` (h, w) must be 0 and is 0 again
    afterwards."""
    count = surface.row.shape[0]
    frames = np.empty((surface.dh.parent.shape[0], 3, 4))
    centres, radii = np.empty((count, 2, 3)), np.empty((count, 2))
    place_capsules(surface, world, angles, size, frames, centres, radii)
    a, b, slope = np.empty(2), np.empty(2), np.empty((2, 3))
    wrist, elbow = world[:3, 3].copy(), world[:3, 3] - ARM_M * world[:3, 0]
    thick, total, arms = 0.0, 0.0, np.zeros(BENDS.shape[0])
    for k in range(count):
        if surface.group[k] == FOREARM:
            thick = max(thick, radii[k, 0])
    circles, cone, box = np.empty(9), np.empty(9), np.empty(4, np.int64)
    for camera in range(inside.shape[0]):
        pose, lens = poses[camera], intrinsics[camera]
        box[0], box[1], box[2], box[3] = mask.shape[0], -1, mask.shape[1], -1
        for k in range(count):
            if surface.group[k] != FOREARM and _project_capsule(centres[k, 0], centres[k, 1], radii[k, 0], radii[k, 1],
                                                                pose, lens, step, a, b, slope, circles):
                first, last = circles[_R0] * RING_M / radii[k, 0], circles[_R1] * RING_M / radii[k, 1]
                _rasterise(circles, first, last - first, mask, box)
        # cut the cone of the arm off 0.1 m before the camera
        end, depth0, depth1 = 1.0, 0.0, 0.0
        for i in range(3):
            depth0 += pose[2, i] * wrist[i]
            depth1 += pose[2, i] * elbow[i]
        depth0, depth1 = depth0 + pose[2, 3], depth1 + pose[2, 3]
        if depth1 < 0.1 and depth0 > 0.1:
            end = (depth0 - 0.1) / (depth0 - depth1)
        arm = _project_capsule(wrist, wrist + end * (elbow - wrist), thick, thick + end * ARM_M * ARM_SPREAD, pose,
                               lens, step, a, b, slope, cone)
        for n in range(BENDS.shape[0]):
            arms[n] += _arm(world, wrist, thick, BENDS[n], inside[camera], step, pose, lens, mask, a, b, slope)
        own = ring = area = 0.0
        for row in range(box[0], box[1] + 1):
            for column in range(box[2], box[3] + 1):
                value = mask[row, column]
                mask[row, column] = 0
                if value == 1 and inside[camera, row, column] != 0.0:  # 0: not known
                    own += inside[camera, row, column]
                    area += 1.0
                elif value == 2 and not (arm and _covers(cone, column, row)):
                    ring += outside[camera, row, column]
        parts[camera, 0], parts[camera, 1], parts[camera, 2] = own, area, ring
        total += own + ring
    return total + max(arms.max(), 0.0)  # a sleeved forearm is background and costs nothing


@njit(cache=True)
def rasterise(centres, radii, pose, intrinsics, step, margin, mask):
    """Mark in `mask` (h, w), every `step`-th pixel of an image, the pixels of capsules and `margin` mask pixels about
    them."""
    a, b, slope = np.empty(2), np.empty(2), np.empty((2, 3))
    circles, box = np.empty(9), np.array([mask.shape[0], -1, mask.shape[1], -1])
    for k in range(centres.shape[0]):
        if _project_capsule(centres[k, 0], centres[k, 1], radii[k, 0], radii[k, 1], pose, intrinsics, step, a, b, slope,
                            circles):
            _rasterise(circles, margin, 0.0, mask, box)


def score(surface: Surface, world: Array, angles: Array, size: Array, odds: LogOddsMaps) -> tuple[float, Array]:
    """Log odds of the hand at `world` (4, 4), `angles` (21,) rad; and (C, 3) of each camera.

    The three are the sum of log odds on the hand, the number of its pixels with known foreground, and the sum of log
    odds in the ring.
    """
    parts = np.zeros((len(odds.inside), 3))
    mask = np.zeros(odds.inside.shape[1:], np.uint8)
    return float(_score(surface, world, angles, size, odds.inside, odds.outside, odds.step, odds.poses,
                        odds.intrinsics, mask, parts)), parts


@njit(cache=True, nogil=True)  # it takes long, and a thread must receive frames meanwhile
def _score_many(surface, world, angles, steps, limits, size, inside, outside, step, poses, intrinsics, scores):
    mask, parts = np.zeros(inside.shape[1:], np.uint8), np.zeros((inside.shape[0], 3))
    moved, turned = np.empty((4, 4)), np.empty(21)
    for n in range(steps.shape[0]):
        move(world, angles, steps[n], moved, turned)
        for i in range(21):
            turned[i] = min(max(turned[i], limits[i, 0]), limits[i, 1])
        scores[n] = _score(surface, moved, turned, size, inside, outside, step, poses, intrinsics, mask, parts)


def score_steps(surface: Surface, world: Array, angles: Array, steps: Array, limits: Array, size: Array,
                odds: LogOddsMaps) -> Array:
    """(N,) scores of the hand moved by `steps` (N, 27) of twist and angles; angles stay within `limits` (21, 2)."""
    scores = np.empty(len(steps))
    _score_many(surface, world, angles, np.ascontiguousarray(steps), limits, size, odds.inside, odds.outside,
                odds.step, odds.poses, odds.intrinsics, scores)
    return scores


def search(surface: Surface, world: Array, angles: Array, covariance: Array, limits: Array, size: Array,
           odds: LogOddsMaps, rng: np.random.Generator, rounds: int) -> tuple[Array, Array]:
    """The most probable pose about `world` (4, 4), `angles` (21,) with prior covariance (27, 27), after `rounds` of
    DRAWS poses.

    The score is the log odds by the foreground over CORRELATED, less half of the squared Mahalanobis distance.
    """
    root = np.linalg.cholesky(covariance + 1e-12 * np.eye(len(covariance)))

    def scores(white: Array) -> Array:
        values = score_steps(surface, world, angles, white @ root.T, limits, size, odds)
        return np.asarray(values / CORRELATED - 0.5 * np.sum(white * white, axis=1))
    best = _cma_es(scores, len(root), rng, rounds)
    moved, turned = np.empty((4, 4)), np.empty(21)
    move(world, angles, root @ best, moved, turned)
    return moved, np.clip(turned, limits[:, 0], limits[:, 1])


def _cma_es(value: Callable[[Array], Array], n: int, rng: np.random.Generator, rounds: int) -> Array:
    """Maximise a function of (DRAWS, n), from 0 with START_STEP; returns the best (n,). CMA-ES with the default
    parameters of Hansen's tutorial, positive weights only. The first sample is the start itself."""
    mu = DRAWS // 2
    weights = np.log(mu + 0.5) - np.log(np.arange(1, mu + 1))
    weights /= weights.sum()
    mu_eff = 1.0 / float(np.sum(weights * weights))
    c_c, c_s = (4.0 + mu_eff / n) / (n + 4.0 + 2.0 * mu_eff / n), (mu_eff + 2.0) / (n + mu_eff + 5.0)
    c_1 = 2.0 / ((n + 1.3) ** 2 + mu_eff)
    c_mu = min(1.0 - c_1, 2.0 * (mu_eff - 2.0 + 1.0 / mu_eff) / ((n + 2.0) ** 2 + mu_eff))
    damping = 1.0 + 2.0 * max(0.0, np.sqrt((mu_eff - 1.0) / (n + 1.0)) - 1.0) + c_s
    expected = np.sqrt(n) * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n))  # length of a standard normal
    mean, step, path, step_path = np.zeros(n), START_STEP, np.zeros(n), np.zeros(n)
    covariance, axes, lengths = np.eye(n), np.eye(n), np.ones(n)
    best, best_value = mean, -np.inf
    for number in range(rounds):
        if number and number % 5 == 0:  # every fifth round: it takes as long as DRAWS scores
            squares, axes = np.linalg.eigh(covariance)
            lengths = np.sqrt(np.maximum(squares, 1e-12))
        drawn = rng.standard_normal((DRAWS, n)) * lengths @ axes.T
        if number == 0:
            drawn[0] = 0.0
        points = mean + step * drawn
        values = value(points)
        order = np.argsort(-values)[:mu]
        if values[order[0]] > best_value:
            best, best_value = points[order[0]], float(values[order[0]])
        moved = weights @ drawn[order]
        mean = mean + step * moved
        step_path = (1.0 - c_s) * step_path + np.sqrt(c_s * (2.0 - c_s) * mu_eff) * (axes @ (axes.T @ moved / lengths))
        length = float(np.linalg.norm(step_path)) / expected
        steady = length / np.sqrt(1.0 - (1.0 - c_s) ** (2 * (number + 1))) < 1.4 + 2.0 / (n + 1.0)
        path = (1.0 - c_c) * path + steady * np.sqrt(c_c * (2.0 - c_c) * mu_eff) * moved
        covariance = ((1.0 - c_1 - c_mu) * covariance + c_1 * np.outer(path, path)
                      + c_mu * (drawn[order].T * weights) @ drawn[order])
        step *= float(np.exp(c_s / damping * (length - 1.0)))
    return best
