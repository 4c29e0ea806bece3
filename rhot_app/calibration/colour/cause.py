"""Why the detector does not find a marker in a picture, or flags it: the test that the marker does not pass.

Every cause is read from the detector's own tables, labels, blobs and measurements; no rule is repeated here.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.colour.paint_region import Mask, PaintRegion
from rhot_node.detect.colour import SECTOR_MAGNITUDE_MIN, Colours, colours_of, sector_table
from rhot_node.detect.fast import SEARCH_STEP, FastDetector
from rhot_node.detect.find import LARGEST
from rhot_node.detect.illuminant import Illuminant
from rhot_node.detect.image import YuvImage
from rhot_node.detect.search import AREA_MIN, Blob, ColourGate, Labels
from rhot_node.markers import MarkerSet
from rhot_node.wire.messages import CANDIDATES_MAX, MarkerFlag, MarkerObservation

Code = Literal["hue", "pale", "dark", "bright", "other", "small", "large", "joined", "thin", "rival", "crowded",
               "border", "hidden", "track"]

JOINED = 2.2  # of the marker's area: a larger blob includes something else
PASSING = 0.5  # of a marker's sample: if fewer pixels pass, the colour's bounds are the cause

_REMEDY: dict[Code, str] = {
    "hue": "Learn its colour anew in this light, or widen its hue.",
    "pale": "Give more light or use a more saturated paint; or lower its least colour.",
    "dark": "Give more light, a longer exposure or more gain.",
    "bright": "Shorten the exposure or lower the gain.",
    "other": "Use another paint for one of the two.",
    "small": "Go nearer, or paint a larger part of the finger.",
    "large": "Use a plainer background, or another paint.",
    "joined": "Put a grey border of some 3 mm round the marker, or use another paint.",
    "thin": "Paint a larger and even part of the finger, or go nearer.",
    "rival": "Take the other object away or cover it, or use another paint.",
    "crowded": "Use a plainer background, or another paint.",
    "border": "Keep the whole marker in the picture.",
    "hidden": "Turn the hand so that the whole marker is seen.",
    "track": "Move more slowly, or learn the colour anew.",
}


@dataclass(frozen=True, slots=True)
class Cause:
    """A test of the detector that a marker does not pass: `code` for programs, and a `sentence` with figures."""

    code: Code
    sentence: str

    @property
    def remedy(self) -> str:
        """What to do about it, a sentence."""
        return _REMEDY[self.code]


class Explainer:
    """Applies the detector's tests to single markers of one set. It holds buffers: one thread only."""

    def __init__(self, markers: MarkerSet) -> None:
        self._markers = markers.markers
        self._gate, self._sector, self._light = ColourGate(markers), sector_table(markers), Illuminant(markers)

    def why_lost(self, detector: FastDetector, image: YuvImage, seen: Sequence[MarkerObservation], index: int,
                 paint: Mapping[str, PaintRegion] | None = None) -> Cause:
        """Why `detector`, which has just returned `seen` for `image`, does not find marker `index`.

        `paint`: the known regions of markers in the picture, by id. Without the marker's own region the whole picture
        is tested for what comes nearest to the marker.
        """
        region = (paint or {}).get(self._markers[index].id)
        self._light.temperature_shift = detector.temperature_shift
        balanced = self._light.balanced(image)
        blob = self._blob(balanced, index, region)
        own = [mark for mark in seen if mark.index == index and mark.found]
        joined = None if blob is None else self._joined(own, blob, index, region, paint or {})
        if joined is not None:
            return joined
        if blob is None or (blob.area < AREA_MIN and region is not None):
            colour = self._colour(balanced, index, region)
            if colour is not None:
                return colour
        if blob is None or blob.area < AREA_MIN:
            return _small(blob, region, balanced)
        if blob.area >= LARGEST * image.u.size:
            return Cause("large", f"What has its colour {_at(blob)} is too large for a marker: "
                         f"{100 * blob.area / image.u.size:.0f} % of the picture, less than {100 * LARGEST:.0f} % is "
                         "taken.")
        near = region.whole if region is not None else _box(blob, image.u.shape)
        if not any(_inside(mark, near) for mark in detector.all_blobs(image)[index]):
            return Cause("thin", f"Its blob {_at(blob)} is a seam between two other colours, or too uneven to be "
                         f"measured: {4 * blob.area:.0f} px² without a pixel that is all paint.")
        if region is not None and any(_inside(mark, near) for mark in own):
            return self._colour(balanced, index, region, partly=True) or Cause(
                "hidden", "Only a part of it is found: the rest is hidden or of another colour.")
        if own:
            return self._rival(own, blob, index, image)
        return Cause("track", f"The search would take its blob {_at(blob)}; no track held it in this picture.")

    @staticmethod
    def why_second(seen: Sequence[MarkerObservation], index: int) -> Cause:
        """Why marker `index` is found, but another object of its colour is reported before it."""
        first = next(mark for mark in seen if mark.index == index)
        return Cause("rival", f"What is found first is at {first.x:.0f}, {first.y:.0f} and has {_area(first):.0f} px².")

    @staticmethod
    def doubt(seen: Sequence[MarkerObservation], index: int) -> Cause | None:
        """Why marker `index`, which was found, has a flag of doubt or rivals; None when it is in plain view."""
        first, *others = [mark for mark in seen if mark.index == index]
        if others:
            other = max(others, key=lambda mark: mark.diameter)
            return Cause("rival", f"{len(others)} more of its colour {'is' if len(others) == 1 else 'are'} in the "
                         f"picture, the largest at {other.x:.0f}, {other.y:.0f} ({_area(other):.0f} px²).")
        if first.flags & MarkerFlag.EDGE:
            return Cause("border", "It is cut by the picture's border.")
        if first.flags & MarkerFlag.PARTIAL:
            return Cause("hidden", "It is smaller than it was, or in pieces: a part of it is hidden.")
        if first.flags & MarkerFlag.AMBIGUOUS:
            return Cause("joined", "Something of its colour has come beside it.")
        return None

    def _blob(self, balanced: YuvImage, index: int, region: PaintRegion | None) -> Blob | None:
        """The largest blob of the marker's colour in `region`, found as in the search of a whole picture."""
        blobs = self._gate.blobs(balanced, [index], 1, SEARCH_STEP)
        if region is not None:
            own = self._gate.labels(balanced) == index + 1
            blobs = [blob for blob in blobs if (own & region.whole)[_slices(blob)].any()]
        return max(blobs, key=lambda blob: blob.area, default=None)

    def _colour(self, balanced: YuvImage, index: int, region: PaintRegion | None, partly: bool = False) -> Cause | None:
        """The colour test that the paint does not pass; None when most of it passes, with `partly` all of it."""
        labels, table = self._gate.labels(balanced), self._gate.table[balanced.u, balanced.v]
        sector, own = self._sector[balanced.u, balanced.v], index + 1
        if region is None:
            if (labels == own).any():
                return None
            for code, reached in (("luma", table == own), ("pale", (sector == own) & (table != own))):
                if reached.any():
                    return self._refusal(code, balanced, index, reached, labels)
            return Cause("hue", f"Nothing in the picture has its hue, {self._hue(index)}.")
        sample = region.sample
        if not sample.any() or np.mean(labels[sample] == own) >= (1.0 if partly else PASSING):
            return None
        refused = {"luma": sample & (table == own) & (labels != own), "other": sample & (table != own) & (table > 0),
                   "pale": sample & (sector == own) & (table == 0), "hue": sample & (sector != own) & (table == 0)}
        code = max(refused, key=lambda code: np.count_nonzero(refused[code]))
        return self._refusal(code, balanced, index, refused[code], table)

    def _refusal(self, code: str, balanced: YuvImage, index: int, where: Mask, labels: Labels) -> Cause:
        """The cause `code` with the figures of the pixels `where`."""
        colours, chroma = colours_of(balanced, where), self._markers[index].chroma
        luma, cb, cr = (float(part) for part in np.median(colours, axis=0))
        if code == "luma":
            dark = luma < 0.5 * (chroma.luma_min + chroma.luma_max)
            limit = f"at least {chroma.luma_min}" if dark else f"at most {chroma.luma_max}"
            return Cause("dark" if dark else "bright",
                         f"Its paint is too {'dark' if dark else 'bright'}: luma {luma:.0f}, {limit} is taken.")
        if code == "other":
            taken = self._markers[int(np.argmax(np.bincount(labels[where]))) - 1].id
            return Cause("other", f"Its paint is taken for {taken}, whose hue is nearer.")
        if code == "pale" or math.hypot(cb, cr) < SECTOR_MAGNITUDE_MIN:
            most = float(np.percentile(_magnitudes(colours), 95.0))
            return Cause("pale", f"Its paint is too pale or too dark: chroma up to {most:.0f}, from "
                         f"{chroma.magnitude_min:.0f} on is taken.")
        return Cause("hue", f"Its paint has another hue, {math.degrees(math.atan2(cr, cb)):.0f}°; {self._hue(index)} "
                     "is taken.")

    def _hue(self, index: int) -> str:
        chroma = self._markers[index].chroma
        return f"{math.degrees(chroma.hue_rad):.0f}° ± {chroma.hue_tolerance_deg:.0f}°"

    def _joined(self, own: Sequence[MarkerObservation], blob: Blob, index: int, region: PaintRegion | None,
                paint: Mapping[str, PaintRegion]) -> Cause | None:
        """The cause if the blob, or the observation made of it, is much larger than the marker."""
        if region is None:
            return None
        x, y = blob.centroid
        held = [mark for mark in own if math.hypot(mark.x - 2.0 * x, mark.y - 2.0 * y) < 0.5 * mark.diameter]
        area = max([0.25 * _area(mark) for mark in held] + [blob.area])
        if area <= JOINED * region.area:
            return None
        others = [name for name, one in paint.items()
                  if name != self._markers[index].id and one.sample[_slices(blob)].any()]
        what = f"with {others[0]}" if others else "with what adjoins it and has nearly its colour"
        return Cause("joined", f"It is found in one piece {what}: {4 * area:.0f} px², the marker has "
                     f"{4 * region.area:.0f} px².")

    def _rival(self, own: Sequence[MarkerObservation], blob: Blob, index: int, image: YuvImage) -> Cause:
        """The cause when another blob was taken for the marker: which one, and why."""
        other = own[0]
        if len(own) >= CANDIDATES_MAX:
            return Cause("crowded", f"{len(own)} other objects of its colour are likelier, the first at {other.x:.0f}, "
                         f"{other.y:.0f}; no more than {CANDIDATES_MAX} are followed.")
        why = "larger" if _area(other) > 4.0 * blob.area else "likelier by its hue and shape"
        cut = " The marker is cut by the picture's border." if blob.touches_border(image.u.shape) else ""
        return Cause("rival", f"Another blob of its colour at {other.x:.0f}, {other.y:.0f} is {why}: "
                     f"{_area(other):.0f} px², the marker has {4 * blob.area:.0f} px².{cut}")


def _small(blob: Blob | None, region: PaintRegion | None, image: YuvImage) -> Cause:
    count = 0.0 if blob is None else blob.area
    where = f" {_at(blob)}" if blob is not None else ""
    edges = [] if region is None else [region.whole[0], region.whole[-1], region.whole[:, 0], region.whole[:, -1]]
    if any(edge.any() for edge in edges) or (blob is not None and blob.touches_border(image.u.shape)):
        return Cause("border", f"It is cut by the picture's border: {4 * count:.0f} px² are left{where}, "
                     f"{4 * AREA_MIN} px² are needed.")
    return Cause("small", f"It is too small: the largest blob of its colour{where} has {4 * count:.0f} px², "
                 f"{4 * AREA_MIN} px² are needed.")


def _at(blob: Blob) -> str:
    x, y = blob.centroid
    return f"at {2.0 * x + 0.5:.0f}, {2.0 * y + 0.5:.0f}"


def _slices(blob: Blob) -> tuple[slice, slice]:
    return slice(int(blob.y_min), int(blob.y_max) + 1), slice(int(blob.x_min), int(blob.x_max) + 1)


def _box(blob: Blob, shape: tuple[int, ...]) -> Mask:
    mask = np.zeros(shape, dtype=np.bool_)
    mask[_slices(blob)] = True
    return mask


def _inside(mark: MarkerObservation, where: Mask) -> bool:
    height, width = where.shape
    return bool(where[min(max(int(mark.y) // 2, 0), height - 1), min(max(int(mark.x) // 2, 0), width - 1)])


def _area(mark: MarkerObservation) -> float:
    """Area of a marker, luma px^2."""
    return 0.25 * math.pi * mark.diameter**2


def _magnitudes(colours: Colours) -> NDArray[np.float32]:
    return np.asarray(np.hypot(colours[:, 1], colours[:, 2]))
