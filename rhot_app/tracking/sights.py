"""What each camera saw last of each marker, and what came of it: the model tracker's memory of raw observations."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.lean import lean
from rhot_app.tracking.kalman.marker_block import MarkerBlock, Sighting
from rhot_app.tracking.kalman.rows import Outcome, Verdict
from rhot_app.tracking.kalman.share import Share
from rhot_app.tracking.kalman.surprise import UNLIKELY
from rhot_app.tracking.tracker import CameraObservations
from rhot_app.tracking.tracks import DOUBTFUL
from rhot_node.wire.messages import MarkerFlag

Array = NDArray[np.float64]
Flags = NDArray[np.uint16]
Indices = NDArray[np.int64]
Mask = NDArray[np.bool_]

SLOWEST_CLEAR_NS = 150_000_000
"""Sights that stay fresh for longer, those of a camera of fewer than 10 frames/s, measure nothing: where a hand went
from one to the next is guessed, and the covariances guess with it."""

_SAME_FRAME_NS = 1_000_000
_RECENT = 12
_PERIODS, _LEARN = 1.5, 0.1
_FRESH_NS = 60_000_000  # before a camera's second frame
_SLOWEST_NS = 400_000_000
_LOST = int(MarkerFlag.LOST)
_NEVER = -(1 << 62)  # ns


class Seen(NamedTuple):
    """The last believed sight of each of M markers by each of C cameras: `times` (C, M) ns, -1 for never; `pixels`
    (C, M, 2) raw px with `covariances` (C, M, 2, 2); `doubtful` (C, M), for what its flags say, for how unlikely it
    was, or because another camera sees more of it. `fresh_ns` (C,): how old a sight may be that counts as of now."""

    times: Indices
    pixels: Array
    covariances: Array
    doubtful: Mask
    fresh_ns: Indices


class Sights:
    """C cameras, M markers. `seen`: what was believed; `newest`: each camera's newest frame; `periods_s`: each
    camera's time from one frame to the next."""

    def __init__(self, cameras: int, markers: int) -> None:
        shape = (cameras, markers)
        self.seen = Seen(np.empty(shape, np.int64), np.empty((*shape, 2)), np.empty((*shape, 2, 2)),
                         np.empty(shape, np.bool_), np.empty(cameras, np.int64))
        self._shared = Share(self.seen)
        self._newest_pixels, self._newest_flags = np.empty((*shape, 2)), np.empty(shape, np.uint16)
        self.reset()

    def reset(self) -> None:
        """Forget all; `seen` stays the same arrays."""
        self.seen.times[:], self.seen.pixels[:], self.seen.covariances[:], self.seen.doubtful[:] = (
            -1, np.nan, np.eye(2), False)
        self.seen.fresh_ns[:] = _FRESH_NS
        self.periods_s = [1e-9 * _FRESH_NS / _PERIODS] * len(self._newest_flags)
        self._paced = [False] * len(self._newest_flags)
        self.newest: list[CameraObservations | None] = [None] * len(self._newest_flags)
        self._newest_pixels[:], self._newest_flags[:] = np.nan, _LOST
        self._latest = [_NEVER] * len(self._newest_flags)
        self._blocks: list[MarkerBlock] = []

    def enter(self, block: MarkerBlock) -> bool:
        """Take a frame in; False when it is there already."""
        observations = block.observations
        camera, begin = observations.camera, observations.t_row0_master_ns
        if begin < self._latest[camera] + _SAME_FRAME_NS:
            for other in self._blocks:
                if (other.observations.camera == camera
                        and abs(other.observations.t_row0_master_ns - begin) < _SAME_FRAME_NS):
                    return False
        self._latest[camera] = max(self._latest[camera], begin)
        self._blocks = [*self._blocks[1 - _RECENT:], block]
        last = self.newest[camera]
        if last is None or begin > last.t_row0_master_ns or last.t_row0_master_ns - begin > _SLOWEST_NS:
            if last is not None and 0 < begin - last.t_row0_master_ns < _SLOWEST_NS:
                self._note_period(camera, 1e-9 * (begin - last.t_row0_master_ns))
            self.newest[camera] = observations
            self._newest_pixels[camera], self._newest_flags[camera] = observations.pixels, observations.flags
        return True

    def _note_period(self, camera: int, period_s: float) -> None:
        share = _LEARN if self._paced[camera] else 1.0
        self._paced[camera] = True
        self.periods_s[camera] += share * (period_s - self.periods_s[camera])
        self.seen.fresh_ns[camera] = round(1e9 * _PERIODS * self.periods_s[camera])

    def recent(self, since_ns: int) -> list[MarkerBlock]:
        """The frames of the last moments that are not earlier than `since_ns`, in the order of time."""
        return sorted((block for block in self._blocks if block.t_ns >= since_ns), key=lambda block: block.t_ns)

    def believe(self, block: MarkerBlock, outcome: Outcome) -> int:
        """Note which sights of a frame were believed, under the names that the hand gave them; returns how many."""
        return int(_believe(self._shared, block.shared, block.t_ns, outcome.shared, outcome.first, outcome.last))

    def last_seen(self) -> tuple[Array, Flags]:
        """(C, M, 2) px of each camera's newest frame, NaN where lost, and (C, M) its flags."""
        return self._newest_pixels.copy(), self._newest_flags.copy()


@njit(cache=True)
def _believe(shared: Share, block: Share, t_ns: int, verdict: Share, first: int, last: int) -> int:
    return note_believed(shared.of, block.of, t_ns, verdict.of, first, last)


@lean
def note_believed(seen: Seen, sighting: Sighting, t_ns: int, verdict: Verdict, first: int, last: int) -> int:
    """All that `Sights.believe` does, of a frame of `t_ns`, of which observations `first` to `last` - 1 are."""
    frame = sighting.frame
    camera, count = frame.camera[0], 0
    for observation in range(first, last):
        if not verdict.believed[observation]:
            continue
        count += 1
        sight = verdict.source[observation, 1]
        marker = frame.label[sight]
        time_ns = t_ns + int(1e9 * frame.late_s[sight])
        if time_ns >= seen.times[camera, marker]:
            seen.times[camera, marker] = time_ns
            for i in range(2):
                seen.pixels[camera, marker, i] = frame.pixels[sight, i]
                for j in range(2):
                    seen.covariances[camera, marker, i, j] = frame.covariances[sight, i, j]
                seen.covariances[camera, marker, i, i] += frame.doubt[sight]
            seen.doubtful[camera, marker] = ((sighting.flags[sight] & DOUBTFUL) != 0
                                             or verdict.widening[observation] > UNLIKELY or frame.doubt[sight] > 0.0)
    return count


@lean
def all_in_sight(seen: Seen, t_ns: int) -> bool:
    """Whether two cameras or more see every marker, well or badly: they did within twice the time for which a sight is
    fresh, because a word that a person reads must not change with every frame that misses one."""
    for m in range(seen.times.shape[1]):
        count = 0
        for c in range(seen.times.shape[0]):
            count += seen.times[c, m] >= 0 and abs(t_ns - seen.times[c, m]) <= 2 * seen.fresh_ns[c]
        if count < 2:
            return False
    return True


@lean
def seen_clearly(seen: Seen, t_ns: int, marker: int) -> bool:
    """Whether two cameras or more see a marker beyond doubt at `t_ns`, by fresh sights of cameras that are not too
    slow."""
    count = 0
    for c in range(seen.times.shape[0]):
        count += (is_fresh(seen, t_ns, c, marker) and not seen.doubtful[c, marker]
                  and seen.fresh_ns[c] <= SLOWEST_CLEAR_NS)
    return count >= 2


@lean
def is_fresh(seen: Seen, t_ns: int, camera: int, marker: int) -> bool:
    """Whether a sight counts as of `t_ns`."""
    return bool(seen.times[camera, marker] >= 0 and abs(t_ns - seen.times[camera, marker]) <= seen.fresh_ns[camera])
