"""What a calibration has found, said once: the same figures are printed, written as JSON and shown beside the rig's.

A calibration's ``report`` makes a `Report` of its result. Nothing else writes its figures out.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from rhot_app.calibration.verdict import Verdict

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from rhot_app.charts import Chart

    Array = NDArray[np.float64]
    Value = float | str | Sequence[float] | Sequence[str] | Array | Mapping[str, Any] | None

UNKNOWN = "–"


@dataclass(frozen=True, slots=True, eq=False)
class Figure:
    """One figure of a result, in the unit in which people read it.

    `name` is for people; one without a name stands in JSON alone. `value` is a number, several, or a text; None and NaN
    are not known. `sd` is its standard deviation, one per number or one for all. `key` is the field in JSON, with dots
    for a field within a field; two keys divided by a space are one per number. `decimals` are shown where no `sd` says
    how many mean something.
    """

    name: str
    value: Value
    unit: str = ""
    sd: Value = None
    decimals: int = 2
    key: str = ""
    sd_key: str = ""

    @property
    def number(self) -> str:
        """The value with its standard deviation, without its unit."""
        if isinstance(self.value, str):
            return self.value
        values, spreads = _several(self.value), _several(self.sd)
        spreads = spreads if len(spreads) == len(values) else (spreads or [None]) * len(values)
        return ", ".join(_number(*each, self.decimals) for each in zip(values, spreads, strict=True)) or UNKNOWN

    @property
    def text(self) -> str:
        """E.g. "534.3 ± 0.5, 534.1 ± 0.5 px"."""
        return f"{self.number} {self.unit}".rstrip() if any(map(str.isdigit, self.number)) else self.number

    @property
    def brief(self) -> str:
        """The same in a narrow column: several numbers with the largest standard deviation of theirs, if they are of
        one unit."""
        values, spreads = _several(self.value), [sd for sd in _several(self.sd) if sd]
        if isinstance(self.value, str) or len(values) < 2:
            return self.text
        more = f" ± {max(spreads):.{self.decimals}f}" if self.unit and spreads else ""
        return f"{', '.join(_number(value, None, self.decimals) for value in values)}{more} {self.unit}".rstrip()

    def fields(self) -> dict[str, Any]:
        """What JSON says of it."""
        found: dict[str, Any] = {}
        for keys, value in ((self.key, self.value), (self.sd_key, self.sd)):
            if " " in keys:
                found |= zip(keys.split(), plain(value), strict=True)
            elif keys:
                found[keys] = plain(value)
        return found


@dataclass(frozen=True, slots=True, eq=False)
class Table:
    """Figures of several things: a row for each, its first figure the name of the thing. In JSON under `key` as a list
    of objects, or `by_name` as one object for each name. `title` is printed above it."""

    key: str
    rows: tuple[tuple[Figure, ...], ...]
    by_name: bool = False
    title: str = ""

    @property
    def heads(self) -> tuple[str, ...]:
        """What stands above each column."""
        return tuple(f"{one.name}, {one.unit}" if one.unit else one.name for one in self.rows[0] if one.name) \
            if self.rows else ()

    @property
    def texts(self) -> list[tuple[str, ...]]:
        """The cells of all rows."""
        return [tuple(one.number for one in row if one.name) for row in self.rows]

    def lines(self) -> list[str]:
        """Printed in columns; a column of numbers is aligned to the right."""
        cells = [self.heads, *self.texts]
        widths = [max(len(row[column]) for row in cells) for column in range(len(self.heads))]
        title = [self.title] if self.title and self.rows else []
        return [*title, *("  ".join(f"{text:{'<' if column == 0 else '>'}{width}}" for column, (text, width)
                                    in enumerate(zip(row, widths, strict=True))).rstrip() for row in cells if row)]

    def to_json(self) -> Any:
        """A list of objects, or one object by name."""
        rows = [nested(fields for one in row for fields in one.fields().items()) for row in self.rows]
        if not self.by_name:
            return rows
        return {str(row[0].value): fields for row, fields in zip(self.rows, rows, strict=True)}


@dataclass(frozen=True, slots=True, eq=False)
class Report:
    """A result as it is said to people and programs.

    `figures` stand in all outputs, and beside the rig's of the same name before a result is used. `tables` and `notes`
    (sentences) are printed too, `fields` are in JSON alone, `charts` on the screen.
    """

    verdict: Verdict
    figures: tuple[Figure, ...] = ()
    tables: tuple[Table, ...] = ()
    notes: tuple[str, ...] = ()
    fields: Mapping[str, Any] = field(default_factory=dict)
    charts: tuple[Chart, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """One object; numbers that are not known are null."""
        figures = (item for one in self.figures for item in one.fields().items())
        tables = ((table.key, table.to_json()) for table in self.tables if table.key)
        return nested([*plain(self.fields).items(), *figures, *tables, *self.verdict.to_json().items()])

    def lines(self) -> list[str]:
        """What is printed below the verdict."""
        named = [one for one in self.figures if one.name]
        width = max((len(one.name) for one in named), default=0)
        tables = [line for table in self.tables for line in ("", *table.lines()) if table.heads]
        between = [""] if tables and self.notes else []
        return [*(f"{one.name:<{width}}  {one.text}" for one in named), *tables, *between, *self.notes]


def plain(value: Any) -> Any:
    """The value as JSON may hold it: arrays are lists, and what is no finite number is None."""
    if hasattr(value, "tolist"):  # of numpy
        return plain(value.tolist())
    if isinstance(value, Mapping):
        return {str(name): plain(one) for name, one in value.items()}
    if isinstance(value, list | tuple):
        return [plain(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def nested(items: Iterable[tuple[str, Any]]) -> dict[str, Any]:
    """One object of `items`, in which "a.b" is the field b of the field a."""
    found: dict[str, Any] = {}
    for name, value in items:
        outer, _, inner = name.partition(".")
        if inner:
            found[outer] = {**(found.get(outer) or {}), **nested([(inner, value)])}
        else:
            found[outer] = value
    return found


def _several(value: Any) -> list[Any]:
    known = plain(value)
    return [] if known is None else known if isinstance(known, list) else [known]


def _number(value: float | None, sd: float | None, decimals: int) -> str:
    """With the digits that its standard deviation leaves meaningful: two of its own."""
    if value is None:
        return UNKNOWN
    if not sd:
        return f"{value:z.{decimals}f}"
    digits = min(max(1 - math.floor(math.log10(sd)), 0), 6)
    return f"{value:z.{digits}f} ± {sd:.{digits}f}"
