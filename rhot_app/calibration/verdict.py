"""What a calibration thinks of itself: findings with figure, likely cause and remedy, and one verdict made of them."""

from __future__ import annotations

import enum
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rhot_app.errors import EngineError


class Grade(enum.Enum):
    """How far a calibration may be trusted."""

    GOOD = "good"
    FAIR = "fair"  # usable; better is possible
    POOR = "poor"  # not to be used: commands refuse to write it, wizards refuse to accept it

    @property
    def rank(self) -> int:
        """0 for good, 1 for fair, 2 for poor."""
        return list(Grade).index(self)


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that was checked and is worth a sentence.

    `code` is stable, for programs and tests ("mirrored", "swapped"); `figure` what was measured with its unit and what
    it should be; `cause` the likely reason; `remedy` what to do next.
    """

    code: str
    grade: Grade
    figure: str
    cause: str = ""
    remedy: str = ""

    @property
    def sentence(self) -> str:
        """Figure, cause and remedy as running text."""
        return " ".join(part for part in (self.figure, self.cause, self.remedy) if part)


@dataclass(frozen=True, slots=True)
class Verdict:
    """The whole judgement: `sentence` sums up in plain words, `findings` are sorted worst first."""

    sentence: str
    findings: tuple[Finding, ...] = ()

    @property
    def grade(self) -> Grade:
        """The worst finding's grade; good without any."""
        return max((finding.grade for finding in self.findings), key=lambda grade: grade.rank, default=Grade.GOOD)

    @property
    def acceptable(self) -> bool:
        """Whether the calibration may be used at all."""
        return self.grade is not Grade.POOR

    @property
    def codes(self) -> frozenset[str]:
        """The codes of all findings."""
        return frozenset(finding.code for finding in self.findings)

    def to_json(self) -> dict[str, Any]:
        """The fields `verdict` (sentence), `grade`, `warnings` (sentences) and `findings` (whole) of a report."""
        return {
            "verdict": self.sentence, "grade": self.grade.value,
            "warnings": [finding.sentence for finding in self.findings if finding.grade is not Grade.GOOD],
            "findings": [{"code": f.code, "grade": f.grade.value, "figure": f.figure, "cause": f.cause,
                          "remedy": f.remedy} for f in self.findings],
        }


def verdict_from(answer: Mapping[str, Any]) -> Verdict:
    """The verdict in an engine's answer. Raises EngineError when it is of another version."""
    try:
        findings = tuple(Finding(one["code"], Grade(one["grade"]), one["figure"], one["cause"], one["remedy"])
                         for one in answer["findings"])
        return Verdict(answer["verdict"], findings)
    except (KeyError, TypeError, ValueError) as exc:
        raise EngineError(f"the engine's answer cannot be read ({exc}); is it of another version? Restart "
                          "engine and app.") from exc


def judge(summary: str, findings: list[Finding]) -> Verdict:
    """The verdict on `findings`; `summary` is the sentence with the main figure ("rms 0.31 px over 13 views").

    The verdict's sentence begins with the grade: what people read first is whether they may go on.
    """
    ordered = tuple(sorted(findings, key=lambda finding: -finding.grade.rank))
    grade = Verdict("", ordered).grade
    opening = {Grade.GOOD: "Good", Grade.FAIR: "Usable, not good", Grade.POOR: "Not usable"}[grade]
    return Verdict(f"{opening}: {summary}", ordered)


def with_findings(verdict: Verdict, findings: Sequence[Finding]) -> Verdict:
    """The verdict with more findings: what was seen after it was reached."""
    return judge(verdict.sentence.partition(": ")[2], [*verdict.findings, *findings]) if findings else verdict


def told_apart(value: float, limit: float, decimals: int = 0) -> str:
    """`value` with so many decimals, and with more where those do not tell it from `limit`, which stands beside it."""
    while decimals < 6 and value != limit and round(value, decimals) == round(limit, decimals):
        decimals += 1
    return f"{value:.{decimals}f}"
