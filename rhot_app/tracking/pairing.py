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

from rhot_app.estimation.track import LOST_NS, NEVER, PREDICTED_NS, SESSION_NS
from rhot_app.tracking.tracker import CameraObservations
from rhot_node.wire.messages import MarkerFlag

Array = NDArray[np.float64]
Times = NDArray[np.int64]
Mask = NDArray[np.bool_]
Flags = NDArray[np.uint16]
Indices = NDArray[np.intp]

KEPT = 32
"""Frames of a camera: 0.26 s at 120 fps, more than it may lag behind another and still count as live."""

SAME_FRAME_NS = 1_000_000
"""ns: the same frame again may have moved by this, with a new estimate of the clock."""

SILENT_NS, SILENT_PERIODS = 200_000_000, 3
"""ns and frame periods: a camera unheard for longer than both no longer holds up the others. No delay varies by more,
so a frame from further in the future than it arrived later has another clock."""

LATE_FRAMES = 5
"""So many frames in a row that are too late for any track are not late: the camera's clock was set back."""

ONE_LOST = 2.5
"""Frame periods between two samples of which one between was lost, and their jitter. Over more of its own periods a
camera has no track, and a spacing that varies by more makes a polynomial amplify noise more than it bends."""

ADVANCE = 0.6
"""Least share of a frame period between states. By half a period the newest instant of two cameras advances with every
frame."""

SIGMA_FLOOR_PX = 0.01

ACCELERATION_PX = 8_000.0
"""What a hand's acceleration looks like, standard deviation in px/s^2: 10 m/s^2 at 0.7 m through a 560 px lens."""

DOUBTFUL = int(MarkerFlag.PARTIAL | MarkerFlag.EDGE | MarkerFlag.AMBIGUOUS)
"""Flags of a sample whose centroid may be biased by pixels, or be another blob's."""

_LOST, _START = int(MarkerFlag.LOST), int(MarkerFlag.ACQUIRED)  # ACQUIRED: before, it may have been another thing


# -- one marker in one camera ------------------------------------------------------------------------------------------

class Samples(NamedTuple):
    """One marker in K frames of one camera: `t_ns` (K,) ascending, each at its own row's time, NEVER where lost;
    `pixels` (K, 2); `covariances` (K, 2, 2) px^2; `flags` (K,) MarkerFlag."""

    t_ns: Times
    pixels: Array
    covariances: Array
    flags: Flags


@njit(cache=True)
def _regular(samples: Samples, rows: Indices) -> bool:
    """Whether the samples of these rows are one track, beyond doubt, and evenly enough spaced for one curve."""
    shortest, longest = LOST_NS, 0
    for k in range(len(rows)):
        flags = samples.flags[rows[k]]
        if flags & DOUBTFUL or (k > 0 and flags & _START):
            return False
        if k > 0:
            spacing = samples.t_ns[rows[k]] - samples.t_ns[rows[k - 1]]
            shortest, longest = min(shortest, spacing), max(longest, spacing)
    return bool(longest <= ONE_LOST * shortest and longest <= PREDICTED_NS)


@njit(cache=True)
def _nodes(samples: Samples, rows: Indices, after: int) -> Indices:
    """Rows of the polynomial for an instant between `after - 1` and `after` of `rows`: four points with the instant in
    the middle where there are any later ones, else the newest four, else three, else the bracket."""
    for first, last in ((after - 2, after + 1), (after - 3, after), (after - 2, after), (after - 1, after + 1)):
        if first >= 0 and last < len(rows) and _regular(samples, rows[first:last + 1]):
            return rows[first:last + 1]
    return rows[after - 1:after + 1]


@njit(cache=True)
def longest_gap_ns(period_ns: int) -> int:
    """The longest gap to be interpolated in the tracks of a camera of this frame period, ns."""
    return max(PREDICTED_NS, min(round(ONE_LOST * period_ns), LOST_NS))


@njit(cache=True)
def interpolate(samples: Samples, gap_ns: int, t_ns: int, pixel: Array, covariance: Array) -> int:
    """p(t) = sum_k w_k(t) p_k by Lagrange's polynomial of up to four samples about `t_ns`; its covariance is
    sum_k w_k^2 C_k.

    A cubic, because a straight line between samples leaves a dt^2 / 8: 2 mm for a hand at 2 m/s and 40 frames/s.
    Writes `pixel` (2,) and `covariance` (2, 2); returns the bracketing samples' flags, or -1 when the instant is not
    bracketed by samples of one track at most `gap_ns` apart. Over more than PREDICTED_NS, in which a finger may turn
    back, the line is straight, and the covariance holds what an acceleration a bends it by: a u v / 2 at u and v
    seconds from the two samples.
    """
    times, flags, rows = samples.t_ns, samples.flags, np.flatnonzero(samples.t_ns > NEVER)
    after = int(np.searchsorted(times[rows], t_ns))
    if after == len(rows):
        return -1
    newer, older = rows[after], rows[after - 1]
    if times[newer] == t_ns:
        pixel[:], covariance[:] = samples.pixels[newer], samples.covariances[newer]
        return int(flags[newer])
    if after == 0 or times[newer] - times[older] > gap_ns or flags[newer] & _START:
        return -1
    nodes = _nodes(samples, rows, after)
    pixel[:], covariance[:] = 0.0, 0.0
    for k in nodes:
        weight = 1.0
        for j in nodes:
            if j != k:
                weight *= float(t_ns - times[j]) / float(times[k] - times[j])
        pixel += weight * samples.pixels[k]
        covariance += weight * weight * samples.covariances[k]
    if times[newer] - times[older] > PREDICTED_NS:
        bend = 0.5e-18 * ACCELERATION_PX * float(t_ns - times[older]) * float(times[newer] - t_ns)
        covariance += bend * bend * np.eye(2)
    return int(flags[older] | flags[newer])


# -- all markers in all cameras ----------------------------------------------------------------------------------------

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


class _Buffer(NamedTuple):
    """The newest K frames of C cameras, oldest first; NEVER where there is none. `row0_ns` (C, K) of each frame's first
    row, `t_ns` (C, M, K) of each marker, NEVER where lost; `pixels`, `covariances` and `flags` (C, M, K, ...) as
    `Samples`. Of each camera (C,): `received_ns`, when it was heard last, `late`, frames too late in a row, and `new`,
    whether it has a new frame since the last state."""

    row0_ns: Times
    t_ns: Times
    pixels: Array
    covariances: Array
    flags: Flags
    received_ns: Times
    late: Times
    new: Mask


class Pairing:
    """The newest frames of C cameras and M markers, and the rule that says when the next state is due."""

    def __init__(self, cameras: int, markers: int) -> None:
        self._shape = shape = (cameras, markers)
        self._buffer = _Buffer(
            np.empty((cameras, KEPT), np.int64), np.empty((*shape, KEPT), np.int64), np.zeros((*shape, KEPT, 2)),
            np.zeros((*shape, KEPT, 2, 2)), np.zeros((*shape, KEPT), np.uint16), np.zeros(cameras, np.int64),
            np.zeros(cameras, np.int64), np.zeros(cameras, np.bool_))
        self.reset()

    def reset(self) -> None:
        """Forget all frames and the last state."""
        self._buffer.row0_ns[:] = self._buffer.t_ns[:] = NEVER
        self._buffer.late[:], self._buffer.new[:] = 0, False
        self._last_ns = NEVER
        self._latest: CameraObservations | None = None
        self.newest_frames: list[CameraObservations | None] = [None] * self._shape[0]

    def ingest(self, observations: CameraObservations) -> None:
        """Keep one frame. Duplicates are ignored, late frames are put in their place."""
        camera, receive_ns = observations.camera, observations.t_receive_ns
        if self._latest is None:
            self._buffer.received_ns[:] = receive_ns  # a camera that is not heard is waited for from now
        if _ingest(self._buffer, camera, observations.t_row0_master_ns, receive_ns, observations.row_time_ns,
                   observations.pixels, observations.covariances, observations.flags):
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
        instant = _pair(self._buffer, self._last_ns, live, pixels, covariances, flags)
        if instant == NEVER:
            return None
        self._last_ns = instant
        return Paired(instant, pixels, covariances, flags, live, self._latest)

    def last_seen(self) -> tuple[Array, Flags]:
        """(C, M, 2) px of each camera's newest frame, NaN where lost, and (C, M) its flags."""
        lost = self._buffer.t_ns[..., -1] == NEVER
        return (np.where(lost[..., None], np.nan, self._buffer.pixels[:, :, -1]),
                np.where(lost, _LOST, self._buffer.flags[..., -1]).astype(np.uint16))


@njit(cache=True)
def _insert(column: NDArray, place: int, value: object) -> None:
    """Put a value before `place` of a column (K, ...) in the order of time; the oldest falls out."""
    for k in range(place - 1):
        column[k] = column[k + 1]
    column[place - 1] = value


@njit(cache=True)
def _ingest(buffer: _Buffer, camera: int, row0_ns: int, receive_ns: int, row_time_ns: int, pixels: Array,
            covariances: Array, flags: Flags) -> bool:
    """Put one frame in its place; returns whether it is its camera's newest. A marker that is lost, is not finite or
    has no usable covariance is no sample."""
    times, own_times, late = buffer.row0_ns[camera], buffer.t_ns[camera], buffer.late
    if (np.abs(times - row0_ns) < SAME_FRAME_NS).any():
        return False
    too_late, ahead_ns = times[-1] - row0_ns > LOST_NS, row0_ns - times[-1]
    late[camera] = late[camera] + 1 if too_late else 0
    if late[camera] == LATE_FRAMES or ahead_ns > receive_ns - buffer.received_ns[camera] + SILENT_NS:
        times[:], own_times[:], late[camera] = NEVER, NEVER, 0  # the clock was set
    place = int(np.searchsorted(times, row0_ns))
    if late[camera] > 0 or place == 0:
        return False
    buffer.received_ns[camera] = max(buffer.received_ns[camera], receive_ns)
    _insert(times, place, row0_ns)
    floor = SIGMA_FLOOR_PX * SIGMA_FLOOR_PX * np.eye(2)
    for m in range(own_times.shape[0]):
        (x, y), covariance, t_ns = pixels[m], covariances[m] + floor, NEVER
        determinant = covariance[0, 0] * covariance[1, 1] - covariance[0, 1] * covariance[1, 0]
        if (not flags[m] & _LOST and abs(x) + abs(y) < 1e6 and 0.0 < determinant < np.inf
                and covariance[0, 0] > 0.0):
            t_ns = row0_ns + round(y * row_time_ns)
        _insert(own_times[m], place, t_ns)
        _insert(buffer.pixels[camera, m], place, pixels[m])
        _insert(buffer.covariances[camera, m], place, covariance)
        _insert(buffer.flags[camera, m], place, flags[m])
    buffer.new[camera] |= place == KEPT
    return place == KEPT


@njit(cache=True)
def _period_ns(row0_ns: Times) -> int:
    """Median spacing of one camera's frame times (K,), ns; 0 with fewer than two."""
    spacing = np.sort(np.diff(row0_ns[row0_ns > NEVER]))
    return spacing[len(spacing) // 2] if len(spacing) else 0


@njit(cache=True)
def _pair(buffer: _Buffer, last_ns: int, live: Mask, pixels: Array, covariances: Array, flags: Times) -> int:
    """The instant at which a state is due, with the last four arrays filled as `Paired` says; NEVER when none is.
    `last_ns`: of the last state."""
    cameras, markers = flags.shape
    instant, slowest_ns, all_new, gaps_ns = -NEVER, 0, True, np.empty(cameras, np.int64)
    for c in range(cameras):
        newest_ns, period_ns = buffer.row0_ns[c, -1], _period_ns(buffer.row0_ns[c])
        gaps_ns[c] = longest_gap_ns(period_ns)
        live[c] = (buffer.received_ns.max() - buffer.received_ns[c] <= max(SILENT_NS, SILENT_PERIODS * period_ns))
        if live[c]:
            own = buffer.t_ns[c, :, -1]
            own = own[own > NEVER]
            instant = min(instant, own.min() if len(own) else newest_ns)
            slowest_ns, all_new = max(slowest_ns, period_ns), all_new and buffer.new[c]
    advance = instant - last_ns
    if instant == NEVER or (advance >= -SESSION_NS and (
            advance <= 0 or not (all_new or advance >= ADVANCE * slowest_ns > 0))):
        return NEVER
    for c in range(cameras):
        for m in range(markers):
            samples = Samples(buffer.t_ns[c, m], buffer.pixels[c, m], buffer.covariances[c, m], buffer.flags[c, m])
            flags[c, m] = interpolate(samples, gaps_ns[c], instant, pixels[c, m], covariances[c, m])
            if flags[c, m] < 0:
                pixels[c, m], covariances[c, m] = np.nan, np.nan
    buffer.new[:] = False
    return instant
