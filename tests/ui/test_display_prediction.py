"""The scene draws the hand as of now where the rig's tracker predicts it, and the newest state where not."""

from __future__ import annotations

import time

import msgspec
import pytest
from fake_backend import FakeBackend
from fake_engine import FakeEngine, synthetic_rig
from PySide6.QtCore import Qt

from rhot_app.project import TrackerSettings
from rhot_app.ui.display_prediction import DisplayPrediction


@pytest.fixture
def engine():
    return FakeEngine(msgspec.structs.replace(synthetic_rig(), tracker=TrackerSettings(kind="model")), running=False)


@pytest.fixture
def predicting(make_bench, engine):
    """The window on a rig with the model tracker, tracking."""
    bench = make_bench(FakeBackend(engine))
    bench.track()
    return bench


def test_the_scene_shows_the_hand_as_of_now_until_it_is_switched_off(predicting, engine, make_bench):
    predicting.until(lambda: len(engine.predicted) > 1)
    asked, now = engine.predicted[-1], time.monotonic_ns()
    assert -0.5e9 < asked - now < 0.3e9
    predicting.press(Qt.Key.Key_N)
    count = len(engine.predicted)
    predicting.run(0.6)
    assert len(engine.predicted) == count
    predicting.press(Qt.Key.Key_N)
    predicting.until(lambda: len(engine.predicted) > count)
    predicting.press(Qt.Key.Key_N)
    assert not make_bench().window.actions_.now.isChecked(), "remembered"


def test_what_is_predicted_is_drawn_and_what_is_of_a_recording_is_not(predicting, engine):
    prediction = DisplayPrediction(predicting.controller)
    fresh = engine.state(time.monotonic())
    shown = prediction.shown(fresh, 0.02)
    assert 0.015e9 < shown.t_master_ns - fresh.t_master_ns < 0.4e9
    engine.hidden = {"thumb": "both"}
    worse = engine.state(time.monotonic())
    assert (shown.marker_knowledge == fresh.marker_knowledge).all()
    known = prediction.shown(fresh, 0.02)
    assert known.condition is fresh.condition and (known.marker_knowledge == fresh.marker_knowledge).all()
    assert (known.marker_knowledge != worse.marker_knowledge).any(), "how it is known is that of the pictures"
    old = engine.state(time.monotonic() - 100.0)
    assert prediction.shown(old, 0.02) is old and prediction.shown(None, 0.02) is None


def test_an_engine_that_does_not_answer_is_let_alone_for_a_while(predicting, engine):
    predicting.window._timer.stop()
    prediction = DisplayPrediction(predicting.controller)
    engine.dead = True
    fresh, count = engine.state(time.monotonic()), len(engine.predicted)
    assert prediction.shown(fresh, 0.02) is fresh and prediction.shown(fresh, 0.02) is fresh
    assert len(engine.predicted) == count + 1


def test_the_classic_tracker_is_never_asked(tracking):
    tracking.run(0.5)
    assert tracking.backend.engine.predicted == []
