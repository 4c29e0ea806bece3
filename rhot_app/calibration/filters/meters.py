"""Jitter and lag of marker positions, of a whole recording or of the last seconds; the verdict on proposed filters.

Jitter is that of `rhot_app.filters.jitter`: of unfiltered positions that of a hand that may move, of filtered ones that
of a hand at rest. Lag is the delay by which the unfiltered curve has to be put back so that the filtered
one lies on it best (least squares over all axes).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.verdict import Finding, Grade, Verdict, judge, told_apart
from rhot_app.filters import jitter
from rhot_app.filters.jitter import parabolas

Array = NDArray[np.float64]

SPEED_WINDOW_S = 0.15

SLOW_M_S = 0.15
"""A lag is not told from noise while the marker's speed (95th percentile) is below."""

_LAG_ROUNDS = 4
_LIVE_S = 2.0


@dataclass(frozen=True, slots=True)
class MarkerMotion:
    """One marker's unfiltered way: `positions` and `velocities` (T, 3), NaN where unknown."""

    positions: Array
    velocities: Array

    @property
    def speed(self) -> float:
        """95th percentile of the speed, m/s; 0 when nothing is known."""
        speeds = np.linalg.norm(self.velocities, axis=1)
        speeds = speeds[np.isfinite(speeds)]
        return float(np.quantile(speeds, 0.95)) if len(speeds) else 0.0


def motion_of(times_s: Array, positions: Array) -> MarkerMotion:
    """The motion of unfiltered positions (T, 3); times may be irregular."""
    return MarkerMotion(positions, velocities(times_s, positions, SPEED_WINDOW_S))


def velocities(times_s: Array, positions: Array, window_s: float) -> Array:
    """(T, 3) m/s by parabolas through `window_s` of positions (T, 3) m; NaN where some of them are missing."""
    return parabolas(times_s, positions, window_s)[1]


def lag(times_s: Array, filtered: Array, motion: MarkerMotion) -> tuple[float, float]:
    """Delay of `filtered` (T, 3), s, and its rms distance from the unfiltered way, m; NaN for a marker too slow."""
    known = np.isfinite(filtered).all(axis=1) & np.isfinite(motion.positions + motion.velocities).all(axis=1)
    if np.count_nonzero(known) < 10 or motion.speed < SLOW_M_S:
        return np.nan, np.nan
    times, target = times_s[known], filtered[known]
    positions, velocities = motion.positions[known], motion.velocities[known]
    error = float(np.sqrt(np.mean(np.square(target - positions).sum(axis=1))))
    delay = 0.0
    for _ in range(_LAG_ROUNDS):
        then, speed = (np.stack([np.interp(times - delay, times, column) for column in columns.T], axis=1)
                       for columns in (positions, velocities))
        delay -= float(np.sum((target - then) * speed) / np.sum(speed * speed))
    return delay, error


@dataclass(frozen=True, slots=True)
class MeterReading:
    """The last two seconds, per marker (M,): jitter of the unfiltered positions, m, and of the filtered ones, NaN while
    the marker moves; lag, s, NaN while it hardly does; speed (95th percentile), m/s."""

    raw_jitter_m: Array
    jitter_m: Array
    lag_s: Array
    speed_m_s: Array


class FilterMeter:
    """Jitter and lag now, from the unfiltered and filtered positions of every state. `add` costs a microsecond or two;
    `read` is meant for a few times a second."""

    def __init__(self, markers: int, capacity: int = 512) -> None:
        self._times = np.full(capacity, np.nan)
        self._raw, self._filtered = np.full((2, capacity, markers, 3), np.nan)
        self._next = 0

    def add(self, t_ns: int, raw: Array, filtered: Array) -> None:
        """Take one state: its time and (M, 3) m, NaN where not located."""
        self._times[self._next] = 1e-9 * t_ns
        self._raw[self._next], self._filtered[self._next] = raw, filtered
        self._next = (self._next + 1) % len(self._times)

    def read(self) -> MeterReading:
        """What the last two seconds show; NaN for a marker that was not seen enough."""
        order = np.argsort(self._times)  # NaN last
        order = order[self._times[order] >= np.nanmax(self._times, initial=-np.inf) - _LIVE_S]
        times = self._times[order] - self._times[order[:1]]
        rows = []
        for marker in range(self._raw.shape[1]):
            raw, filtered = self._raw[order, marker], self._filtered[order, marker]
            motion = motion_of(times, raw)
            filtered = np.where(np.isfinite(raw), filtered, np.nan)
            rests = motion.speed <= MOVING_M_S  # what a filter leaves is not told from a motion
            rows.append((jitter.moving(times, raw), jitter.resting(times, filtered) if rests else math.nan,
                         lag(times, filtered, motion)[0], motion.speed))
        return MeterReading(*np.array(rows, dtype=np.float64).reshape(-1, 4).T)


# -- verdict on proposed filters ---------------------------------------------------------------------------------------

RESTLESS_M_S, MOVING_M_S = 0.02, 0.08
"""A hand held still wanders slower than the first, and one that is faster than the second was not held still."""

BRISK_M_S, SLUGGISH_M_S = 0.5, 0.25
"""The fast movement's speed (95th percentile, the fastest marker's) should reach the first; below the second lag is
not to be seen."""

_TOLERANCE = 1.1


@dataclass(frozen=True, slots=True)
class FilterTargets:
    """What filters should keep to: jitter at rest, rms, and lag of a fast movement. The movement's rms error should be
    no more than so much lag makes of its speed."""

    jitter_m: float = 0.4e-3
    lag_s: float = 1e-3


@dataclass(frozen=True, slots=True)
class MarkerFigures:
    """One marker: speed in the fast recording, m/s; jitter at rest without filters, px and m; then with the proposed
    filters and with the rig's own jitter m, lag s and error m. NaN where not seen, or too slow for a lag."""

    marker_id: str
    known: bool
    speed_m_s: float
    raw_jitter_px: float
    raw_jitter_m: float
    jitter_m: float
    lag_s: float
    error_m: float
    jitter_now_m: float
    lag_now_s: float
    error_now_m: float

    @property
    def worse(self) -> bool:
        """Whether the rig's filters, or none at all, are better in jitter and in lag; a lag that does not show is none
        that is worse. No filter has no lag."""
        return (self.jitter_m > self.jitter_now_m and abs(self.lag_s) > abs(self.lag_now_s)) \
            or (self.jitter_m > self.raw_jitter_m and abs(self.lag_s) > 0.0)


@dataclass(frozen=True, slots=True)
class FilterFigures:
    """What is judged. `drift_m_s`: how fast the hand that was held still wandered."""

    targets: FilterTargets
    markers: tuple[MarkerFigures, ...]
    drift_m_s: float

    def worst(self, name: str) -> float:
        """The largest of a figure over the known markers; NaN when none has it."""
        values = [abs(getattr(marker, name)) for marker in self.markers if marker.known]
        return max((value for value in values if not math.isnan(value)), default=math.nan)


def judge_filters(figures: FilterFigures) -> Verdict:
    """The verdict on a proposal."""
    lag_s = figures.worst("lag_s")
    moving = "their lag does not show" if math.isnan(lag_s) else (
        f"moving, they lag by {1e3 * lag_s:.1f} ms (now {1e3 * figures.worst('lag_now_s'):.1f})")
    summary = (f"at rest the markers jitter by {1e3 * figures.worst('jitter_m'):.2f} mm rms at most (unfiltered "
               f"{1e3 * figures.worst('raw_jitter_m'):.2f}, with the rig's filters "
               f"{1e3 * figures.worst('jitter_now_m'):.2f}); {moving}.")
    return judge(summary, [*_still(figures), *_fast(figures), *_worse(figures), *_compromise(figures),
                           *_unseen(figures)])


def _still(figures: FilterFigures) -> list[Finding]:
    if figures.drift_m_s <= RESTLESS_M_S:
        return []
    return [Finding("not_still", Grade.POOR if figures.drift_m_s > MOVING_M_S else Grade.FAIR,
                    f"The hand that was to be still moved at {1e3 * figures.drift_m_s:.0f} mm/s.",
                    "Movement then counts as jitter.", "Rest the hand on something and record again.")]


def _fast(figures: FilterFigures) -> list[Finding]:
    speed = max((marker.speed_m_s for marker in figures.markers if marker.known), default=0.0)
    if speed >= BRISK_M_S:
        return []
    return [Finding("not_fast", Grade.POOR if speed < SLUGGISH_M_S else Grade.FAIR,
                    f"The fast movement reached {speed:.2f} m/s only.", "Lag shows in fast movement.",
                    "Wave the hand briskly, 20 cm wide, and record again.")]


def _worse(figures: FilterFigures) -> list[Finding]:
    known = [marker for marker in figures.markers if marker.known]
    worse = [marker.marker_id for marker in known if marker.worse]
    if not worse:
        return []
    all_worse = len(worse) == len(known)
    who = "every marker" if all_worse else ", ".join(worse)
    return [Finding("worse", Grade.POOR if all_worse else Grade.FAIR,
                    f"For {who} jitter and lag are worse than with the rig's filters, or than without any.",
                    "The limits leave nothing better to choose.",
                    "Keep the rig's filters, or allow more jitter or more lag.")]


def _compromise(figures: FilterFigures) -> list[Finding]:
    targets, found = figures.targets, []
    jitter, lag = figures.worst("jitter_m"), figures.worst("lag_s")
    if lag > _TOLERANCE * targets.lag_s:
        found.append(Finding(
            "lag", Grade.FAIR, f"Moving markers lag by {told_apart(1e3 * lag, 1e3 * targets.lag_s, 1)} ms, more than "
            f"the {1e3 * targets.lag_s:g} ms asked for.",
            "The pictures come too seldom for so little lag at this speed.", "Use a higher frame rate, or allow more."))
    if jitter > _TOLERANCE * targets.jitter_m:
        found.append(Finding(
            "jitter", Grade.FAIR, f"At rest {told_apart(1e3 * jitter, 1e3 * targets.jitter_m, 2)} mm of jitter "
            f"remain, more than the {1e3 * targets.jitter_m:g} mm asked for.",
            "Filters that follow this fast let so much noise through.",
            "Allow more lag, come nearer to the cameras, or give more light."))
    return found


def _unseen(figures: FilterFigures) -> list[Finding]:
    names = [marker.marker_id for marker in figures.markers if not marker.known]
    if not names:
        return []
    return [Finding("unseen", Grade.FAIR, f"{', '.join(names)} were not measured long enough in both recordings.", "",
                    "They get the settings of the others; record again with all markers in sight of both cameras.")]
