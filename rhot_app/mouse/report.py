"""The measures of the 3-D mouse as text tables."""

from __future__ import annotations

from typing import Any

import numpy as np

from rhot_app.mouse.pointer import BUTTONS

Figures = dict[str, Any]


def report(set_ups: list[Figures]) -> str:
    """A table of each set-up with all measures, and a comparison of the set-ups."""
    parts = [_report(figures) for figures in set_ups]
    if len(set_ups) > 1:
        parts.append("\n".join(_comparison(set_ups)))
    return "\n\n\n".join(parts)


def _comparison(set_ups: list[Figures]) -> list[str]:
    """A line per measure, a column per set-up."""
    rows: list[tuple[str, list[str]]] = [("Beside each other", [one["set_up"] for one in set_ups])]
    for axis, name in (("x_mm", "right"), ("y_mm", "forward"), ("height_mm", "height")):
        rows.append((f"jitter, {name}, median [mm]", [_median([each[axis] for each in one["resolution"]])
                                                      for one in set_ups]))
    for axis, name in (("x_mm", "right"), ("y_mm", "forward"), ("height_mm", "height")):
        rows.append((f"error while moved, {name}, median rms [mm]", [
            _median([each["rms"] and each["rms"][axis] for each in one["coupling"]]) for one in set_ups]))
    for button in BUTTONS:
        rows.append((f"{button} button: right of presses, wrong", [
            "{right} of {presses}, {wrong}".format(**one["buttons"][button]) for one in set_ups]))
    rows.append(("target test [bit/s]", ["-" if one["throughput"]["tracked"] is None else
                                         f"{one['throughput']['tracked']['bits_per_s']:.2f}" for one in set_ups]))
    rows.append(("picked and placed", [f"{sum(each['placed'] for each in one['place'])} of {len(one['place'])}"
                                       for one in set_ups]))
    return [f"{name:<42}" + "".join(f"{value:>26}" for value in values) for name, values in rows]


def _median(values: list[float | None]) -> str:
    known = [value for value in values if value is not None]
    lost = len(values) - len(known)
    return ("-" if not known else f"{np.median(known):.1f}") + (f" ({lost} lost)" if lost else "")


def _report(figures: Figures) -> str:
    """The tables of one set-up."""
    source = "rendered images" if figures["pictures"] else "observations without images"
    found, place = figures["throughput"], figures["place"]
    late = figures["latency"]
    lines = [f"3-D mouse on the twin, {figures['set_up']}, seed {figures['seed']}, from {source}. Lengths are the "
             "cursor's.",
             "", "Hand speed along the table (always from images)      time in which the hand is held",
             *(f"  {one['speed_m_per_s']:5.2f} m/s {100.0 * one['held']:40.1f} %" for one in figures["speed"]),
             "", "Moved alone    error of the cursor [mm]: rms of right, forward, height; then their peaks",
             *(f"  {one['moved']:<12}{_three(one['rms'])}    {_three(one['peak'])}" for one in figures["coupling"]),
             "", "Palm turned on the table   jitter, standard deviation [mm]: right  forward  height",
             *(f"  {one['turn_deg']:+5.0f} deg{_three(one):>71}" for one in figures["resolution"]),
             "", "Button     presses   right   wrong   late [ms, median]",
             *(f"  {button:<10}{one['presses']:6}{one['right']:8}{one['wrong']:8}"
               + ("       -" if one["late_ms"] is None else f"{one['late_ms']:8.0f}")
               for button, one in figures["buttons"].items()),
             "", *_latency(late), "", *(_throughput(name, found[name]) for name in ("true", "tracked"))]
    single = figures.get("one_camera")
    if single is not None:
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
    lag = f"The cursor lags {one['lag_ms']:.0f} ms behind the hand at the state's own time."
    if one["ready_p50_ms"] is None:
        return [lag]
    return [f"Latency: a state is ready {one['ready_p50_ms']:.1f} ms (p50), {one['ready_p99_ms']:.1f} ms (p99) after "
            "the hand was there.",
            lag]


def _three(one: Figures | None) -> str:
    if one is None or one["x_mm"] is None:
        return f"{'not tracked':>24}"
    return f"{one['x_mm']:8.2f} {one['y_mm']:8.2f} {one['height_mm']:7.2f}"


def _throughput(name: str, one: Figures | None) -> str:
    if one is None:
        return f"Target test, {name} hand: not every target was clicked."
    return (f"Target test, {name} hand: {one['bits_per_s']:.2f} bit/s, {one['movement_s']:.2f} s each, effective width "
            f"{one['effective_width_mm']:.1f} mm, {one['missed']} missed.")
