"""Spread, lag and time to a start of tracks that are late and noisy by construction."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from synthetic_track import LATE_S, WORN, make_track, make_truth

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "benchmarks"))

from scenarios import found_after, lag, rising, settled_after, spread

TIMES = np.arange(0.5, 3.5, 0.025)


def swing(times_s: np.ndarray) -> np.ndarray:
    return 0.1 * np.sin(2.0 * np.pi * times_s)


@pytest.mark.parametrize("late_s", [0.0, 0.004, 0.03, -0.01])
def test_a_lag_is_found_whatever_the_constant_error(late_s: float) -> None:
    truth = make_truth(swing)
    track = make_track(truth, TIMES, late_s=late_s, off=5e-3)
    tips = track.fingertip_positions[:, WORN.tip_fingers]
    assert lag(TIMES, tips, truth, WORN) == pytest.approx(late_s, abs=1e-4)


def test_unknown_states_do_not_hide_a_lag() -> None:
    truth = make_truth(swing)
    tips = make_track(truth, TIMES, late_s=0.01).fingertip_positions[:, WORN.tip_fingers]
    tips[::7] = np.nan
    assert lag(TIMES, tips, truth, WORN) == pytest.approx(0.01, abs=1e-4)


def test_spread_is_that_of_the_noise_after_two_seconds() -> None:
    times = np.arange(0.0, 60.0, 0.025)
    noise = np.random.default_rng(2).normal(0.0, [1e-4, 2e-4, 5e-4], (len(times), 3))
    noise[times < 2.0] = 1.0
    axes, whole = spread(make_track(make_truth(seconds=61.0), times, off=noise[:, None]), WORN)
    assert axes == pytest.approx([1e-4, 2e-4, 5e-4], rel=0.05)
    assert whole == pytest.approx(np.sqrt(30.0) * 1e-4, rel=0.05)


def test_a_palm_that_speeds_up_is_told_from_one_that_brakes() -> None:
    truth = make_truth(swing)
    speed_rises = (np.cos(2.0 * np.pi * TIMES) * -np.sin(2.0 * np.pi * TIMES)) > 0.05
    speed_falls = (np.cos(2.0 * np.pi * TIMES) * -np.sin(2.0 * np.pi * TIMES)) < -0.05
    found = rising(TIMES, truth)
    assert found[speed_rises & (np.abs(np.cos(2.0 * np.pi * TIMES)) > 0.3)].all()
    assert not found[speed_falls].any()


def test_a_hand_is_found_once_every_tip_in_sight_is_near() -> None:
    truth = make_truth()
    off = np.zeros((len(TIMES), 1, 3))
    off[:4, :, 1] = 6e-3
    after = found_after(make_track(truth, TIMES, off=off), truth, WORN, first_s=TIMES[0])
    assert after == pytest.approx(4 * 0.025 + LATE_S)
    assert found_after(make_track(truth, TIMES, off=6e-3), truth, WORN, first_s=0.0) is None


def test_a_ratio_has_settled_when_it_stays() -> None:
    times = np.arange(5.0)
    assert settled_after(times, np.array([1.1, 1.0, 1.1, 1.01, 0.99]), 0.02) == 3.0
    assert settled_after(times, np.array([1.0, 1.0, 1.0, 1.0, 1.1]), 0.02) is None
    assert settled_after(times, np.full(5, np.nan), 0.02) is None
    assert settled_after(times, np.ones(5), 0.02) == 0.0
