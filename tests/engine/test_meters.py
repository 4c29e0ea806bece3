"""Rates and latencies of the last seconds."""

from __future__ import annotations

import pytest

from rhot_app.engine.pipeline import RateMeter

MS = 1_000_000


def test_a_steady_stream_has_its_rate_wherever_the_window_is_cut() -> None:
    meter = RateMeter()
    for k in range(300):
        meter.tick(k * 8 * MS)
    last = 299 * 8 * MS
    assert [meter.rate_hz(last + late * MS) for late in (0, 3, 7)] == pytest.approx([125.0] * 3, rel=0.01)


def test_a_burst_after_a_start_is_no_rate() -> None:
    meter = RateMeter()
    meter.tick(0)
    assert meter.rate_hz(0) == 0.0
    meter.tick(1 * MS)
    assert meter.rate_hz(1 * MS) == pytest.approx(4.0)


def test_a_stream_that_stops_fades() -> None:
    meter = RateMeter()
    for k in range(100):
        meter.tick(k * 10 * MS)
    assert meter.rate_hz(1490 * MS) == pytest.approx(50.0, rel=0.03)
    assert meter.rate_hz(3000 * MS) == 0.0
