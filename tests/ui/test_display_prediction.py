"""The scene draws the hand as of now where the rig's tracker estimates velocities, and the newest state where not."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import msgspec
import numpy as np
import pytest
from fake_backend import FakeBackend
from fake_engine import FakeEngine, synthetic_rig
from PySide6.QtCore import Qt

from rhot_app.project import TrackerSettings
from rhot_app.state import Condition
from rhot_app.ui.appearance import DisplayPrediction

AHEAD_S = 0.02


@pytest.fixture(scope="module")
def predicting(make_shared_bench):
    """The window on a rig with the estimator, tracking."""
    rig = msgspec.structs.replace(synthetic_rig(), tracker=TrackerSettings(kind="estimator"))
    bench = make_shared_bench(FakeBackend(FakeEngine(rig, running=False)))
    bench.track()
    return bench


def ahead_of_newest(bench):
    """s: how far after the newest state the drawn one is."""
    newest = bench.controller.live.state
    return 1e-9 * (bench.window.screen_parts.shown(newest, AHEAD_S).t_master_ns - newest.t_master_ns)


def test_the_scene_shows_the_hand_as_of_now_until_it_is_switched_off(predicting, make_bench):
    predicting.until(lambda: ahead_of_newest(predicting) > 0.5 * AHEAD_S)
    predicting.press(Qt.Key.Key_N)
    predicting.until(lambda: ahead_of_newest(predicting) == 0.0)
    predicting.press(Qt.Key.Key_N)
    predicting.until(lambda: ahead_of_newest(predicting) > 0.5 * AHEAD_S)
    predicting.press(Qt.Key.Key_N)
    assert not make_bench(settings=predicting.window.settings).window.actions_.now.isChecked(), "remembered"
    predicting.press(Qt.Key.Key_N)


def test_what_is_predicted_is_drawn_and_what_is_of_a_recording_is_not(predicting):
    prediction, engine = DisplayPrediction(predicting.controller), predicting.backend.engine
    fresh = engine.state(predicting.clock())
    shown = prediction.shown(fresh, AHEAD_S)
    passed_s = 1e-9 * (shown.t_master_ns - fresh.t_master_ns)
    assert 0.75 * AHEAD_S < passed_s <= 0.1 + 1e-6
    np.testing.assert_allclose(shown.world_from_palm[0, 3] - fresh.world_from_palm[0, 3], 0.1 * passed_s, rtol=0.3)
    assert shown.condition is fresh.condition and (shown.marker_knowledge == fresh.marker_knowledge).all()
    old = engine.state(predicting.clock() - 100.0)
    assert prediction.shown(old, AHEAD_S) is old and prediction.shown(None, AHEAD_S) is None
    gone = replace(fresh, condition=Condition.LOST)
    assert prediction.shown(gone, AHEAD_S) is gone


def test_a_hand_without_a_velocity_is_drawn_as_it_is():
    classic = FakeEngine()
    fresh = classic.state(1.0)
    controller = SimpleNamespace(rig=classic.rig, clock=lambda: 1.0)
    assert DisplayPrediction(controller).shown(fresh, AHEAD_S) is fresh
