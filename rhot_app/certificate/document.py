"""What a certificate says: lines with figures, their 95 % intervals, the thesis's numbers and verdicts. The JSON file.

``certificate.json``, format ``rhot-certificate``; docs/certificate.md describes it.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Final, Literal

import msgspec

from rhot_app.certificate.intervals import Interval
from rhot_app.errors import CertificateError
from rhot_node.files import read_document

FORMAT: Final = "rhot-certificate"
VERSION: Final = 1

Word = Literal["agrees", "differs", "not measured"]


class Figure(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One number: `value` with the ends `low` and `high` of its 95 % interval; null where it is not known or bounded.
    `expected`: what it should be, null where nothing is; `thesis`: what the thesis says of it, in words."""

    name: str
    unit: str
    value: float | None
    low: float | None = None
    high: float | None = None
    expected: float | None = None
    thesis: str = ""

    @property
    def interval(self) -> Interval:
        """As numbers; what is not known is NaN, an end without a bound infinite."""
        if self.value is None:
            return Interval(math.nan, math.nan, math.nan)
        return Interval(self.value, -math.inf if self.low is None else self.low,
                        math.inf if self.high is None else self.high)


def figure(name: str, unit: str, interval: Interval, *, expected: float | None = None, thesis: str = "") -> Figure:
    """A figure of an interval that is in `unit` already."""
    value, low, high = (float(x) if math.isfinite(x) else None
                        for x in (interval.value, interval.low, interval.high))
    return Figure(name, unit, value, low, high, expected, thesis)


class Line(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One line of a certificate. `code` is stable; `sentence` is the verdict in words; `cause` the likely reason of a
    difference, `remedy` what to do. `curves`: raw numbers by name, for charts and for those who compute anew."""

    code: str
    title: str
    verdict: Word
    sentence: str
    cause: str = ""
    remedy: str = ""
    figures: tuple[Figure, ...] = ()
    curves: dict[str, list[float | None]] = {}

    def figure(self, name: str) -> Figure | None:
        """The figure of that name."""
        return next((one for one in self.figures if one.name == name), None)


def not_measured(code: str, title: str, why: str, remedy: str, figures: tuple[Figure, ...] = (),
                 curves: dict[str, list[float | None]] | None = None) -> Line:
    """A line whose step is missing, showed nothing, or too little to agree with anything: then with what it showed."""
    return Line(code, title, "not measured", f"{why[0].upper()}{why[1:]}", remedy=remedy, figures=figures,
                curves=curves or {})


class Certificate(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """All lines of one rig. `created`: UTC, ISO 8601; `rig_sha256`: of the rig file's content, as JSON; `simulated`:
    the rig is the digital twin, which proves nothing of a real one."""

    created: str
    rig: str
    rig_sha256: str
    simulated: bool
    program: str
    lines: tuple[Line, ...]
    format: Literal["rhot-certificate"] = FORMAT
    version: Literal[1] = VERSION

    def line(self, code: str) -> Line:
        """The line of that code. Raises KeyError."""
        return {line.code: line for line in self.lines}[code]

    def count(self, word: Word) -> int:
        """Lines with that verdict."""
        return sum(line.verdict == word for line in self.lines)

    @property
    def summary(self) -> str:
        """One sentence about all lines; what was not measured is never passed over."""
        words: dict[Word, str] = {"agrees": "agree", "differs": "differ", "not measured": "not measured"}
        parts = [f"{self.count(one)} {one if self.count(one) == 1 else plural}" for one, plural in words.items()
                 if self.count(one)]
        return f"{self.rig}: of {len(self.lines)} lines {', '.join(parts)}."


def read_certificate(path: Path) -> Certificate:
    """Read a certificate's JSON file, or that of a folder. Raises CertificateError."""
    path = path / "certificate.json" if path.is_dir() else path
    return read_document(path, Certificate, format_name=FORMAT, version=VERSION, error=CertificateError)


class Difference(msgspec.Struct, frozen=True):
    """A figure of both certificates. `changed`: the 95 % interval of the difference leaves out 0."""

    line: str
    name: str
    unit: str
    before: Interval
    after: Interval

    @property
    def changed(self) -> bool:
        """Beyond both intervals taken together."""
        step = self.after.value - self.before.value
        down, up = self.before.value - self.before.low, self.before.high - self.before.value
        low, high = self.after.value - self.after.low, self.after.high - self.after.value
        return bool(step > math.hypot(up, low) or -step > math.hypot(down, high))

    @property
    def sentence(self) -> str:
        """Before, after, and whether that is a change."""
        word = "changed" if self.changed else "no change beyond the intervals"
        return (f"{self.line}, {self.name}: {number(self.before.value)} -> {number(self.after.value)} {self.unit}, "
                f"{word}")


def compare(before: Certificate, after: Certificate) -> tuple[list[Difference], list[str]]:
    """Figures that both have, and a sentence for each line whose verdict is another one or that only one has."""
    found: list[Difference] = []
    notes: list[str] = []
    later = {line.code: line for line in after.lines}
    for line in before.lines:
        other = later.pop(line.code, None)
        if other is None:
            notes.append(f"{line.title} is not in the new certificate.")
            continue
        if other.verdict != line.verdict:
            notes.append(f"{line.title}: the verdict was \"{line.verdict}\" and is \"{other.verdict}\".")
        for one in line.figures:
            match = other.figure(one.name)
            if match is not None and match.unit == one.unit and one.value is not None and match.value is not None:
                found.append(Difference(line.title, one.name, one.unit, one.interval, match.interval))
    return found, [*notes, *(f"{line.title} is new." for line in later.values())]


def number(value: float | None, spread: float = 0.0) -> str:
    """Three significant digits, or as many as show two of `spread`, half an interval's length; no exponent; a dash for
    what is not known."""
    if value is None or math.isnan(value):
        return "–"
    if math.isinf(value):
        return "unbounded"
    if value == 0.0:
        return "0"
    decimals = 2 - math.floor(math.log10(abs(value)))
    if 0.0 < spread < math.inf:
        decimals = 1 - math.floor(math.log10(spread))
    text = f"{value:.{min(max(decimals, 0), 4)}f}"
    return text.lstrip("-") if float(text) == 0.0 else text


def in_words(interval: Interval, unit: str) -> str:
    """E.g. ``0.31 mm (0.28 to 0.35)``."""
    value, low, high = (number(x, interval.half_width) for x in (interval.value, interval.low, interval.high))
    return f"{value} {unit} ({low} to {high})"
