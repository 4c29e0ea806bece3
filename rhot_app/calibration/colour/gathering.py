"""Gather samples of the markers' paint from all cameras of a rig: a person names a marker in one, the others follow.

What a person says is kept as picks, so that each can be taken back. A marker that was named in one camera's picture is
looked for in those of the others, and taken there when it is found plainly and is of about the same size.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import zip_longest

import numpy as np

from rhot_app.calibration.colour.colours import NO_COLOURS
from rhot_app.calibration.colour.paint_region import PaintRegion, Point, region_at
from rhot_app.calibration.colour.samples import GROWN, ColourSamples, MarkedPicture, PaintSamples
from rhot_app.calibration.colour.separability import SKIN
from rhot_app.errors import CalibrationError
from rhot_node.detect.colour import SAMPLES_MIN, Box, Colours, box_mask, colours_of, learn_chroma_from_colours
from rhot_node.detect.fast import DOUBTFUL, FastDetector
from rhot_node.detect.image import YuvImage
from rhot_node.markers import ChromaModel, Marker, MarkerSet
from rhot_node.wire.messages import MarkerFlag

SKIN_HALF_PX = 8  # of the box that a click on skin stands for


@dataclass(frozen=True, slots=True, eq=False)
class Pick:
    """What a person has said: this is the paint of `name` (or bare skin), at a click or in a box, luma px. `chroma`:
    what that paint is like."""

    name: str
    camera: str
    image: YuvImage
    where: Box | Point
    chroma: ChromaModel | None = None


class ColourGathering:
    """Samples by marker over all `cameras`. Pictures given to it must not change later.

    `revision` counts every change of what was gathered.
    """

    def __init__(self, cameras: Sequence[str]) -> None:
        self._collectors = {name: ColourSamples() for name in cameras}
        self._picks: list[Pick] = []
        self._scouts: dict[str, FastDetector] = {}
        self.revision = 0

    @property
    def names(self) -> tuple[str, ...]:
        """Markers that a person has named, in the order in which that was done."""
        return tuple(dict.fromkeys(pick.name for pick in self._picks if pick.name != SKIN))

    @property
    def earlier(self) -> dict[str, tuple[ChromaModel, ...]]:
        """What each marker was said to look like before a later pick in the same picture replaced that."""
        last = {(pick.name, pick.camera): pick for pick in self._picks}
        return {name: tuple(pick.chroma for pick in self._picks if pick.name == name and pick.chroma is not None
                            and last[name, pick.camera] is not pick) for name in self.names}

    def last_pick(self, name: str) -> int:
        """Which of all picks was the last one of a marker, counted from 0."""
        return max(number for number, pick in enumerate(self._picks) if pick.name == name)

    def unseen_by(self, camera: str) -> tuple[str, ...]:
        """Markers that a person has named in another camera's picture, and that were not found in this one's."""
        return tuple(name for name in self.names if name not in self._collectors[camera].names)

    @property
    def skin(self) -> Colours:
        """(N, 3) Y, Cb, Cr of bare skin."""
        return np.concatenate([NO_COLOURS, *(colours_of(pick.image, box_mask(pick.image, [_box(pick.where)]))
                                             for pick in self._picks if pick.name == SKIN)])

    @property
    def samples(self) -> tuple[PaintSamples, ...]:
        """What all cameras have given, one per marker."""
        by_name: dict[str, list[PaintSamples]] = {name: [] for name in self.names}
        for collector in self._collectors.values():
            for one in collector.samples:
                by_name[one.name].append(one)
        return tuple(_joined(own) for own in by_name.values() if own)

    @property
    def views(self) -> tuple[MarkedPicture, ...]:
        """Pictures to search the room in, of the cameras in turn."""
        turns = zip_longest(*(collector.views for collector in self._collectors.values()))
        return tuple(view for turn in turns for view in turn if view is not None)

    def pictures(self, name: str) -> int:
        """From how many pictures a marker's samples are."""
        return sum(collector.pictures(name) for collector in self._collectors.values())

    def variety(self, name: str) -> float:
        """0..1: how much of a marker has been seen, by the camera that has seen most of it."""
        return max((collector.variety(name) for collector in self._collectors.values()), default=0.0)

    @property
    def enough(self) -> bool:
        """Whether every marker named so far was seen at enough places and angles."""
        return bool(self.names) and all(self.variety(name) >= 1.0 for name in self.names)

    def pick(self, name: str, camera: str, image: YuvImage, where: Box | Point) -> None:
        """This is the paint of `name`, or bare skin (`separability.SKIN`): a click (x, y) or a box, luma px.

        Replaces what was gathered for the marker before. Raises CalibrationError, nothing has changed then, when there
        is no colour, or so much of it that it cannot be a marker.
        """
        chroma = None
        if name == SKIN:
            if np.count_nonzero(box_mask(image, [_box(where)])) < SAMPLES_MIN:
                raise CalibrationError("skin: the box is too small; draw it over more of the hand.")
        else:
            region = ColourSamples().add(name, image, where)
            chroma = learn_chroma_from_colours(colours_of(image, region.sample))
        self._picks.append(Pick(name, camera, image, where, chroma))
        self._renew(name)

    def take_back(self) -> str | None:
        """Undo the last pick; the name it was for, None when there was none."""
        if not self._picks:
            return None
        name = self._picks.pop().name
        self._renew(name)
        return name

    def follow(self, images: Mapping[str, YuvImage]) -> dict[str, dict[str, PaintRegion]]:
        """Look for the named markers in new pictures by camera; the regions of which samples were taken."""
        taken: dict[str, dict[str, PaintRegion]] = {}
        for camera, image in images.items():
            found = self._collectors[camera].follow(image) | self._adopt(camera, image)
            if found:
                taken[camera] = found
                self.revision += 1
        return taken

    def _renew(self, name: str) -> None:
        """Gather a marker anew from what a person has said of it: for each camera, what was said last."""
        self.revision += 1
        self._scouts = {}
        if name == SKIN:
            return
        last = {pick.camera: pick for pick in self._picks if pick.name == name}
        for camera, collector in self._collectors.items():
            collector.forget(name)
            if camera in last:
                collector.add(name, last[camera].image, last[camera].where)

    def _adopt(self, camera: str, image: YuvImage) -> dict[str, PaintRegion]:
        """Take over from the other cameras the markers that were not named in this one."""
        collector = self._collectors[camera]
        missing = [name for name in self.names if name not in collector.names]
        if not missing:
            return {}
        samples = self.samples
        if camera not in self._scouts:
            self._scouts[camera] = FastDetector(MarkerSet(markers=tuple(
                Marker(id=f"m{k}", chroma=learn_chroma_from_colours(one.colours), display_rgb=one.rgb)
                for k, one in enumerate(samples))))
        found = {}
        seen = self._scouts[camera].detect(image)
        for index, one in enumerate(samples):
            candidates = [mark for mark in seen if mark.index == index and mark.found]
            doubtful = DOUBTFUL if len(candidates) < 2 else DOUBTFUL & ~MarkerFlag.AMBIGUOUS
            places = [(mark.x, mark.y) for mark in candidates if not mark.flags & doubtful]
            regions = [(place, _plain_region(image, place)) for place in places if one.name in missing]
            fitting = [place for place, region in regions
                       if region is not None and 1.0 / GROWN < region.area / one.area < GROWN]
            if len(fitting) == 1:  # of two of its colour and size, nobody knows which it is
                found[one.name] = collector.add(one.name, image, fitting[0])
        return found


def _plain_region(image: YuvImage, at: Point) -> PaintRegion | None:
    try:
        return region_at(image, at)
    except CalibrationError:
        return None


def _box(where: Box | Point) -> Box:
    if len(where) == 4:
        return where
    x, y = round(where[0]), round(where[1])
    return x - SKIN_HALF_PX, y - SKIN_HALF_PX, x + SKIN_HALF_PX, y + SKIN_HALF_PX


def _joined(own: list[PaintSamples]) -> PaintSamples:
    """One marker as several cameras have seen it; their pictures are numbered on."""
    frames, boxes, first, shown = [], [], 0, 0
    for one in own:
        frames.append(one.frame + np.int32(first))
        boxes.append(np.where(one.box < 0, one.box, one.box + np.int32(shown)))
        first, shown = first + int(one.frame.max()) + 1, shown + int(one.box.max()) + 1
    return PaintSamples(own[0].name, np.concatenate([one.colours for one in own]), np.concatenate(frames),
                        np.concatenate(boxes), float(np.mean([one.area for one in own])))
