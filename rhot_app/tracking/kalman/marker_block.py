"""One camera's frame as a residual block."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.tracking.kalman.association import relabel
from rhot_app.tracking.kalman.estimate import Estimate
from rhot_app.tracking.kalman.markers import Frame, append_markers
from rhot_app.tracking.kalman.rows import Rows
from rhot_app.tracking.kalman.wearing import Wearing
from rhot_app.tracking.tracker import CameraObservations
from rhot_node.wire.messages import MarkerFlag

Array = NDArray[np.float64]

_LOST = int(MarkerFlag.LOST)


class MarkerBlock:
    """The markers that one camera saw in one frame. `t_ns`: the mean time of its sights, or of its middle row;
    `sights`: how many markers it shows."""

    def __init__(self, wearing: Wearing, observations: CameraObservations) -> None:
        count = len(observations.pixels)
        self.observations = observations
        self.frame = Frame(np.array([observations.camera]), np.empty(count, np.bool_), observations.pixels,
                           observations.covariances, np.empty(count), np.empty(count, np.int64))
        self._wearing = wearing
        after_ns, self.sights = _read(self.frame, observations.flags, 1e-9 * observations.row_time_ns,
                                      wearing.cameras.intrinsics)
        self.t_ns = observations.t_row0_master_ns + int(after_ns)

    def associate(self, estimate: Estimate) -> int:
        """Ask the hand, carried to this frame's instant, which marker each sight is of; returns how many changed."""
        return int(relabel(self._wearing.worn, self._wearing.cameras, self.frame, estimate))

    def linearise(self, estimate: Estimate, rows: Rows) -> None:
        """Append the frame's observations; see `ResidualBlock`."""
        append_markers(self._wearing.worn, self._wearing.cameras, self.frame, estimate, rows)


@njit(cache=True)
def _read(frame: Frame, flags: NDArray[np.uint16], row_time_s: float, intrinsics: Array) -> tuple[float, int]:
    """Fill `seen`, `late_s` and, as the sights say themselves, `label`; returns the mean time of the sights after row
    0, ns, and how many they are. `intrinsics` (C, 9): the middle row is that of the optical axis."""
    total, count = 0.0, 0
    for m in range(frame.seen.shape[0]):
        frame.label[m] = m
        x, y = frame.pixels[m]
        frame.seen[m] = not flags[m] & _LOST and np.isfinite(x + y)
        if frame.seen[m]:
            frame.late_s[m] = y * row_time_s
            total += frame.late_s[m]
            count += 1
    mean = total / count if count else intrinsics[frame.camera[0], 3] * row_time_s
    for m in range(frame.seen.shape[0]):
        frame.late_s[m] -= mean
    return 1e9 * mean, count
