"""The clockwork of pairing: which frames count, which cameras are live, and the newest instant all of them bracket.

Arrays: `frames` (C, 8) int64, times of each camera's row 0 in its newest frames, ns, ascending; `book` (C, 4) int64,
its columns COUNT, RECEIVED, STALE and NEW; `newest` (C, M) the markers' own times in the newest frame, -1 where lost.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

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
_LATE_NS = 500_000_000  # later than this a frame is of no use to any track
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
    elif count > 0 and frames[count - 1] - t_row0_ns > _LATE_NS:
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
