"""The shipped filter settings: less jitter at rest, no error worth the name in motion."""

import numpy as np
import pytest
from synthetic_rig import (
    FAST,
    WIDE,
    Viewing,
    compare,
    hand_trajectory,
    make_rig,
    observe,
    run,
    still_trajectory,
)

from rhot_app.filters.one_euro import OneEuroFilter
from rhot_app.project import FilterSettings
from rhot_app.tracking.scene import make_tracker

PRESETS = {"wide": (WIDE, 0.6), "fast": (FAST, 1.0)}


def with_and_without(preset, distance, motion, noise_px=0.03):
    figures = []
    for enabled in (True, False):
        rig = make_rig(preset, filters=FilterSettings(enabled=enabled))
        trajectory = hand_trajectory(rig, motion or "rest", 4.0, distance)
        if motion is None:
            trajectory = still_trajectory(trajectory(np.array([0.0]))[0])
        frames = observe(rig, preset, trajectory, 4.0, Viewing(noise_px=noise_px))
        figures.append(compare(rig, run(make_tracker(rig), frames), trajectory).marker_mm)
    return figures


@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.parametrize(("motion", "share"), [(None, 0.75), ("grasp", 1.1)])
def test_a_hand_at_rest_jitters_less_and_a_grasping_one_is_followed_as_exactly_as_without_filters(preset, motion,
                                                                                                  share):
    filtered, raw = with_and_without(*PRESETS[preset], motion)
    assert filtered < share * raw


@pytest.mark.parametrize("preset", PRESETS)
def test_filters_add_less_than_a_millimetre_at_two_metres_per_second(preset):
    filtered, raw = with_and_without(*PRESETS[preset], "fast")
    assert np.sqrt(filtered**2 - raw**2) < 1.0


@pytest.mark.parametrize(("kind", "unit_per_m"), [("pixel", 900.0), ("position", 1.0)])
@pytest.mark.parametrize("rate_hz", [40.0, 120.0])
@pytest.mark.parametrize("speed", [0.02, 0.2, 0.5, 2.0])
def test_a_steady_motion_lags_by_less_than_a_tenth_of_a_millimetre(kind, unit_per_m, rate_hz, speed):
    settings = getattr(FilterSettings(), kind)
    filtered = OneEuroFilter.from_settings([settings])
    times = np.arange(0.0, 1.0, 1.0 / rate_hz)
    for t in times:
        out = filtered(t, np.array([speed * unit_per_m * t]))
    lag_m = speed * times[-1] - out[0] / unit_per_m
    assert 0.0 <= lag_m < 1e-4
