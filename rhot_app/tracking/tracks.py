"""Short tracks of image positions, one per camera and marker, and their interpolation to any instant.

Arrays: times (C, M, K) int64 ns ascending, newest last of `counts` (C, M); pixels (C, M, K, 2); covariances
(C, M, K, 2, 2) px^2; flags (C, M, K).
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_node.wire.messages import MarkerFlag

Array = NDArray[np.float64]
Times = NDArray[np.int64]
Flags = NDArray[np.uint16]

LENGTH = 32
"""Samples kept: 0.26 s at 120 fps, more than any camera may lag behind another and still count as live."""

MAX_GAP_NS = 100_000_000
"""No curve is laid through samples further apart: a finger reverses its direction in that time. A camera that is
slower than this is interpolated in straight lines, and pays for it with its covariance."""

SLOW_PERIODS = 2.5
SLOWEST_GAP_NS = 600_000_000
"""A slow camera's samples are one track over this many of its own frame periods, and never over more ns."""

ACCELERATION_PX = 8_000.0
"""What a hand's acceleration looks like, standard deviation in px/s^2: 10 m/s^2 at 0.7 m through a 560 px lens."""

DOUBTFUL = int(MarkerFlag.PARTIAL | MarkerFlag.EDGE | MarkerFlag.AMBIGUOUS)
"""Flags of a sample whose centroid may be biased by pixels, or be another blob's."""

_START = int(MarkerFlag.ACQUIRED)  # first sample of a track: what was seen before may have been another thing

_MAX_SPACING_RATIO = 2.5  # more irregular spacing makes the polynomial amplify noise more than it bends
_SAME_NS = 1_000  # a sample this near to the instant is the value at the instant


@njit(cache=True)
def insert(times: Times, pixels: Array, covariances: Array, flags: Flags, count: int,
           t_ns: int, x: float, y: float, covariance: Array, flag: int) -> int:
    """Put one sample in its place in one track (K, ...); returns the new count. A sample older than a full track
    remembers, or at the time of one that is there, is ignored."""
    place = count
    while place > 0 and times[place - 1] > t_ns:
        place -= 1
    if place > 0 and times[place - 1] == t_ns:
        return count
    full = count == times.shape[0]
    if full:
        if place == 0:
            return count
        place -= 1
        for k in range(place):
            times[k] = times[k + 1]
            pixels[k] = pixels[k + 1]
            covariances[k] = covariances[k + 1]
            flags[k] = flags[k + 1]
    else:
        for k in range(count, place, -1):
            times[k] = times[k - 1]
            pixels[k] = pixels[k - 1]
            covariances[k] = covariances[k - 1]
            flags[k] = flags[k - 1]
    times[place] = t_ns
    pixels[place, 0] = x
    pixels[place, 1] = y
    covariances[place] = covariance
    flags[place] = flag
    return count if full else count + 1


@njit(cache=True)
def _regular(times: Times, flags: Flags, first: int, last: int) -> bool:
    """Whether samples first..last are one track, beyond doubt, and evenly enough spaced for one curve."""
    shortest, longest = times[first + 1] - times[first], times[first + 1] - times[first]
    for k in range(first + 1, last):
        spacing = times[k + 1] - times[k]
        shortest = min(shortest, spacing)
        longest = max(longest, spacing)
    for k in range(first, last + 1):
        if flags[k] & DOUBTFUL or (k > first and flags[k] & _START):
            return False
    return longest <= _MAX_SPACING_RATIO * shortest and longest <= MAX_GAP_NS


@njit(cache=True)
def _nodes(times: Times, flags: Flags, count: int, after: int) -> tuple[int, int]:
    """First and last sample of the polynomial for an instant between `after - 1` and `after`: four points with the
    instant in the middle where there are any later ones, else the newest four, else three, else the bracket."""
    for first, last in ((after - 2, after + 1), (after - 3, after), (after - 2, after), (after - 1, after + 1)):
        if first >= 0 and last < count and _regular(times, flags, first, last):
            return first, last
    return after - 1, after


@njit(cache=True)
def longest_gap_ns(period_ns: int) -> int:
    """The longest gap to be interpolated in the tracks of a camera of this frame period, ns."""
    return max(MAX_GAP_NS, min(round(SLOW_PERIODS * period_ns), SLOWEST_GAP_NS))


@njit(cache=True)
def interpolate(times: Times, pixels: Array, covariances: Array, flags: Flags, count: int, gap_ns: int,
                t_ns: int, pixel: Array, covariance: Array) -> int:
    """The position of one track (K, ...) at `t_ns`, by the Lagrange polynomial of up to four neighbouring samples.

    A cubic, because a straight line between samples leaves a dt^2 / 8: 2 mm for a hand at 2 m/s and 40 frames/s.
    Writes `pixel` (2,) and `covariance` (2, 2); returns the bracketing samples' flags, or -1 when the instant is not
    bracketed by samples of one track at most `gap_ns` apart. Over more than MAX_GAP_NS the line is straight, and the
    covariance holds what an acceleration bends it by: a u v / 2 at u and v seconds from the two samples.
    """
    after = 0
    while after < count and times[after] < t_ns - _SAME_NS:
        after += 1
    if after == count:
        return -1
    if abs(times[after] - t_ns) <= _SAME_NS:
        pixel[:] = pixels[after]
        covariance[:] = covariances[after]
        return int(flags[after])
    if after == 0 or times[after] - times[after - 1] > gap_ns or flags[after] & _START:
        return -1
    first, last = _nodes(times, flags, count, after)
    pixel[:] = 0.0
    covariance[:] = 0.0
    for k in range(first, last + 1):
        weight = 1.0
        for j in range(first, last + 1):
            if j != k:
                weight *= float(t_ns - times[j]) / float(times[k] - times[j])
        pixel += weight * pixels[k]
        covariance += weight * weight * covariances[k]
    if times[after] - times[after - 1] > MAX_GAP_NS:
        bend = 0.5e-18 * ACCELERATION_PX * float(t_ns - times[after - 1]) * float(times[after] - t_ns)
        covariance[0, 0] += bend * bend
        covariance[1, 1] += bend * bend
    return int(flags[after - 1] | flags[after])


@njit(cache=True)
def ingest_frame(times: Times, pixels: Array, covariances: Array, flags: Flags, counts: NDArray[np.int64],
                 newest: Times, t_row0_ns: int, row_time_ns: int, is_newest: bool, sigma_floor_px: float,
                 new_pixels: Array, new_covariances: Array, new_flags: Flags) -> int:
    """Take one frame's markers into one camera's tracks (M, K, ...).

    What is lost, not finite or without a usable covariance is no sample. When the frame `is_newest`, `newest` (M,) is
    set to the markers' own times, or -1 where lost. Returns the number of samples.
    """
    floor = sigma_floor_px * sigma_floor_px
    covariance = np.empty((2, 2))
    taken = 0
    for m in range(newest.shape[0]):
        if is_newest:
            newest[m] = -1
        x, y = new_pixels[m, 0], new_pixels[m, 1]
        if new_flags[m] & 1 or not (abs(x) < 1e5 and abs(y) < 1e5):
            continue
        covariance[:] = new_covariances[m]
        determinant = covariance[0, 0] * covariance[1, 1] - covariance[0, 1] * covariance[1, 0]
        if not (determinant >= 0.0 and 0.0 <= covariance[0, 0] < 1e8 and 0.0 <= covariance[1, 1] < 1e8):
            continue
        covariance[0, 0] += floor
        covariance[1, 1] += floor
        t_ns = t_row0_ns + round(y * row_time_ns)
        counts[m] = insert(times[m], pixels[m], covariances[m], flags[m], counts[m], t_ns, x, y, covariance,
                           new_flags[m])
        if is_newest:
            newest[m] = t_ns
        taken += 1
    return taken


@njit(cache=True)
def interpolate_all(times: Times, pixels: Array, covariances: Array, flags: Flags, counts: NDArray[np.int64],
                    gaps_ns: Times, t_ns: int, out_pixels: Array, out_covariances: Array,
                    out_flags: NDArray[np.int64]) -> None:
    """`interpolate` for every camera, with its own longest gap (C,), and marker; NaN pixels and flags -1 where the
    instant is not bracketed."""
    for c in range(counts.shape[0]):
        for m in range(counts.shape[1]):
            flag = interpolate(times[c, m], pixels[c, m], covariances[c, m], flags[c, m], counts[c, m], gaps_ns[c],
                               t_ns, out_pixels[c, m], out_covariances[c, m])
            out_flags[c, m] = flag
            if flag < 0:
                out_pixels[c, m] = np.nan
                out_covariances[c, m] = np.nan
