"""The measures of the 3-D mouse as tables for people."""

from __future__ import annotations

from typing import Any

import numpy as np

Figures = dict[str, Any]


def report(figures: Figures) -> str:
    """All measures, a table each."""
    seen = "rendered images and the detector" if figures["pictures"] else "observations without images"
    found, place = figures["throughput"], figures["place"]
    late = figures["latency"]
    lines = [f"3-D mouse on the twin, seed {figures['seed']}, from {seen}. Lengths are the cursor's.",
             "", "Hand speed along the table (always from images)      time in which the hand is held",
             *(f"  {one['speed_m_per_s']:5.2f} m/s {100.0 * one['held']:40.1f} %" for one in figures["speed"]),
             "", "Moved alone    error of the cursor [mm]: rms of right, forward, height; then their peaks",
             *(f"  {one['moved']:<12}{_three(one['rms'])}    {_three(one['peak'])}" for one in figures["coupling"]),
             "", "Palm turned on the table   jitter, standard deviation [mm]: right  forward  height",
             *(f"  {one['turn_deg']:+5.0f} deg{_three(one):>71}" for one in figures["resolution"]),
             "", *_latency(late), "", *(_throughput(name, found[name]) for name in ("true", "tracked"))]
    single = figures["one_camera"]
    lines += ["", "One camera covered     error of the cursor, rms [mm]: right  forward  height",
              *(f"  {name:<21}{_three(single[key]):>50}" for name, key in (("palm anywhere", "free"),
                                                                           ("palm on the table", "on_table")))]
    if place:
        away = [one["away_mm"] for one in place]
        lines += ["", f"Pick and place: {sum(one['placed'] for one in place)} of {len(place)} balls came to lie within "
                      f"their radius of 25 mm; off by {np.median(away):.0f} mm (median), {max(away):.0f} mm at most."]
    return "\n".join(lines)


def _latency(one: Figures | None) -> list[str]:
    if one is None:
        return ["Latency: the hand was not tracked."]
    return [f"Latency: a state is ready {one['ready_p50_ms']:.1f} ms (p50), {one['ready_p99_ms']:.1f} ms (p99) after "
            "the hand was there.",
            f"The cursor lags {one['lag_ms']:.0f} ms behind the hand at the state's own time."]


def _three(one: Figures | None) -> str:
    if one is None or one["x_mm"] is None:
        return f"{'not tracked':>24}"
    return f"{one['x_mm']:8.2f} {one['y_mm']:8.2f} {one['height_mm']:7.2f}"


def _throughput(name: str, one: Figures | None) -> str:
    if one is None:
        return f"Target test, {name} hand: not every target was clicked."
    return (f"Target test, {name} hand: {one['bits_per_s']:.2f} bit/s, {one['movement_s']:.2f} s each, effective width "
            f"{one['effective_width_mm']:.1f} mm, {one['missed']} missed.")
