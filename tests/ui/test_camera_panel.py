"""A picture is drawn with what was found in it, and with nothing else."""

from __future__ import annotations

from dataclasses import replace

import cv2
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


def painted(preview, colour):
    """Where the paint of an RGB colour is in a preview, px of the full frame."""
    bgr = cv2.imdecode(np.frombuffer(preview.jpeg, np.uint8), cv2.IMREAD_COLOR).astype(int)
    rows, columns = np.nonzero((np.abs(bgr - np.array(colour[::-1])) < 40).all(axis=2))
    return 2.0 * columns.mean(), 2.0 * rows.mean()


def test_rings_sit_on_the_markers_of_the_very_picture(panel, engine):
    """The hand moves; states and other pictures come before and after this one."""
    live, view = Live(), panel.views["left"]
    places = []
    for t_s in (1.0, 3.0, 5.0, 4.0):  # the last one was overtaken
        live.take(engine.state(t_s + 0.1))
        live.take(engine.preview(0, t_s))
        live.take(engine.preview(1, t_s - 0.4))
        live.take(engine.state(t_s + 0.2))
        panel.refresh(live)
        assert view.marked == ["thumb", "index", "middle", "ring", "little", "wrist"]
        for view_, camera in ((view, "left"), (panel.views["right"], "right")):
            for mark, marker in zip(view_.marks, engine.rig.markers.markers, strict=True):
                at = painted(live.previews[camera], marker.display_rgb)
                assert (mark.place.x(), mark.place.y()) == pytest.approx(at, abs=5.0), marker.id
        places.append((view.marks[1].place.x(), view.marks[1].place.y()))
    assert np.linalg.norm(np.diff(places, axis=0), axis=1).min() > 15.0, "rings of another picture would be seen"


def test_a_picture_of_which_nothing_is_known_has_no_rings(panel, engine):
    live = Live()
    live.take(engine.preview(0, 1.0))
    panel.refresh(live)
    assert len(panel.views["left"].marked) == 6
    live.take(engine.state(1.01))
    live.take(replace(engine.preview(0, 1.01), pixels=np.empty((0, 2)), flags=np.empty(0, np.uint16)))
    panel.refresh(live)
    assert panel.views["left"].marked == [], "neither those of the state nor those of the picture before"


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
