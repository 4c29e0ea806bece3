"""What a person aims at stays where it is, in large and in small windows."""

from __future__ import annotations

import pytest
from PySide6.QtWidgets import QToolButton, QWidget

from rhot_app.engine.status import Advice
from rhot_app.ui.models.notice import Notice

NO_ROOM = (1024, 700)


@pytest.fixture
def desk(tracking):
    """The shared window at the size of a small laptop."""
    tracking.window.resize(1280, 800)
    tracking.window.docks.arrange()
    tracking.until(lambda: steady(tracking))
    yield tracking
    tracking.backend.calm()
    tracking.window.passing.clear()
    tracking.window.resize(1280, 800)


def steady(bench):
    """Whether everything stands where it stood a tenth of a second before."""
    def places():
        return [place(bench, part) for part in bench.window.findChildren(QWidget) if part.isVisible()]

    before = places()
    bench.run(0.1)
    return places() == before


def place(bench, widget):
    """Where a widget stands in the window, and how large it is."""
    at = widget.mapTo(bench.window, widget.rect().topLeft())
    return at.x(), at.y(), widget.width(), widget.height()


def test_the_menus_stay_where_they_are_when_recording_begins(desk):
    toolbar, record = desk.window.toolbar, desk.window.actions_.record
    menus = (toolbar.rig_button, toolbar.calibrate_button, toolbar.view_button)
    before = [place(desk, menu) for menu in menus]
    desk.click(toolbar.controls.widgetForAction(record))
    desk.until(lambda: record.text() == "Stop recording" and toolbar.source_label.isVisible() and steady(desk))
    assert [place(desk, menu) for menu in menus] == before
    desk.click(toolbar.controls.widgetForAction(record))
    desk.until(lambda: record.text() == "Record")
    assert [place(desk, menu) for menu in menus] == before


def test_sentences_come_and_go_and_the_plots_stay_where_they_are(desk):
    plots, advice = desk.window.screen_parts.plots, desk.window.advice
    before = place(desk, plots)
    desk.backend.engine.advice = (Advice("error", "Node left does not answer."),
                                  Advice("warning", "Camera right has seen no marker for 5 s.", "colours"))
    desk.until(lambda: len(advice.texts) == 2)
    desk.window.tell(Notice("info", "Something was done."))
    desk.until(lambda: advice.texts[0] == "Something was done." and steady(desk))
    assert place(desk, plots) == before
    assert advice.more.isVisible() and advice.waiting == ["Camera right has seen no marker for 5 s."]
    desk.backend.engine.advice = (Advice("error", "The simulated cameras did not start. " * 8),)
    desk.until(lambda: desk.said("did not start") and steady(desk))
    assert place(desk, plots) == before


def test_the_panels_keep_their_width_whatever_the_angles_say(desk):
    scene, hand, engine = desk.window.screen_parts.scene, desk.window.screen_parts.hand, desk.backend.engine
    before = place(desk, scene), [place(desk, cell) for cell in hand.cells]
    cells = hand.cells
    engine.running = False
    desk.let_pass(1.0)
    desk.until(lambda: {cell.text() for cell in cells} == {"–"} and steady(desk))
    assert (place(desk, scene), [place(desk, cell) for cell in cells]) == before
    for cell in cells:
        cell.setText("-88 ±88°")
    hand.palm.setText("inferred, ± 12.40 mm, ± 11.2°; size 1.03 ± 0.02")
    desk.until(lambda: steady(desk))
    assert (place(desk, scene), [place(desk, cell) for cell in cells]) == before


def test_a_small_screen_has_room_for_the_window_and_shows_the_state(desk):
    window, toolbar = desk.window, desk.window.toolbar
    desk.backend.engine.log_path = "/recordings/a.rhotlog"
    desk.until(lambda: toolbar.source_label.isVisible())
    window.resize(*NO_ROOM)
    desk.until(lambda: steady(desk))
    assert (window.width(), window.height()) == NO_ROOM
    assert toolbar.badge.isVisible()
    at = place(desk, toolbar.badge)
    assert at[0] + at[2] <= window.width()
    for part in (window.screen_parts.hand, window.screen_parts.plots, window.screen_parts.scene):
        x, y, width, height = place(desk, part)
        assert x >= 0 and y >= 0 and x + width <= window.width() and y + height <= window.height()


def test_controls_that_do_not_fit_stand_behind_an_arrow(desk):
    window, controls = desk.window, desk.window.toolbar.controls
    arrow = controls.findChild(QToolButton, "qt_toolbar_ext_button")
    assert not arrow.isVisible()
    desk.backend.engine.log_path = "/recordings/a.rhotlog"
    window.resize(*NO_ROOM)
    desk.until(lambda: desk.window.toolbar.source_label.isVisible() and arrow.isVisible())
    hidden = [action.text() for action in controls.actions()
              if action.text() and not controls.widgetForAction(action).isVisible()]
    desk.until(lambda: [action.text() for action in arrow.menu().actions() if action.text()] == hidden)
    assert hidden[-1] == "Guide" and "Start" not in hidden
