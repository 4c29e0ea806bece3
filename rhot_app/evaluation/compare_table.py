"""The table of `rhot evaluate --compare`: trackers side by side, and the last one's figure as a part of the first's."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from rhot_app.evaluation.accuracy import Figures, ratio
from rhot_app.evaluation.compare import Comparison, Run


@dataclass(frozen=True, slots=True)
class Column:
    """One figure: its key, its heading, its form, and whether a ratio says anything."""

    key: str
    heading: str
    form: str
    compared: bool = True


COLUMNS = (
    Column("tip_visible_mm", "tips visible mm", ".2f"), Column("tip_measured_mm", "tips measured mm", ".2f"),
    Column("tip_display_mm", "tips displayed mm", ".2f"), Column("marker_mm", "markers mm", ".2f"),
    Column("angles_deg", "angles deg", ".1f"), Column("palm_turn_deg", "palm turn deg", ".1f"),
    Column("swaps", "swaps", ".0f", compared=False), Column("states_per_s", "states/s", ".0f", compared=False),
)
_CELL = 7


def table(comparison: Comparison, trackers: Sequence[str], columns: Sequence[Column] = COLUMNS) -> str:
    """One line per run, and one for all seeds of each motion; under each figure the trackers and the ratio of the last
    tracker's to the first one's."""
    names = [_name(run) for motion in comparison.motions() for run in comparison.of(motion)]
    width = max(len(name) for name in [*names, *comparison.motions()]) + 2
    lines = _heads(width, trackers, columns)
    for motion in comparison.motions():
        runs = comparison.of(motion)
        if len(runs) > 1:
            lines += [_line(_name(run), width, run.figures, trackers, columns) for run in runs]
        lines.append(_line(motion, width, comparison.together(motion).figures, trackers, columns))
    return "\n".join(lines)


def cell(value: float | None, form: str) -> str:
    """A figure, or a dash where there is none."""
    return "-" if value is None or value != value else format(value, form)


def _name(run: Run) -> str:
    return f"  {run.motion} {run.seed}"


def _heads(width: int, trackers: Sequence[str], columns: Sequence[Column]) -> list[str]:
    first, second = " " * width, " " * width
    for column in columns:
        under = [*trackers, "ratio"] if _has_ratio(column, trackers) else list(trackers)
        words = "".join(word[:_CELL].rjust(_CELL + 1) for word in under)
        first += "  " + column.heading[:len(words)].rjust(len(words))
        second += "  " + words
    return [first, second]


def _line(name: str, width: int, figures: dict[str, Figures], trackers: Sequence[str],
          columns: Sequence[Column]) -> str:
    line = name.ljust(width)
    for column in columns:
        values = [figures[tracker][column.key] for tracker in trackers]
        cells = [cell(value, column.form) for value in values]
        if _has_ratio(column, trackers):
            cells.append(cell(ratio(values[-1], values[0]), ".2f"))
        line += "  " + "".join(text.rjust(_CELL + 1) for text in cells)
    return line


def _has_ratio(column: Column, trackers: Sequence[str]) -> bool:
    return column.compared and len(trackers) > 1
