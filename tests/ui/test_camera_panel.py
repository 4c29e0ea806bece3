"""Marks belong to the instant of the picture under them."""

from __future__ import annotations

import numpy as np
import pytest
from fake_engine import FakeClient, FakeEngine
from person import pause
from PySide6.QtTest import QTest

from rhot_app.ui.backend.live import Live
from rhot_app.ui.models.palette import DARK
from rhot_app.ui.panels.camera_panel import CameraPanel


@pytest.fixture
def engine():
    return FakeEngine(clock=lambda: 0.0)


@pytest.fixture
def panel(qtbot, themed, engine):
    panel = CameraPanel(DARK)
    qtbot.addWidget(panel)
    panel.show_rig(engine.rig)
    panel.resize(600, 900)
    panel.show()
    return panel


def test_marks_are_those_of_the_pictures_time(panel, engine):
    live = Live()
    states = [engine.state(1.0 + 0.1 * k) for k in range(5)]
    for state in states:
        live.take(state)
    live.previews["left"] = engine.preview(0, 1.21)
    panel.refresh(live)
    view = panel.views["left"]
    assert view.marked == ["thumb", "index", "middle", "ring", "little", "wrist"]
    drawn = np.array([(mark.place.x(), mark.place.y()) for mark in view.marks])
    assert drawn == pytest.approx(states[2].camera_pixels[0])


def test_a_picture_that_is_ahead_of_the_states_waits_for_its_marks(panel, engine):
    live = Live()
    live.previews["left"] = engine.preview(0, 3.0)
    live.take(engine.state(2.0))
    panel.refresh(live)
    assert panel.views["left"].marked == []
    live.take(engine.state(2.98))
    panel.refresh(live)
    assert len(panel.views["left"].marked) == 6
    live.take(engine.state(3.01))
    panel.refresh(live)
    assert panel.unmarked == set()


def test_what_a_camera_does_not_see_is_not_marked(panel, engine):
    engine.hidden = {"ring": "right"}
    live = Live()
    live.take(engine.state(1.0))
    live.previews = {name: engine.preview(k, 1.0) for k, name in enumerate(("left", "right"))}
    panel.refresh(live)
    assert "ring" in panel.views["left"].marked and "ring" not in panel.views["right"].marked


def test_a_small_picture_names_its_markers_while_the_mouse_is_over_it(panel, engine, qtbot):
    live = Live()
    live.take(engine.state(1.0))
    live.previews["left"] = engine.preview(0, 1.0)
    view = panel.views["left"]
    panel.refresh(live)
    pause(0.02)
    assert view.width() > 400 and view.named
    panel.resize(420, 220)
    pause(0.02)
    QTest.mouseMove(panel.views["right"], panel.views["right"].rect().center())
    qtbot.waitUntil(lambda: not view.named)
    bare = view.grab().toImage()
    QTest.mouseMove(view, view.rect().center())
    qtbot.waitUntil(lambda: view.named)
    assert view.grab().toImage() != bare and view.marked[0] == "thumb"


def test_pictures_stand_beside_each_other_where_that_is_larger(panel):
    panel.resize(600, 240)
    pause(0.02)
    left, right = (panel.views[name].geometry() for name in ("left", "right"))
    assert left.top() == right.top() and left.right() < right.left()
    panel.resize(300, 700)
    pause(0.02)
    left, right = (panel.views[name].geometry() for name in ("left", "right"))
    assert left.left() == right.left() and left.bottom() < right.top()


def test_live_keeps_only_the_newest_for_drawing_and_all_for_the_windows():
    now = [0.0]
    engine = FakeEngine(clock=lambda: now[0])
    client, live = FakeClient(engine), Live(clock=lambda: now[0])
    now[0] = 1.0
    live.step(client)
    assert live.state_count in (40, 41) and live.state is not None
    assert live.state.t_master_ns == pytest.approx(1e9, abs=3e7)
    live.sample(1_000_000_000)
    assert np.isfinite(live.jitter.window(1_000_000_000, 1.0)[1]).all()
    live.sample(2_000_000_000)
    assert np.isnan(live.jitter.window(2_000_000_000, 0.1)[1]).all()
