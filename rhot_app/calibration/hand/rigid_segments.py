"""Which markers keep their distance: rigid pairs, the bodies they make up, and markers that slipped on the way."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

RIGID_SD_M = 0.3e-3
"""A distance that varies by less than this beyond its noise is constant: skin on bones moves more than that whenever
the bones do."""

SLIP_M = 1.5e-3
"""The smallest step of a constant distance that is worth repeating the recording."""

_LEAST_SAMPLES = 60
_EDGE = 0.1  # of the recording: a step so near its ends is an outlier rather than a slip
_BLOCKS = 40
_STANDS_OUT = 4.0  # standard deviations of what is about each level
_MAD = 1.4826


@dataclass(frozen=True, slots=True)
class RigidPair:
    """Markers `first` and `second` (columns) stay `distance_m` apart, within `sd_m` (robust)."""

    first: int
    second: int
    distance_m: float
    sd_m: float


@dataclass(frozen=True, slots=True)
class Slip:
    """The distance of two markers was constant twice: `before_m` until `at_s`, `after_m` from then on."""

    first: int
    second: int
    at_s: float
    before_m: float
    after_m: float


def rigid_pairs(positions: Array, noise_m: float) -> list[RigidPair]:
    """All pairs of the M markers of tracks (T, M, 3) m that keep their distance, given the tracks' noise per axis."""
    found = []
    for first, second in zip(*np.triu_indices(positions.shape[1], 1), strict=True):
        distance = _distances(positions, int(first), int(second))
        if len(distance) < _LEAST_SAMPLES:
            continue
        middle = float(np.median(distance))
        sd = _MAD * float(np.median(np.abs(distance - middle)))
        spread = 0.25 * float(np.subtract(*np.percentile(distance, [97.5, 2.5])))  # a body that moves at times
        if max(sd, spread) ** 2 < 2.0 * noise_m ** 2 + RIGID_SD_M ** 2:
            found.append(RigidPair(int(first), int(second), middle, sd))
    return found


def rigid_bodies(pairs: list[RigidPair], markers: int) -> list[tuple[int, ...]]:
    """Groups of markers in which every pair is rigid, largest first; a marker is in one group at most."""
    rigid = np.zeros((markers, markers), dtype=bool)
    for pair in pairs:
        rigid[pair.first, pair.second] = rigid[pair.second, pair.first] = True
    bodies: list[tuple[int, ...]] = []
    left = set(range(markers))
    while True:
        grown = max((_grow(start, rigid, left) for start in left), key=len, default=())
        if len(grown) < 2:
            return bodies
        bodies.append(grown)
        left -= set(grown)


def find_slip(times_s: Array, positions: Array, first: int, second: int) -> Slip | None:
    """Where the distance of two markers that should be rigid steps from one constant value to another."""
    distance = np.linalg.norm(positions[:, first] - positions[:, second], axis=1)
    step = find_step(times_s, np.asarray(distance), SLIP_M)
    return None if step is None else Slip(first, second, *step)


def find_step(times_s: Array, values: Array, smallest: float) -> tuple[float, float, float] | None:
    """When values (N,) that should be constant step from one level to another, and both levels; NaN are left out.

    None when there is no step of at least `smallest` that stands out of their scatter.
    """
    seen = np.isfinite(values)
    times, values = times_s[seen], values[seen]
    if len(values) < _LEAST_SAMPLES:
        return None
    blocks = [float(np.median(part)) for part in np.array_split(values, _BLOCKS)]
    begins = [float(part[0]) for part in np.array_split(times, _BLOCKS)]
    edge = int(_EDGE * _BLOCKS)
    cut = min(range(edge, _BLOCKS - edge + 1), key=lambda k: _scatter(blocks[:k]) + _scatter(blocks[k:]))
    before, after = float(np.median(blocks[:cut])), float(np.median(blocks[cut:]))
    within = np.sqrt((_scatter(blocks[:cut]) + _scatter(blocks[cut:])) / _BLOCKS)
    if abs(after - before) < max(smallest, _STANDS_OUT * float(within)):
        return None
    return begins[cut], before, after


def _scatter(values: list[float]) -> float:
    """Sum of squares about the mean."""
    return float(np.var(values) * len(values))


def _distances(positions: Array, first: int, second: int) -> Array:
    distance = np.linalg.norm(positions[:, first] - positions[:, second], axis=1)
    return np.asarray(distance[np.isfinite(distance)])


def _grow(start: int, rigid: NDArray[np.bool_], among: set[int]) -> tuple[int, ...]:
    """The group that one marker makes up with those that are rigid with it and with each other, in order."""
    body = [start]
    for other in sorted(among - {start}):
        if all(rigid[other, member] for member in body):
            body.append(other)
    return tuple(sorted(body))
