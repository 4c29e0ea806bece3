"""How far the colours can be told apart: what share of one the detector takes for the other, by its own tables.

Lamps count as often as they may come: skin that a lamp at the end of the range turns orange is seldom mistaken.

Two decisions count. The search of the whole picture asks hue, magnitude and luma; what passes there can steal a
marker's name. The window of a tracked marker asks hue and half of the marker's level; what passes there and adjoins the
marker joins it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.colour.illuminant import LAMPS, Lamp, balanced, chances, relit
from rhot_app.calibration.colour.model import WINDOW_LEVEL
from rhot_app.calibration.colour.samples import PaintSamples
from rhot_node.detect.colour import Colours, directions, sector_table
from rhot_node.detect.search import ColourGate
from rhot_node.markers import MarkerSet

SKIN, ROOM = "skin", "room"
CHANCES = chances(LAMPS)
SHADES = (1.0, 0.8)  # of a marker's level: beside skin that faces the lamp it may be turned away and get 40 % less
PIXELS = 3000  # of each colour that are tried by every lamp


@dataclass(frozen=True, slots=True)
class Overlap:
    """`share` 0..1 of `other` (a marker, skin or the room) that is taken for `marker`, over all lamps that may come.

    `window`: whether the window of a tracked marker takes it; otherwise the search of the whole picture does. `lamp`:
    by which that is worst.
    """

    marker: str
    other: str
    share: float
    window: bool
    lamp: Lamp


@dataclass(frozen=True, slots=True)
class Separability:
    """All pairs. `coverage`: per marker, what share of its own paint passes by the lamp where that is least.

    `matrix` (M, M + others): share of the column's colour that is taken for the row's marker, over all lamps; the
    diagonal is coverage.
    """

    names: tuple[str, ...]
    others: tuple[str, ...]
    matrix: NDArray[np.float64]
    overlaps: tuple[Overlap, ...]

    @property
    def coverage(self) -> tuple[float, ...]:
        """Share of every marker's own paint that passes by the lamp where that is least."""
        return tuple(float(self.matrix[k, k]) for k in range(len(self.names)))

    def pair(self, first: str, second: str) -> float:
        """0..1: how far two colours overlap, whichever is taken for the other."""
        return max((one.share for one in self.overlaps if {one.marker, one.other} == {first, second}), default=0.0)

    @property
    def sentences(self) -> tuple[str, ...]:
        """Every pair that overlaps by half a percent or more, worst first: "orange and skin overlap by 18 %"."""
        pairs = {frozenset((one.marker, one.other)) for one in self.overlaps}
        ordered = sorted((sorted(pair, key=self._position) for pair in pairs), key=lambda pair: -self.pair(*pair))
        return tuple(f"{first} and {_article(second)} overlap by {100.0 * self.pair(first, second):.0f} %"
                     for first, second in ordered if self.pair(first, second) >= 0.005)

    def _position(self, name: str) -> int:
        return (*self.names, *self.others).index(name)


def _article(name: str) -> str:
    return "the room" if name == ROOM else name


class Judge:
    """The detector's decisions about single colours, for one marker set."""

    def __init__(self, markers: MarkerSet, levels: Sequence[float]) -> None:
        """`levels`: each marker's chroma magnitude by the lamp of the calibration, grey levels."""
        self._gate = ColourGate(markers)
        self._sector = sector_table(markers)
        self._directions = directions(markers)
        self._levels = np.asarray(levels, dtype=np.float64)

    def shares(self, colours: Colours, lamp: Lamp) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """(M,) shares of `colours`, by this lamp, that the search takes for each marker, and that its window would."""
        if not len(colours):
            return np.zeros(len(self._levels)), np.zeros(len(self._levels))
        colours = balanced(relit(colours[::max(1, len(colours) // PIXELS)], lamp), lamp.temperature_shift)
        u, v = _byte(colours[:, 1]), _byte(colours[:, 2])
        luma = colours[:, 0]
        found = self._gate.table[u, v].astype(np.int64)
        limits = self._gate.luma_limits[np.maximum(found - 1, 0)]
        found[(luma < limits[:, 0]) | (luma > limits[:, 1])] = 0
        sector = self._sector[u, v]
        along = self._directions @ colours[:, 1:].T.astype(np.float64)
        least = WINDOW_LEVEL * lamp.gains[1] * self._levels[:, None]
        numbers = np.arange(1, len(self._levels) + 1)[:, None]
        joining = np.mean([(sector == numbers) & (along >= shade * least) for shade in SHADES], axis=(0, 2))
        return np.mean(found == numbers, axis=1), joining


def judge_colours(markers: MarkerSet, samples: Sequence[PaintSamples], skin: Colours,
                  rooms: Sequence[Colours]) -> Separability:
    """How far the markers' paints, skin and the room can be told apart by all lamps.

    `samples` in the order of `markers`; `skin` (N, 3) Y, Cb, Cr, none when it is unknown; `rooms`: for every marker the
    colours around it, in pictures where it is known.
    """
    paints = [one.typical for one in samples]
    judge = Judge(markers, [float(np.median(np.hypot(paint[:, 1], paint[:, 2]))) for paint in paints])
    names = tuple(one.name for one in samples)
    others = ((SKIN,) if len(skin) else ()) + ((ROOM,) if any(len(room) for room in rooms) else ())
    touching = [*zip(names, paints, strict=True), *([(SKIN, skin)] if len(skin) else [])]
    searched, tracked = np.zeros((2, len(LAMPS), len(names), len(names) + len(others)))
    for row, lamp in enumerate(LAMPS):
        for column, (_, colours) in enumerate(touching):
            searched[row, :, column], tracked[row, :, column] = judge.shares(colours, lamp)
        for k, room in enumerate(rooms if ROOM in others else ()):  # nothing of the room adjoins a marker for long
            searched[row, k, -1] = judge.shares(room, lamp)[0][k]
    coverage = np.diagonal(searched, axis1=1, axis2=2).min(axis=0)
    overlaps = tuple(_overlap(marker, other, searched[:, k, column], tracked[:, k, column])
                     for k, marker in enumerate(names) for column, other in enumerate((*names, *others))
                     if marker != other)
    shares = {(one.marker, one.other): one.share for one in overlaps}
    matrix = np.array([[shares.get((marker, other), coverage[k]) for other in (*names, *others)]
                       for k, marker in enumerate(names)])
    return Separability(names, others, matrix, overlaps)


def _overlap(marker: str, other: str, searched: NDArray[np.float64], tracked: NDArray[np.float64]) -> Overlap:
    """`searched`, `tracked` (L,): what the search and the window take, by each of LAMPS."""
    by_search, by_window = float(CHANCES @ searched), float(CHANCES @ tracked)
    window = by_window > by_search
    worst = int(np.argmax(tracked if window else searched))
    return Overlap(marker, other, max(by_search, by_window), window, LAMPS[worst])


def _byte(chroma: NDArray[np.float32]) -> NDArray[np.intp]:
    return np.clip(np.rint(chroma) + 128.0, 0, 255).astype(np.intp)
