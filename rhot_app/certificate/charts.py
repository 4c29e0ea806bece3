"""The charts of a certificate: the thesis's numbers beside the user's."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from rhot_app.calibration.depth.fit import depth_from_disparity
from rhot_app.certificate import thesis
from rhot_app.certificate.document import Line
from rhot_app.charts import Array, Chart, Curve

MINE, PALE, THESIS, CORRECTED, GREY, DARK = "#2978b8", "#8cbfe6", "#e08a2e", "#f5d19e", "#dbdbdb", "#404040"
"""Of this rig, its second bar, the thesis, its corrected values, limits, intervals."""

_LEAST_MS, _MOST_MS = 1e-3, 100.0


def chart_of(line: Line) -> Chart | None:
    """The chart of a line; None for one that has nothing to show."""
    make = _CHARTS.get(line.code)
    return None if make is None or not line.curves else make(line)


def _values(line: Line, name: str) -> Array:
    """A curve's numbers; NaN for what is not known."""
    return np.array(line.curves[name], dtype=np.float64)


def _level(name: str, span: tuple[float, float], value: float, colour: str) -> Curve:
    return Curve(name, np.array(span), np.full(2, value), colour=colour)


def _static(line: Line) -> Chart:
    """Figure 7.7: bars per marker and axis, and the thesis's range."""
    names = tuple(line.curves)
    values = np.nan_to_num(np.array([_values(line, name)[:2] for name in names]))
    low = min(10.0 ** (math.ceil(math.log10(max(values[values > 0.0].min(initial=10.0), 1e-3))) - 1), 0.01)
    at, span = np.arange(len(names), dtype=np.float64), (-0.6, len(names) - 0.4)
    least, most = (_level(name, span, value, THESIS) for name, value in
                   zip(("thesis: 2 to 5 px", ""), thesis.JITTER_PX, strict=True))
    return Chart("Jitter of a static marker in the pictures (figure 7.7)", "", "px, standard deviation", (
        Curve("x", at - 0.15, values[:, 0], "bars", colour=MINE, width=0.26),
        Curve("y", at + 0.15, values[:, 1], "bars", colour=PALE, width=0.26), least, most),
        log_y=True, names=names, x_span=span, y_span=(low, 10.0))


def _depth(line: Line) -> Chart:
    """Figure 7.8 and table 10.1 as deviations: the user's, the thesis's, and one pixel (eq. 7.3)."""
    ruler = _values(line, "ruler_m")
    off = 100.0 * (_values(line, "seen_m") / ruler - 1.0)
    order = np.argsort(ruler)
    pixel, at = (100.0 * _values(line, "one_pixel_m") / ruler)[order], 100.0 * ruler[order]
    theirs = 100.0 * (depth_from_disparity(thesis.DISPARITY_PX, thesis.BASELINE_M, thesis.WIDTH_PX,
                                           math.radians(thesis.VIEW_ANGLE_DEG)) / thesis.REAL_M - 1.0)
    corrected = 100.0 * (thesis.POWER_K_M * thesis.DISPARITY_PX**thesis.POWER_Z / thesis.REAL_M - 1.0)
    most = 1.1 * max(6.0, float(np.nanmax(np.abs(off))))
    return Chart("Deviation from the ruler (table 10.1, figure 7.8)", "cm by the ruler", "%", (
        Curve("one pixel, eq. 7.3", at, pixel, colour=GREY), Curve("", at, -pixel, colour=GREY),
        Curve("thesis, eq. 6.12", 100.0 * thesis.REAL_M, theirs, "dots", colour=THESIS),
        Curve("corrected, eq. 7.4", 100.0 * thesis.REAL_M, corrected, "dots", colour=CORRECTED),
        Curve("this rig", 100.0 * ruler, off, "dots", colour=MINE)),
        x_span=(0.0, max(105.0, 105.0 * float(ruler.max()))), y_span=(-most, most))


def _timing(line: Line) -> Chart:
    """p50 and p99 of every stage, and the thesis's means."""
    names = tuple(line.curves)
    theirs = {"detect": "colour detection", "network": "UDP sending", "sum": "sum"}
    at = np.arange(len(names), dtype=np.float64)
    middle, late = np.maximum(np.nan_to_num([_values(line, name) for name in names]), _LEAST_MS).T
    mean = np.array([thesis.TIMING_MS[theirs[name]][0] if name in theirs else np.nan for name in names])
    return Chart("Time of each stage (table 7.1)", "", "ms", (
        Curve("p50", at - 0.28, middle, "bars", colour=MINE, width=0.24),
        Curve("p99", at, late, "bars", colour=PALE, width=0.24),
        Curve("thesis, mean", at + 0.28, mean, "bars", colour=THESIS, width=0.24)),
        log_y=True, names=names, x_span=(-0.6, len(names) - 0.4), y_span=(_LEAST_MS, _MOST_MS))


def _rod(line: Line) -> Chart:
    """Every length over its distance."""
    depth, length = 100.0 * _values(line, "depth_m"), _values(line, "length_mm")
    stated = line.curves["stated_mm"][0] or 0.0
    reach = 1.1 * max(float(np.abs(length - stated).max()), 0.015 * stated)
    span = (float(np.floor(depth.min())), float(np.ceil(depth.max())))
    return Chart("Length of the rod wherever it is held", "cm from the cameras", "mm", (
        _level("1 % wrong", span, 0.99 * stated, GREY), _level("", span, 1.01 * stated, GREY),
        _level("as stated", span, stated, THESIS), Curve("as seen", depth, length, "faint dots", colour=MINE)),
        x_span=span, y_span=(stated - reach, stated + reach))


def _latency(line: Line) -> Chart:
    """Each delay with its interval."""
    words = {"exposed": "timestamp", "arrived": "master", "appears": "appears", "vanishes": "vanishes"}
    kept = [name for name in words if name in line.curves]
    low, value, high = np.nan_to_num([_values(line, name) for name in kept]).T
    at = np.arange(len(kept), dtype=np.float64)
    return Chart("From the screen's order", "", "ms", (
        Curve("this rig; the line is the interval", at, value, "bars", colour=MINE),
        Curve("", at, low, "whiskers", high, colour=DARK)),
        names=tuple(words[name] for name in kept), x_span=(-0.6, len(kept) - 0.4),
        y_span=(0.0, max(1.15 * float(max(value.max(), high.max())), 1.0)))


_CHARTS: dict[str, Callable[[Line], Chart]] = {
    "static": _static, "depth": _depth, "timing": _timing, "rod": _rod, "latency": _latency}
