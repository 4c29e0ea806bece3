"""Brings cameras that are not synchronised to one instant: decides when a state is due, and for which time.

The state's time is the newest instant that every live camera brackets: the earliest of the times at which the cameras'
newest frames saw their markers, each marker at its own row's time. All tracks are interpolated to it; nothing is
paired by arrival.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.estimation.track import LOST_NS, SESSION_NS
from rhot_app.tracking import tracks
from rhot_app.tracking.tracker import CameraObservations
from rhot_node.wire.messages import MarkerFlag

Array = NDArray[np.float64]

# -- compiled bookkeeping of frames ------------------------------------------------------------------------------------
# Arrays: `frames` (C, 8) int64, times of each camera's row 0 in its newest frames, ns, ascending; `book` (C, 4) int64,
# its columns COUNT, RECEIVED, STALE and NEW; `newest` (C, M) the markers' own times in the newest frame, -1 where lost.

Times = NDArray[np.int64]
Mask = NDArray[np.bool_]

COUNT, RECEIVED, STALE, NEW = range(4)
"""Of one camera: frames held, last receive time ns, frames too late in a row, whether new since the last state."""

FRAMES = 8

IGNORED, TAKEN, ANEW = range(3)
"""What became of a frame; ANEW: it begins its camera's time anew, what came before is of another clock."""

SILENT_NS = 200_000_000
"""A camera unheard for longer (or for three of its frame periods) no longer holds up the others."""

_SAME_FRAME_NS = 1_000_000  # the same frame again, its time moved a little by a new clock estimate
_STEP_NS = 100_000_000  # frames cannot come from the future by more than delays vary
_STALE_FRAMES_BEFORE_RESET = 5


@njit(cache=True)
def place_frame(frames: Times, book: Times, t_row0_ns: int, receive_ns: int) -> int:
    """Enter a frame's time into one camera's `frames` (8,) and `book` (4,); IGNORED, TAKEN or ANEW."""
    count = book[COUNT]
    outcome = TAKEN
    for k in range(count):
        if abs(frames[k] - t_row0_ns) < _SAME_FRAME_NS:
            return IGNORED
    if count > 0 and t_row0_ns > frames[count - 1]:
        book[STALE] = 0
        if t_row0_ns - frames[count - 1] > receive_ns - book[RECEIVED] + _STEP_NS:
            outcome = ANEW  # its clock was set forwards
    elif count > 0 and frames[count - 1] - t_row0_ns > LOST_NS:  # of no use to any track
        book[STALE] += 1
        if book[STALE] < _STALE_FRAMES_BEFORE_RESET:
            return IGNORED
        outcome = ANEW  # not late: its clock was set back
    if outcome == ANEW:
        count = 0
        book[STALE] = 0
    elif count == FRAMES:
        if t_row0_ns < frames[0]:
            return IGNORED
        frames[:-1] = frames[1:].copy()
        count -= 1
    place = count
    while place > 0 and frames[place - 1] > t_row0_ns:
        frames[place] = frames[place - 1]
        place -= 1
    frames[place] = t_row0_ns
    book[COUNT] = count + 1
    return outcome


@njit(cache=True)
def period_ns(frames: Times, count: int) -> int:
    """Median spacing of one camera's frame times, ns; 0 with fewer than two."""
    if count < 2:
        return 0
    spacings = np.empty(FRAMES - 1, np.int64)
    for k in range(count - 1):
        spacing, place = frames[k + 1] - frames[k], k
        while place > 0 and spacings[place - 1] > spacing:
            spacings[place] = spacings[place - 1]
            place -= 1
        spacings[place] = spacing
    return int(spacings[(count - 1) // 2])


@njit(cache=True)
def find_live(frames: Times, book: Times, first_receive_ns: int, last_receive_ns: int, live: Mask) -> None:
    """Fill `live` (C,): cameras heard of recently; one never heard has as long since the first frame of any."""
    for c in range(live.shape[0]):
        since = book[c, RECEIVED] if book[c, COUNT] > 0 else first_receive_ns
        live[c] = last_receive_ns - since <= max(SILENT_NS, 3 * period_ns(frames[c], book[c, COUNT]))


@njit(cache=True)
def newest_instant(frames: Times, book: Times, newest: Times, live: Mask) -> tuple[int, int, bool]:
    """(newest instant that every live camera brackets or -1, slowest live camera's frame period, whether all are new).
    """
    instant, period, all_new = -1, 0, True
    for c in range(live.shape[0]):
        if not live[c]:
            continue
        count = book[c, COUNT]
        if count == 0:
            return -1, 0, False
        time = -1
        for m in range(newest.shape[1]):
            if newest[c, m] >= 0 and (time < 0 or newest[c, m] < time):
                time = newest[c, m]
        if time < 0:
            time = frames[c, count - 1]
        instant = time if instant < 0 else min(instant, time)
        period = max(period, period_ns(frames[c], count))
        all_new = all_new and book[c, NEW] != 0
    return instant, period, all_new


# -- pairing of unsynchronised cameras ---------------------------------------------------------------------------------

Flags = NDArray[np.uint16]

_ADVANCE_FRACTION = 0.6  # of a frame period; see `Pairing.due`
_SIGMA_FLOOR_PX = 0.01
_LOST = int(MarkerFlag.LOST)

_FIRST_RECEIVE, _LAST_RECEIVE, _LAST_STATE = range(3)  # of the marks, ns; -1: none yet


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


class _Tracks(NamedTuple):
    """C cameras, M markers: `frames` (C, 8) and `book` (C, 4) as in `schedule`; `marks` (3,) ns; `times` .. `counts` as
    in `tracks`; `newest` (C, M) the markers' own times in the newest frame, `seen_pixels` (C, M, 2) and `seen_flags`
    (C, M) what it shows."""

    frames: Times
    book: Times
    marks: Times
    times: Times
    pixels: Array
    covariances: Array
    flags: Flags
    counts: Times
    newest: Times
    seen_pixels: Array
    seen_flags: Flags


class Pairing:
    """Tracks of C cameras and M markers, and the clockwork that says when the next state is due."""

    def __init__(self, cameras: int, markers: int) -> None:
        self._shape = (cameras, markers)
        length = tracks.LENGTH
        self._tracks = _Tracks(
            np.zeros((cameras, FRAMES), np.int64), np.zeros((cameras, 4), np.int64), np.empty(3, np.int64),
            np.zeros((cameras, markers, length), np.int64), np.zeros((cameras, markers, length, 2)),
            np.zeros((cameras, markers, length, 2, 2)), np.zeros((cameras, markers, length), np.uint16),
            np.zeros((cameras, markers), np.int64), np.empty((cameras, markers), np.int64),
            np.empty((cameras, markers, 2)), np.empty((cameras, markers), np.uint16))
        self.reset()

    def reset(self) -> None:
        """Forget all tracks and the last state."""
        self._tracks.counts[:] = 0
        self._tracks.newest[:] = -1
        self._tracks.seen_pixels[:] = np.nan
        self._tracks.seen_flags[:] = _LOST
        self._tracks.book[:] = 0
        self._tracks.marks[:] = -1
        self._latest: CameraObservations | None = None
        self.newest_frames: list[CameraObservations | None] = [None] * self._shape[0]

    @property
    def heard(self) -> bool:
        """Whether any frame came since the last reset."""
        return self._latest is not None

    def ingest(self, observations: CameraObservations) -> None:
        """Take one frame into the tracks. Duplicates are ignored, late frames are put in their place."""
        camera = observations.camera
        if _ingest(self._tracks, camera, observations.t_row0_master_ns, observations.t_receive_ns,
                   observations.row_time_ns, observations.pixels, observations.covariances, observations.flags):
            self._latest = self.newest_frames[camera] = observations

    def due(self) -> Paired | None:
        """All cameras at the newest bracketed instant, if a state is due there.

        It is due when every live camera has delivered a new frame since the last state and the instant advanced, so
        that states come at the slowest camera's rate. It is also due when the instant advanced by most of a frame
        period: the cameras' phases drift, and without this the pairing would stay with the older of two possible
        partners, up to a whole period behind.
        """
        if self._latest is None:
            return None
        live, pixels = np.empty(self._shape[0], np.bool_), np.empty((*self._shape, 2))
        covariances, flags = np.empty((*self._shape, 2, 2)), np.empty(self._shape, np.int64)
        instant = _pair(self._tracks, live, pixels, covariances, flags)
        return None if instant < 0 else Paired(instant, pixels, covariances, flags, live, self._latest)

    def last_seen(self) -> tuple[Array, Flags]:
        """(C, M, 2) px of each camera's newest frame, NaN where lost, and (C, M) its flags."""
        return self._tracks.seen_pixels.copy(), self._tracks.seen_flags.copy()


@njit(cache=True)
def _ingest(all_tracks: _Tracks, camera: int, t_row0_ns: int, receive_ns: int, row_time_ns: int, pixels: Array,
            covariances: Array, flags: Flags) -> bool:
    """Take one frame into the tracks; returns whether it is its camera's newest."""
    frames, book, marks, newest = all_tracks.frames, all_tracks.book, all_tracks.marks, all_tracks.newest
    if marks[_FIRST_RECEIVE] < 0:
        marks[_FIRST_RECEIVE] = receive_ns
    outcome = place_frame(frames[camera], book[camera], t_row0_ns, receive_ns)
    if outcome == IGNORED:
        return False
    if outcome == ANEW:
        all_tracks.counts[camera] = 0
        newest[camera] = -1
    book[camera, RECEIVED] = max(book[camera, RECEIVED], receive_ns)
    marks[_LAST_RECEIVE] = max(marks[_LAST_RECEIVE], receive_ns)
    is_newest = frames[camera, book[camera, COUNT] - 1] == t_row0_ns
    tracks.ingest_frame(all_tracks.times[camera], all_tracks.pixels[camera], all_tracks.covariances[camera],
                        all_tracks.flags[camera], all_tracks.counts[camera], newest[camera], t_row0_ns, row_time_ns,
                        is_newest, _SIGMA_FLOOR_PX, pixels, covariances, flags)
    if is_newest:
        book[camera, NEW] = 1
        for m in range(newest.shape[1]):
            seen = newest[camera, m] >= 0
            for k in range(2):
                all_tracks.seen_pixels[camera, m, k] = pixels[m, k] if seen else np.nan
            all_tracks.seen_flags[camera, m] = flags[m] if seen else _LOST
    return bool(is_newest)


@njit(cache=True)
def _pair(all_tracks: _Tracks, live: Mask, pixels: Array, covariances: Array, flags: Times) -> int:
    """The instant at which a state is due, with the last four arrays filled as `Paired` says; -1 when none is."""
    frames, book, marks = all_tracks.frames, all_tracks.book, all_tracks.marks
    find_live(frames, book, marks[_FIRST_RECEIVE], marks[_LAST_RECEIVE], live)
    instant, period, all_new = newest_instant(frames, book, all_tracks.newest, live)
    if instant < 0:
        return -1
    advance = instant - marks[_LAST_STATE]
    if marks[_LAST_STATE] < 0 or advance < -SESSION_NS:
        advance = period + 1
    if advance <= 0 or not (all_new or (period > 0 and advance >= _ADVANCE_FRACTION * period)):
        return -1
    gaps = np.empty(live.shape[0], np.int64)
    for c in range(live.shape[0]):
        gaps[c] = tracks.longest_gap_ns(period_ns(frames[c], book[c, COUNT]))
    tracks.interpolate_all(all_tracks.times, all_tracks.pixels, all_tracks.covariances, all_tracks.flags,
                           all_tracks.counts, gaps, instant, pixels, covariances, flags)
    marks[_LAST_STATE] = instant
    book[:, NEW] = 0
    return int(instant)
