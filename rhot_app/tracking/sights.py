"""What each camera saw last of each marker, and what came of it: the model tracker's memory of raw observations."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rhot_app.tracking.kalman.hand_filter import Outcome
from rhot_app.tracking.kalman.marker_block import MarkerBlock
from rhot_app.tracking.tracker import CameraObservations
from rhot_app.tracking.tracks import DOUBTFUL
from rhot_node.wire.messages import MarkerFlag

Array = NDArray[np.float64]
Flags = NDArray[np.uint16]

_SAME_FRAME_NS = 1_000_000
_RECENT = 12
_PERIODS = 1.5
_SLOWEST_NS = 400_000_000


class Sights:
    """C cameras, M markers. `times` (C, M) ns, -1 for never, `pixels` (C, M, 2) and `covariances` (C, M, 2, 2) of the
    last believed sight of each marker; `fresh_ns`: how old one may be that counts as of now."""

    def __init__(self, cameras: int, markers: int) -> None:
        self._shape = (cameras, markers)
        self.reset()

    def reset(self) -> None:
        """Forget all."""
        self.times = np.full(self._shape, -1, np.int64)
        self.pixels = np.full((*self._shape, 2), np.nan)
        self.covariances = np.ones((*self._shape, 2, 2)) * np.eye(2)
        self.fresh_ns = 60_000_000
        self.newest: list[CameraObservations | None] = [None] * self._shape[0]
        self._doubtful = np.zeros(self._shape, np.bool_)
        self._blocks: list[MarkerBlock] = []

    def enter(self, block: MarkerBlock) -> bool:
        """Take a frame in; False when it is there already."""
        camera, begin = block.observations.camera, block.observations.t_row0_master_ns
        for other in self._blocks:
            if (other.observations.camera == camera
                    and abs(other.observations.t_row0_master_ns - begin) < _SAME_FRAME_NS):
                return False
        self._blocks = [*self._blocks[1 - _RECENT:], block]
        last = self.newest[camera]
        if last is None or begin > last.t_row0_master_ns or last.t_row0_master_ns - begin > _SLOWEST_NS:
            if last is not None and 0 < begin - last.t_row0_master_ns < _SLOWEST_NS:
                period = _PERIODS * (begin - last.t_row0_master_ns)
                self.fresh_ns += round(0.1 * (period - self.fresh_ns))
            self.newest[camera] = block.observations
        return True

    def recent(self, since_ns: int) -> list[MarkerBlock]:
        """The frames of the last moments that are not earlier than `since_ns`, in the order of time."""
        return sorted((block for block in self._blocks if block.t_ns >= since_ns), key=lambda block: block.t_ns)

    def believe(self, block: MarkerBlock, outcome: Outcome) -> None:
        """Note which sights of a frame were believed, under the names that the hand gave them."""
        frame, camera = block.frame, block.observations.camera
        sights = outcome.source[outcome.believed, 1]
        markers = frame.label[sights]
        times = block.t_ns + (1e9 * frame.late_s[sights]).astype(np.int64)
        newer = times >= self.times[camera, markers]
        sights, markers = sights[newer], markers[newer]
        self.times[camera, markers] = times[newer]
        self.pixels[camera, markers] = frame.pixels[sights]
        self.covariances[camera, markers] = frame.covariances[sights]
        self._doubtful[camera, markers] = (block.observations.flags[sights] & DOUBTFUL) != 0

    def clear(self, t_ns: int) -> NDArray[np.bool_]:
        """(M,) markers that two cameras or more see beyond doubt, just now."""
        fresh = (self.times >= 0) & (np.abs(t_ns - self.times) <= self.fresh_ns) & ~self._doubtful
        return np.asarray(fresh.sum(axis=0) >= 2)

    def last_seen(self) -> tuple[Array, Flags]:
        """(C, M, 2) px of each camera's newest frame, NaN where lost, and (C, M) its flags."""
        pixels = np.full((*self._shape, 2), np.nan)
        flags = np.full(self._shape, int(MarkerFlag.LOST), np.uint16)
        for camera, frame in enumerate(self.newest):
            if frame is not None:
                pixels[camera], flags[camera] = frame.pixels, frame.flags
        return pixels, flags
