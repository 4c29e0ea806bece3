"""One chart as paper and SVG show it."""

from __future__ import annotations

import re

import numpy as np
import pytest
from pdf_pages import pages_of

from rhot_app.charts import Chart, Curve, ticks

X = np.arange(5.0)


def boxes(chart: Chart, colour: str) -> np.ndarray:
    """(N, 4) mm: those of one colour, without the legend's."""
    found = re.findall(rf'<rect x="([\d.]+)" y="([\d.]+)" width="([\d.]+)" height="([\d.]+)" fill="{colour}"/>',
                       chart.draw().to_svg().decode())
    return np.array(found, dtype=np.float64)[:-1]


def lines(chart: Chart, colour: str) -> list[np.ndarray]:
    """(N, 2) mm each."""
    found = re.findall(rf'<polyline fill="none" stroke="{colour}" stroke-width="[\d.]+" points="([^"]+)"',
                       chart.draw().to_svg().decode())
    return [np.array([pair.split(",") for pair in one.split()], dtype=np.float64) for one in found]


def test_bars_are_as_high_as_their_values() -> None:
    values = np.array([1.0, 2.0, np.nan, 4.0, 8.0])
    bars = (Curve("a", X, values, "bars", colour="#112233"),)
    plain = boxes(Chart("t", "", "mm", bars, y_span=(0.0, 10.0)), "#112233")
    assert len(plain) == 4, "what is not known has no bar"
    np.testing.assert_allclose(plain[:, 3] / plain[0, 3], [1.0, 2.0, 4.0, 8.0], rtol=1e-3)
    log = boxes(Chart("t", "", "mm", bars, log_y=True, y_span=(0.5, 16.0)), "#112233")
    np.testing.assert_allclose(log[:, 3] / log[0, 3], [1.0, 2.0, 3.0, 4.0], rtol=1e-3)


def test_a_line_is_interrupted_where_nothing_is_known_and_stays_on_the_paper() -> None:
    values = np.array([0.0, 5.0, np.nan, 5.0, 1e6])
    drawn = lines(Chart("t", "", "mm", (Curve("a", X, values, colour="#112233"),), y_span=(0.0, 10.0)), "#112233")
    assert [len(one) for one in drawn] == [2, 2]
    assert drawn[0][1, 1] == pytest.approx(drawn[1][0, 1]) and (np.concatenate(drawn) > 0.0).all()


@pytest.mark.parametrize("style", ["line", "dashes", "dots", "band", "bars", "whiskers"])
def test_what_is_not_known_is_not_drawn(style: str) -> None:
    for x in (X, X[:0]):
        for y, high in ((x, np.full(len(x), np.nan)), (np.full(len(x), np.nan), x)):
            svg = Chart("t", "", "mm", (Curve("a", x, y, style, high),)).draw().to_svg()  # type: ignore[arg-type]
            assert b"nan" not in svg


@pytest.mark.parametrize(("span", "log", "expected"), [
    ((0.0, 10.0), False, [0.0, 2.0, 4.0, 6.0, 8.0, 10.0]), ((-6.6, 6.6), False, [-5.0, 0.0, 5.0]),
    ((0.01, 10.0), True, [0.01, 0.1, 1.0, 10.0]), ((1.0, 10.0), True, [1.0, 2.0, 5.0, 10.0])])
def test_ticks_are_round(span: tuple[float, float], log: bool, expected: list[float]) -> None:
    assert ticks(span, log=log) == pytest.approx(expected)


def test_paper_shows_title_names_and_units() -> None:
    chart = Chart("Rest (a)", "cm – far", "µm", (Curve("left", X, X, "bars"), Curve("5 %", X, X, "whiskers", X + 1.0)),
                  names=tuple("ABCDE"))
    (text, picture), = pages_of(chart.draw().to_pdf())
    assert all(word in text for word in ("Rest (a)", "cm – far", "µm", "left", "5 %", "A", "E"))
    assert (picture.min(axis=-1) < 128).mean() > 0.01
