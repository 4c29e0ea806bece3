"""The charts of a certificate, the thesis's numbers beside the user's: drawings in millimetres, for HTML and PDF."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.depth.fit import depth_from_disparity
from rhot_app.certificate import thesis
from rhot_app.certificate.document import Line
from rhot_app.vector_graphics import Box, Drawing, Ink, Stroke, Text

Array = NDArray[np.float64]

MINE: Ink = (0.16, 0.47, 0.72)
THESIS: Ink = (0.88, 0.54, 0.18)
_GRID: Ink = (0.86, 0.86, 0.86)
_DARK: Ink = (0.25, 0.25, 0.25)
_WIDTH, _HEIGHT = 172.0, 72.0  # mm
_LEFT, _RIGHT, _TOP, _FOOT = 16.0, 4.0, 13.0, 12.0


def chart_of(line: Line) -> Drawing | None:
    """The chart of a line; None for one that has nothing to show."""
    make = _CHARTS.get(line.code)
    return None if make is None or not line.curves else make(line)


@dataclass
class _Axes:
    """A frame with ticks; values are clipped to it."""

    title: str
    x_label: str
    y_label: str
    x: tuple[float, float]
    y: tuple[float, float]
    log: bool = False
    x_ticks: Sequence[float] | None = None
    boxes: list[Box] = field(default_factory=list)
    strokes: list[Stroke] = field(default_factory=list)
    texts: list[Text] = field(default_factory=list)

    def at(self, x: float, y: float) -> tuple[float, float]:
        """Where it lies, mm."""
        across = (x - self.x[0]) / (self.x[1] - self.x[0])
        low, high, value = (math.log10(max(one, 1e-12)) if self.log else one for one in (*self.y, y))
        up = (value - low) / (high - low)
        return (_LEFT + min(max(across, 0.0), 1.0) * (_WIDTH - _LEFT - _RIGHT),
                _HEIGHT - _FOOT - min(max(up, 0.0), 1.0) * (_HEIGHT - _TOP - _FOOT))

    def line(self, x: Sequence[float], y: Sequence[float], ink: Ink, width: float = 0.4) -> None:
        """A curve."""
        self.strokes.append(Stroke(tuple(self.at(a, b) for a, b in zip(x, y, strict=True)), width, ink))

    def dots(self, x: Sequence[float], y: Sequence[float], ink: Ink, size: float = 1.4) -> None:
        """Squares about points."""
        for a, b in zip(x, y, strict=True):
            u, v = self.at(a, b)
            self.boxes.append(Box(u - 0.5 * size, v - 0.5 * size, size, size, ink))

    def bars(self, x: float, width: float, low: float, high: float, ink: Ink) -> None:
        """A bar from `low` to `high`, `width` on the x axis."""
        u0, v0 = self.at(x - 0.5 * width, high)
        u1, v1 = self.at(x + 0.5 * width, low)
        self.boxes.append(Box(u0, v0, u1 - u0, max(v1 - v0, 0.2), ink))

    def drawing(self, legend: Sequence[tuple[str, Ink]], names: Sequence[str] = ()) -> Drawing:
        """The finished chart; `names` stand below instead of numbers at 0, 1, 2, ..."""
        frame: list[Stroke] = []
        texts = [Text(_LEFT, 4.5, 3.3, self.title, bold=True), Text(2.0, _TOP - 2.0, 2.6, self.y_label, ink=_DARK),
                 Text(_WIDTH - _RIGHT - 1.35 * len(self.x_label), _HEIGHT - 2.0, 2.6, self.x_label, ink=_DARK)]
        for value in _log_ticks(self.y) if self.log else _ticks(self.y):
            u, v = self.at(self.x[0], value)
            frame.append(Stroke(((u, v), (_WIDTH - _RIGHT, v)), 0.15, _GRID))
            label = f"{value:g}"
            texts.append(Text(u - 1.5 - 1.5 * len(label), v + 0.9, 2.6, label, ink=_DARK))
        for k, value in enumerate(_ticks(self.x) if not names else range(len(names))):
            u, v = self.at(value, self.y[0])
            label = names[k] if names else f"{value:g}"
            texts.append(Text(u - 0.7 * len(label), v + 4.2, 2.6, label, ink=_DARK))
        x = _WIDTH - _RIGHT - sum(8.0 + 1.45 * len(name) for name, _ in legend)
        for name, ink in legend:
            self.boxes.append(Box(x, 6.6, 3.0, 2.0, ink))
            texts.append(Text(x + 4.0, 8.6, 2.6, name, ink=_DARK))
            x += 8.0 + 1.45 * len(name)
        corner, end = self.at(self.x[0], self.y[0]), self.at(self.x[1], self.y[0])
        frame.append(Stroke((corner, end), 0.25, _DARK))
        return Drawing(_WIDTH, _HEIGHT, tuple(self.boxes), (*texts, *self.texts), self.title, (*frame, *self.strokes))


def _ticks(span: tuple[float, float]) -> list[float]:
    step = 10.0 ** math.floor(math.log10((span[1] - span[0]) / 2.0))
    step *= next(factor for factor in (1.0, 2.0, 5.0, 10.0) if (span[1] - span[0]) / (step * factor) <= 6.0)
    first = math.ceil(span[0] / step - 1e-9)
    return [round(k * step, 10) for k in range(first, math.floor(span[1] / step + 1e-9) + 1)]


def _log_ticks(span: tuple[float, float]) -> list[float]:
    return [10.0**k for k in range(math.ceil(math.log10(span[0])), math.floor(math.log10(span[1])) + 1)]


def _static(line: Line) -> Drawing:
    """Figure 7.7: bars per marker and axis, and the thesis's range."""
    names = list(line.curves)
    values = np.array([[x or 0.0 for x in line.curves[name][:2]] for name in names])
    low = 10.0 ** (math.ceil(math.log10(max(values[values > 0.0].min(), 1e-3))) - 1)
    low = min(low, 0.01)
    axes = _Axes("Jitter of a static marker in the pictures (figure 7.7)", "", "px, standard deviation",
                 (-0.6, len(names) - 0.4), (low, 10.0), log=True)
    for value in thesis.JITTER_PX:
        axes.line((-0.6, len(names) - 0.4), (value, value), THESIS, 0.6)
    for k, row in enumerate(values):
        axes.bars(k - 0.15, 0.26, low, row[0], MINE)
        axes.bars(k + 0.15, 0.26, low, row[1], (0.55, 0.75, 0.9))
    return axes.drawing((("x", MINE), ("y", (0.55, 0.75, 0.9)), ("thesis: 2 to 5 px", THESIS)), names)


def _depth(line: Line) -> Drawing:
    """Figure 7.8 and table 10.1 as deviations: the user's, the thesis's, and one pixel (eq. 7.3)."""
    ruler = np.array(line.curves["ruler_m"], dtype=np.float64)
    off = 100.0 * (np.array(line.curves["seen_m"], dtype=np.float64) / ruler - 1.0)
    pixel = 100.0 * np.array(line.curves["one_pixel_m"], dtype=np.float64) / ruler
    theirs = 100.0 * (depth_from_disparity(thesis.DISPARITY_PX, thesis.BASELINE_M, thesis.WIDTH_PX,
                                           math.radians(thesis.VIEW_ANGLE_DEG)) / thesis.REAL_M - 1.0)
    corrected = 100.0 * (thesis.POWER_K_M * thesis.DISPARITY_PX**thesis.POWER_Z / thesis.REAL_M - 1.0)
    most = 1.1 * max(6.0, float(np.abs(off).max()))
    axes = _Axes("Deviation from the ruler (table 10.1, figure 7.8)", "cm by the ruler", "%",
                 (0.0, max(105.0, 105.0 * float(ruler.max()))), (-most, most))
    order = np.argsort(ruler)
    for sign in (1.0, -1.0):
        axes.line((100.0 * ruler[order]).tolist(), (sign * pixel[order]).tolist(), _GRID, 0.5)
    axes.dots((100.0 * thesis.REAL_M).tolist(), theirs.tolist(), THESIS)
    axes.dots((100.0 * thesis.REAL_M).tolist(), corrected.tolist(), (0.96, 0.82, 0.62))
    axes.dots((100.0 * ruler).tolist(), off.tolist(), MINE, 1.8)
    return axes.drawing((("this rig", MINE), ("thesis, eq. 6.12", THESIS), ("corrected, eq. 7.4", (0.96, 0.82, 0.62)),
                         ("one pixel, eq. 7.3", _GRID)))


def _timing(line: Line) -> Drawing:
    """p50 and p99 of every stage, and the thesis's means."""
    names = list(line.curves)
    theirs = {"detect": "colour detection", "network": "UDP sending", "sum": "sum"}
    axes = _Axes("Time of each stage (table 7.1)", "", "ms", (-0.6, len(names) - 0.4), (1e-3, 100.0), log=True)
    for k, name in enumerate(names):
        middle, late = (max(value or 0.0, 1e-3) for value in line.curves[name])
        axes.bars(k - 0.28, 0.24, 1e-3, middle, MINE)
        axes.bars(k, 0.24, 1e-3, late, (0.55, 0.75, 0.9))
        if name in theirs:
            axes.bars(k + 0.28, 0.24, 1e-3, thesis.TIMING_MS[theirs[name]][0], THESIS)
    return axes.drawing((("p50", MINE), ("p99", (0.55, 0.75, 0.9)), ("thesis, mean", THESIS)), names)


def _rod(line: Line) -> Drawing:
    """Every length over its distance."""
    depth = 100.0 * np.array(line.curves["depth_m"], dtype=np.float64)
    length = np.array(line.curves["length_mm"], dtype=np.float64)
    stated = line.curves["stated_mm"][0] or 0.0
    reach = 1.1 * max(float(np.abs(length - stated).max()), 0.015 * stated)
    span = (float(np.floor(depth.min())), float(np.ceil(depth.max())))
    axes = _Axes("Length of the rod wherever it is held", "cm from the cameras", "mm", span,
                 (stated - reach, stated + reach))
    for factor in (0.99, 1.01):
        axes.line(span, (factor * stated, factor * stated), _GRID, 0.5)
    axes.line(span, (stated, stated), THESIS, 0.6)
    axes.dots(depth.tolist(), length.tolist(), MINE, 0.9)
    return axes.drawing((("as seen", MINE), ("as stated", THESIS), ("1 % wrong", _GRID)))


def _latency(line: Line) -> Drawing:
    """Each delay with its interval."""
    names = {"exposed": "timestamp", "arrived": "master", "appears": "appears", "vanishes": "vanishes"}
    kept = [name for name in names if name in line.curves]
    most = 1.15 * max(value or 0.0 for name in kept for value in line.curves[name])
    axes = _Axes("From the screen's order", "", "ms", (-0.6, len(kept) - 0.4), (0.0, max(most, 1.0)))
    for k, name in enumerate(kept):
        low, value, high = (one or 0.0 for one in line.curves[name])
        axes.bars(k, 0.4, 0.0, value, MINE)
        axes.line((k, k), (low, high), _DARK, 0.5)
    return axes.drawing((("this rig; the line is the interval", MINE),), [names[name] for name in kept])


_CHARTS: dict[str, Callable[[Line], Drawing]] = {
    "static": _static, "depth": _depth, "timing": _timing, "rod": _rod, "latency": _latency}
