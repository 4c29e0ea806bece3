"""Lines 3 and 5: where the time goes (RHOT table 7.1), and how old a picture is, by a patch that flashes on a screen.

That the nodes' timestamps agree with each other proves nothing: all may be late by the same driver. A patch that turns
a marker's colour on and off at irregular times is light whose time is known, and goes the whole way: screen, camera,
detection, network, master. The screen's own delay is part of it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from rhot_app.certificate import thesis
from rhot_app.certificate.document import Line, figure, in_words, not_measured, number
from rhot_app.certificate.intervals import Interval, mean_of, percentile_of
from rhot_app.certificate.recordings import CertifiedRecording, Latencies
from rhot_app.latency import whole_way
from rhot_app.state import LATENCY_STAGES

Array = NDArray[np.float64]
Times = NDArray[np.int64]

TIMING, LATENCY = "Time of each stage", "End-to-end latency"

_ONES = {"detect": "colour detection", "network": "UDP sending"}
"""The thesis's name of a stage, where both have one."""


_REMEDIES = {"detect": "Lower the picture's size or rate, or use a faster node.",
             "network": "Connect the nodes by cable."}


def judge_timing(latencies: Array) -> Line:
    """Median and 99th percentile of every stage and of the whole; `latencies` (N, stages) s of `LATENCY_STAGES`."""
    figures, curves = [], dict[str, list[float | None]]()
    known = [k for k, name in enumerate(LATENCY_STAGES) if name != "receive_to_state"
             and np.isfinite(latencies[:, k]).any()]
    for name, samples in [*((LATENCY_STAGES[k], latencies[:, k]) for k in known), ("sum", whole_way(latencies))]:
        of_thesis = thesis.TIMING_MS.get(_ONES.get(name, name))
        words = "" if of_thesis is None else f"mean {of_thesis[0]:.2f}, SD {of_thesis[1]:.2f} ms (table 7.1)"
        middle, late = (percentile_of(samples, part).scaled(1e3) for part in (0.5, 0.99))
        figures += [figure(f"{name}, p50", "ms", middle, thesis=words), figure(f"{name}, p99", "ms", late)]
        curves[name] = [middle.value, late.value]
    late = figures[-1].interval
    measured = f"From the picture to the state, 99 of 100 take less than {in_words(late, 'ms')}."
    limit = 1e3 * thesis.FRAME_S
    beside = f"The thesis wants less than {limit:.0f} ms and takes {thesis.TIMING_MS['sum'][0]:.0f} ms."
    if late.low > limit:
        slow = max((name for name in curves if name != "sum"), key=lambda name: curves[name][1] or 0.0)
        return Line("timing", TIMING, "differs", f"{measured} {beside}", f"Most of it is spent in \"{slow}\".",
                    _REMEDIES.get(slow, "That is this computer's own time, now: close other programs and make the "
                                  "certificate again."), tuple(figures), curves)
    if late.high > limit:
        return not_measured("timing", TIMING, f"too few states, or a busy computer. {measured} {beside}",
                            "Record longer, and close other programs.", tuple(figures), curves)
    return Line("timing", TIMING, "agrees", f"{measured} {beside}", figures=tuple(figures), curves=curves)


# -- line 5: end-to-end latency ----------------------------------------------------------------------------------------

DWELL_S = (0.15, 0.45)
"""How long the patch stays as it is: longer than the slowest rig takes (three frames at 30 Hz and a screen), and as
irregular as possible, so that only one delay fits."""

LONGEST_S = 0.5
"""Delays are sought up to here."""

SCREEN_S = (0.0, 0.1)
"""A screen shows between nothing and this later than it is ordered: 60 Hz monitors take 10 to 50 ms, televisions up to
100 ms. A picture that is stamped before the light or later than that has a wrong time."""

_SPREADS_S = np.geomspace(1e-4, 1e-2, 9)
"""Standard deviations of a delay that are taken as possible: a quiet cable to a busy wireless network."""

_STRAY = 0.01
"""Probability that an edge is seen at any other time: a colour that flickers, a datagram that is lost."""

_FOLLOWS = 0.8
"""Part of the frames that the code must explain: another code explains half of them by chance, and the best of all
delays not seven tenths of some hundred frames."""

_STEP_S = 1e-4


def flash_edges(seconds: float, seed: int) -> list[tuple[float, bool]]:
    """(s, lit) of a pseudo-random code: when the patch changes, and to what; it begins dark."""
    rng, t, lit, edges = np.random.default_rng([seed, 0xF1A5]), 0.5, False, list[tuple[float, bool]]()
    while t < seconds - DWELL_S[1]:
        lit = not lit
        edges.append((t, lit))
        t += float(rng.uniform(*DWELL_S))
    return edges


def judge_latency(recording: CertifiedRecording, marker: str, edges: Sequence[tuple[int, bool]],
                  latencies: Latencies) -> Line:
    """The delay between the screen's code and what arrives; `latencies` of the same log's states, whose instants wait
    for the slower camera."""
    m = recording.marker(marker)
    if len(edges) < 10:
        return not_measured("latency", LATENCY, f"the patch changed {len(edges)} times only.", _FLASH)
    at = np.array([t for t, _ in edges], dtype=np.int64)
    lit = np.array([on for _, on in edges])
    clocks: dict[str, list[Interval]] = {name: [] for name in ("exposed", "arrived", "appears", "vanishes")}
    agreement = []
    for camera in range(recording.camera_count):
        chosen = recording.cameras == camera
        seen = np.isfinite(recording.pixels[chosen, m, 0])
        for clock, times in (("exposed", recording.exposed_ns[chosen, m]), ("arrived", recording.arrivals_ns[chosen])):
            coarse, matched = _coarse(times, seen, at, lit)
            agreement.append(matched)
            parts = [_delay(times, seen, at, lit, coarse, kind) for kind in (True, False)]
            if any(part is None for part in parts):
                continue
            appears, vanishes = parts
            assert appears is not None and vanishes is not None
            clocks[clock].append(_mean([appears, vanishes]))
            if clock == "arrived":
                clocks["appears"].append(appears)
                clocks["vanishes"].append(vanishes)
    if not clocks["arrived"] or min(agreement) < _FOLLOWS:
        return not_measured("latency", LATENCY, "what the cameras saw does not follow the code of the screen (the best "
                            f"delay explains {100 * min(agreement, default=0.0):.0f} % of the frames).", _FLASH)
    found = {name: _mean(parts).scaled(1e3) for name, parts in clocks.items()}
    stamp = found["exposed"].widened(1e3 * recording.clock_bound_s / 1.96)
    wait = mean_of(latencies.waits).scaled(1e3)
    age, reach = stamp.value + wait.value + 1e3 * latencies.compute_s, math.hypot(stamp.half_width, wait.half_width)
    state = Interval(age, age - reach, age + reach)
    figures = (figure("screen to master", "ms", found["arrived"], thesis="not measured"),
               figure("screen to state", "ms", state, thesis="not measured"),
               figure("screen to the picture's timestamp", "ms", stamp),
               figure("until it appears", "ms", found["appears"]),
               figure("until it vanishes", "ms", found["vanishes"]))
    sentence = (f"What the screen is told is seen by the master {in_words(found['arrived'], 'ms')} later and is a "
                f"state after {number(state.value)} ms, the screen's own delay included. The pictures are stamped "
                f"{in_words(stamp, 'ms')} after the screen was told.")
    curves: dict[str, list[float | None]] = {name: [one.low, one.value, one.high] for name, one in found.items()}
    if stamp.low < 1e3 * SCREEN_S[0] and stamp.high > 1e3 * SCREEN_S[1]:
        return not_measured("latency", LATENCY, f"a wrong time of the pictures would not show. {sentence}",
                            "Connect the nodes by cable, so that their clocks are known, and record again.",
                            figures, curves)
    if stamp.high < 1e3 * SCREEN_S[0] or stamp.low > 1e3 * SCREEN_S[1]:
        early = stamp.high < 1e3 * SCREEN_S[0]
        return Line("latency", LATENCY, "differs", sentence,
                    "A picture is stamped before the light that it shows." if early else
                    "The pictures are stamped later than any screen is slow, or the screen is a very slow one.",
                    "The camera's driver states a wrong time: correct time_offset_s of all nodes." if early else
                    "Try another screen or its game mode; if it stays, correct time_offset_s of all nodes.",
                    figures, curves)
    return Line("latency", LATENCY, "agrees", f"{sentence} A screen takes between 0 and {1e3 * SCREEN_S[1]:.0f} ms.",
                figures=figures, curves=curves)


_FLASH = ("Turn the cameras to the screen, open Certificate in the app, and let the patch flash for 20 s in a darkened "
          "room.")


def _mean(parts: Sequence[Interval]) -> Interval:
    value = float(np.mean([part.value for part in parts]))
    half = math.sqrt(sum(part.half_width**2 for part in parts)) / len(parts)
    return Interval(value, value - half, value + half)


def _coarse(times: Times, seen: NDArray[np.bool_], at: Times, lit: NDArray[np.bool_]) -> tuple[float, float]:
    """The delay, s, at which the code explains most frames, and which part of them: the maximum of the
    cross-correlation, in the middle of its plateau. `times` (F,) ns and `seen` (F,) of one camera; the code's edges."""
    delays = np.arange(-LONGEST_S, LONGEST_S, 1e-3)
    inside = (times > at[0] + round(1e9 * LONGEST_S)) & (times < at[-1] - round(1e9 * LONGEST_S))
    if not inside.any():
        return math.nan, 0.0
    chosen, seen = times[inside], seen[inside]
    matches = np.array([np.mean(lit[np.clip(np.searchsorted(at, chosen - round(1e9 * delay), side="right") - 1, 0,
                                            None)] == seen) for delay in delays])
    plateau = delays[matches >= matches.max() - 1e-9]
    return float(plateau.mean()), float(matches.max())


def _delay(times: Times, seen: NDArray[np.bool_], at: Times, lit: NDArray[np.bool_], coarse: float,
           kind: bool) -> Interval | None:
    """The mean delay, s, of edges of one kind (True: to lit). Every edge lies between the last frame that does not show
    it and the first that does: the likelihood of a Gaussian delay with interval-censored samples, integrated over its
    standard deviation. None when too few edges are seen clearly."""
    if math.isnan(coarse):
        return None
    window = 0.4e9 * DWELL_S[0]
    bounds = []
    for edge, on in zip(at, lit, strict=True):
        if on != kind:
            continue
        near = np.flatnonzero(np.abs(times - edge - 1e9 * coarse) < window)
        shows = seen[near] == on
        if len(near) < 2 or shows[0] or not shows[-1] or np.count_nonzero(np.diff(shows.astype(int))) != 1:
            continue
        first = near[int(np.argmax(shows))]
        bounds.append((1e-9 * (times[first - 1] - edge), 1e-9 * (times[first] - edge)))
    if len(bounds) < 5:
        return None
    low, high = np.array(bounds).T
    means = np.arange(coarse - 1e-9 * window, coarse + 1e-9 * window, _STEP_S)
    log = np.full(len(means), -np.inf)
    for spread in _SPREADS_S:
        inside = (stats.norm.cdf((high[:, None] - means) / spread) - stats.norm.cdf((low[:, None] - means) / spread))
        stray = _STRAY * (high - low)[:, None] / (2e-9 * window)
        log = np.logaddexp(log, np.log((1.0 - _STRAY) * inside + stray).sum(axis=0))
    weight = np.exp(log - log.max())
    total = np.cumsum(weight) / weight.sum()
    ends = [float(means[int(np.searchsorted(total, part))]) for part in (0.025, 0.5, 0.975)]
    return Interval(ends[1], ends[0] - _STEP_S, ends[2] + _STEP_S)
