"""The thesis's text datagrams (RHOT 6.4): ``x,y;x,y;...`` in the rig's marker order, one port per node.

They carry no session, time or key, so they are as trustworthy as the network they come from.
"""

from __future__ import annotations

import re

import numpy as np

from rhot_app.tracking.tracker import CameraObservations
from rhot_node.errors import WireError
from rhot_node.wire.fields import IMAGE_SIZE_MAX
from rhot_node.wire.messages import MarkerFlag

LENGTH_MAX = 4096  # bytes; 64 markers with room to spare

VARIANCE_PX2 = 1.0
"""Assumed variance of a text centroid per axis: the thesis measured 2-5 px peak deviation (RHOT figure 7.7)."""

DIAMETER_PX = 16.0  # a painted fingertip at 0.6 m; the text does not say
QUALITY = 0.5
TIME_BOUND_S = 0.005
"""The delay from exposure to here is not known; half of a 100 Hz frame is what pairing has to expect."""

Point = tuple[float, float]

_NUMBER = re.compile(rb"[+-]?(?:\d{1,9}(?:\.\d{0,12})?|\.\d{1,12})\Z")


def parse_text(data: bytes | bytearray | memoryview, count: int) -> list[Point | None]:
    """The `count` marker positions of a text datagram, px; None for a lost marker (``-1,-1``, ``,`` or nothing).

    A trailing newline, carriage return, NUL or one semicolon too many is tolerated, as `nc` and printf produce them.
    Raises WireError with reason length, count or text.
    """
    if len(data) > LENGTH_MAX:
        raise WireError("length", f"{len(data)} bytes of text")
    pairs = bytes(data).rstrip(b"\r\n\0 \t").split(b";")
    if len(pairs) == count + 1 and not pairs[-1].strip():
        pairs.pop()
    if len(pairs) != count:
        raise WireError("count", f"{len(pairs)} pairs for {count} markers")
    return [_parse_pair(pair) for pair in pairs]


def _parse_pair(pair: bytes) -> Point | None:
    parts = [part.strip() for part in pair.split(b",")]
    if not any(parts) and len(parts) <= 2:
        return None
    if len(parts) != 2 or not all(_NUMBER.match(part) for part in parts):
        raise WireError("text", f"{pair!r} is not a pair of numbers")
    x, y = float(parts[0]), float(parts[1])
    if x == -1.0 and y == -1.0:
        return None
    if not (0.0 <= x <= IMAGE_SIZE_MAX and 0.0 <= y <= IMAGE_SIZE_MAX):
        raise WireError("text", f"{pair!r} lies outside any image")
    return x, y


class TextReader:
    """Reads text datagrams of one camera."""

    def __init__(self, camera: int, count: int, size: tuple[int, int], time_offset_ns: int = 0) -> None:
        """`count` markers in the rig's order, image `size` (width, height) px; the calibrated `time_offset_ns` is added
        to the receive time, so a delay that a moving marker showed is taken off here."""
        self._camera = camera
        self._count = count
        self._size = size
        self._time_offset_ns = time_offset_ns

    def read(self, data: bytes, t_receive_ns: int) -> CameraObservations:
        """The observations of one datagram. Raises WireError (length, count, text, or marker: outside the image)."""
        pixels = np.full((self._count, 2), np.nan)
        for row, point in enumerate(parse_text(data, self._count)):
            if point is not None:
                if point[0] > self._size[0] or point[1] > self._size[1]:
                    raise WireError("marker", f"{point} lies outside the image of {self._size} px")
                pixels[row] = point
        lost = np.isnan(pixels[:, 0])
        return CameraObservations(
            camera=self._camera, t_row0_master_ns=t_receive_ns + self._time_offset_ns, row_time_ns=0,
            clock_bound_s=TIME_BOUND_S, t_receive_ns=t_receive_ns, detect_s=float("nan"), network_s=float("nan"),
            pixels=pixels, covariances=np.where(lost, 0.0, VARIANCE_PX2)[:, None, None] * np.eye(2),
            diameters=np.where(lost, 0.0, DIAMETER_PX), qualities=np.where(lost, 0.0, QUALITY),
            flags=np.where(lost, MarkerFlag.LOST, 0).astype(np.uint16))
