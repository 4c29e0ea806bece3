"""Collect samples of the markers' paint: from a click or a box at first, then by following the moving markers.

One picture shows a paint in one place, at one angle to the lamp. What is learnt from many covers shading and position,
and one finger over the marker or a glint in one frame counts for little.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import cast

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.colour.paint_region import (
    PaintRegion,
    Point,
    hue_of,
    hues_spread_deg,
    only,
    polar,
    region_at,
    region_in,
    region_of,
    touched,
)
from rhot_app.errors import CalibrationError
from rhot_node.detect.colour import SAMPLES_MIN, Box, Colours, colours_of, learn_chroma_from_colours
from rhot_node.detect.fast import DOUBTFUL, FastDetector
from rhot_node.detect.illuminant import RGB_FROM_YCC
from rhot_node.detect.image import YuvImage
from rhot_node.errors import SettingsError
from rhot_node.markers import Marker, MarkerSet
from rhot_node.wire.messages import MarkerFlag, MarkerObservation

PIXELS_A_FRAME = 300  # of one marker: every frame weighs about the same
FRAMES_MOST = 60  # of one marker; enough places and angles
FRAMES_ENOUGH = 10
VIEWS_MOST = 12  # pictures kept to search the room in
MOVED = 0.5  # diameters from every place seen so far: another place
TURNED = 1.12  # ratio of areas or of levels to what was seen there: another angle or light
GROWN = 2.0  # of the area since it was seen last: no marker comes so near at once


@dataclass(frozen=True, slots=True)
class PaintSamples:
    """Pixels of one marker's paint.

    `colours` (N, 3): Y, Cb, Cr, chroma minus 128. `frame` (N,): which picture each is from. `box` (N,): which click or
    box of a person each lies in, -1 where the marker was followed. `area`: how large the marker is in the pictures,
    median, chroma px.
    """

    name: str
    colours: Colours
    frame: NDArray[np.int32]
    box: NDArray[np.int32]
    area: float

    @property
    def frames(self) -> int:
        """How many pictures they are from."""
        return len(np.unique(self.frame))

    @property
    def rgb(self) -> tuple[int, int, int]:
        """The paint's median colour, 0..255."""
        red, green, blue = np.clip(np.rint(RGB_FROM_YCC @ np.median(self.colours, axis=0)), 0, 255).astype(int)
        return int(red), int(green), int(blue)

    @property
    def typical(self) -> Colours:
        """The paint without glints, edges and whatever else lies in a box: hue and chroma are near the median of all,
        or of the same box: a person says that it is this paint, in whatever light."""
        kept = _near_median(self.colours)
        for number in np.unique(self.box[self.box >= 0]):
            own = np.flatnonzero(self.box == number)
            kept[own] |= _near_median(self.colours[own])
        return self.colours[kept]

    @property
    def spread_deg(self) -> float:
        """By how much the hues of what a person has shown differ, degrees."""
        return hues_spread_deg([np.median(self.colours[self.box == number, 1:], axis=0)
                                for number in np.unique(self.box[self.box >= 0])])


@dataclass(frozen=True, slots=True)
class MarkedPicture:
    """A picture and the markers that are known in it, by name."""

    image: YuvImage
    paint: dict[str, PaintRegion] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class _Observation:
    """One picture's share of a marker's samples."""

    picture: int
    colours: Colours
    box: NDArray[np.int32]
    x: float
    y: float
    area: float
    level: float


class ColourSamples:
    """Gathers samples for any number of markers, picture by picture. Pictures given to it must not change later.

    `add` names a marker in a picture; `follow` finds the named ones in further pictures by the real detector and takes
    what adds something: another place, another angle, another light.
    """

    def __init__(self) -> None:
        self._observations: dict[str, list[_Observation]] = {}
        self._views: list[MarkedPicture] = []
        self._pictures = self._boxes = 0
        self._last: YuvImage | None = None
        self._detector: FastDetector | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Markers that have samples, in the order in which they were named."""
        return tuple(self._observations)

    @property
    def views(self) -> tuple[MarkedPicture, ...]:
        """Pictures that were kept to search the room in."""
        return tuple(self._views)

    @property
    def samples(self) -> tuple[PaintSamples, ...]:
        """What has been gathered, one per marker."""
        return tuple(PaintSamples(
            name=name, colours=np.concatenate([one.colours for one in observations]),
            frame=np.concatenate([np.full(len(one.colours), one.picture, np.int32) for one in observations]),
            box=np.concatenate([one.box for one in observations]),
            area=float(np.median([one.area for one in observations])))
            for name, observations in self._observations.items())

    def pictures(self, name: str) -> int:
        """From how many pictures a marker's samples are."""
        return len(self._observations.get(name, []))

    def variety(self, name: str) -> float:
        """0..1: how much of a marker has been seen; 1 from FRAMES_ENOUGH pictures on that each showed something new."""
        return min(1.0, len(self._observations.get(name, [])) / FRAMES_ENOUGH)

    def add(self, name: str, image: YuvImage, where: Box | Point | Sequence[Box]) -> PaintRegion:
        """Samples of the marker `name` at a click (x, y) or in boxes (x0, y0, x1, y1), luma px, upper ends exclusive.

        Returns what is taken for its paint, to be shown. Raises CalibrationError when there is no colour, so much of it
        that it cannot be a marker, or boxes on different paints.
        """
        try:
            region = _region(image, where)
            learn_chroma_from_colours(colours_of(image, region.sample))
        except (SettingsError, CalibrationError) as exc:
            raise CalibrationError(f"{name}: {exc}") from exc
        self._make_room()
        self._keep(image, {name: region}, [cast(Box, box) for box in where] if isinstance(where[0], tuple) else [])
        self._detector = None
        return region

    def follow(self, image: YuvImage) -> dict[str, PaintRegion]:
        """Find the named markers in a picture of a stream and take samples where they show something new.

        Returns the markers of which samples were taken. Half-hidden and doubtful ones are left out; that something else
        has a marker's colour is no doubt where the size tells them apart.
        """
        if not self._observations:
            return {}
        detector = self._follower()
        found, taken = detector.detect(image), {}
        for index, name in enumerate(self.names):
            seen = found[index]
            if seen.found and len(self._observations[name]) < FRAMES_MOST and self._plain(name, index, found):
                inside = detector.paint_mask(image, seen)
                if np.count_nonzero(inside) < SAMPLES_MIN:
                    continue
                region = region_of(inside)
                if self._adds(name, _observation(0, image, region, -1)):
                    taken[name] = region
        if taken:
            self._keep(image, taken)
        return taken

    def keep_view(self, image: YuvImage) -> None:
        """Keep a picture to search the room in, whether or not it shows a marker that anybody named."""
        if len(self._views) < VIEWS_MOST and all(view.image is not image for view in self._views):
            self._views.append(MarkedPicture(image))

    def forget(self, name: str) -> None:
        """Drop a marker's samples."""
        self._observations.pop(name, None)
        for view in self._views:
            view.paint.pop(name, None)
        self._detector = None

    def _follower(self) -> FastDetector:
        """The real detector, with what is known so far; learnt anew only when somebody names a marker.

        It is shown the last named markers alone at first: what else has their colours is not what to follow.
        """
        if self._detector is None:
            self._detector = FastDetector(MarkerSet(markers=tuple(
                Marker(id=f"m{k}", chroma=learn_chroma_from_colours(paint.colours), display_rgb=paint.rgb)
                for k, paint in enumerate(self.samples))))
            named = next(view for view in reversed(self._views) if view.paint)
            self._detector.detect(only(named.image, np.any([one.whole for one in named.paint.values()], axis=0)))
        return self._detector

    def _plain(self, name: str, index: int, found: Sequence[MarkerObservation]) -> bool:
        """Whether the first candidate of a marker is in plain view, and the only one of about its size."""
        others = [mark for mark in found[len(self.names):] if mark.index == index]
        expected = self._observations[name][-1].area
        if any(1.0 / GROWN < math.pi * (0.25 * mark.diameter) ** 2 / expected < GROWN for mark in others):
            return False
        return not found[index].flags & (DOUBTFUL & ~MarkerFlag.AMBIGUOUS if others else DOUBTFUL)

    def _adds(self, name: str, new: _Observation) -> bool:
        if not 1.0 / GROWN < new.area / self._observations[name][-1].area < GROWN:
            return False  # something else of that colour
        diameter = math.sqrt(4.0 / math.pi * new.area)
        for old in self._observations[name]:
            near = math.hypot(new.x - old.x, new.y - old.y) < MOVED * diameter
            if near and max(new.area / old.area, old.area / new.area) < TURNED \
                    and max(new.level / old.level, old.level / new.level) < TURNED:
                return False
        return True

    def _make_room(self) -> None:
        """A picture in which somebody names a marker is kept in any case: one goes whose markers others show too."""
        if len(self._views) == VIEWS_MOST:
            shown = [name for view in self._views for name in view.paint]
            spare = next((view for view in self._views if all(shown.count(name) > 1 for name in view.paint)),
                         self._views[0])
            self._views = [view for view in self._views if view is not spare]

    def _keep(self, image: YuvImage, regions: dict[str, PaintRegion], boxes: Sequence[Box] | None = None) -> None:
        """`boxes`: in which a person has shown the only region, none for a click; None where it was followed."""
        if image is not self._last:
            self._pictures += 1
            self._last = image
        for name, region in regions.items():
            first = -1 if boxes is None else self._boxes
            new = _observation(self._pictures, image, region, first, boxes or ())
            self._boxes = max(self._boxes, int(new.box.max()) + 1)
            self._observations.setdefault(name, []).append(new)
        self.keep_view(image)
        for view in self._views:
            if view.image is image:
                view.paint.update(regions)


def _region(image: YuvImage, where: Box | Point | Sequence[Box]) -> PaintRegion:
    if isinstance(where[0], tuple):
        return region_in(image, [cast(Box, box) for box in where])
    return region_at(image, cast(Point, where)) if len(where) == 2 else region_in(image, [cast(Box, where)])


def _observation(picture: int, image: YuvImage, region: PaintRegion, first: int,
                 boxes: Sequence[Box] = ()) -> _Observation:
    """What a region adds. Several `boxes`, numbered from `first`, weigh the same, however large each is."""
    colours = colours_of(image, region.sample)
    rows, columns = np.nonzero(region.sample)
    level = float(np.hypot(*np.median(colours[:, 1:], axis=0)))
    parts = [np.flatnonzero(touched(image, [box])[region.sample]) for box in boxes] if len(boxes) > 1 else \
        [np.arange(len(colours))[::max(1, len(colours) // PIXELS_A_FRAME)]]
    each = min(max(map(len, parts)), PIXELS_A_FRAME // len(parts) + 1)
    if len(parts) > 1:
        parts = [part[np.linspace(0, len(part) - 1, each).astype(int)] for part in parts if len(part)]
    return _Observation(picture, np.concatenate([colours[part] for part in parts]),
                        np.concatenate([np.full(len(part), first + k if first >= 0 else -1, np.int32)
                                        for k, part in enumerate(parts)]),
                        float(columns.mean()), float(rows.mean()), region.area, level)


def _near_median(colours: Colours) -> NDArray[np.bool_]:
    """(N,) whether a colour's hue and chroma are near those of the median."""
    hue, magnitude, level = polar(colours, hue_of(np.median(colours[:, 1:], axis=0)))
    spread = 1.4826 * float(np.median(np.abs(hue)))
    return np.asarray((np.abs(hue) <= max(5.0 * spread, 12.0)) & (magnitude >= 0.3 * level))
