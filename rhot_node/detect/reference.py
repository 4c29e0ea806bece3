"""The thesis's own detector, for comparison: threshold, blur, close and open, largest contour, box centre, ROI.

RHOT chapters 6.3 and 7.2. Every colour has its own pass over the BGR picture.
"""

from __future__ import annotations

import math

import cv2
import numpy as np

from rhot_node.detect.image import EVEN, GREY, WHITE, Plane, YuvImage, to_bgr
from rhot_node.markers import Marker, MarkerSet, RangeModel
from rhot_node.wire.messages import NO_FLAGS, MarkerFlag, MarkerObservation

Box = tuple[int, int, int, int]  # x, y, width, height; px

ROI_MARGIN = 40  # px around the last box (RHOT 7.2.1)
BLUR = (5, 5)
KERNEL = np.ones((3, 3), dtype=np.uint8)
CONTOUR_AREA_MIN = 12.0  # px^2; smaller is noise
BOX_VARIANCE = EVEN + 0.5 * 0.5  # px^2: half-pixel steps of a box centre, and a noisy pixel on either side

HUES = 180  # of OpenCV
HUE_SLACK = 0.5  # OpenCV hue steps of 2 degrees per degree of the chroma model's tolerance
SATURATION_LEFT = 0.55  # of the displayed colour's saturation
VALUE_MIN = 50  # RHOT 6.3.2: at least 50


class ReferenceDetector:
    """Finds every marker as the thesis does; see `rhot_node.detect.image.Detector`."""

    def __init__(self, markers: MarkerSet, roi_margin: int = ROI_MARGIN) -> None:
        self._ranges = [range_of(marker) for marker in markers.markers]
        self._margin = roi_margin
        self._boxes: list[Box | None] = []
        self.reset()

    def reset(self) -> None:
        """Forget all regions of interest: the next frame is searched as a whole."""
        self._boxes = [None] * len(self._ranges)

    def detect(self, image: YuvImage) -> tuple[MarkerObservation, ...]:
        """One observation per marker, in the order of the marker set; lost markers are stated as lost."""
        bgr = to_bgr(image)
        return tuple(self._find(index, bgr) for index in range(len(self._ranges)))

    def all_blobs(self, image: YuvImage) -> list[list[MarkerObservation]]:
        """Every blob of every marker's colour, largest first, without regard to the ROI; a list per marker."""
        bgr = to_bgr(image)
        height, width = bgr.shape[:2]
        everything = []
        for index, model in enumerate(self._ranges):
            boxes = _blobs(bgr, model, (0, 0, width, height))
            everything.append([_observe(index, box, area, (width, height), MarkerFlag.ACQUIRED) for area, box in boxes])
        return everything

    def _find(self, index: int, bgr: Plane) -> MarkerObservation:
        height, width = bgr.shape[:2]
        last = self._boxes[index]
        roi = (0, 0, width, height) if last is None else _grow(last, self._margin, width, height)
        blobs = _blobs(bgr, self._ranges[index], roi)
        if not blobs:
            self._boxes[index] = None
            nan = math.nan
            return MarkerObservation(index, nan, nan, 0.0, nan, nan, nan, 0.0, MarkerFlag.LOST | MarkerFlag.REFERENCE)
        area, box = blobs[0]
        self._boxes[index] = box
        return _observe(index, box, area, (width, height), NO_FLAGS if last else MarkerFlag.ACQUIRED)


def _grow(box: Box, margin: int, width: int, height: int) -> Box:
    """The box with a margin all round, clamped to the frame (RHOT eq. 6.3 to 6.5)."""
    x, y = max(box[0] - margin, 0), max(box[1] - margin, 0)
    return x, y, min(box[0] + box[2] + margin, width) - x, min(box[1] + box[3] + margin, height) - y


def _blobs(bgr: Plane, model: RangeModel, roi: Box) -> list[tuple[float, Box]]:
    """(contour area, bounding box in the frame) of the blobs in the region of interest, largest first."""
    x0, y0, width, height = roi
    mask = clean_mask(threshold(bgr[y0:y0 + height, x0:x0 + width], model))
    contours, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    found = []
    for contour in contours:
        area = float(cv2.contourArea(contour))
        if area >= CONTOUR_AREA_MIN:
            x, y, box_width, box_height = cv2.boundingRect(contour)
            found.append((area, (x + x0, y + y0, box_width, box_height)))
    return sorted(found, reverse=True)


def _observe(index: int, box: Box, area: float, size: tuple[int, int], flags: MarkerFlag) -> MarkerObservation:
    """The box's centre as an observation."""
    x, y, width, height = box
    flags |= MarkerFlag.REFERENCE
    if x == 0 or y == 0 or x + width == size[0] or y + height == size[1]:
        flags |= MarkerFlag.EDGE
    return MarkerObservation(
        index=index, x=x + 0.5 * (width - 1), y=y + 0.5 * (height - 1), diameter=2.0 * math.sqrt(area / math.pi),
        cov_xx=BOX_VARIANCE, cov_xy=0.0, cov_yy=BOX_VARIANCE, quality=min(1.0, area / (0.5 * width * height)),
        flags=flags)


def threshold(bgr: Plane, model: RangeModel) -> Plane:
    """Binary mask (0, 255) of the pixels inside the model's bounds."""
    if model.space == "rgb":
        return _in_range(bgr, model.lower[::-1], model.upper[::-1])
    return threshold_hsv(np.asarray(cv2.cvtColor(bgr, cv2.COLOR_BGR2HSV), dtype=np.uint8), model)


def threshold_hsv(hsv: Plane, model: RangeModel) -> Plane:
    """The same of a picture that is in HSV already, by a model in HSV."""
    lower, upper = model.lower, model.upper
    if lower[0] <= upper[0]:
        return _in_range(hsv, lower, upper)
    below = _in_range(hsv, (0, lower[1], lower[2]), upper)  # across red: from 0, and up to 179
    return below | _in_range(hsv, lower, (HUES - 1, upper[1], upper[2]))


def clean_mask(mask: Plane) -> Plane:
    """Blur the mask (0, 255), take its half level, close, then open (RHOT 6.3.3)."""
    blurred = cv2.GaussianBlur(mask, BLUR, 0)
    closed = cv2.morphologyEx(_in_range(np.asarray(blurred, np.uint8), (GREY,), (WHITE,)), cv2.MORPH_CLOSE, KERNEL)
    return np.asarray(cv2.morphologyEx(closed, cv2.MORPH_OPEN, KERNEL), dtype=np.uint8)


def range_of(marker: Marker) -> RangeModel:
    """The marker's own range model, or an HSV range round its displayed colour when it has none."""
    if marker.range is not None:
        return marker.range
    pixel = np.array([[marker.display_rgb[::-1]]], dtype=np.uint8)
    hue, saturation, value = (int(c) for c in cv2.cvtColor(pixel, cv2.COLOR_BGR2HSV)[0, 0])
    slack = max(4, round(HUE_SLACK * marker.chroma.hue_tolerance_deg))
    lower = ((hue - slack) % HUES, round(SATURATION_LEFT * saturation), min(VALUE_MIN, value // 2))
    return RangeModel(space="hsv", lower=lower, upper=((hue + slack) % HUES, WHITE, WHITE))


def _in_range(image: Plane, lower: tuple[int, ...], upper: tuple[int, ...]) -> Plane:
    return np.asarray(cv2.inRange(image, np.array(lower), np.array(upper)), dtype=np.uint8)
