"""One summary of latencies: in the engine, in the window and in an evaluation the same figures."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rhot_app.engine.pipeline import LatencyMeter
from rhot_app.latency import STACKED, p50_p99, whole_way
from rhot_app.state import LATENCY_STAGES


def test_percentiles_are_those_of_the_known_values_of_each_column() -> None:
    rng = np.random.default_rng(2)
    values = rng.exponential(1.0, (501, 3))
    values[rng.random((501, 3)) < 0.3] = np.nan
    values[:, 2] = np.nan
    p50, p99 = p50_p99(values)
    for column in range(2):
        known = values[np.isfinite(values[:, column]), column]
        assert (p50[column], p99[column]) == pytest.approx(tuple(np.percentile(known, [50.0, 99.0])))
    assert np.isnan(p50[2]) and np.isnan(p99[2])
    assert p50_p99(np.array([3.0]))[1] == 3.0 and np.isnan(p50_p99(np.zeros(0))[0])
    assert np.isnan(p50_p99(np.zeros((0, 2)))[1]).all()


def test_the_whole_way_is_the_sum_of_each_state() -> None:
    rows = np.full((3, len(LATENCY_STAGES)), 0.001)
    rows[0, -1] = 9.0  # overlaps the others
    rows[1, 0] = np.nan
    rows[2] = np.nan
    whole = whole_way(rows)
    assert whole[:2] == pytest.approx([0.001 * len(STACKED), 0.001 * (len(STACKED) - 1)]) and math.isnan(whole[2])


def test_the_engines_meter_says_the_same() -> None:
    meter, rng = LatencyMeter(window=50), np.random.default_rng(3)
    values = rng.exponential(0.01, 80)
    for value in values:
        meter.add({"solve": float(value)})
    assert list(meter.summary()) == ["solve"]
    found = meter.summary()["solve"]
    assert (found.p50_s, found.p99_s) == pytest.approx(tuple(np.percentile(values[-50:], [50.0, 99.0])))
