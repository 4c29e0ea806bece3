"""The chart of benchmarks/solvers.py: three panels of bars over the same methods, as SVG."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from html import escape

Row = dict[str, dict[str, float]]

LEFT, PANEL, GAP, LINE, TOP = 190, 230, 60, 26, 64
NEAR, FAR, INK, FAINT = "#2a78b8", "#e08a2e", "#222222", "#dddddd"


@dataclass(frozen=True, slots=True)
class Panel:
    """One panel: a logarithmic axis from `low` to `high` with a line at every power of ten, and two bars a method."""

    title: str
    low: float
    high: float
    bars: tuple[tuple[str, Callable[[Row], float | None]], ...]  # colour, value

    def place(self, value: float) -> float:
        """Where a value lies on the axis, px from its left; what is less than its beginning lies there."""
        share = math.log10(max(value, self.low) / self.low) / math.log10(self.high / self.low)
        return PANEL * min(share, 1.0)


def _of(case: str, field: str) -> Callable[[Row], float | None]:
    return lambda row: row[case][field] if case in row else None


PANELS = (
    Panel("five fingers, µs (whisker: p99)", 1.0, 1e4, ((NEAR, _of("near", "median_us")),
                                                                    (FAR, _of("far", "median_us")))),
    Panel("targets missed, %", 0.01, 100.0, ((NEAR, _of("near", "missed_percent")),
                                             (FAR, _of("any", "missed_percent")))),
    Panel("largest step of a joint, degrees", 1.0, 1000.0, ((NEAR, _of("stretch", "jump_deg")),
                                                           (FAR, _of("axis", "jump_deg")))),
)
KEYS = (("near", "far"), ("near", "any"), ("stretch", "axis"))


def draw_chart(figures: dict[str, Row]) -> str:
    """The SVG of the figures that benchmarks/solvers.py gathers."""
    width = LEFT + len(PANELS) * (PANEL + GAP)
    height = TOP + LINE * len(figures) + 34
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" '
             f'height="{height}" font-family="sans-serif" font-size="12" fill="{INK}">',
             f'<rect width="{width}" height="{height}" fill="#ffffff"/>']
    for row, name in enumerate(figures):
        label = name.lower().replace("_", " ").replace("fabrik", "FABRIK").replace("svd", "SVD")
        parts.append(_text(LEFT - 10, TOP + LINE * row + 17, label, "end"))
    for index, panel in enumerate(PANELS):
        parts += _draw_panel(panel, KEYS[index], LEFT + index * (PANEL + GAP), figures)
    return "\n".join([*parts, "</svg>", ""])


def _draw_panel(panel: Panel, keys: tuple[str, str], left: float, figures: dict[str, Row]) -> list[str]:
    bottom = TOP + LINE * len(figures)
    parts = [_text(left, 18, panel.title, "start", bold=True)]
    for key, (colour, _), at in zip(keys, panel.bars, (left, left + 80), strict=True):
        parts += [_bar(at, 28, 10, 10, colour), _text(at + 15, 37, key, "start")]
    power = panel.low
    while power <= panel.high * 1.0001:
        x = left + panel.place(power)
        parts += [f'<line x1="{x:.1f}" y1="{TOP - 8}" x2="{x:.1f}" y2="{bottom + 4}" stroke="{FAINT}"/>',
                  _text(x, bottom + 20, f"{power:g}", "middle")]
        power *= 10.0
    for row, of in enumerate(figures.values()):
        for offset, (colour, value_of) in zip((4, 13), panel.bars, strict=True):
            value, y = value_of(of), TOP + LINE * row + offset
            if value is None:
                continue
            parts.append(_bar(left, y, max(panel.place(value), 1.0), 8, colour))
            if panel is PANELS[0]:
                parts.append(_whisker(panel, left, y + 4, value, of["near" if offset == 4 else "far"]["p99_us"]))
    return parts


def _bar(x: float, y: float, width: float, height: float, colour: str) -> str:
    return f'<rect x="{x:.1f}" y="{y:.1f}" width="{width:.1f}" height="{height}" fill="{colour}"/>'


def _whisker(panel: Panel, left: float, y: float, start: float, end: float) -> str:
    a, b = left + panel.place(start), left + panel.place(end)
    return (f'<path d="M{a:.1f} {y:.1f}H{b:.1f}M{b:.1f} {y - 3:.1f}V{y + 3:.1f}" stroke="{INK}" fill="none"/>')


def _text(x: float, y: float, text: str, anchor: str, bold: bool = False) -> str:
    weight = ' font-weight="bold"' if bold else ""
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}"{weight}>{escape(text)}</text>'
