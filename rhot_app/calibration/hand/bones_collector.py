"""Collects the minute of movement and says which fingers have moved enough; finds rigid pairs of markers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.hand.marker_places import DISTAL, MarkerPlace, MarkerTracks
from rhot_app.hand.skeleton import FINGERS

Array = NDArray[np.float64]

SWEEPS = 3
"""So often each finger shall bend and stretch."""

LEAST_S = 30.0
"""So long all markers shall have been in sight together, even when every finger has moved."""

GAP_S = 0.5
"""An instant counts until the next one, at most so long: cameras of two pictures a second are slow, not blind."""

BENT_PART = 0.75
THUMB_BENT_PART = 0.9
"""A finger has bent when its tip is nearer to the palm than this part of its farthest; the thumb is shorter."""

STRETCHED_PART = 0.93
_SEEN_PART = 0.8  # of the markers: an instant that shows fewer does not count


@dataclass(frozen=True, slots=True)
class FingerProgress:
    """How often a finger bent and stretched; `seen` False when it has no marker at its end."""

    finger: str
    sweeps: int
    seen: bool

    @property
    def fraction(self) -> float:
        """0..1."""
        return min(self.sweeps / SWEEPS, 1.0) if self.seen else 1.0


@dataclass(frozen=True, slots=True)
class BonesProgress:
    """Where the collection stands: `fraction` 0..1, and the `sentence` that says what to do next."""

    fingers: tuple[FingerProgress, ...]
    seconds: float
    fraction: float
    sentence: str

    @property
    def done(self) -> bool:
        """Whether everything has moved enough."""
        return self.fraction >= 1.0


class BonesCollector:
    """Feed it every instant; it keeps them all. For a live wizard and for files alike."""

    def __init__(self, places: tuple[MarkerPlace, ...]) -> None:
        self._places = places
        self._times: list[float] = []
        self._positions: list[Array] = []
        self._palm = [k for k, place in enumerate(places) if place.on_palm]
        self._sweeps = [_Sweep(next((k for k, place in enumerate(places)
                                     if place.finger == finger and place.segment == DISTAL), None),
                               THUMB_BENT_PART if finger == 0 else BENT_PART) for finger in range(5)]
        self._together_s = 0.0

    def add(self, t_s: float, positions: Array) -> None:
        """Take one instant: `positions` (M, 3) m in the order of the places, NaN where a marker is not seen."""
        seen = np.isfinite(positions[:, 0])
        if self._times and seen.mean() >= _SEEN_PART:
            self._together_s += min(max(t_s - self._times[-1], 0.0), GAP_S)
        self._times.append(t_s)
        self._positions.append(np.array(positions, dtype=np.float64))
        palm = positions[self._palm][seen[self._palm]] if self._palm else positions[seen]
        if len(palm):
            for sweep in self._sweeps:
                sweep.add(positions, palm.mean(axis=0))

    @property
    def progress(self) -> BonesProgress:
        """How far it is."""
        fingers = tuple(FingerProgress(name, sweep.count, sweep.marker is not None)
                        for name, sweep in zip(FINGERS, self._sweeps, strict=True))
        fraction = float(np.mean([min(self._together_s / LEAST_S, 1.0), *(finger.fraction for finger in fingers)]))
        return BonesProgress(fingers, self._together_s, fraction, self._sentence(fingers))

    @property
    def tracks(self) -> MarkerTracks:
        """Everything so far."""
        return MarkerTracks(np.array(self._times), np.array(self._positions).reshape(-1, len(self._places), 3),
                            self._places)

    def _sentence(self, fingers: tuple[FingerProgress, ...]) -> str:
        least = min(fingers, key=lambda finger: finger.fraction)
        if least.fraction < 1.0:
            which = "thumb" if least.finger == "thumb" else f"{least.finger} finger"
            return f"Bend and stretch the {which} fully: {least.sweeps} of {SWEEPS} times done."
        if self._together_s < LEAST_S:
            return "Move all fingers freely and turn the hand, with every marker in sight."
        return "Every finger has moved enough."


class _Sweep:
    """Counts how often one fingertip comes near the palm and goes away again."""

    def __init__(self, marker: int | None, bent_part: float) -> None:
        self.marker = marker
        self.count = 0
        self._bent_part = bent_part
        self._farthest = 0.0
        self._bent = False

    def add(self, positions: Array, palm: Array) -> None:
        """Look at one instant."""
        if self.marker is None or not np.isfinite(positions[self.marker, 0]):
            return
        distance = float(np.linalg.norm(positions[self.marker] - palm))
        self._farthest = max(self._farthest, distance)
        if distance < self._bent_part * self._farthest:
            self._bent = True
        elif self._bent and distance > STRETCHED_PART * self._farthest:
            self._bent = False
            self.count += 1


# -- rigid pairs of markers --------------------------------------------------------------------------------------------

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
