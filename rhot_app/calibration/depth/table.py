"""Distances and the disparities measured there: gathered live, or read from a table that a person wrote."""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rhot_app.errors import CalibrationError
from rhot_node.errors import printable
from rhot_node.files import read_table

UNITS_M = {"m": 1.0, "cm": 0.01, "mm": 0.001}

_DISTANCE = re.compile(r"^(?:real|true|distance|depth)(?:_distance)?(?:_(m|cm|mm))?$")
_DISPARITY = re.compile(r"^(?:disparity|disp|parallax)(?:_(?:px|pixels?))?$")


@dataclass(frozen=True, slots=True)
class DepthRow:
    """One distance, m, with the mean disparity there, px, signed as it was measured.

    `sd_px` is the spread of the `count` single disparities, NaN for one. `line` is the file's, 0 when measured live.
    """

    distance_m: float
    disparity_px: float
    sd_px: float = math.nan
    count: int = 1
    line: int = 0

    @property
    def where(self) -> str:
        """The row's place in words."""
        return f"line {self.line}" if self.line else f"the measurement at {100 * self.distance_m:.4g} cm"


@dataclass(frozen=True, slots=True)
class RejectedRow:
    """A row that is not used, and why."""

    where: str
    reason: str


class DepthTable:
    """Rows for `rhot_app.calibration.depth.fit.fit_depth`. What cannot be a measurement is kept as `rejected`."""

    def __init__(self) -> None:
        self.rows: list[DepthRow] = []
        self.rejected: list[RejectedRow] = []
        self.unit_is_guessed = False  # the table's header did not say it

    def add(self, distance_m: float, disparities: Iterable[float]) -> DepthRow | None:
        """Take the disparities (px, either sign) seen of one marker at one distance; NaN ones are left out.

        Returns the row, or None when it was rejected. Several rows may have the same distance.
        """
        seen = np.array(list(disparities), dtype=np.float64)
        seen = seen[np.isfinite(seen)]
        if not len(seen):
            self.rejected.append(RejectedRow(f"the measurement at {100 * distance_m:.4g} cm", "no disparity was seen"))
            return None
        spread = float(seen.std(ddof=1)) if len(seen) > 1 else math.nan
        return self.take(DepthRow(distance_m, float(seen.mean()), spread, len(seen)))

    def take(self, row: DepthRow) -> DepthRow | None:
        """Take a finished row in; returns it, or None when it was rejected."""
        if not (math.isfinite(row.distance_m) and math.isfinite(row.disparity_px)):
            reason = "not a number"
        elif row.distance_m <= 0.0:
            reason = f"the distance {100 * row.distance_m:g} cm is not positive"
        elif row.disparity_px == 0.0:
            reason = "the disparity is zero, which only something infinitely far away has"
        else:
            self.rows.append(row)
            return row
        self.rejected.append(RejectedRow(row.where, reason))
        return None


def read_depth_table(path: Path) -> DepthTable:
    """Read a CSV with a column of distances (``real_cm``; also ``distance_mm``, ``real_m``) and ``disparity_px``.

    Lines that begin with # are comments; commas, semicolons or tabs separate; a decimal comma is understood where
    commas do not separate. Lines that hold no measurement are rejected one by one. Raises CalibrationError when the
    file is not such a table.
    """
    lines = [(number, line) for number, line in enumerate(_text(path).splitlines(), start=1)
             if line.strip(" ,;\t") and not line.lstrip().startswith("#")]
    if not lines:
        raise CalibrationError(f"{path}: the table is empty. Give one line per distance under the header "
                               "real_cm,disparity_px.")
    separator = max(",;\t", key=lines[0][1].count)
    header = _cells(lines[0][1], separator)
    distance, unit = _column(path, header, "real_cm", _DISTANCE, "the distances")
    disparity, _ = _column(path, header, "disparity_px", _DISPARITY, "the disparities")
    table = DepthTable()
    table.unit_is_guessed = not unit
    for number, line in lines[1:]:
        cells = _cells(line, separator)
        try:
            values = [_number(cells[column], separator) for column in (distance, disparity)]
        except (ValueError, IndexError):
            table.rejected.append(RejectedRow(f"line {number}", f"{line.strip()[:60]!r} holds no two numbers"))
            continue
        table.take(DepthRow(values[0] * UNITS_M[unit or "cm"], values[1], line=number))
    return table


def _text(path: Path) -> str:
    try:
        data = read_table(path)
    except OSError as exc:
        raise CalibrationError(f"{path}: the table cannot be read ({exc.strerror}).") from exc
    try:
        text = data.decode("utf-16" if data[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    if "\0" in text or data[:4] == b"PK\3\4":
        raise CalibrationError(f"{path}: this is not a text file. Save the table as CSV.")
    return text


def _cells(line: str, separator: str) -> list[str]:
    try:
        return [cell.strip() for cell in next(csv.reader(io.StringIO(line), delimiter=separator))]
    except csv.Error:  # a cell of more than 131072 characters
        return []


def _column(path: Path, header: Sequence[str], name: str, pattern: re.Pattern[str], what: str) -> tuple[int, str]:
    """Index and unit of the column `name`, else of the one column whose name matches `pattern`."""
    names = [re.sub(r"[^a-z]+", "_", cell.lower()).strip("_") for cell in header]
    found = [(index, match) for index, one in enumerate(names) if (match := pattern.match(one))]
    if names.count(name) == 1:
        found = [(index, match) for index, match in found if names[index] == name]
    if len(found) != 1:
        listed = printable(", ".join(header)) or "nothing"
        problem = f"no column for {what}, {name}" if not found else f"{len(found)} columns that may be {what}"
        raise CalibrationError(f"{path}: {problem}. Its first line names {listed}; it must name real_cm and "
                               "disparity_px once each.")
    index, match = found[0]
    return index, (match.group(1) or "") if pattern.groups else ""


def _number(text: str, separator: str) -> float:
    return float(text if separator == "," else text.replace(",", "."))
