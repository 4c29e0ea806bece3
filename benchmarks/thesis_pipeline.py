"""The thesis's detection at OpenCV's best: one conversion to HSV; per marker threshold, blur, close and open."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_node.detect.reference import ROI_MARGIN, clean_mask, range_of, threshold_hsv
from rhot_node.markers import MarkerSet, RangeModel

Plane = NDArray[np.uint8]
Box = tuple[int, int, int, int]


class ThesisPipeline:
    """RHOT 6.3: HSV bounds, 5x5 blur, 3x3 close and open, largest contour, the centre of its box."""

    def __init__(self, markers: MarkerSet) -> None:
        self._ranges = [range_of(marker) for marker in markers.markers]
        self._boxes: list[Box | None] = [None] * len(self._ranges)

    def full(self, bgr: Plane) -> list[tuple[float, float] | None]:
        """Every marker in the whole frame, converted once."""
        hsv = np.asarray(cv2.cvtColor(bgr, cv2.COLOR_BGR2HSV), dtype=np.uint8)
        self._boxes = [_largest(hsv, model, 0, 0) for model in self._ranges]
        return [_centre(box) for box in self._boxes]

    def regions(self, bgr: Plane) -> list[tuple[float, float] | None]:
        """Every marker round its last box, each region converted by itself; the whole frame where there is none."""
        height, width = bgr.shape[:2]
        for index, (model, last) in enumerate(zip(self._ranges, self._boxes, strict=True)):
            x0 = y0 = 0
            x1, y1 = width, height
            if last is not None:
                x0, y0 = max(last[0] - ROI_MARGIN, 0), max(last[1] - ROI_MARGIN, 0)
                x1, y1 = last[0] + last[2] + ROI_MARGIN, last[1] + last[3] + ROI_MARGIN
            hsv = np.asarray(cv2.cvtColor(bgr[y0:y1, x0:x1], cv2.COLOR_BGR2HSV), dtype=np.uint8)
            self._boxes[index] = _largest(hsv, model, x0, y0)
        return [_centre(box) for box in self._boxes]


def _largest(hsv: Plane, model: RangeModel, x0: int, y0: int) -> Box | None:
    mask = clean_mask(threshold_hsv(hsv, model))
    contours, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    if not contours:
        return None
    x, y, width, height = cv2.boundingRect(max(contours, key=cv2.contourArea))
    return x + x0, y + y0, width, height


def _centre(box: Box | None) -> tuple[float, float] | None:
    return None if box is None else (box[0] + 0.5 * (box[2] - 1), box[1] + 0.5 * (box[3] - 1))
