"""The filter wizard: a hand held still, a hand that waves, charts, and a rig with other filters."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest
from fake_engine import FakeEngine
from log_writing import write_log
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from synthetic_rig import WIDE, Viewing, make_rig, observe, still_trajectory
from waving import waving
from wizard_hand import RecordingClient

from rhot_app.project import FilterSettings, OneEuroSettings, load_rig
from rhot_app.ui.wizards.filters import FastGuide, LiveMeters, StillGuide

SECONDS = 5.0
LAZY = FilterSettings(pixel=OneEuroSettings(0.3, 0.0001, 1.0), position=OneEuroSettings(0.3, 0.001, 1.0))


class MovingHand:
    """A listener that hears the fake engine's hand, at the rate of its states."""

    def __init__(self, engine):
        self.engine = engine
        self.shake_m = 0.0

    def connect(self):
        return self

    def close(self):
        """Nothing to close."""

    def poll(self):
        now = self.engine.clock()
        state = self.engine.state(now)
        return [replace(state, marker_raw_positions=state.marker_raw_positions + self.shake_m * np.sin(8.0 * now))]


def write_movement(rig, path):
    """What the engine would have recorded: a resting hand or a waving one, by the page's title."""
    moving = waving(rig, SECONDS)
    trajectory = moving if "fast" in Path(path).name else still_trajectory(moving(np.zeros(1))[0])
    write_log(Path(path), rig, observe(rig, WIDE, trajectory, SECONDS, Viewing(noise_px=0.05)))


@pytest.fixture
def hands(open_wizard):
    rig = msgspec.structs.replace(make_rig(), filters=LAZY)
    hand = MovingHand(FakeEngine())
    hands = open_wizard("filters", RecordingClient(rig, write=lambda log: write_movement(rig, log)),
                        listen=hand.connect)
    hands.hand = hand
    return hands


def test_from_two_movements_to_a_rig_with_other_filters(hands):
    hands.until(lambda: hands.window.page.table.records_model.rowCount() == 6)
    hands.record()
    hands.next()
    hands.record()
    hands.next()
    step, page, first = hands.window.step, hands.window.page, hands.solved()
    assert [plot.getAxis("left").labelText for plot in page.charts.plots] == ["jitter, mm", "lag, ms"]
    page.stage.setCurrentIndex(1)
    hands.until(lambda: "px/s" in page.charts.plots[1].getAxis("bottom").labelText)
    page.jitter.setFocus()
    page.jitter.selectAll()
    QTest.keyClicks(page.jitter, "2.00")
    QTest.keyClick(page.jitter, Qt.Key.Key_Tab)
    hands.until(lambda: step.result is not None and step.result is not first)
    assert step.result.pixel.chosen.min_cutoff_hz > first.pixel.chosen.min_cutoff_hz, "more jitter is allowed"
    page.own.setChecked(True)
    hands.next()
    table = hands.window.page.table
    words = [one.what for one in table.records]
    assert "filter of positions" in words and "index: jitter at rest" in words and "index: lag" in words
    hands.use()
    saved = load_rig(hands.path).filters
    assert saved.position == step.result.position.chosen and set(saved.position_markers) == set(make_rig().markers.ids)
    hands.restore()
    assert load_rig(hands.path).filters == LAZY


def test_a_hand_that_moved_is_no_hand_held_still(hands):
    """Sentence, bar and tick say the same."""
    hands.hand.shake_m = 0.1
    hands.until(lambda: hands.window.page.table.records_model.rowCount() == 6)
    hands.key(Qt.Key.Key_Space)
    hands.until(lambda: hands.window.step.phase == "recording" and "moves" in hands.sentence)
    hands.key(Qt.Key.Key_Space)
    hands.until(lambda: hands.window.step.phase == "recorded" and "moved" in hands.sentence)
    still = next(bar for bar in hands.frame.bars.bars if bar.name == "still")
    assert not still.full and not hands.window.step.view().done
    hands.next()
    assert hands.frame.steps.states[0] == "to come", "no tick"


def heard(speed_m_s, noise_m=2e-4, seconds=3.0):
    """States of a hand that moves to and fro at this speed."""
    engine = FakeEngine()
    random = np.random.default_rng(3)
    states = []
    for t_s in np.arange(0.0, seconds, 0.02):
        state = engine.state(float(t_s))
        at = np.tile((0.1 * np.sin(10.0 * speed_m_s * t_s), 0.0, 0.5), (len(state.marker_ids), 1))
        raw = at + noise_m * random.standard_normal(at.shape)
        late = np.tile((0.1 * np.sin(10.0 * speed_m_s * (t_s - 0.01)), 0.0, 0.5), (len(at), 1))
        states.append(replace(state, marker_raw_positions=raw, marker_positions=late))
    return states


def test_the_guides_tell_a_still_hand_from_a_fast_one():
    still, fast = LiveMeters(), LiveMeters()
    still.watch(heard(0.0))
    fast.watch(heard(0.8))
    assert "Good" in StillGuide(still).sentence() and "rest the hand" in StillGuide(fast).sentence()
    assert "Faster" in FastGuide(still).sentence() and "Good" in FastGuide(fast).sentence()
    guide = FastGuide(fast)
    guide.watch(())
    assert all(bar.full for bar in guide.bars()) and guide.shortfall() == ""
    assert [row[3] for row in still.rows()] == ["–"] * 6, "a hand at rest shows no lag"
    assert float(fast.rows()[0][3]) == pytest.approx(10.0, abs=1.0)
    assert float(still.rows()[0][1]) == pytest.approx(0.2 * 3**0.5, abs=0.05)
