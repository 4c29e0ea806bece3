"""What all verdicts have in common, and single checks of which no other test gives a bad input."""

from __future__ import annotations

import pytest

from rhot_app.calibration.stereo.ruler import RulerResult, ruler_finding
from rhot_app.calibration.verdict import Grade, told_apart


@pytest.mark.parametrize(("value", "limit", "decimals", "text"), [
    (0.34, 0.3, 1, "0.34"), (0.3000001, 0.3, 1, "0.300000"), (0.4, 0.3, 1, "0.4"), (54.96, 55.0, 0, "54.96"),
    (3.2, 3.2, 1, "3.2"), (float("inf"), 1.0, 1, "inf")])
def test_a_figure_is_never_printed_like_the_limit_that_it_exceeds(value: float, limit: float, decimals: int,
                                                                  text: str) -> None:
    assert told_apart(value, limit, decimals) == text


@pytest.mark.parametrize(("measured_m", "std_m", "code", "grade"), [
    (0.300, 0.001, "ruler", Grade.GOOD), (0.310, 0.001, "square_size", Grade.POOR),
    (0.304, 0.0005, "square_size", Grade.FAIR), (0.300, 0.02, "ruler_vague", Grade.FAIR),
    (0.330, 0.02, "ruler_vague", Grade.FAIR)])
def test_a_ruler_that_could_not_say_no_confirms_nothing(measured_m: float, std_m: float, code: str,
                                                        grade: Grade) -> None:
    result = RulerResult(0.3, measured_m, std_m)
    finding = ruler_finding(result, 0.03)
    assert (finding.code, finding.grade) == (code, grade) and result.tells == (code != "ruler_vague")
