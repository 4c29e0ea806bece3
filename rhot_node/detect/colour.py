"""Learn a marker's colour from samples of its paint."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rhot_node.detect.image import GREY, MAD_SD, WHITE, YuvImage
from rhot_node.errors import SettingsError
from rhot_node.markers import ChromaModel, MarkerSet

Box = tuple[int, int, int, int]
Colours = NDArray[np.float32]

SAMPLES_MIN = 12  # chroma pixels
MAGNITUDE_LEAST = 12.0  # grey levels of mean chroma; less is grey
TOLERANCE_DEG = (8.0, 22.0)  # narrower loses paint in noise, wider takes the neighbour's colour
SPREADS = 3.0  # robust standard deviations on both sides of the mean that the hue tolerance spans
WEAKEST = 10  # per cent of the samples that may be weaker: glints, and what is no paint
BLACK_NOISE = 8  # luma: darker pixels have chroma of noise alone
BURNT, BRIGHT = 250, 235  # luma: highlights beyond are no paint, unless the paint itself is as bright
LIGHT_LEFT = 0.5  # of the weakest sample: shadow on the paint leaves about this much of its chroma and luma
MAGNITUDE_MIN = 8.0  # grey levels of chroma below which a paint shows no hue


def box_mask(image: YuvImage, boxes: list[Box]) -> NDArray[np.bool_]:
    """(H/2, W/2) chroma pixels that lie wholly in `boxes`, each (x0, y0, x1, y1) luma px, the upper ends exclusive."""
    mask = np.zeros(image.u.shape, dtype=np.bool_)
    for x0, y0, x1, y1 in boxes:
        mask[(max(y0, 0) + 1) // 2:max(y1, 0) // 2, (max(x0, 0) + 1) // 2:max(x1, 0) // 2] = True
    return mask


def colours_of(image: YuvImage, mask: NDArray[np.bool_]) -> Colours:
    """(N, 3) mean luma, Cb and Cr (minus 128) of the chroma pixels where `mask` (H/2, W/2) is True."""
    rows, columns = np.nonzero(mask)
    luma = [image.y[2 * rows + j, 2 * columns + i].astype(np.float32) for j in (0, 1) for i in (0, 1)]
    return np.stack([np.mean(luma, axis=0), image.u[rows, columns] - np.float32(GREY),
                     image.v[rows, columns] - np.float32(GREY)], axis=1)


def learn_chroma(image: YuvImage, boxes: list[Box]) -> ChromaModel:
    """Colour model of the paint inside `boxes`, each (x0, y0, x1, y1) luma px, the upper ends exclusive.

    Mean and spread are robust (median, median absolute deviation): a glint or a corner of something else in a box
    does no harm as long as most of it is paint. Raises SettingsError when the boxes hold too few pixels or no colour.
    """
    return learn_chroma_from_pixels(image, box_mask(image, boxes))


def learn_chroma_from_pixels(image: YuvImage, mask: NDArray[np.bool_]) -> ChromaModel:
    """As `learn_chroma`, from the chroma pixels where `mask` (H/2, W/2) is True."""
    return learn_chroma_from_colours(colours_of(image, mask))


def learn_chroma_from_colours(colours: Colours) -> ChromaModel:
    """As `learn_chroma`, from (N, 3) luma, Cb and Cr (minus 128)."""
    luma, cb, cr = colours.astype(np.float64).T
    if cb.size < SAMPLES_MIN:
        raise SettingsError(f"the samples hold {cb.size} colour pixels inside the image; at least {SAMPLES_MIN} are "
                            "needed. Draw the box larger, or go nearer.")
    mean_cb, mean_cr = float(np.median(cb)), float(np.median(cr))
    magnitude = math.hypot(mean_cb, mean_cr)
    if magnitude < MAGNITUDE_LEAST:
        raise SettingsError(f"the samples are almost grey (chroma {magnitude:.0f} of at least {MAGNITUDE_LEAST:.0f}); "
                            "grey, black and white cannot be told from the room. Use a stronger paint or more light.")
    direction = mean_cb / magnitude, mean_cr / magnitude
    along = cb * direction[0] + cr * direction[1]
    hue = np.degrees(np.arctan2(cr * direction[0] - cb * direction[1], along))
    spread = MAD_SD * float(np.median(np.abs(hue - np.median(hue))))
    weakest = float(np.percentile(along, WEAKEST))
    return ChromaModel(
        cb=round(mean_cb, 1), cr=round(mean_cr, 1),
        hue_tolerance_deg=round(min(max(SPREADS * spread, TOLERANCE_DEG[0]), TOLERANCE_DEG[1]), 1),
        magnitude_min=round(max(LIGHT_LEFT * weakest, MAGNITUDE_MIN), 1),
        luma_min=max(int(LIGHT_LEFT * float(np.percentile(luma, WEAKEST))), BLACK_NOISE),
        luma_max=BURNT if float(np.percentile(luma, 100 - WEAKEST)) < BRIGHT else WHITE)


# -- colour tables -----------------------------------------------------------------------------------------------------
# For every chroma pair (U, V), the number of the marker whose colour it may be.

Table = NDArray[np.uint8]

SECTOR_MAGNITUDE_MIN = 6.0  # grey levels; below, the hue of an 8-bit chroma pair means nothing


def sector_table(markers: MarkerSet) -> Table:
    """(256, 256) label of [U, V] by hue alone: 1 + marker index, 0 for none.

    Where sectors overlap the nearest hue wins. Used inside the window of a marker whose local chroma level is known.
    """
    return _table(markers, [SECTOR_MAGNITUDE_MIN] * len(markers.markers))


def acquisition_table(markers: MarkerSet) -> Table:
    """(256, 256) label of [U, V] by hue and magnitude: what a full search believes to be marker paint.

    The magnitude gate matters: skin and wood reach into the hues of red and yellow, but not into their saturation.
    """
    return _table(markers, [marker.chroma.magnitude_min for marker in markers.markers])


def directions(markers: MarkerSet) -> NDArray[np.float64]:
    """(M, 2) unit vectors (cb, cr) of the markers' hues."""
    hues = [marker.chroma.hue_rad for marker in markers.markers]
    return np.array([(math.cos(hue), math.sin(hue)) for hue in hues])


def _table(markers: MarkerSet, magnitude_min: list[float]) -> Table:
    cb, cr = np.meshgrid(np.arange(256.0) - GREY, np.arange(256.0) - GREY, indexing="ij")
    angle, magnitude = np.arctan2(cr, cb), np.hypot(cb, cr)
    best = np.full((256, 256), np.inf)
    table = np.zeros((256, 256), dtype=np.uint8)
    for index, marker in enumerate(markers.markers):
        away = np.abs(np.remainder(angle - marker.chroma.hue_rad + math.pi, 2 * math.pi) - math.pi)
        inside = (away <= math.radians(marker.chroma.hue_tolerance_deg)) & (magnitude >= magnitude_min[index])
        nearer = inside & (away < best)
        table[nearer] = index + 1
        best[nearer] = away[nearer]
    return table
