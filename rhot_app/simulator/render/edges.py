"""Which pixels of a traced image must be sampled again: those near a change of what their centres show (numba)."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.simulator.render.body import REST_GROUP

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

SKIN_ID, PAINT_ID = 1, 20
"""What a pixel shows: 0 background, then skin of the hand and of the forearm (its far end sweeps far), tape and bands
in other colours than a marker's, then markers."""

STILL_PX = 0.02  # what moves less while exposed is taken to stand still


@njit(cache=True, inline="always")
def id_of(meta: Indices, n: int) -> int:
    """What a pixel shows where solid `n` is: `meta` (N, 3) kind, group, marker."""
    if meta[n, 2] >= 0:
        return PAINT_ID + meta[n, 2]
    return SKIN_ID + meta[n, 0] + (2 if meta[n, 1] == REST_GROUP else 0)


@njit(cache=True)
def reach_by_id(meta: Indices, sweep: Array) -> Indices:
    """(128, 2) px around a change of id, by id, that the exposure may sweep."""
    reach = np.zeros((128, 2), np.int64)
    for n in range(len(meta)):
        code = id_of(meta, n)
        for axis in range(2):
            pixels = math.ceil(0.5 * sweep[n, axis]) if sweep[n, axis] > STILL_PX else 0
            reach[code, axis] = max(reach[code, axis], pixels)
    return reach


@njit(cache=True)
def mark_edges(ids: NDArray[np.int8], edges: NDArray[np.uint8], rows: Indices, top: int, bottom: int,
                reach: Indices) -> None:
    """Mark in `edges` (H, W) what lies within a body's `reach` (codes, 2) px of a border between two of `ids` (H, W).

    `rows` (H, 2): first and last column of each row in which anything is; rows from `top` to before `bottom` count.
    """
    height, width = ids.shape
    for y in range(max(top - 1, 0), bottom):
        below = min(y + 1, height - 1)
        left, right = min(rows[y, 0], rows[below, 0]), max(rows[y, 1], rows[below, 1])
        for x in range(max(left - 1, 0), right):
            here, beside, under = ids[y, x], ids[y, min(x + 1, width - 1)], ids[below, x]
            if here == beside and here == under:
                continue
            wide = max(reach[here, 0], reach[beside, 0], reach[under, 0])
            high = max(reach[here, 1], reach[beside, 1], reach[under, 1])
            to_x = x + wide + 2 if here != beside else x + wide + 1
            to_y = y + high + 2 if here != under else y + high + 1
            for j in range(max(y - high, 0), min(to_y, height)):
                for i in range(max(x - wide, 0), min(to_x, width)):
                    edges[j, i] = 1
