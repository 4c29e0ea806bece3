"""What `benchmarks/trackers.py` prints of a trial: what was tried, a line per tracker, and what the columns mean."""

from __future__ import annotations

from collections.abc import Iterable

from rhot_app.evaluation.accuracy import Figures
from rhot_app.evaluation.compare_table import cell

Results = dict[str, Figures]
"""Figures of each tracker."""

MEANINGS: tuple[tuple[str, str], ...] = (
    ("tips_mm", "fingertips off the truth, root mean square"),
    ("tips_max_mm", "the farthest that one of them was off, in any take"),
    ("known_share", "part of the fingertips' states that tell a place at all; what is not told is in no other column"),
    ("within_3_sd_share", "part of the fingertips' axes within three stated standard deviations; 0.997 when honest"),
    ("states_per_s", "states per second while the camera is covered or silent"),
    ("back_after_s", "s until every fingertip in sight is within 5 mm again, the slowest take"),
    ("swaps", "states that show one fingertip where another one is, once each time it happens"),
    ("swaps_measured", "those of them that are called measured"),
    ("palm_turn_deg", "palm turned off the truth, root mean square"),
    ("stated_deg", "standard deviation of that as stated"),
    ("sd_mm", "standard deviation of a still hand's fingertips in space; sd_x, sd_y, sd_z: along the rig's axes"),
    ("lag_ms", "shift of the truth in time that fits best; more than 0: the tracker is late"),
    ("still_sd_mm", "standard deviation of a still hand's fingertips in space; ramp_, fast_: of those movements"),
    ("median_s", "time until every visible fingertip is within 5 mm, over all starts; p95_s, max_s: the slow ones"),
    ("never", "starts after which no hand was found"),
    ("median_us", "time from a datagram's bytes to its state, by the clock; p99_us: one in a hundred takes longer; "
                  "cpu_: of the processor"),
    ("rss_growth_mb", "memory gained since the log's first lap; objects_growth: Python's own, in blocks"),
    ("error_at_5s_percent", "how far the size is off after 5 s, and so on; stated_percent: its stated deviation"),
    ("within_2_percent_after_s", "s after which the size stays within 2 % of the truth, the slowest take"),
    ("max_off_in_sd", "the most that the size was off, in stated standard deviations"),
)
"""What columns say that their names do not, in the order in which they are told."""


def run_table(name: str, about: str, results: Results) -> str:
    """A trial's table: its name and what it was tried on, the columns, a line per tracker."""
    keys = list(next(iter(results.values())))
    width = max(len(row) for row in results)
    lines = [f"{name}: {about}", " " * width + "".join(f"  {key:>8}" for key in keys)]
    lines += [row.ljust(width) + "".join(f"  {_form(figures[key]):>{max(8, len(key))}}" for key in keys)
              for row, figures in results.items()]
    return "\n".join(lines) + "\n"


def legend(trials: Iterable[Results]) -> str:
    """What the columns of these trials mean."""
    shown = {key for results in trials for figures in results.values() for key in figures}
    told = [(key, meaning) for key, meaning in MEANINGS if key in shown]
    width = max((len(key) for key, _ in told), default=0)
    return "\n".join(f"  {key.ljust(width)}  {meaning}" for key, meaning in told)


def _form(value: float | None) -> str:
    return cell(value, ".0f" if value is not None and abs(value) >= 1000.0 else ".3f")
