"""The thesis's own detector, for comparison: threshold, blur, close and open, largest contour, box centre, ROI.

RHOT chapters 6.3 and 7.2. Every colour has its own pass over the BGR picture.
"""

from __future__ import annotations

import math

import cv2
import numpy as np

from rhot_node.detect.image import Plane, YuvImage, to_bgr
from rhot_node.markers import Marker, MarkerSet, RangeModel
from rhot_node.wire.messages import MarkerFlag, MarkerObservation

Box = tuple[int, int, int, int]  # x, y, width, height; px

ROI_MARGIN = 40  # px around the last box (RHOT 7.2.1)
BLUR = (5, 5)
KERNEL = np.ones((3, 3), dtype=np.uint8)
CONTOUR_AREA_MIN = 12.0  # px^2; smaller is noise
BOX_VARIANCE = 1.0 / 12.0 + 0.25  # px^2: half-pixel steps of a box centre, and a noisy pixel on either side

HUE_SLACK = 0.5  # OpenCV hue steps of 2 degrees per degree of the chroma model's tolerance
SATURATION_LEFT = 0.55  # of the displayed colour's saturation
VALUE_MIN = 50  # RHOT 6.3.2: at least 50


class ReferenceDetector:
    """Finds every marker as the thesis does; see `rhot_node.detect.detector.Detector`."""

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

    def _find(self, index: int, bgr: Plane) -> MarkerObservation:
        height, width = bgr.shape[:2]
        last = self._boxes[index]
        x0, y0, x1, y1 = 0, 0, width, height
        if last is not None:
            x0, y0 = max(last[0] - self._margin, 0), max(last[1] - self._margin, 0)
            x1 = min(last[0] + last[2] + self._margin, width)
            y1 = min(last[1] + last[3] + self._margin, height)
        mask = clean_mask(threshold(bgr[y0:y1, x0:x1], self._ranges[index]))
        contours, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        largest = max(contours, key=cv2.contourArea, default=None)
        flags = MarkerFlag.REFERENCE if last is not None else MarkerFlag.REFERENCE | MarkerFlag.ACQUIRED
        if largest is None or cv2.contourArea(largest) < CONTOUR_AREA_MIN:
            self._boxes[index] = None
            nan = math.nan
            return MarkerObservation(index, nan, nan, 0.0, nan, nan, nan, 0.0, MarkerFlag.LOST | MarkerFlag.REFERENCE)
        x, y, box_width, box_height = cv2.boundingRect(largest)
        x, y = x + x0, y + y0
        self._boxes[index] = (x, y, box_width, box_height)
        if x == 0 or y == 0 or x + box_width == width or y + box_height == height:
            flags |= MarkerFlag.EDGE
        area = float(cv2.contourArea(largest))
        return MarkerObservation(
            index=index, x=x + 0.5 * (box_width - 1), y=y + 0.5 * (box_height - 1),
            diameter=math.sqrt(4.0 * area / math.pi), cov_xx=BOX_VARIANCE, cov_xy=0.0, cov_yy=BOX_VARIANCE,
            quality=min(1.0, area / (0.5 * box_width * box_height)), flags=flags)


def threshold(bgr: Plane, model: RangeModel) -> Plane:
    """Binary mask (0, 255) of the pixels inside the model's bounds."""
    lower, upper = model.lower, model.upper
    if model.space == "rgb":
        return _in_range(bgr, lower[::-1], upper[::-1])
    hsv = np.asarray(cv2.cvtColor(bgr, cv2.COLOR_BGR2HSV), dtype=np.uint8)
    if lower[0] <= upper[0]:
        return _in_range(hsv, lower, upper)
    below = _in_range(hsv, (0, lower[1], lower[2]), upper)  # across red: from 0, and up to 179
    return below | _in_range(hsv, lower, (179, upper[1], upper[2]))


def clean_mask(mask: Plane) -> Plane:
    """Blur the mask, take its half level, close, then open (RHOT 6.3.3)."""
    blurred = cv2.GaussianBlur(mask, BLUR, 0)
    _, binary = cv2.threshold(blurred, 127, 255, cv2.THRESH_BINARY)
    closed = cv2.morphologyEx(binary, cv2.MORPH_CLOSE, KERNEL)
    return np.asarray(cv2.morphologyEx(closed, cv2.MORPH_OPEN, KERNEL), dtype=np.uint8)


def range_of(marker: Marker) -> RangeModel:
    """The marker's own range model, or an HSV range round its displayed colour when it has none."""
    if marker.range is not None:
        return marker.range
    pixel = np.array([[marker.display_rgb[::-1]]], dtype=np.uint8)
    hue, saturation, value = (int(c) for c in cv2.cvtColor(pixel, cv2.COLOR_BGR2HSV)[0, 0])
    slack = max(4, round(HUE_SLACK * marker.chroma.hue_tolerance_deg))
    lower = ((hue - slack) % 180, round(SATURATION_LEFT * saturation), min(VALUE_MIN, value // 2))
    return RangeModel(space="hsv", lower=lower, upper=((hue + slack) % 180, 255, 255))


def _in_range(image: Plane, lower: tuple[int, ...], upper: tuple[int, ...]) -> Plane:
    return np.asarray(cv2.inRange(image, np.array(lower), np.array(upper)), dtype=np.uint8)
