"""What part of each marker other parts of the hand hide, by a few rays instead of a picture (numba)."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.simulator.raycast import PREPARED, hit, prepare

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

_RINGS = (0, 6, 12)  # rays at the centre, and on rings about it


def spots() -> Array:
    """(K, 2) places that cover the unit disc evenly."""
    places = [(0.0, 0.0)]
    for ring, count in enumerate(_RINGS[1:], start=1):
        radius = 0.92 * ring / (len(_RINGS) - 1)
        angles = 2.0 * np.pi * (np.arange(count) + 0.5 * ring) / count
        places += list(zip(radius * np.cos(angles), radius * np.sin(angles), strict=True))
    return np.array(places)


@njit(cache=True)
def visible_parts(solids: Indices, sizes: Array, placed: Array, own: Indices, discs: Array, places: Array,
                  seen: Array) -> None:
    """Fill `seen` (F, M, 3): the visible part 0..1 of each marker's disc and the middle of what is visible of it.

    `solids` (N, 2): kind and group, `sizes` (N, 3) m, `placed` (F, N, 12) in the camera's frame, as in `HandBody`.
    `own` (M,): the group that does not hide the marker: its own finger. `discs` (F, M, 6): normalised x and y of the
    middle, normalised radius, depth m, and normalised x and y of by how much the disc is drawn out to either side, as
    that of a capsule is; `places` (K, 2) in the unit disc. A disc that is NaN is not visible.
    """
    table = np.empty((1, solids.shape[0], PREPARED))
    for f in range(placed.shape[0]):
        for n in range(solids.shape[0]):
            prepare(solids[n, 0], placed[f, n], sizes, table, 0, n)
        for m in range(own.shape[0]):
            x0, y0, radius, depth, along_x, along_y = discs[f, m]
            out = math.hypot(along_x, along_y)
            if out > 0.0:
                along_x, along_y = along_x / out, along_y / out
            count, sum_x, sum_y = 0, 0.0, 0.0
            for k in range(places.shape[0]):
                drawn = out * (places[k, 0] * along_x + places[k, 1] * along_y)
                x = x0 + radius * places[k, 0] + drawn * along_x
                y = y0 + radius * places[k, 1] + drawn * along_y
                free = x == x
                for n in range(solids.shape[0]):
                    if free and solids[n, 1] != own[m] and hit(solids[n, 0], table, 0, n, x, y) < depth:
                        free = False
                if free:
                    count += 1
                    sum_x += x
                    sum_y += y
            seen[f, m, 0] = count / places.shape[0]
            seen[f, m, 1] = sum_x / count if count else np.nan
            seen[f, m, 2] = sum_y / count if count else np.nan
