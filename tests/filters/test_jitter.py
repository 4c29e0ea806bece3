"""The definitions of jitter: what each takes out, and what it leaves."""

from __future__ import annotations

import numpy as np
import pytest

from rhot_app.filters import jitter
from rhot_app.filters.one_euro import OneEuroFilter

NOISE_M = 3e-4
TRUE_M = NOISE_M * np.sqrt(3.0)


def wave(times_s: np.ndarray, hz: float) -> np.ndarray:
    """Ten centimetres to either side."""
    return 0.1 * np.sin(2.0 * np.pi * hz * times_s)[:, None] * np.array([1.0, 0.3, 0.1])


def noisy(hz: float, rate_hz: float = 100.0) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(4)
    times = np.cumsum(rng.uniform(0.8, 1.2, 1000)) / rate_hz
    return times, wave(times, hz) + rng.normal(0.0, NOISE_M, (1000, 3))


@pytest.mark.parametrize("hz", [0.0, 0.5, 1.5])
def test_of_a_moving_hand_the_differences_are_noise_alone(hz: float) -> None:
    assert jitter.moving(*noisy(hz)) == pytest.approx(TRUE_M, rel=0.1)


def test_parabolas_take_a_wave_for_noise_and_a_drift_for_none() -> None:
    assert jitter.resting(*noisy(0.0)) == pytest.approx(TRUE_M, rel=0.05)
    times, drifting = noisy(0.0)
    assert jitter.resting(times, drifting + 0.02 * times[:, None]) == pytest.approx(TRUE_M, rel=0.05)
    assert jitter.resting(*noisy(1.5)) > 3.0 * TRUE_M


def test_of_filtered_positions_at_rest_parabolas_miss_least() -> None:
    times, values = noisy(0.0)
    one = OneEuroFilter(3, 5.0, 0.0)
    smooth = np.array([one(float(t), row) for t, row in zip(times, values, strict=True)])
    left = np.sqrt(np.square(smooth[50:]).sum(axis=1).mean())
    assert jitter.resting(times, smooth) == pytest.approx(left, rel=0.25)
    assert jitter.moving(times, smooth) < 0.6 * left


def test_gaps_and_missing_samples_are_passed_over() -> None:
    times, values = noisy(0.0)
    values[10:20] = np.nan
    times[500:] += 3.0
    values[500:] += 1.0
    assert jitter.moving(times, values) == pytest.approx(TRUE_M, rel=0.1)
    assert np.isnan(jitter.moving(times[:3], values[:3])) and np.isnan(jitter.moving(times[:0], values[:0]))
    assert np.isnan(jitter.moving(np.arange(20.0), values[:20])), "a second apart"
    assert np.isnan(jitter.resting(times[:4], values[:4]))


def test_scatter_is_about_the_mean() -> None:
    assert jitter.scatter(noisy(0.0)[1] + 5.0) == pytest.approx(TRUE_M, rel=0.05)
    assert jitter.scatter(np.full((3, 3), np.nan)) is None
