"""Trials of a tracker on one take, each with a misfortune or a question of its own. Figures' keys end in their unit.

A tracker is given as the rig that asks for it (`Rig.tracker`, `Rig.filters`, `Rig.hand`), or as itself; the take's
log, altered or not, goes through the door into it. Figures of several takes are put together by `gather`.
"""

from __future__ import annotations

import sys
import zlib
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from rhot_app.errors import SimulatorError
from rhot_app.evaluation.accuracy import Deviations, Figures, WornMarkers, axes_within, deviations, distances, worn_by
from rhot_app.evaluation.data_sets import DataSet
from rhot_app.evaluation.run import SETTLE_S
from rhot_app.evaluation.score import VISIBLE_FRACTION, cell, count_swaps, rms
from rhot_app.evaluation.track import Timed, TrackedStates, states_of, tracked
from rhot_app.hand.skeleton import WRIST_ROLE
from rhot_app.project import Rig
from rhot_app.recording.raw_log import Record, RecordKind
from rhot_app.simulator.film.node_log import lost
from rhot_app.simulator.film.truth import Truth
from rhot_app.tracking.tracker import Tracker

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

import fault_injection

Array = NDArray[np.float64]

BLIND_S = 1.0
"""A camera is covered for so long, from another moment on in every take: how a hand moves just then decides how well it
is known without."""

BLIND_FROM_S = 2.0
WRIST_ALONE_S = 3.0
SCALE_TOLERANCE = 0.02
SCALE_TIMES_S = (1.0, 2.0, 5.0, 10.0, 20.0, 30.0)


def one_camera_blind(take: DataSet, rig: Rig, tracker: Tracker | None = None, *, says_so: bool) -> Figures:
    """Fingertips while the first camera is covered for a second, and which part of their axes is within three of the
    stated standard deviations (0.9973 when honest), and how long after it every fingertip that both see is within 5 mm;
    `says_so` False: while its node is silent."""
    node = rig.nodes[0].node_id
    begin = blind_from(take)
    records = (fault_injection.changed(take.records(), fault_injection.blind(node, begin, begin + BLIND_S)) if says_so
               else fault_injection.silent(take.records(), node, begin, begin + BLIND_S))
    track, end = tracked(records, rig, tracker), begin + BLIND_S
    during = track.where((track.times_s >= begin) & (track.times_s < end))
    off = _off(during, take).tips
    tips, stated = distances(off), during.fingertip_covariances[:, worn_by(take.rig).tip_fingers]
    within, judged = axes_within(off, stated, np.ones(off.shape[:2], np.bool_))
    return {"tips_mm": _mm(rms(tips)), "tips_max_mm": _most_mm(tips),
            "known_share": float(np.isfinite(tips).mean()) if tips.size else 0.0,
            "within_3_sd_share": within / judged if judged else None,
            "back_after_s": found_after(track.where(track.times_s >= end), take.truth, worn_by(take.rig), end),
            "states_per_s": len(during.times_s) / BLIND_S}


def blind_from(take: DataSet) -> float:
    """When `one_camera_blind` covers the camera, s of the take."""
    last = max(take.seconds - BLIND_S - 0.5, BLIND_FROM_S)
    return float(np.random.default_rng(_seed(take)).uniform(BLIND_FROM_S, last))


def markers_hidden(take: DataSet, rig: Rig, tracker: Tracker | None = None, *, share: float,
                   together: bool, lasting_s: tuple[float, float] = fault_injection.EPISODE_S) -> Figures:
    """Fingertips of every state when each marker is hidden for a share of the time, for `lasting_s` at a time."""
    change = fault_injection.hidden(share, take.seconds, [node.node_id for node in rig.nodes], len(rig.markers.markers),
                          _seed(take), together=together, lasting_s=lasting_s)
    return _all_states(take, rig, fault_injection.changed(take.records(), change), tracker)


def names_mixed_up(take: DataSet, rig: Rig, *, pair: tuple[int, int], share: float) -> Figures:
    """Fingertips and swaps when nodes take one marker for another for a share of the time."""
    change = fault_injection.mixed_up(pair, share, take.seconds, [node.node_id for node in rig.nodes], _seed(take))
    return _all_states(take, rig, fault_injection.changed(take.records(), change))


def plain(take: DataSet, rig: Rig) -> Figures:
    """Fingertips of every state, and swaps, on the log as it is: of whatever the tracker shows - that a hidden marker
    is carried on to where another one is counts - and of what it calls measured."""
    return _all_states(take, rig, take.records())


def wrist_alone(take: DataSet, rig: Rig) -> Figures:
    """What is said of the palm's turn when only the wrist's marker is left, three seconds into the take, and what is
    true: rms over the states."""
    wrist = [marker.role for marker in rig.markers.markers].index(WRIST_ROLE)
    records = fault_injection.changed(take.records(), lambda t_s, _, seen: seen if t_s < WRIST_ALONE_S else [
        marker if marker.index == wrist else lost(marker.index) for marker in seen])
    track = tracked(records, rig)
    track = track.where(track.times_s >= WRIST_ALONE_S + SETTLE_S)
    turn = distances(_off(track, take).palm[:, 3:])
    stated = np.sqrt(np.trace(track.palm_covariance[:, 3:, 3:], axis1=1, axis2=2))
    return {"palm_turn_deg": _deg(rms(turn)), "stated_deg": _deg(rms(stated))}


def standing_still(take: DataSet, rig: Rig) -> Figures:
    """Spread of a still hand's fingertips, per axis of the rig and in space."""
    axes, whole = spread(tracked(take.records(), rig), worn_by(rig))
    return {"sd_x_mm": 1e3 * axes[0], "sd_y_mm": 1e3 * axes[1], "sd_z_mm": 1e3 * axes[2], "sd_mm": 1e3 * whole}


def lagging(take: DataSet, rig: Rig, *, speeding_up: bool) -> Figures:
    """Lag of the fingertips by best time shift; `speeding_up`: only while the palm gets faster."""
    worn = worn_by(rig)
    track = tracked(take.records(), rig)
    chosen = (track.times_s >= SETTLE_S) & (track.times_s <= take.seconds - 0.1)
    if speeding_up:
        chosen &= rising(track.times_s, take.truth)
    times, tips = track.times_s[chosen], track.fingertip_positions[chosen][:, worn.tip_fingers]
    off = distances(tips - take.truth.markers_at(times)[:, worn.tips])
    return {"lag_ms": 1e3 * lag(times, tips, take.truth, worn), "tips_mm": _mm(rms(off))}


def growing(take: DataSet, rig: Rig, true_scale: float) -> Figures:
    """How the estimated size of the hand nears the truth: its error at SCALE_TIMES_S, when it stays within
    SCALE_TOLERANCE, whether it is at the last of these times, what standard deviation is stated in the end, and how
    many of them it was ever off, None where none is stated. `true_scale`: true length over that of the rig's hand."""
    track = tracked(take.records(), rig)
    ratios, stated = track.hand_scale / true_scale, track.hand_scale_sd
    at = np.minimum(np.searchsorted(track.times_s, SCALE_TIMES_S), len(ratios) - 1)
    figures: Figures = {f"error_at_{t:g}s_percent": float(100.0 * (ratios[k] - 1.0))
                        for t, k in zip(SCALE_TIMES_S, at, strict=True) if t <= track.times_s[-1]}
    known = stated > 0.0
    return figures | {"within_2_percent_after_s": settled_after(track.times_s, ratios, SCALE_TOLERANCE),
                      "within_2_percent_share": float(abs(ratios[at[-1]] - 1.0) <= SCALE_TOLERANCE),
                      "stated_percent": float(100.0 * stated[-1]) if known[-1] else None,
                      "max_off_in_sd": float(np.abs(np.log(ratios[known]) / stated[known]).max(initial=0.0))
                      if known.any() else None}


def starting(take: DataSet, rig: Rig, starts_s: Sequence[float]) -> list[float | None]:
    """For each scene time at which datagrams begin to come: time until every visible fingertip is within 5 mm, s."""
    found = []
    for start_s in starts_s:
        records = fault_injection.begun_at(take.records(), start_s)
        first_s = min(fault_injection.arrival_s(record) for record in records if record.kind is RecordKind.DATAGRAM)
        try:
            found.append(found_after(tracked(records, rig), take.truth, worn_by(rig), first_s))
        except SimulatorError:  # no state at all
            found.append(None)
    return found


def computing(take: DataSet, rig: Rig, minutes: float) -> Figures:
    """Time from a datagram's bytes to its state, and how memory grows after the first lap of a log that is repeated."""
    records = take.records()
    laps = max(2, round(60.0 * minutes / take.seconds))
    first = _Lap(records)
    timed = Timed(first.watch(fault_injection.prolonged(records, laps)))
    for _ in states_of(timed, rig):
        pass
    by_clock, of_processor = 1e6 * np.array(timed.compute_s), 1e6 * np.array(timed.cpu_s)
    return {"median_us": float(np.median(by_clock)), "p99_us": float(np.percentile(by_clock, 99.0)),
            "cpu_median_us": float(np.median(of_processor)), "cpu_p99_us": float(np.percentile(of_processor, 99.0)),
            "datagrams": float(len(by_clock)), "rss_growth_mb": (_resident_bytes() - first.resident) / 1e6,
            "objects_growth": float(sys.getallocatedblocks() - first.blocks)}


def gather(runs: Sequence[Figures]) -> Figures:
    """Figures of several takes: the worst of maxima, of errors over time and of waits, sums of counts, the mean of lags
    and shares, else root mean square. A wait that never ended in one of them is None."""
    out: Figures = {}
    for name in runs[0]:
        known = np.array([value for figures in runs if (value := figures[name]) is not None])
        if not known.size or (len(known) < len(runs) and name.endswith("_after_s")):
            out[name] = None
        elif "max" in name or name.endswith("_after_s"):
            out[name] = float(known.max())
        elif name.startswith("error"):
            out[name] = float(known[np.argmax(np.abs(known))])
        elif name.startswith("swaps") or name == "seconds":
            out[name] = float(known.sum())
        elif name.startswith("lag") or name.endswith(("share", "per_s")):
            out[name] = float(known.mean())
        else:
            out[name] = rms(known)
    return out


class _Lap:
    """Notes the memory in use once the first lap of a repeated log is over."""

    def __init__(self, records: Sequence[Record]) -> None:
        self.resident = self.blocks = 0
        self._length = len(records)

    def watch(self, records: Iterable[Record]) -> Iterator[Record]:
        """The same records."""
        for number, record in enumerate(records):
            if number == self._length:
                self.resident, self.blocks = _resident_bytes(), sys.getallocatedblocks()
            yield record


def _resident_bytes() -> int:
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4096


def _all_states(take: DataSet, rig: Rig, records: Sequence[Record], tracker: Tracker | None = None) -> Figures:
    track = tracked(records, rig, tracker)
    track = track.where((track.times_s >= SETTLE_S) & (track.times_s <= take.seconds))
    off, true = _off(track, take), take.truth.markers_at(track.times_s)
    tips = distances(off.tips)
    measured = np.where(off.measured[..., None], track.marker_positions, np.nan)
    return {"tips_mm": _mm(rms(tips)), "tips_max_mm": _most_mm(tips), "known_share": float(np.isfinite(tips).mean()),
            "swaps": float(count_swaps(track.marker_positions, true)),
            "swaps_measured": float(count_swaps(measured, true)),
            "seconds": float(track.times_s[-1] - track.times_s[0])}


def _off(track: TrackedStates, take: DataSet) -> Deviations:
    return deviations(track, take.truth, worn_by(take.rig))


def _seed(take: DataSet) -> int:
    """A number that differs from take to take."""
    return zlib.crc32(take.folder.name.encode())


def _mm(value: float | None) -> float | None:
    return None if value is None else 1e3 * value


def _deg(value: float | None) -> float | None:
    return None if value is None else float(np.degrees(value))


def _most_mm(distances_m: Array) -> float | None:
    finite = distances_m[np.isfinite(distances_m)]
    return float(1e3 * finite.max()) if finite.size else None


# -- how calm and how prompt a track is --------------------------------------------------------------------------------

Mask = NDArray[np.bool_]

SETTLED_S = 2.0
"""A still hand's spread is measured after this scene time."""

NEAR_M = 5e-3
"""A hand counts as found when every fingertip in sight is as near as this to the truth."""

_LAG_LIMITS_S = (-0.05, 0.1)
_RISING_MPS = 0.1


def spread(track: TrackedStates, worn: WornMarkers) -> tuple[Array, float]:
    """Standard deviation of a still hand's fingertips about their means after SETTLED_S: per axis (3,) and in space, m;
    root mean square over the fingers."""
    tips = track.fingertip_positions[track.times_s >= SETTLED_S][:, worn.tip_fingers]
    variances = np.nanmean(np.nanvar(tips, axis=0), axis=0)
    return np.sqrt(variances), float(np.sqrt(variances.sum()))


def lag(times_s: Array, tips: Array, truth: Truth, worn: WornMarkers) -> float:
    """By how much later the truth would have to be to fit the fingertips (N, T, 3) best, s; > 0 is late.

    What a fingertip is off by all the time is no lag, so the mean is left out; the best fit is in the least squares.
    """
    known = np.isfinite(tips).all(axis=(1, 2))

    def misfit(shift_s: float) -> float:
        off = tips[known] - truth.markers_at(times_s[known] - shift_s)[:, worn.tips]
        return float(np.square(off - off.mean(axis=0)).sum())

    grid = np.linspace(*_LAG_LIMITS_S, 31)
    best = int(np.argmin([misfit(shift) for shift in grid]))
    bounds = (grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)])
    return float(minimize_scalar(misfit, bounds=bounds, method="bounded", options={"xatol": 1e-6}).x)


def rising(times_s: Array, truth: Truth) -> Mask:
    """(N,) whether the palm is getting faster at these times, and is no longer at rest."""
    before, now, after = (truth.palm_at(times_s + step)[:, :3, 3] for step in (-5e-3, 0.0, 5e-3))
    speed_before, speed_after = distances(now - before) / 5e-3, distances(after - now) / 5e-3
    return np.asarray((speed_after > speed_before) & (speed_after > _RISING_MPS))


def found_after(track: TrackedStates, truth: Truth, worn: WornMarkers, first_s: float) -> float | None:
    """Time from the first datagram, received at scene time `first_s`, until a state has every fingertip whose marker is
    truly visible nearer than NEAR_M to the truth, s. None when there never is one."""
    off = distances(track.fingertip_positions[:, worn.tip_fingers] - truth.markers_at(track.times_s)[:, worn.tips])
    visible = truth.visible_at(track.times_s)[:, worn.tips] >= VISIBLE_FRACTION
    good = visible.any(axis=1) & np.where(visible, off < NEAR_M, True).all(axis=1)
    return float(track.receive_s[np.argmax(good)] - first_s) if good.any() else None


def settled_after(times_s: Array, ratios: Array, tolerance: float) -> float | None:
    """The time from which on a ratio (N,) stays within `tolerance` of 1; None when it does not at the end."""
    outside = np.flatnonzero(~(np.abs(ratios - 1.0) <= tolerance))
    if not outside.size:
        return float(times_s[0])
    return None if outside[-1] == len(times_s) - 1 else float(times_s[outside[-1] + 1])


# -- tables -----------------------------------------------------------------------------------------------------------

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
    lines = [(key, meaning) for key, meaning in MEANINGS if key in shown]
    width = max((len(key) for key, _ in lines), default=0)
    return "\n".join(f"  {key.ljust(width)}  {meaning}" for key, meaning in lines)


def _form(value: float | None) -> str:
    return cell(value, ".0f" if value is not None and abs(value) >= 1000.0 else ".3f")
