"""What a chart shows, without the widget that draws it on the screen; on paper and in HTML it is drawn here."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rhot_app.vector_graphics import Box, Drawing, Ink, Mark, Stroke, Text

Array = NDArray[np.float64]
Style = Literal["line", "dashes", "dots", "faint dots", "band", "bars", "whiskers"]
Span = tuple[float, float]


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """One curve: `x` and `y` (N,). A band and whiskers reach from `y` to `high` (N,); bars from the axis to `y`,
    `width` wide, in units of x. `colour` ``#rrggbb``: its own, if it has one; a curve without a `name` stays out of the
    legend."""

    name: str
    x: Array
    y: Array
    style: Style = "line"
    high: Array | None = None
    colour: str = ""
    width: float = 0.4


@dataclass(frozen=True, slots=True, eq=False)
class Chart:
    """Curves over one pair of axes with their units; `log_x`, `log_y`: a logarithmic axis, all values above 0. `names`
    stand below 0, 1, 2, ... instead of numbers. `x_span`, `y_span`: what the axes show, where that is fixed."""

    title: str
    x_label: str
    y_label: str
    curves: tuple[Curve, ...]
    log_x: bool = False
    log_y: bool = False
    names: tuple[str, ...] = ()
    x_span: Span | None = None
    y_span: Span | None = None

    def reach(self) -> tuple[Span, Span]:
        """Lowest and highest x and y: the fixed spans, or those of all finite values, bars' ends among them."""
        x = [curve.x for curve in self.curves]
        y = [part for curve in self.curves for part in (curve.y, curve.high) if part is not None]
        return self.x_span or _extent(x, log=self.log_x), self.y_span or _extent(y, log=self.log_y)

    def draw(self, width: float = 172.0, height: float = 72.0) -> Drawing:
        """The chart on paper or in HTML, mm."""
        return _Paper(self, width, height).drawing()


def hex_of(rgb: tuple[int, int, int]) -> str:
    """``#rrggbb`` of three bytes."""
    return "#{:02x}{:02x}{:02x}".format(*rgb)


def ticks(span: Span, *, log: bool) -> list[float]:
    """Round values of an axis: at most seven, or powers of ten, with 2 and 5 between where there are few of them."""
    low, high = span
    if log:
        bottom, top = math.log10(low), math.log10(high)
        steps = (1.0, 2.0, 5.0) if top - bottom < _FEW_DECADES else (1.0,)
        every = [step * 10.0**decade for decade in range(math.floor(bottom), math.ceil(top) + 1) for step in steps]
        return [value for value in every if low * (1.0 - 1e-9) <= value <= high * (1.0 + 1e-9)]
    step = 10.0 ** math.floor(math.log10((high - low) / 2.0))
    step *= next(factor for factor in (1.0, 2.0, 5.0, 10.0) if (high - low) / (step * factor) <= 6.0)
    return [round(k * step, 10) for k in range(math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1)]


_FEW_DECADES = 2.5


def _extent(parts: Sequence[Array], *, log: bool) -> Span:
    values = np.concatenate([np.ravel(part) for part in parts]) if parts else np.empty(0)
    values = values[np.isfinite(values) & ((values > 0.0) | (not log))]
    low, high = (float(values.min()), float(values.max())) if len(values) else (1.0, 10.0)
    if low == high:
        low, high = (0.5 * low, 2.0 * high) if log else (low - 0.5, high + 0.5)
    return low, high


# -- On paper ----------------------------------------------------------------------------------------------------------

_GRID: Ink = (0.86, 0.86, 0.86)
_DARK: Ink = (0.25, 0.25, 0.25)
_TONES = ("#2978b8", "#e08a2e", "#2e8b57", "#b5302a", "#777777")
_LEFT, _RIGHT, _TOP, _FOOT = 16.0, 4.0, 13.0, 12.0  # mm around the axes
_LETTER_MM, _LEGEND_MM, _KEY_MM = 2.6, 1.45, 8.0  # a letter's height; width of one in the legend, and of what is beside
_WIDTHS = {"line": 0.4, "dashes": 0.5, "whiskers": 0.5, "band": 0.2}
_DOT_MM = {"dots": 1.8, "faint dots": 0.9}
_DASHES = 60  # along an axis


class _Paper:
    """The marks of one chart; values beyond the axes are drawn at their ends."""

    def __init__(self, chart: Chart, width: float, height: float) -> None:
        self.chart, self.width, self.height = chart, width, height
        self.spans = chart.reach()
        self.marks: list[Mark] = []

    def at(self, x: float, y: float) -> tuple[float, float]:
        """Where it lies, mm."""
        across, up = (self._share(value, span, log=log) for value, span, log in zip(
            (x, y), self.spans, (self.chart.log_x, self.chart.log_y), strict=True))
        return (_LEFT + across * (self.width - _LEFT - _RIGHT),
                self.height - _FOOT - up * (self.height - _TOP - _FOOT))

    @staticmethod
    def _share(value: float, span: Span, *, log: bool) -> float:
        low, high = (math.log10(end) for end in span) if log else span
        at = math.log10(max(value, 1e-12)) if log else value
        return min(max((at - low) / (high - low), 0.0), 1.0)

    def drawing(self) -> Drawing:
        """Frame, curves, legend."""
        self._axes()
        tones = iter(_TONES * (1 + len(self.chart.curves) // len(_TONES)))
        legend = []
        for curve in self.chart.curves:
            ink = _ink(curve.colour or next(tones))
            self._curve(curve, ink)
            if curve.name:
                legend.append((curve.name, ink))
        x = self.width - _RIGHT - sum(_KEY_MM + _LEGEND_MM * len(name) for name, _ in legend)
        for name, ink in legend:
            self.marks.append(Box(x, 6.6, 3.0, 2.0, ink))
            self.marks.append(Text(x + 4.0, 8.6, _LETTER_MM, name, ink=_DARK))
            x += _KEY_MM + _LEGEND_MM * len(name)
        return Drawing(self.width, self.height, tuple(self.marks), self.chart.title)

    def _axes(self) -> None:
        chart, (x_span, y_span) = self.chart, self.spans
        right, foot = self.width - _RIGHT, self.height - _FOOT
        self.marks += [Text(_LEFT, 4.5, 3.3, chart.title, bold=True),
                       Text(2.0, _TOP - 2.0, _LETTER_MM, chart.y_label, ink=_DARK),
                       Text(right, self.height - 2.0, _LETTER_MM, chart.x_label, ink=_DARK, anchor="end")]
        for value in ticks(y_span, log=chart.log_y):
            _, y = self.at(x_span[0], value)
            self.marks.append(Stroke(((_LEFT, y), (right, y)), 0.15, _GRID))
            self.marks.append(Text(_LEFT - 1.5, y + 0.9, _LETTER_MM, f"{value:g}", ink=_DARK, anchor="end"))
        labels = (dict(enumerate(chart.names)) if chart.names
                  else {value: f"{value:g}" for value in ticks(x_span, log=chart.log_x)})
        for value, label in labels.items():
            x, _ = self.at(value, y_span[0])
            self.marks.append(Text(x, foot + 4.2, _LETTER_MM, label, ink=_DARK, anchor="middle"))
        self.marks.append(Stroke(((_LEFT, foot), (right, foot)), 0.25, _DARK))

    def _curve(self, curve: Curve, ink: Ink) -> None:
        known = np.isfinite(curve.x) & np.isfinite(curve.y)
        high = curve.y if curve.high is None else curve.high
        match curve.style:
            case "dots" | "faint dots":
                size = _DOT_MM[curve.style]
                for x, y in zip(curve.x[known], curve.y[known], strict=True):
                    u, v = self.at(x, y)
                    self.marks.append(Box(u - 0.5 * size, v - 0.5 * size, size, size, ink))
            case "bars":
                foot = self.spans[1][0] if self.chart.log_y else min(max(self.spans[1][0], 0.0), self.spans[1][1])
                for x, y in zip(curve.x[known], curve.y[known], strict=True):
                    (left, top), (right, low) = (self.at(x - 0.5 * curve.width, max(y, foot)),
                                                 self.at(x + 0.5 * curve.width, min(y, foot)))
                    self.marks.append(Box(left, top, right - left, max(low - top, 0.2), ink))
            case "whiskers":
                known = known & np.isfinite(high)
                for x, y, end in zip(curve.x[known], curve.y[known], high[known], strict=True):
                    self.marks.append(Stroke((self.at(x, y), self.at(x, end)), _WIDTHS["whiskers"], ink))
            case "band":
                self._line(curve.x, curve.y, known, ink, "band")
                self._line(curve.x, high, known & np.isfinite(high), ink, "band")
            case _:
                self._line(curve.x, curve.y, known, ink, curve.style)

    def _line(self, x: Array, y: Array, known: NDArray[np.bool_], ink: Ink, style: str) -> None:
        """A stroke for every run of known values; dashes are every other piece of it."""
        for run in np.ma.clump_unmasked(np.ma.masked_array(x, ~known)) if known.any() else ():
            points = np.array([self.at(a, b) for a, b in zip(x[run], y[run], strict=True)])
            if style == "dashes":
                along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
                cuts = np.arange(0.0, along[-1], self.width / _DASHES)
                ends = np.stack([[np.interp(cuts, along, points[:, k]) for k in (0, 1)],
                                 [np.interp(cuts + 0.5 * self.width / _DASHES, along, points[:, k]) for k in (0, 1)]])
                self.marks += [Stroke(((a[0], a[1]), (b[0], b[1])), _WIDTHS[style], ink)
                                 for a, b in zip(ends[0].T.tolist(), ends[1].T.tolist(), strict=True)]
            elif len(points) > 1:
                self.marks.append(Stroke(tuple((u, v) for u, v in points.tolist()), _WIDTHS[style], ink))


def _ink(colour: str) -> Ink:
    red, green, blue = (int(colour[k:k + 2], 16) / 255.0 for k in (1, 3, 5))
    return red, green, blue
