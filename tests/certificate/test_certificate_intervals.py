"""95 % intervals hold the truth in about 95 of 100 cases, also of samples that are correlated as a detector's are."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from rhot_app.certificate.document import number
from rhot_app.certificate.intervals import Interval, effective_size, mean_of, percentile_of, sd_of

Array = NDArray[np.float64]

RUNS, SAMPLES = 300, 800


def noise(rng: np.random.Generator, correlation: float, count: int = SAMPLES) -> Array:
    """Unit variance; half of it white, the rest a Gauss-Markov process, as a slow bias beside white noise."""
    slow = rng.normal(0.0, 1.0, count)
    for k in range(1, count):
        slow[k] = correlation * slow[k - 1] + math.sqrt(1.0 - correlation**2) * slow[k]
    return np.sqrt(0.5) * (slow + rng.normal(0.0, 1.0, count))


@pytest.mark.parametrize("correlation", [0.0, 0.7, 0.95])
@pytest.mark.parametrize(("of", "truth"), [
    (mean_of, 3.0), (lambda samples: sd_of([samples]), 1.0), (lambda samples: percentile_of(samples, 0.5), 3.0),
    (lambda samples: percentile_of(samples, 0.9), 3.0 + float(stats.norm.ppf(0.9)))], ids=["mean", "sd", "p50", "p90"])
def test_intervals_hold_the_truth(of: Callable[[Array], Interval], truth: float, correlation: float) -> None:
    held = sum(of(3.0 + noise(np.random.default_rng([k, 7]), correlation)).holds(truth) for k in range(RUNS))
    assert 0.89 <= held / RUNS <= 0.995


def test_correlated_samples_count_for_fewer() -> None:
    rng = np.random.default_rng(3)
    assert effective_size(noise(rng, 0.0)) > 0.6 * SAMPLES
    assert effective_size(noise(rng, 0.98)) < 0.2 * SAMPLES
    assert effective_size(np.full(100, 0.1)) == 100


def test_too_few_samples_say_nothing() -> None:
    for interval in (mean_of(np.ones(3)), sd_of([np.ones(3)]), percentile_of(np.full(50, np.nan), 0.5)):
        assert math.isnan(interval.value) and not interval.holds(0.0)
    assert math.isinf(percentile_of(np.random.default_rng(1).normal(size=50), 0.99).high)  # 50 say no p99's end


@pytest.mark.parametrize(("value", "spread", "text"), [
    (0.12345, 0.0, "0.123"), (-1.0009, 0.0015, "-1.0009"), (123.456, 0.0, "123"), (None, 0.0, "–"),
    (math.inf, 0.0, "unbounded"), (0.0, 0.2, "0")])
def test_numbers_have_the_digits_that_they_deserve(value: float | None, spread: float, text: str) -> None:
    assert number(value, spread) == text
