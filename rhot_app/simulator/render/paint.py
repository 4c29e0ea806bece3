"""Which points of a solid's surface are painted, and how bright the paint is there (numba).

A point of a surface has three coordinates, m: along the solid's axis (from a capsule's end a, or a cylinder's middle),
across it, and up, out of the back of the hand. `body.py` describes the rows of `paint` (N, PAINT_FIELDS).
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.simulator.render.body import (
    ACROSS,
    ALL_ROUND,
    BOUNDS,
    CAPSULE,
    CORNERS,
    GAP,
    GAP_AT,
    HALF,
    MIDDLE,
    ON_ONE_SIDE,
    SEED,
    SIDE,
    UNEVEN,
    WORN,
)

Array = NDArray[np.float64]

CHIP_M, BLOTCH_M = 2e-3, 8e-3
"""Size of the pieces that are missing from worn paint, and period of the thickness of uneven paint, m."""


@njit(cache=True, fastmath=True)
def local_point(kind: int, p: Array, s: int, n: int, x: float, y: float, t: float) -> tuple[float, float, float]:
    """Along, across and up, m, of the point at depth `t` on the ray (x, y, 1), which meets the solid in row (s, n) of
    the prepared table `p`."""
    if kind != CAPSULE:
        return (p[s, n, 12] * (p[s, n, 9] + t * (p[s, n, 0] * x + p[s, n, 1] * y + p[s, n, 2])),
                p[s, n, 13] * (p[s, n, 10] + t * (p[s, n, 3] * x + p[s, n, 4] * y + p[s, n, 5])),
                p[s, n, 14] * (p[s, n, 11] + t * (p[s, n, 6] * x + p[s, n, 7] * y + p[s, n, 8])))
    length = math.sqrt(p[s, n, 6])
    ax, ay, az = p[s, n, 3] / length, p[s, n, 4] / length, p[s, n, 5] / length
    ux, uy, uz = p[s, n, 11], p[s, n, 12], p[s, n, 13]
    dx, dy, dz = t * x - p[s, n, 0], t * y - p[s, n, 1], t - p[s, n, 2]
    across = dx * (uy * az - uz * ay) + dy * (uz * ax - ux * az) + dz * (ux * ay - uy * ax)
    return dx * ax + dy * ay + dz * az, across, dx * ux + dy * uy + dz * uz


@njit(cache=True, fastmath=True)
def is_painted(paint: Array, n: int, along: float, across: float, up: float) -> bool:
    """Whether a point of solid `n` has paint."""
    bounds = paint[n, BOUNDS]
    if bounds == ON_ONE_SIDE:
        if up * paint[n, SIDE] < 0.0:
            return False
        reach = (abs((along - paint[n, MIDDLE]) / paint[n, HALF]) ** paint[n, CORNERS]
                 + abs(across / paint[n, ACROSS]) ** paint[n, CORNERS])
        if reach > 1.0:
            return False
    elif bounds == ALL_ROUND:
        if abs(along - paint[n, MIDDLE]) > paint[n, HALF]:
            return False
        if paint[n, GAP] > 0.0:
            off = math.atan2(across, up) - paint[n, GAP_AT]
            off -= 2.0 * math.pi * math.floor(off / (2.0 * math.pi) + 0.5)
            if abs(off) < paint[n, GAP]:
                return False
    return not (paint[n, WORN] > 0.0 and _chance(paint[n, SEED], along, across, up) < paint[n, WORN])


@njit(cache=True, fastmath=True)
def paint_level(paint: Array, n: int, along: float, across: float, up: float) -> float:
    """Factor on the brightness of solid `n` at a point, 1 where its paint is even."""
    turn, phase = 2.0 * math.pi / BLOTCH_M, 1.7 * paint[n, SEED]
    return 1.0 + paint[n, UNEVEN] * math.sin(turn * along + phase) * math.cos(0.6 * turn * (across + up) + 2.9 * phase)


@njit(cache=True)
def _chance(seed: float, along: float, across: float, up: float) -> float:
    """A uniform pseudo-random number in [0, 1) for the chip at a point: a multiply and xor-shift hash of its cell."""
    i, j, k = math.floor(along / CHIP_M), math.floor(across / CHIP_M), math.floor(up / CHIP_M)
    value = (i * 0x9E3779B1 + j * 0x85EBCA6B + k * 0xC2B2AE35 + int(seed) * 0x27D4EB2F) & 0xFFFFFFFFFFFF
    value = ((value ^ (value >> 21)) * 0x2545F491) & 0xFFFFFFFFFFFF
    value = ((value ^ (value >> 17)) * 0x27D4EB2F) & 0xFFFFFFFFFFFF
    return float((value ^ (value >> 23)) & 0xFFFFFF) / 16777216.0
