"""The thesis's text datagrams (RHOT 6.4) as observations. They carry no time: the kernel's receive time stands in."""

from __future__ import annotations

import numpy as np

from rhot_app.tracking.tracker import CameraObservations
from rhot_node.errors import WireError
from rhot_node.wire.messages import MarkerFlag
from rhot_node.wire.text import parse_text

VARIANCE_PX2 = 1.0
"""Assumed variance of a text centroid per axis: the thesis measured 2-5 px peak deviation (RHOT figure 7.7)."""

DIAMETER_PX = 16.0  # a painted fingertip at 0.6 m; the text does not say
QUALITY = 0.5
TIME_BOUND_S = 0.005
"""The delay from exposure to here is not known; half of a 100 Hz frame is what pairing has to expect."""


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
        points = parse_text(data, self._count)
        pixels = np.full((self._count, 2), np.nan)
        for row, point in enumerate(points):
            if point is not None:
                if point[0] > self._size[0] or point[1] > self._size[1]:
                    raise WireError("marker", f"{point} lies outside the image of {self._size} px")
                pixels[row] = point
        lost = np.isnan(pixels[:, 0])
        return CameraObservations(
            camera=self._camera, t_row0_master_ns=t_receive_ns + self._time_offset_ns, row_time_ns=0,
            clock_bound_s=TIME_BOUND_S, t_receive_ns=t_receive_ns, detect_s=float("nan"), network_s=float("nan"),
            pixels=pixels,
            covariances=np.where(lost, 0.0, VARIANCE_PX2)[:, None, None] * np.eye(2),
            diameters=np.where(lost, 0.0, DIAMETER_PX), qualities=np.where(lost, 0.0, QUALITY),
            flags=np.where(lost, MarkerFlag.LOST, 0).astype(np.uint16))
