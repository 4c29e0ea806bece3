"""The 1-euro filter against its authors' reference signal and against a plain scalar twin."""

import csv
import math
from pathlib import Path

import numpy as np
import pytest

from rhot_app.filters.one_euro import RESET_GAP_S, OneEuroFilter
from rhot_app.project import OneEuroSettings

REFERENCE = Path(__file__).parents[2] / "../shared/data/one_euro/groundTruth.csv"


class ScalarOneEuro:
    """The published algorithm, one channel, written from the paper."""

    def __init__(self, min_cutoff, beta, derivative_cutoff):
        self.min_cutoff, self.beta, self.derivative_cutoff = min_cutoff, beta, derivative_cutoff
        self.t = self.x = self.dx = None

    def __call__(self, t, value):
        if self.t is None:
            self.t, self.x, self.dx = t, value, 0.0
            return value
        period = t - self.t

        def alpha(cutoff):
            return 1.0 / (1.0 + 1.0 / (2.0 * math.pi * cutoff * period))

        a = alpha(self.derivative_cutoff)
        self.dx = a * (value - self.x) / period + (1.0 - a) * self.dx
        a = alpha(self.min_cutoff + self.beta * abs(self.dx))
        self.x = a * value + (1.0 - a) * self.x
        self.t = t
        return self.x


def test_agrees_with_the_authors_reference_signal():
    if not REFERENCE.exists():
        pytest.skip(f"{REFERENCE} is absent: the 1-euro reference signal is needed")
    rows = [tuple(map(float, row.values())) for row in csv.DictReader(REFERENCE.read_text().splitlines())]
    filtered = OneEuroFilter(1, 1.0, 0.1, 1.0)
    for k, (_, _, noisy, expected) in enumerate(rows):
        assert filtered(k / 120.0, np.array([noisy]))[0] == pytest.approx(expected, abs=1e-4)


def test_many_channels_at_irregular_times_agree_with_the_scalar_twin():
    rng = np.random.default_rng(5)
    parameters = rng.uniform([0.3, 0.0, 0.5], [8.0, 20.0, 12.0], (7, 3))
    filtered = OneEuroFilter(7, *parameters.T)
    twins = [ScalarOneEuro(*row) for row in parameters]
    t = 1e4
    signal = np.zeros(7)
    for _ in range(400):
        t += rng.uniform(0.004, 0.06)
        signal = signal + rng.normal(0.0, 0.1, 7)
        np.testing.assert_allclose(filtered(t, signal), [twin(t, v) for twin, v in zip(twins, signal, strict=True)],
                                   rtol=1e-12, atol=1e-12)


def test_a_missing_sample_holds_the_channel_and_gives_nan():
    filtered = OneEuroFilter(2, 1.0, 0.0)
    filtered(0.0, np.array([1.0, 1.0]))
    assert np.isnan(filtered(0.1, np.array([np.nan, 2.0]))).tolist() == [True, False]
    twin = ScalarOneEuro(1.0, 0.0, 1.0)
    twin(0.0, 1.0)
    assert filtered(0.2, np.array([2.0, 2.0]))[0] == pytest.approx(twin(0.2, 2.0))


def test_a_long_gap_starts_anew():
    filtered = OneEuroFilter(1, 0.1, 0.0)
    filtered(0.0, np.array([5.0]))
    filtered(0.02, np.array([6.0]))
    assert filtered(0.02 + RESET_GAP_S + 0.01, np.array([-3.0]))[0] == -3.0
    assert filtered.state[0, 2] == 0.0


def test_time_never_runs_backwards_and_infinity_never_enters():
    filtered = OneEuroFilter(1, 1.0, 0.0)
    filtered(1.0, np.array([2.0]))
    assert filtered(0.9, np.array([50.0]))[0] == 2.0
    assert filtered(1.0, np.array([50.0]))[0] == 2.0
    assert np.isnan(filtered(1.1, np.array([np.inf]))[0])
    assert np.isfinite(filtered(1.2, np.array([2.1]))[0])


def test_reset_forgets_only_the_masked_channels():
    filtered = OneEuroFilter.from_settings([OneEuroSettings(0.5, 0.0)] * 2)
    filtered(0.0, np.array([1.0, 1.0]))
    filtered.reset(np.array([True, False]))
    out = filtered(0.01, np.array([9.0, 9.0]))
    assert out[0] == 9.0 and out[1] < 2.0


@pytest.mark.parametrize("speed", [0.1, 1.0, 10.0, 100.0])
def test_the_lag_of_a_ramp_is_bounded_by_beta_at_any_speed(speed):
    beta, rate = 2.0, 120.0
    filtered = OneEuroFilter(1, 0.5, beta, 8.0)
    for k in range(3000):
        out = filtered(k / rate, np.array([speed * k / rate]))
    assert 0.0 < speed * 2999 / rate - out[0] < 1.0 / (2.0 * np.pi * beta)
