"""What proposed filters are worth: whether the hand was still and then fast, and what could not be had at once."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rhot_app.calibration.verdict import Finding, Grade, Verdict, judge

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
    return judge(summary, [*_still(figures), *_fast(figures), *_compromise(figures), *_unseen(figures)])


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


def _compromise(figures: FilterFigures) -> list[Finding]:
    targets, found = figures.targets, []
    jitter, lag = figures.worst("jitter_m"), figures.worst("lag_s")
    if lag > _TOLERANCE * targets.lag_s:
        found.append(Finding(
            "lag", Grade.FAIR, f"Moving markers lag by {1e3 * lag:.1f} ms, more than the {1e3 * targets.lag_s:.1f} ms "
            "asked for.", "The pictures come too seldom for so little lag at this speed.",
            "Use a higher frame rate, or allow more."))
    if jitter > _TOLERANCE * targets.jitter_m:
        found.append(Finding(
            "jitter", Grade.FAIR, f"At rest {1e3 * jitter:.2f} mm of jitter remain, more than the "
            f"{1e3 * targets.jitter_m:.2f} mm asked for.", "Filters that follow this fast let so much noise through.",
            "Allow more lag, come nearer to the cameras, or give more light."))
    return found


def _unseen(figures: FilterFigures) -> list[Finding]:
    names = [marker.marker_id for marker in figures.markers if not marker.known]
    if not names:
        return []
    return [Finding("unseen", Grade.FAIR, f"{', '.join(names)} were not measured long enough in both recordings.", "",
                    "They get the settings of the others; record again with all markers in sight of both cameras.")]
