"""The window as a person uses it: buttons are clicked, keys are pressed, sentences are read."""

from __future__ import annotations

import time

from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtTest import QTest

from rhot_app.engine.status import Advice
from rhot_app.ui.common.controller import RESTART_FORGET_S


def test_the_simulated_rig_tracks_at_one_click(bench):
    window = bench.window
    bench.click(window.welcome.twin_button)
    bench.until(lambda: window.toolbar.badge.word == "TRACKING")
    assert bench.backend.calls == ["twin grasp"]
    assert ("start", {}) in bench.backend.engine.commands
    bench.until(lambda: window.toolbar.badge.rate == "40 Hz")
    bench.until(lambda: window.screen_parts.markers.words == ["ok"] * 6)
    assert [card.row.name for card in window.screen_parts.nodes.cards] == ["left", "right"]
    bench.until(lambda: set(window.screen_parts.cameras.views["left"].marked) ==
                   {"thumb", "index", "middle", "ring", "little", "wrist"})
    bench.until(lambda: window.screen_parts.hand.cells[0].text().endswith("°"))
    bench.until(lambda: bench.calm)


def test_the_chosen_motion_is_used_and_remembered(bench):
    box = bench.window.welcome.motion_box
    box.setCurrentIndex(box.findData("pinch"))
    bench.click(bench.window.welcome.twin_button)
    bench.until(lambda: bench.backend.calls[:1] == ["twin pinch"])
    assert bench.window.settings.motion == "pinch"


def test_space_stops_and_starts(tracking):
    tracking.press(Qt.Key.Key_Space)
    tracking.until(lambda: tracking.window.toolbar.badge.word == "IDLE")
    tracking.until(lambda: "Start" in tracking.window.actions_.start.text())
    tracking.let_pass(1.0)
    tracking.until(lambda: tracking.window.screen_parts.markers.words == ["not tracking"] * 6)
    tracking.until(tracking.window.screen_parts.scene.start_button.isVisible)
    tracking.until(lambda: tracking.said("space bar"))
    tracking.click(tracking.window.screen_parts.scene.start_button)
    tracking.until(lambda: tracking.window.toolbar.badge.word == "TRACKING")
    tracking.until(lambda: "Stop" in tracking.window.actions_.start.text())
    assert tracking.backend.engine.running


def test_a_focused_button_keeps_its_space_bar(tracking):
    pause = tracking.window.screen_parts.jitter.pause_button
    pause.setFocus(Qt.FocusReason.TabFocusReason)
    tracking.press(Qt.Key.Key_Space, pause)
    assert pause.isChecked() and tracking.backend.engine.running


def test_numbers_show_and_hide_panels(tracking):
    docks = tracking.window.docks.docks
    for number, dock in enumerate(docks, start=1):
        assert dock.isVisible()
        tracking.press(getattr(Qt.Key, f"Key_{number}"))
        assert not dock.isVisible()
        tracking.press(getattr(Qt.Key, f"Key_{number}"))
        assert dock.isVisible()


def test_six_leaves_the_scene_alone(tracking):
    docks = tracking.window.docks.docks
    tracking.press(Qt.Key.Key_4)
    tracking.press(Qt.Key.Key_6)
    assert not any(dock.isVisible() for dock in docks)
    tracking.press(Qt.Key.Key_6)
    assert [dock.isVisible() for dock in docks] == [True, True, True, False, True]


def test_a_hidden_camera_panel_asks_for_no_pictures(tracking):
    tracking.press(Qt.Key.Key_3)
    tracking.until(lambda: ("preview", {"on": False}) in tracking.backend.engine.commands)
    tracking.press(Qt.Key.Key_3)
    tracking.until(lambda: tracking.backend.engine.commands[-1] == ("preview", {"on": True}))
    assert tracking.backend.engine.commands.count(("preview", {"on": False})) == 1


def test_f_frames_the_hand_and_home_resets(tracking):
    scene = tracking.window.screen_parts.scene
    tracking.press(Qt.Key.Key_Home)
    far = scene.cameraParams()["distance"]
    tracking.press(Qt.Key.Key_F)
    assert scene.cameraParams()["distance"] < far
    tracking.press(Qt.Key.Key_Home)
    assert scene.cameraParams()["distance"] == far


def test_the_hand_is_framed_when_tracking_begins_unless_the_view_was_moved(tracking):
    scene, engine = tracking.window.screen_parts.scene, tracking.backend.engine
    tracking.press(Qt.Key.Key_Home)
    far = scene.cameraParams()["distance"]
    tracking.see_newer_states()
    assert scene.cameraParams()["distance"] == far, "the view stays where the person put it"
    engine.session += 1
    tracking.until(lambda: scene.cameraParams()["distance"] < 0.7 * far)
    framed = scene.cameraParams()
    QTest.wheelEvent(scene.windowHandle() or tracking.window.windowHandle(),
                     QPointF(scene.mapTo(tracking.window, scene.rect().center())), QPoint(0, -360))
    moved = scene.cameraParams()
    assert moved["distance"] > framed["distance"]
    engine.session += 1
    tracking.see_newer_states()
    assert scene.cameraParams() == moved
    tracking.press(Qt.Key.Key_Home)


def test_advice_comes_and_goes(tracking):
    sentence = "Right camera saw no wrist marker for 12 s."
    tracking.backend.engine.hidden = {"wrist": "right"}
    tracking.backend.engine.advice = (Advice("warning", sentence),)
    tracking.until(lambda: tracking.said(sentence) and not tracking.calm)
    tracking.until(lambda: tracking.window.screen_parts.markers.words[-1] == "left only")
    tracking.until(lambda: tracking.window.toolbar.badge.word == "PARTIAL")
    tracking.backend.engine.hidden = {}
    tracking.backend.engine.advice = ()
    tracking.until(lambda: tracking.calm and not tracking.said(sentence))


def test_a_vanished_engine_is_said_and_started_again(tracking):
    backend = tracking.backend
    backend.gate.clear()
    backend.engine.dead = True
    tracking.let_pass(2.0)
    tracking.until(lambda: tracking.window.toolbar.badge.word == "NO ENGINE")
    tracking.until(lambda: tracking.said("engine stopped", "again"))
    tracking.until(lambda: tracking.window.screen_parts.markers.words == ["not tracking"] * 6)
    tracking.until(lambda: not tracking.window.actions_.start.isEnabled())
    backend.gate.set()
    tracking.until(lambda: tracking.window.toolbar.badge.word == "TRACKING")
    assert "restart start=True" in backend.calls
    tracking.until(lambda: tracking.calm)


def test_an_engine_that_cannot_be_started_again_waits_for_a_click(tracking):
    backend = tracking.backend
    tracking.let_pass(RESTART_FORGET_S)
    backend.refuse = "The rig file is gone."
    backend.engine.dead = True
    tracking.let_pass(2.0)
    tracking.until(lambda: backend.calls.count("restart start=True") == 3)
    tracking.until(lambda: tracking.said("could not be started", backend.refuse))
    backend.refuse = ""
    tracking.until(lambda: "Try again" in tracking.window.advice.buttons)
    tracking.click(tracking.window.advice.buttons["Try again"])
    tracking.until(lambda: tracking.window.toolbar.badge.word == "TRACKING")
    assert backend.calls.count("restart start=True") == 4


def test_simulated_cameras_that_stopped_can_be_started_again(tracking):
    tracking.backend.alive = False
    tracking.until(lambda: tracking.let_pass(0.5) or tracking.said("simulated cameras", "stopped"))
    tracking.backend.alive = True
    tracking.controller.press("twin")
    tracking.until(lambda: tracking.backend.calls.count("twin grasp") == 1)
    tracking.until(lambda: tracking.window.toolbar.badge.word == "TRACKING")
    tracking.until(lambda: not tracking.said("simulated cameras", "stopped"))
    assert tracking.backend.calls.count("twin grasp") == 1


def test_the_rig_menu_shows_what_the_rig_says(tracking):
    window = tracking.window
    a = window.actions_
    assert [entry.text() for entry in a.properties.actions()] == ["Cameras …", "Markers …", "Hand …"]
    assert a.properties.menuAction() in window.menus.rig.actions()
    assert not {a.cameras, a.markers, a.hand} & set(window.menus.calibrate.actions())
    for action, tab in ((window.actions_.cameras, 0), (window.actions_.markers, 1), (window.actions_.hand, 2)):
        action.trigger()
        dialog = next(w for w in tracking.window.children() if type(w).__name__ == "RigDialog" and w.isVisible())
        assert dialog.tabs.currentIndex() == tab
        dialog.close()
        tracking.run(0.0)


def test_a_hand_that_stands_still_for_a_second_is_taken_away(tracking):
    scene = tracking.window.screen_parts.scene
    tracking.until(lambda: scene.actors.visible)
    tracking.backend.engine.hidden = dict.fromkeys(tracking.backend.engine.rig.markers.ids, "both")
    tracking.until(lambda: tracking.window.toolbar.badge.word == "LOST")
    tracking.let_pass(1.0)
    tracking.until(lambda: not scene.actors.visible)
    tracking.until(lambda: tracking.window.screen_parts.markers.words == ["not seen"] * 6)
    assert not scene.actors.visible


def test_the_window_stays_quick(tracking):
    """No tick of the timer may hold the window for long, software OpenGL included; other programs may hold it."""
    costs = []
    for _ in range(30):
        tracking.let_pass(0.1)  # states, words about the engine, and a picture now and then
        begin = time.thread_time()
        tracking.window.tick()
        costs.append(time.thread_time() - begin)
    assert sorted(costs)[len(costs) // 2] < 0.05


def test_the_state_is_visible_while_recording(tracking):
    toolbar, engine = tracking.window.toolbar, tracking.backend.engine
    tracking.window.resize(1280, 800)
    engine.log_path = "/recordings/a.rhotlog"
    tracking.until(lambda: toolbar.source_label.isVisible()
                   and tracking.window.actions_.record.text() == "Stop recording")
    tracking.until(lambda: toolbar.badge.isVisible() and toolbar.rig_label.isVisible())
    assert toolbar.badge.geometry().right() <= toolbar.width()
