"""Rays against the solids of a hand (numba). The ray starts at the camera's centre with direction (x, y, 1), so that
the ray parameter is the depth along the optical axis, m.

`prepare` turns a parameter row (see body.py) into the numbers that `hit` wants, in one row of a table (S, N, PREPARED):
S moments, N solids. The functions take the whole table and indices because numba counts references of every view.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.simulator.render.body import CAPSULE

Array = NDArray[np.float64]

PREPARED = 15
NO_HIT = 1e30


@njit(cache=True, fastmath=True, inline="always")
def prepare(kind: int, row: Array, sizes: Array, table: Array, s: int, n: int) -> None:
    """Fill row (s, n) of the table from parameters `row` (12,) in the camera's frame and `sizes` (N, 3) m."""
    if kind == CAPSULE:
        bx, by, bz = row[3] - row[0], row[4] - row[1], row[5] - row[2]
        length2 = bx * bx + by * by + bz * bz
        along = -(row[0] * bx + row[1] * by + row[2] * bz)
        away2 = row[0] * row[0] + row[1] * row[1] + row[2] * row[2]
        radius2 = sizes[n, 0] * sizes[n, 0]
        table[s, n, 0], table[s, n, 1], table[s, n, 2] = row[0], row[1], row[2]
        table[s, n, 3], table[s, n, 4], table[s, n, 5] = bx, by, bz
        table[s, n, 6], table[s, n, 7] = length2, along
        table[s, n, 8] = length2 * away2 - along * along - radius2 * length2
        table[s, n, 9] = away2 - radius2
        table[s, n, 10] = row[3] * row[3] + row[4] * row[4] + row[5] * row[5] - radius2
        table[s, n, 11], table[s, n, 12], table[s, n, 13] = row[6], row[7], row[8]
    else:
        for axis in range(3):
            inverse = 1.0 / sizes[n, axis]
            x, y, z = row[3 + 3 * axis] * inverse, row[4 + 3 * axis] * inverse, row[5 + 3 * axis] * inverse
            table[s, n, 3 * axis], table[s, n, 3 * axis + 1], table[s, n, 3 * axis + 2] = x, y, z
            table[s, n, 9 + axis] = -(x * row[0] + y * row[1] + z * row[2])
            table[s, n, 12 + axis] = sizes[n, axis]


@njit(cache=True, fastmath=True, inline="always")
def hit(kind: int, p: Array, s: int, n: int, x: float, y: float) -> float:
    """Depth at which the ray (x, y, 1) enters the solid in row (s, n) of the table `p`; NO_HIT when it misses."""
    if kind == CAPSULE:
        dd = x * x + y * y + 1.0
        bard = p[s, n, 3] * x + p[s, n, 4] * y + p[s, n, 5]
        rdoa = -(p[s, n, 0] * x + p[s, n, 1] * y + p[s, n, 2])
        a = p[s, n, 6] * dd - bard * bard
        b = p[s, n, 6] * rdoa - p[s, n, 7] * bard
        h = b * b - a * p[s, n, 8]
        if h < 0.0:
            return NO_HIT
        t = (-b - math.sqrt(h)) / a if a > 1e-18 else 0.0
        along = p[s, n, 7] + t * bard
        if 0.0 < along < p[s, n, 6]:
            return t if t > 0.0 else NO_HIT
        if along <= 0.0:
            b = rdoa
            c = p[s, n, 9]
        else:
            b = rdoa - bard
            c = p[s, n, 10]
        h = b * b - dd * c
        if h <= 0.0:
            return NO_HIT
        t = (-b - math.sqrt(h)) / dd
        return t if t > 0.0 else NO_HIT
    dx = p[s, n, 0] * x + p[s, n, 1] * y + p[s, n, 2]
    dy = p[s, n, 3] * x + p[s, n, 4] * y + p[s, n, 5]
    dz = p[s, n, 6] * x + p[s, n, 7] * y + p[s, n, 8]
    a = dy * dy + dz * dz
    b = p[s, n, 10] * dy + p[s, n, 11] * dz
    h = b * b - a * (p[s, n, 10] * p[s, n, 10] + p[s, n, 11] * p[s, n, 11] - 1.0)
    if h <= 0.0:
        return NO_HIT
    root = math.sqrt(h)
    enter, leave = (-b - root) / a, (-b + root) / a
    slab = 1.0 / dx if dx != 0.0 else 1e18
    t1, t2 = (-1.0 - p[s, n, 9]) * slab, (1.0 - p[s, n, 9]) * slab
    enter = max(enter, min(t1, t2))
    return enter if 0.0 < enter < min(leave, max(t1, t2)) else NO_HIT


@njit(cache=True, fastmath=True, inline="always")
def lambert(kind: int, p: Array, s: int, n: int, x: float, y: float, t: float, light: Array) -> float:
    """Cosine, at least 0, between the surface normal at depth `t` on the ray and `light` (3,), a unit vector."""
    if kind == CAPSULE:
        along = (p[s, n, 7] + t * (p[s, n, 3] * x + p[s, n, 4] * y + p[s, n, 5])) / p[s, n, 6]
        along = min(max(along, 0.0), 1.0)
        nx = t * x - p[s, n, 0] - along * p[s, n, 3]
        ny = t * y - p[s, n, 1] - along * p[s, n, 4]
        nz = t - p[s, n, 2] - along * p[s, n, 5]
    else:
        u = p[s, n, 9] + t * (p[s, n, 0] * x + p[s, n, 1] * y + p[s, n, 2])
        v = p[s, n, 10] + t * (p[s, n, 3] * x + p[s, n, 4] * y + p[s, n, 5])
        w = p[s, n, 11] + t * (p[s, n, 6] * x + p[s, n, 7] * y + p[s, n, 8])
        if v * v + w * w < 0.999:
            side = 1.0 if u > 0.0 else -1.0
            nx, ny, nz = side * p[s, n, 0], side * p[s, n, 1], side * p[s, n, 2]
        else:
            nx = v * p[s, n, 3] + w * p[s, n, 6]
            ny = v * p[s, n, 4] + w * p[s, n, 7]
            nz = v * p[s, n, 5] + w * p[s, n, 8]
    norm = math.sqrt(nx * nx + ny * ny + nz * nz) + 1e-30
    cosine = (nx * light[0] + ny * light[1] + nz * light[2]) / norm
    return cosine if cosine > 0.0 else 0.0
