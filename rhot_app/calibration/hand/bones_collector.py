"""Collects the minute of movement, and says all the time which fingers have moved enough and what to do next."""

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

BENT_PART = 0.75
THUMB_BENT_PART = 0.9
"""A finger has bent when its tip is nearer to the palm than this part of its farthest; the thumb is shorter."""

STRETCHED_PART = 0.93
_SIGHT_PART = 0.8  # of the markers: an instant that shows fewer does not count


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
        if self._times and seen.mean() >= _SIGHT_PART:
            self._together_s += min(max(t_s - self._times[-1], 0.0), 0.2)
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
