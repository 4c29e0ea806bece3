"""The image a detector works on: planar YUV420, full-range BT.601, as a Pi camera delivers it."""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_node.wire.messages import MarkerObservation

Plane = NDArray[np.uint8]

GREY = 128
"""U and V of what has no colour."""


WHITE = 255
"""The greatest value of a byte."""

MAD_SD = 1.4826
"""Standard deviation of a normal distribution by its median absolute deviation."""

EVEN = 1.0 / 12.0
"""Variance of what is evenly spread over a length of one."""


def table_of(record: Any) -> np.dtype[Any]:
    """The dtype of an array of such records, all of whose fields are float64. Compiled code reads and writes its fields
    by their names. `record`: a named tuple."""
    return np.dtype([(name, np.float64) for name in record._fields])


def rows_of(records: NDArray[np.void]) -> NDArray[np.float64]:
    """(N, fields) view of such records; read quicker than the records themselves."""
    return records.view(np.float64).reshape(len(records), -1)


class YuvImage(NamedTuple):
    """Three planes: `y` (H, W), `u` = Cb and `v` = Cr (H/2, W/2), uint8, H and W even.

    A chroma sample (x, y) lies at luma 2 (x, y) + 0.5: it is the mean of a 2x2 block.
    """

    y: Plane
    u: Plane
    v: Plane

    @property
    def size(self) -> tuple[int, int]:
        """(width, height), px."""
        return self.y.shape[1], self.y.shape[0]

    def copy(self) -> YuvImage:
        """The same with planes of its own."""
        return YuvImage(self.y.copy(), self.u.copy(), self.v.copy())


def from_i420(buffer: Plane, width: int, height: int, stride: int | None = None) -> YuvImage:
    """View an I420 buffer (Y, then U, then V) as an image, without a copy.

    `stride`: bytes from luma row to luma row, even, where rows are padded; those of chroma are half as far apart.
    """
    stride = width if stride is None else stride
    flat = buffer.reshape(-1)
    luma, chroma = stride * height, (stride // 2) * (height // 2)
    return YuvImage(
        flat[:luma].reshape(height, stride)[:, :width],
        flat[luma:luma + chroma].reshape(height // 2, stride // 2)[:, :width // 2],
        flat[luma + chroma:luma + 2 * chroma].reshape(height // 2, stride // 2)[:, :width // 2],
    )


def from_bgr(bgr: Plane) -> YuvImage:
    """Convert (H, W, 3) BGR; an odd last row or column is cut off.

    OpenCV's own I420 conversion takes the chroma of one pixel of each 2x2 block, half a pixel off; this averages.
    """
    height, width = bgr.shape[0] & ~1, bgr.shape[1] & ~1
    bgr = bgr[:height, :width]
    luma = cv2.cvtColor(bgr, cv2.COLOR_BGR2GRAY)
    half = cv2.cvtColor(cv2.resize(bgr, (width // 2, height // 2), interpolation=cv2.INTER_AREA), cv2.COLOR_BGR2YCrCb)
    return YuvImage(np.asarray(luma, np.uint8), np.asarray(half[:, :, 2], np.uint8, order="C"),
                    np.asarray(half[:, :, 1], np.uint8, order="C"))


def to_bgr(image: YuvImage) -> Plane:
    """(H, W, 3) BGR of an image, for people and for the reference detector; chroma is interpolated linearly.

    INTER_LINEAR rounds otherwise on ARM than on x86; INTER_LINEAR_EXACT does not.
    """
    size = image.size
    chroma = [cv2.resize(plane, size, interpolation=cv2.INTER_LINEAR_EXACT) for plane in (image.v, image.u)]
    bgr = cv2.cvtColor(cv2.merge([image.y, *chroma]), cv2.COLOR_YCrCb2BGR)
    return np.asarray(bgr, dtype=np.uint8)


# -- detector interface ------------------------------------------------------------------------------------------------

class Detector(Protocol):
    """A detector keeps small state between frames (windows, sizes); frames must come in order of time."""

    def detect(self, image: YuvImage) -> tuple[MarkerObservation, ...]:
        """The best candidate of every marker, in the order of the marker set, lost markers reported as lost; then
        further candidates, if any: at most CANDIDATES_MAX of a marker in all."""
        ...

    def reset(self) -> None:
        """Forget all tracks: the next frame is searched as a whole."""
        ...
