"""Normalised errors of states whose covariances are true, too small, or absent."""

from __future__ import annotations

import numpy as np
import pytest
from synthetic_track import WORN, make_track, make_truth

from rhot_app.evaluation.accuracy import (
    INSTANT_S,
    Squares,
    at_instants,
    axes_within,
    band,
    consistency,
    deviations,
    normalised,
    squares,
)

COVARIANCE = 1e-6 * np.array([[1.0, 0.3, 0.0], [0.3, 2.0, -0.5], [0.0, -0.5, 9.0]])
TIMES = np.arange(0.0, 3.9, INSTANT_S) + 0.5 * INSTANT_S


def runs(count: int, claimed: float = 1.0, seed: int = 3) -> list[Squares]:
    """Errors drawn from COVARIANCE, alike for all of a state's points, of trackers that claim `claimed` times it."""
    truth, out = make_truth(), []
    for k in range(count):
        rng = np.random.default_rng([seed, k])
        off = rng.multivariate_normal(np.zeros(3), COVARIANCE, len(TIMES))[:, None]
        track = make_track(truth, TIMES, off=off, covariance=claimed * COVARIANCE)
        out.append(squares(track, deviations(track, truth, WORN), WORN))
    return out


def test_true_covariances_are_inside_the_band_at_95_percent_of_the_instants() -> None:
    for quantity in ("tips", "joints", "markers"):
        found = consistency(runs(5), quantity)
        assert found.average == pytest.approx(1.0, abs=0.1)
        assert found.inside == pytest.approx(0.95, abs=0.05)
        assert found.within == pytest.approx(0.9973, abs=0.004)


def test_covariances_too_small_are_found_out() -> None:
    found = consistency(runs(5, claimed=0.25), "tips")
    assert found.average == pytest.approx(4.0, rel=0.1)
    assert found.inside is not None and found.inside < 0.1
    assert found.within is not None and found.within < 0.9


def test_covariances_too_large_are_outside_the_band_as_well() -> None:
    found = consistency(runs(5, claimed=10.0), "tips")
    assert found.average == pytest.approx(0.1, rel=0.1)
    assert found.inside is not None and found.inside < 0.1
    assert found.within == 1.0


def test_a_tracker_without_covariances_is_not_judged() -> None:
    found = consistency(runs(2), "palm")
    assert (found.average, found.inside, found.within) == (None, None, None)


def test_the_band_is_that_of_the_mean_over_seeds() -> None:
    draws = np.random.default_rng(1).chisquare(3, (200_000, 5)).mean(axis=1) / 3.0
    low, high = band(5, 3)
    assert np.quantile(draws, [0.025, 0.975]) == pytest.approx([low, high], rel=0.02)


def test_instants_take_the_newest_state_and_stay_empty_without_one() -> None:
    values = at_instants(np.array([0.001, 0.020, 0.060]), np.array([[1.0], [2.0], [3.0]]))
    assert values[0, 0] == 2.0 and np.isnan(values[1, 0]) and values[2, 0] == 3.0


def test_singular_and_unknown_covariances_give_no_figure() -> None:
    covariances = np.stack([np.eye(3), np.diag([1.0, 1.0, 0.0]), np.full((3, 3), np.nan)])
    found = normalised(np.ones((3, 3)), covariances)
    assert found[0] == pytest.approx(3.0) and np.isnan(found[1:]).all()


def test_only_what_is_chosen_is_within() -> None:
    errors = np.array([[0.0, 0.0, 4.0], [9.0, 9.0, 9.0]])
    assert axes_within(errors, np.tile(np.eye(3), (2, 1, 1)), np.array([True, False])) == (2, 3)
