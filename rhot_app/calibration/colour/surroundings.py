"""What else in the room has the markers' colours: its hues, and what each marker's gate lets through."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.colour.paint_region import Mask, only
from rhot_app.calibration.colour.samples import MarkedPicture
from rhot_node.detect.colour import Colours, colours_of
from rhot_node.detect.image import YuvImage
from rhot_node.detect.search import ColourGate
from rhot_node.markers import Marker, MarkerSet

HUE_STEP_DEG = 5
HUE_BINS = 360 // HUE_STEP_DEG
ROOM_MAGNITUDE = 14.0  # grey levels of chroma; less is a shade of grey
ROOM_PIXELS = 20000  # of all pictures that models are tried on


@dataclass(frozen=True, slots=True)
class Rival:
    """The thing outside the marker that its gate would rather take than any other.

    `picture`: index of the view. `x`, `y`: its centre, luma px. `area_px`: its size, `passing_px`: all that passes,
    luma px^2. `merit`: as the detector's search ranks it, as a fraction of the marker's own in that picture: above 1 it
    is taken for the marker.
    """

    marker: str
    picture: int
    x: float
    y: float
    area_px: float
    passing_px: float
    merit: float


@dataclass(frozen=True, slots=True)
class SurroundingsResult:
    """`hue_px` (72,): chroma pixels per picture outside all markers by hue, from -180 degrees on in steps of 5.

    `rivals`: per marker the worst of all pictures that show it, None when nothing passes.
    """

    hue_px: NDArray[np.float64]
    rivals: tuple[Rival | None, ...]


@dataclass(frozen=True, slots=True)
class SurroundingColours:
    """Coloured things round a marker: `colours` (N, 3) Y, Cb, Cr, each of which stands for `weight` chroma pixels of a
    picture, in a room of `size` chroma pixels, grey ones included."""

    colours: Colours
    weight: float
    size: float


def survey_surroundings(markers: MarkerSet, names: Sequence[str], views: Sequence[MarkedPicture]) -> SurroundingsResult:
    """Search the pictures outside the markers. `names`: of the markers, in the order of the set."""
    gate = ColourGate(markers)
    histogram = np.zeros(HUE_BINS)
    rivals: list[Rival | None] = [None] * len(names)
    for picture, view in enumerate(views):
        room = outside(view)
        histogram += hue_histogram(view.image, room) / len(views)
        for index, name in enumerate(names):
            if name in view.paint:
                rival = _rival(gate, markers.markers[index], index, view, picture, room)
                known = rivals[index]
                if rival is not None and (known is None or rival.merit > known.merit):
                    rivals[index] = rival
    return SurroundingsResult(histogram, tuple(rivals))


def hue_histogram(image: YuvImage, where: Mask) -> NDArray[np.float64]:
    """(72,) chroma pixels of the picture by hue, of those in `where` (H/2, W/2) that are coloured at all."""
    bins = _HUE_BINS[image.u, image.v][where]
    return np.bincount(bins, minlength=HUE_BINS + 1)[:HUE_BINS].astype(np.float64)


def outside(view: MarkedPicture) -> Mask:
    """(H/2, W/2) everything but the markers known in the picture."""
    room = np.ones(view.image.u.shape, dtype=np.bool_)
    for region in view.paint.values():
        room &= ~region.whole
    return room


def surrounding_colours(views: Sequence[MarkedPicture], name: str) -> SurroundingColours:
    """The coloured things outside the markers, in the pictures that show `name`."""
    shown = [(view, outside(view)) for view in views if name in view.paint]
    found = [colours_of(view.image, room & (_HUE_BINS[view.image.u, view.image.v] < HUE_BINS)) for view, room in shown]
    colours = np.concatenate(found) if found else np.zeros((0, 3), np.float32)
    step, pictures = max(1, len(colours) // ROOM_PIXELS), max(len(shown), 1)
    size = sum(float(np.count_nonzero(room)) for _, room in shown) / pictures
    return SurroundingColours(colours[::step], step / pictures, max(size, 1.0))


def _rival(gate: ColourGate, marker: Marker, index: int, view: MarkedPicture, picture: int, room: Mask) -> Rival | None:
    name, shape = marker.id, view.image.u.shape
    blobs = gate.blobs(only(view.image, room), [index])
    if not blobs:
        return None
    best = max(blobs, key=lambda blob: blob.merit(marker, shape))
    own = [blob.merit(marker, shape) for blob in gate.blobs(only(view.image, view.paint[name].whole), [index])]
    x, y = best.centroid
    return Rival(name, picture, x=2.0 * x + 0.5, y=2.0 * y + 0.5, area_px=4.0 * best.area,
                 passing_px=4.0 * sum(blob.area for blob in blobs),
                 merit=best.merit(marker, shape) / (max(own, default=0.0) or view.paint[name].area))


def _hue_bins() -> NDArray[np.uint8]:
    """(256, 256) of [U, V]: bin of the hue, HUE_BINS where it is grey."""
    cb, cr = np.meshgrid(np.arange(256) - 128.0, np.arange(256) - 128.0, indexing="ij")
    bins = np.floor((np.degrees(np.arctan2(cr, cb)) + 180.0) / HUE_STEP_DEG) % HUE_BINS
    return np.where(np.hypot(cb, cr) >= ROOM_MAGNITUDE, bins, HUE_BINS).astype(np.uint8)


_HUE_BINS = _hue_bins()
