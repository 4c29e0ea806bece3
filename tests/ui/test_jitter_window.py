"""The jitter figure: motion removed, noise kept, gaps respected."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fake_engine import FakeEngine

from rhot_app.filters.jitter import difference_weights, moving
from rhot_app.ui.models.meters import JitterWindow

RATE_HZ = 40.0


@pytest.fixture(scope="module")
def template():
    return FakeEngine(clock=lambda: 0.0).state(1.0)


def feed(window, template, times_s, positions):
    for t, place in zip(times_s, positions, strict=True):
        raw = np.tile(place, (len(template.marker_ids), 1))
        window.add(replace(template, t_master_ns=round(t * 1e9), marker_raw_positions=raw))


def test_weights_annul_parabolas_and_keep_noise():
    times = np.array([0.0, 0.02, 0.055, 0.08])
    weights = difference_weights(times)
    for power in range(3):
        assert abs(weights @ times**power) < 1e-12
    assert np.linalg.norm(weights) == pytest.approx(1.0)


def test_noise_is_told_as_its_own_rms(template):
    random = np.random.default_rng(3)
    times = np.arange(400) / RATE_HZ
    window = JitterWindow(span_s=5.0)
    feed(window, template, times, 0.0005 * random.standard_normal((400, 3)))
    assert window.rms(round(times[-1] * 1e9)) == pytest.approx(0.0005 * np.sqrt(3), rel=0.12)


def test_it_is_what_the_definition_says(template):
    random = np.random.default_rng(4)
    times = np.cumsum(random.choice([0.02, 0.025, 0.03, 0.3], 30, p=[0.3, 0.4, 0.25, 0.05]))
    places = 0.001 * random.standard_normal((30, 3))
    window = JitterWindow(span_s=60.0)
    feed(window, template, times, places)
    assert window.rms(round(times[-1] * 1e9)) == pytest.approx(moving(times, places), rel=1e-6)


def test_smooth_motion_is_not_jitter(template):
    times = np.arange(120) / RATE_HZ
    path = 0.1 * np.stack([np.sin(2 * np.pi * 0.5 * times), times, np.cos(2 * np.pi * 0.5 * times)], axis=1)
    window = JitterWindow()
    feed(window, template, times, path)
    assert (window.rms(round(times[-1] * 1e9)) < 0.00005).all()


def test_a_pause_is_not_bridged(template):
    times = np.array([0.0, 0.025, 0.05, 1.0, 1.025, 1.05])
    window = JitterWindow()
    feed(window, template, times, np.zeros((6, 3)))
    assert np.isnan(window.rms(round(1.05 * 1e9))).all()


def test_old_values_leave_the_window(template):
    times = np.arange(40) / RATE_HZ
    window = JitterWindow(span_s=1.0)
    feed(window, template, times, np.zeros((40, 3)))
    assert np.isfinite(window.rms(round(times[-1] * 1e9))).all()
    assert np.isnan(window.rms(round(times[-1] * 1e9) + 2_000_000_000)).all()


def test_a_marker_that_is_lost_has_no_figure(template):
    window = JitterWindow()
    for k in range(40):
        raw = np.zeros((len(template.marker_ids), 3))
        raw[2] = np.nan
        window.add(replace(template, t_master_ns=round(k / RATE_HZ * 1e9), marker_raw_positions=raw))
    figures = window.rms(round(39 / RATE_HZ * 1e9))
    assert np.isnan(figures[2]) and np.isfinite(np.delete(figures, 2)).all()
