"""Brings cameras that are not synchronised to one instant: decides when a state is due, and for which time.

The state's time is the newest instant that every live camera brackets: the earliest of the times at which the cameras'
newest frames saw their markers, each marker at its own row's time. All tracks are interpolated to it; nothing is
paired by arrival.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from rhot_app.tracking import tracks
from rhot_app.tracking.tracker import CameraObservations
from rhot_node.wire.messages import MarkerFlag

Array = NDArray[np.float64]

SILENT_NS = 200_000_000
"""A camera unheard for longer (or for three of its frame periods) no longer holds up the others."""

_SAME_FRAME_NS = 1_000_000  # the same frame again, its time moved a little by a new clock estimate
_LATE_NS = 500_000_000  # later than this a frame is of no use to any track
_STEP_NS = 100_000_000  # frames cannot come from the future by more than delays vary
_STALE_FRAMES_BEFORE_RESET = 5
_NEW_TIMELINE_NS = 1_000_000_000
_ADVANCE_FRACTION = 0.6  # of a frame period; see `Pairing.due`
_SIGMA_FLOOR_PX = 0.01
_FRAMES = 8


@dataclass(frozen=True, slots=True)
class Paired:
    """All cameras at one instant. `pixels` (C, M, 2) raw px, NaN where the instant is not bracketed; `covariances`
    (C, M, 2, 2) px^2; `flags` (C, M) MarkerFlag of the bracketing samples, -1 where there are none; `live` (C,)."""

    t_ns: int
    pixels: Array
    covariances: Array
    flags: NDArray[np.int64]
    live: NDArray[np.bool_]
    completed_by: CameraObservations


class Pairing:
    """Tracks of C cameras and M markers, and the clockwork that says when the next state is due."""

    def __init__(self, cameras: int, markers: int, time_offsets_ns: NDArray[np.int64] | None = None) -> None:
        self._shape = (cameras, markers)
        self._time_offsets_ns = np.zeros(cameras, np.int64) if time_offsets_ns is None else time_offsets_ns
        length = tracks.LENGTH
        self._times = np.zeros((cameras, markers, length), np.int64)
        self._pixels = np.zeros((cameras, markers, length, 2))
        self._covariances = np.zeros((cameras, markers, length, 2, 2))
        self._flags = np.zeros((cameras, markers, length), np.uint16)
        self.reset()

    def reset(self) -> None:
        """Forget all tracks and the last state."""
        cameras, markers = self._shape
        self._counts = np.zeros((cameras, markers), np.int64)
        self._newest = np.full((cameras, markers), -1, np.int64)
        self._frames: list[list[int]] = [[] for _ in range(cameras)]
        self._newest_frames: list[CameraObservations | None] = [None] * cameras
        self._receive_ns: list[int] = [0] * cameras
        self._stale = [0] * cameras
        self._is_new = [False] * cameras
        self._first_receive_ns = 0
        self._last_receive_ns = 0
        self._last_state_ns = -1
        self._latest: CameraObservations | None = None

    @property
    def heard(self) -> bool:
        """Whether any frame came since the last reset."""
        return self._latest is not None

    def ingest(self, observations: CameraObservations) -> None:
        """Take one frame into the tracks. Duplicates are ignored, late frames are put in their place."""
        camera = observations.camera
        t_row0 = observations.t_row0_master_ns + int(self._time_offsets_ns[camera])
        receive = observations.t_receive_ns
        if self._latest is None:
            self._first_receive_ns = receive
        frames = self._frames[camera]
        if not self._place_frame(camera, t_row0, receive):
            return
        self._receive_ns[camera] = max(self._receive_ns[camera], receive)
        self._last_receive_ns = max(self._last_receive_ns, receive)
        newest = frames[-1] == t_row0
        tracks.ingest_frame(self._times[camera], self._pixels[camera], self._covariances[camera], self._flags[camera],
                            self._counts[camera], self._newest[camera], t_row0, observations.row_time_ns, newest,
                            _SIGMA_FLOOR_PX, observations.pixels, observations.covariances, observations.flags)
        if newest:
            self._is_new[camera] = True
            self._newest_frames[camera] = observations
            self._latest = observations

    def _place_frame(self, camera: int, t_row0: int, receive: int) -> bool:
        """Enter a frame's time into the camera's list; False when the frame is to be ignored."""
        frames = self._frames[camera]
        if not frames:
            frames.append(t_row0)
            return True
        if any(abs(t - t_row0) < _SAME_FRAME_NS for t in frames):
            return False
        if t_row0 > frames[-1]:
            elapsed = receive - self._receive_ns[camera]
            if t_row0 - frames[-1] > elapsed + _STEP_NS:
                self._reset_camera(camera)  # its clock was set forwards
            self._stale[camera] = 0
            frames.append(t_row0)
        elif frames[-1] - t_row0 > _LATE_NS:
            self._stale[camera] += 1
            if self._stale[camera] < _STALE_FRAMES_BEFORE_RESET:
                return False
            self._reset_camera(camera)  # not late: its clock was set back
            frames.append(t_row0)
        else:
            frames.append(t_row0)
            frames.sort()
        if len(frames) > _FRAMES:
            del frames[0]
        return t_row0 in frames

    def _reset_camera(self, camera: int) -> None:
        self._frames[camera].clear()
        self._counts[camera] = 0
        self._newest[camera] = -1
        self._newest_frames[camera] = None
        self._stale[camera] = 0

    def live(self) -> NDArray[np.bool_]:
        """(C,) cameras heard of recently; a camera never heard has as long since the first frame of any."""
        alive = np.zeros(self._shape[0], np.bool_)
        for camera, frames in enumerate(self._frames):
            since = self._receive_ns[camera] if frames else self._first_receive_ns
            alive[camera] = self._last_receive_ns - since <= max(SILENT_NS, 3 * _period_ns(frames))
        return alive

    def due(self) -> Paired | None:
        """All cameras at the newest bracketed instant, if a state is due there.

        It is due when every live camera has delivered a new frame since the last state and the instant advanced, so
        that states come at the slowest camera's rate. It is also due when the instant advanced by most of a frame
        period: the cameras' phases drift, and without this the pairing would stay with the older of two possible
        partners, up to a whole period behind.
        """
        if self._latest is None:
            return None
        live = self.live()
        instant, period, all_new = self._instant(live)
        if instant is None:
            return None
        advance = instant - self._last_state_ns if self._last_state_ns >= 0 else period + 1
        if advance < -_NEW_TIMELINE_NS:
            advance = period + 1
        if advance <= 0 or not (all_new or (period > 0 and advance >= _ADVANCE_FRACTION * period)):
            return None
        return self._pair(instant, live, self._latest)

    def _instant(self, live: NDArray[np.bool_]) -> tuple[int | None, int, bool]:
        """(newest bracketed instant or None, slowest live camera's frame period, whether all live ones are new)."""
        instant: int | None = None
        period, all_new = 0, True
        for camera in np.flatnonzero(live):
            frames = self._frames[camera]
            if not frames:
                return None, 0, False
            seen = self._newest[camera]
            seen = seen[seen >= 0]
            time = int(seen.min()) if seen.size else frames[-1]
            instant = time if instant is None else min(instant, time)
            period = max(period, _period_ns(frames))
            all_new = all_new and self._is_new[camera]
        return instant, period, all_new

    def _pair(self, instant: int, live: NDArray[np.bool_], latest: CameraObservations) -> Paired:
        pixels, covariances = np.empty((*self._shape, 2)), np.empty((*self._shape, 2, 2))
        flags = np.empty(self._shape, np.int64)
        tracks.interpolate_all(self._times, self._pixels, self._covariances, self._flags, self._counts, instant,
                               pixels, covariances, flags)
        self._last_state_ns = instant
        self._is_new = [False] * self._shape[0]
        return Paired(instant, pixels, covariances, flags, live, latest)

    def last_seen(self) -> tuple[Array, NDArray[np.uint16]]:
        """(C, M, 2) px of each camera's newest frame, NaN where lost, and (C, M) its flags."""
        cameras, markers = self._shape
        pixels = np.full((cameras, markers, 2), np.nan)
        flags = np.full((cameras, markers), int(MarkerFlag.LOST), np.uint16)
        for camera, observations in enumerate(self._newest_frames):
            if observations is not None:
                seen = self._newest[camera] >= 0
                pixels[camera, seen] = observations.pixels[seen]
                flags[camera, seen] = observations.flags[seen]
        return pixels, flags


def _period_ns(frames: list[int]) -> int:
    """Median spacing of frame times, ns; 0 with fewer than two."""
    spacings = sorted(later - earlier for earlier, later in pairwise(frames))
    return spacings[len(spacings) // 2] if spacings else 0
