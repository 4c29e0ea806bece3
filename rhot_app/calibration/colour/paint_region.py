"""The region of a marker in a picture, from a click on it or from a box over it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_app.errors import CalibrationError
from rhot_node.detect.colour import MAGNITUDE_LEAST, SAMPLES_MIN, Box, Colours, box_mask, colours_of
from rhot_node.detect.coverage import RING
from rhot_node.detect.image import YuvImage

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Point = tuple[float, float]

HUE_REACH_DEG = 16.0  # of the same paint in other shade, noise included
LEVEL_REACH = (0.42, 2.0)  # of the sample's chroma: shade, and the edge where half the pixel is paint
SEED = 40  # chroma pixels; a smaller box only says where the paint is, which is taken from round it
SEED_HUE_DEG, SEED_LEVEL = 8.0, (0.65, 1.5)  # ... as far as it is plainly the same
LEAK = 3.0  # times what is plainly the same: what is only alike is then something else, such as the finger
GREY = 128  # chroma of grey, bytes
SOLID = 0.7  # of its convex hull that a marker fills, half hidden ones included
ENOUGH = "10 x 8 px"  # a box that holds SAMPLES_MIN chroma pixels wherever it lies
REGION_MOST = 0.2  # of the picture; more is the room, or an arm, and no marker


@dataclass(frozen=True, slots=True)
class PaintRegion:
    """Chroma pixels (H/2, W/2) of one marker: `sample`, those that are surely paint; `whole`, all it may touch.

    `runs_on`: its colour goes on where the marker must end; `whole` is then what is plainly the same, or the sample.
    """

    sample: Mask
    whole: Mask
    runs_on: bool = False

    @property
    def area(self) -> float:
        """Size of the whole marker without the margin of `whole`, chroma px."""
        return float(np.count_nonzero(_shrunk(self.whole, RING)))


def region_at(image: YuvImage, point: Point) -> PaintRegion:
    """The paint round a click (x, y) luma px: what is connected with it and of its colour.

    Raises CalibrationError when the click is outside, on grey, or on something too large or too small for a marker.
    """
    width, height = image.size
    x, y = point
    if not (0 <= x < width and 0 <= y < height):
        raise CalibrationError(f"the point {x:g}, {y:g} lies outside the picture of {width} x {height} px.")
    column, row = min(int(x) // 2, width // 2 - 1), min(int(y) // 2, height // 2 - 1)
    around = np.zeros(image.u.shape, dtype=np.bool_)
    around[max(row - 1, 0):row + 2, max(column - 1, 0):column + 2] = True
    found = _extent(image, around)
    if found is None:
        raise CalibrationError("there is no colour under the click: grey, black and white cannot be told from the "
                               "room. Click the middle of the paint.")
    flooded, runs_on = found
    share = np.count_nonzero(flooded) / flooded.size
    if share > REGION_MOST:
        raise CalibrationError(f"the colour under the click runs over {100 * share:.0f} % of the picture: that is the "
                               "room or the skin, not a marker. Click the middle of the paint, or draw a box over it.")
    inner = _shrunk(flooded, 1)
    sample = inner if np.count_nonzero(inner) >= SAMPLES_MIN else flooded
    if np.count_nonzero(sample) < SAMPLES_MIN:
        raise CalibrationError(f"only {np.count_nonzero(sample)} colour pixels belong to the paint under the click; "
                               f"{SAMPLES_MIN} are needed. Go nearer, or draw a box over the marker.")
    return PaintRegion(sample, _grown(flooded, RING), runs_on)


def region_in(image: YuvImage, boxes: list[Box]) -> PaintRegion:
    """The paint in boxes (x0, y0, x1, y1) luma px, upper ends exclusive, and the marker that it belongs to.

    Boxes that hold few pixels only say where the paint is: what is plainly the same round them is taken too. Raises
    CalibrationError when they lie outside the picture, on different paints, or on less than can be learnt from.
    """
    sample = box_mask(image, boxes) | touched(image, [box for box in boxes if not box_mask(image, [box]).any()])
    if not sample.any():
        width, height = image.size
        raise CalibrationError(f"the box {boxes[0]} holds no colour pixel of the picture of {width} x {height} px.")
    _require_one_paint(image, boxes)
    held, found = int(np.count_nonzero(sample)), _extent(image, sample)
    if found is None:
        if held < SAMPLES_MIN:
            raise CalibrationError(f"the {held} colour pixels of the samples are almost grey, and {SAMPLES_MIN} are "
                                   "needed; grey, black and white cannot be told from the room. Use a stronger paint "
                                   "or more light.")
        return PaintRegion(sample, _grown(sample, RING))
    flooded, runs_on = found
    if held < SEED:
        alike = _flood(image, sample, SEED_HUE_DEG, SEED_LEVEL)
        if alike is not None and _may_be_a_marker(alike, SEED):
            inner = _shrunk(alike, 1)
            sample = sample | (inner if np.count_nonzero(inner | sample) >= SAMPLES_MIN else alike)
    _require_enough(sample, held)
    if not _may_be_a_marker(flooded, int(np.count_nonzero(sample))):
        return PaintRegion(sample, _grown(sample, RING), True)
    return PaintRegion(sample, _grown(flooded | sample, RING), runs_on)


def touched(image: YuvImage, boxes: list[Box]) -> Mask:
    """(H/2, W/2) the chroma pixels that boxes touch: a box of 2 x 2 px may hold none wholly."""
    width, height = image.size
    return box_mask(image, [(x0 - x0 % 2, y0 - y0 % 2, min(x1 + x1 % 2, width), min(y1 + y1 % 2, height))
                            for x0, y0, x1, y1 in boxes])


def _require_one_paint(image: YuvImage, boxes: list[Box]) -> None:
    """Raise CalibrationError when the boxes of one marker have hues that no light gives one paint."""
    chromas = []
    for box in boxes if len(boxes) > 1 else []:
        mask = box_mask(image, [box])
        chromas.append(np.median(colours_of(image, mask if mask.any() else touched(image, [box])), axis=0)[1:])
        if math.hypot(*chromas[-1]) < MAGNITUDE_LEAST:
            raise CalibrationError(f"the box {box} is almost grey; draw all boxes on the paint.")
    apart = hues_spread_deg(chromas)
    if apart > 2.0 * HUE_REACH_DEG:
        raise CalibrationError(f"its boxes in one picture differ in hue by {apart:.0f}°: one of them is on something "
                               "else. Every marker has a name of its own; draw all its boxes on its paint.")


def hues_spread_deg(chromas: Sequence[Array | Colours]) -> float:
    """The angle that the hues of colours (cb, cr) span; 0 for one or none. Within twice HUE_REACH_DEG all are the same
    paint's middle hue in other light."""
    if not len(chromas):
        return 0.0
    middle = hue_of(sum(chroma / np.hypot(*chroma) for chroma in chromas))
    return float(np.ptp([math.remainder(hue_of(chroma) - middle, 360.0) for chroma in chromas]))


def hue_of(chroma: Array | Colours) -> float:
    """The angle of a colour (cb, cr), degrees."""
    return math.degrees(math.atan2(float(chroma[1]), float(chroma[0])))


def polar(colours: Colours, hue: float) -> tuple[Array, Array, float]:
    """(N,) degrees from `hue`, -180..180, (N,) magnitudes, and their median, of colours (N, 3) Y, Cb, Cr."""
    cb, cr = colours[:, 1].astype(np.float64), colours[:, 2].astype(np.float64)
    away = np.remainder(np.degrees(np.arctan2(cr, cb)) - hue + 180.0, 360.0) - 180.0
    magnitude = np.hypot(cb, cr)
    return away, magnitude, float(np.median(magnitude)) if len(magnitude) else 0.0


def _require_enough(sample: Mask, held: int) -> None:
    """Raise CalibrationError that says which size is needed, when there is less than can be learnt from."""
    count = int(np.count_nonzero(sample))
    if count < SAMPLES_MIN:
        around = f", {count} with the paint round them" if count > held else ""
        raise CalibrationError(f"the samples hold {held} colour {'pixel' if held == 1 else 'pixels'} (2 x 2 px "
                               f"each){around}; at least {SAMPLES_MIN} are needed, and no more of the paint was found "
                               f"round them. {ENOUGH} of paint are enough in one box; smaller boxes in a picture add "
                               "up.")


def _extent(image: YuvImage, seed: Mask) -> tuple[Mask, bool] | None:
    """What is connected with `seed` and of its paint, and whether something alike adjoins it; None for grey."""
    alike, same = _flood(image, seed), _flood(image, seed, SEED_HUE_DEG, SEED_LEVEL)
    if alike is None or same is None:
        return None
    leaks = int(np.count_nonzero(alike)) > LEAK * max(int(np.count_nonzero(same)), SAMPLES_MIN)
    return (same, True) if leaks else (alike, False)


def _may_be_a_marker(flooded: Mask, sampled: int) -> bool:
    """Not much of the picture, and of one piece: a finger's paint has no fingers itself."""
    if np.count_nonzero(flooded) > max(REGION_MOST * flooded.size, 1.5 * sampled):
        return False
    contours, _ = cv2.findContours(_grown(flooded, 1).astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    largest = max(contours, key=cv2.contourArea)
    return cv2.contourArea(largest) >= SOLID * cv2.contourArea(cv2.convexHull(largest))


def region_of(sample: Mask) -> PaintRegion:
    """The region of a marker that the detector placed, from its inner pixels."""
    return PaintRegion(sample, _grown(_grown(sample, 1), RING))


def only(image: YuvImage, where: Mask) -> YuvImage:
    """The picture with everything but `where` (H/2, W/2) grey."""
    return YuvImage(image.y, np.where(where, image.u, GREY).astype(np.uint8),
                    np.where(where, image.v, GREY).astype(np.uint8))


def _flood(image: YuvImage, seed: Mask, hue_deg: float = HUE_REACH_DEG,
           levels: tuple[float, float] = LEVEL_REACH) -> Mask | None:
    """What is connected with `seed` and of its colour; None when that is grey."""
    _, cb, cr = (float(c) for c in np.median(colours_of(image, seed), axis=0))
    if math.hypot(cb, cr) < MAGNITUDE_LEAST:
        return None
    same = alike(image, (cb, cr), hue_deg, levels)
    _, numbers = cv2.connectedComponents(same.astype(np.uint8), connectivity=8)
    own = np.unique(numbers[seed & same])
    return np.asarray(np.isin(numbers, own[own > 0]))


def alike(image: YuvImage, chroma: tuple[float, float], hue_deg: float = SEED_HUE_DEG,
          levels: tuple[float, float] = SEED_LEVEL) -> Mask:
    """(H/2, W/2) the chroma pixels that are plainly of the colour `chroma` (cb, cr): of its hue and about its level."""
    cb, cr = chroma
    level = math.hypot(cb, cr)
    u, v = image.u.astype(np.float32) - 128.0, image.v.astype(np.float32) - 128.0
    along, across = (u * cb + v * cr) / level, (v * cb - u * cr) / level
    return np.asarray((np.abs(across) <= math.tan(math.radians(hue_deg)) * along)
                      & (along >= levels[0] * level) & (along <= levels[1] * level))


def surroundings(region: PaintRegion) -> Mask:
    """(H/2, W/2) what lies round a marker within its own diameter."""
    by = max(round(math.sqrt(4.0 / math.pi * max(region.area, 1.0))), 2)
    return _grown(region.whole, by) & ~region.whole


def _grown(mask: Mask, by: int) -> Mask:
    return cv2.dilate(mask.astype(np.uint8), np.ones((2 * by + 1, 2 * by + 1), np.uint8)).astype(np.bool_)


def _shrunk(mask: Mask, by: int) -> Mask:
    return cv2.erode(mask.astype(np.uint8), np.ones((2 * by + 1, 2 * by + 1), np.uint8),
                     borderValue=0).astype(np.bool_)
