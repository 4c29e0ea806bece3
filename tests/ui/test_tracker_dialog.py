"""The choice of the tracker: clicked, seen in the engine and in the file, taken back."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from pathlib import Path

import msgspec
import pytest
from fake_engine import FakeClient, FakeEngine, synthetic_rig
from patience import PATIENCE_MS, PATIENCE_S
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest

from rhot_app.calibration.proposal import rows_of
from rhot_app.calibration.rig_figures import tracker_text
from rhot_app.hand.anthropometry import hand_length
from rhot_app.project import DepthSettings, TrackerSettings, load_rig, save_rig
from rhot_app.rig_history import versions
from rhot_app.ui.dialogs.tracker_dialog import TrackerDialog
from rhot_app.ui.models import proposal
from rhot_app.ui.models.words import scale_text, size_text
from rhot_node.files import resource_path
from rhot_node.markers import load_markers

MODEL = TrackerSettings(kind="estimator")
FLOATING = TrackerSettings(kind="estimator", float_scale=True)


def with_tracker(tracker):
    return msgspec.structs.replace(synthetic_rig(), tracker=tracker)


@dataclass
class Desk:
    """The dialog on a rig file and a fake engine, without the window around it."""

    dialog: TrackerDialog
    engine: FakeEngine
    path: Path
    qtbot: object

    def until(self, condition):
        """Let time pass until it holds."""
        self.qtbot.waitUntil(condition, timeout=PATIENCE_MS)

    def settled(self, words):
        """Wait until a change is through, and see what is said of it."""
        self.until(lambda: words in self.dialog.sentence.text())


@pytest.fixture
def opened(qtbot, themed, tmp_path):
    """A function that opens the dialog on a rig."""
    def open_on(rig, wait=lambda: None):
        engine, path = FakeEngine(rig), tmp_path / "desk.json"
        save_rig(path, rig)
        dialog = TrackerDialog(rig, path, lambda: wait() or FakeClient(engine),
                               lambda: engine.state(1.0) if engine.running else None)
        qtbot.addWidget(dialog)
        dialog.show()
        dialog.activateWindow()
        assert QTest.qWaitForWindowActive(dialog, PATIENCE_MS)
        return Desk(dialog, engine, path, qtbot)
    return open_on


def click_on_word(button):
    """Of a radio button or a box to tick, whose middle may lie beyond its word."""
    QTest.mouseClick(button, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier,
                     QPoint(12, button.height() // 2))


def test_the_estimator_is_one_click_away_and_taken_back_with_one_key(opened):
    desk = opened(synthetic_rig())
    dialog, path = desk.dialog, desk.path
    assert dialog.kinds["classic"].isChecked() and not dialog.details.isVisible()
    assert not dialog.undo_button.isEnabled()
    click_on_word(dialog.kinds["estimator"])
    desk.settled("In force")
    assert desk.engine.rig.tracker == MODEL and load_rig(path).tracker == MODEL
    (version,) = versions(path)
    assert "estimator" in version.replaced_by and "full" in version.replaced_by
    assert dialog.details.isVisible()
    QTest.keyClick(dialog, Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    desk.settled("Taken back")
    assert load_rig(path).tracker.kind == "classic" and desk.engine.rig.tracker.kind == "classic"
    assert dialog.kinds["classic"].isChecked() and not dialog.undo_button.isEnabled()


def test_it_stays_open_until_the_engine_has_changed_over(opened, qtbot, monkeypatch):
    monkeypatch.setattr(proposal, "is_missing", lambda part: part == "estimator")
    go_on = threading.Event()
    desk = opened(synthetic_rig(), wait=lambda: None if go_on.wait(PATIENCE_S) else pytest.fail("never went on"))
    click_on_word(desk.dialog.kinds["estimator"])
    assert not desk.dialog.close_button.isEnabled()
    assert "Compiling" in desk.dialog.sentence.text(), "whoever waits a minute learns why"
    desk.dialog.close()
    QTest.keyClick(desk.dialog, Qt.Key.Key_Escape)
    assert desk.dialog.isVisible()
    go_on.set()
    desk.settled("In force")
    assert load_rig(desk.path).tracker == MODEL
    qtbot.mouseClick(desk.dialog.close_button, Qt.MouseButton.LeftButton)
    assert not desk.dialog.isVisible()


def test_it_stays_on_the_screen_when_it_grows(opened):
    desk = opened(synthetic_rig())
    dialog, screen = desk.dialog, desk.dialog.screen().availableGeometry()
    dialog.move(0, screen.bottom() - dialog.height())
    click_on_word(dialog.kinds["estimator"])
    desk.settled("In force")
    assert dialog.frameGeometry().bottom() <= screen.bottom()


def test_fingers_and_limits_are_chosen_from_lists(opened):
    desk = opened(with_tracker(MODEL))
    dialog = desk.dialog
    for box in (dialog.variant_box, dialog.limits_box):
        before = load_rig(desk.path)
        QTest.keyClick(box, Qt.Key.Key_Down)
        desk.until(lambda before=before: load_rig(desk.path) != before and dialog.close_button.isEnabled()
              and dialog.details.isEnabled())
    assert load_rig(desk.path).tracker == TrackerSettings(kind="estimator", variant="coupled", limits="thesis")
    assert "DIP = 2/3 PIP" in dialog.variant_words.text()
    QTest.mouseClick(dialog.undo_button, Qt.MouseButton.LeftButton)
    desk.settled("Taken back")
    assert load_rig(desk.path).tracker == TrackerSettings(kind="estimator", variant="coupled")
    assert dialog.limits_box.currentData() == "anatomical"


def test_a_hand_that_lies_flat_is_ticked_and_kept_by_other_choices(opened):
    desk = opened(msgspec.structs.replace(with_tracker(MODEL), up="z"))
    dialog = desk.dialog

    def changes(act):
        before = load_rig(desk.path)
        act()
        desk.until(lambda: load_rig(desk.path) != before and dialog.close_button.isEnabled())
        return load_rig(desk.path).tracker

    flat = changes(lambda: click_on_word(dialog.flat_check))
    assert flat.palm_plane.normal == (0.0, 0.0, 1.0) and 0.0 < flat.palm_plane.distance_m < 0.04
    assert "middle_pip_flexion" in flat.locked_deg and "thumb_cmc_flexion" not in flat.locked_deg
    coupled = changes(lambda: QTest.keyClick(dialog.variant_box, Qt.Key.Key_Down))
    assert coupled == msgspec.structs.replace(flat, variant="coupled")
    assert changes(lambda: click_on_word(dialog.flat_check)) == TrackerSettings(kind="estimator", variant="coupled")


def test_the_classic_trackers_solver_is_chosen_from_a_list(opened):
    desk = opened(with_tracker(TrackerSettings()))
    dialog = desk.dialog
    assert dialog.solver.isVisible() and not dialog.details.isVisible()
    QTest.keyClick(dialog.ik_box, Qt.Key.Key_Down)
    desk.until(lambda: load_rig(desk.path).tracker.ik == "transpose" and dialog.solver.isEnabled())
    assert "2.13" in dialog.ik_words.text()
    QTest.mouseClick(dialog.undo_button, Qt.MouseButton.LeftButton)
    desk.settled("Taken back")
    assert load_rig(desk.path).tracker == TrackerSettings()


def test_a_size_that_takes_two_lines_is_not_cut_off(opened):
    desk = opened(with_tracker(FLOATING))
    label, desk.engine.running = desk.dialog.size_label, False
    desk.until(lambda: label.text().startswith("No size yet"))
    desk.engine.running = True
    desk.until(lambda: label.text().startswith("1.03"))
    assert label.isVisible() and label.whole


def test_the_estimated_size_is_shown_and_put_into_the_hand(opened):
    desk = opened(with_tracker(MODEL))
    dialog, path, before = desk.dialog, desk.path, load_rig(desk.path)
    assert not dialog.size_button.isVisible()
    click_on_word(dialog.size_check)
    desk.until(lambda: dialog.size_label.text().startswith("1.03 ± 0.02"))
    assert load_rig(path).tracker.float_scale
    desk.until(dialog.size_button.isEnabled)
    QTest.mouseClick(dialog.size_button, Qt.MouseButton.LeftButton)
    desk.until(lambda: load_rig(path).hand != before.hand and dialog.undo_button.isEnabled())
    assert hand_length(load_rig(path).hand) == pytest.approx(1.03 * hand_length(before.hand), rel=1e-6)
    assert "1 030" in versions(path)[0].replaced_by
    QTest.mouseClick(dialog.undo_button, Qt.MouseButton.LeftButton)
    desk.settled("Taken back")
    assert load_rig(path).hand == before.hand and load_rig(path).tracker.float_scale


def test_a_size_that_is_not_certain_cannot_be_used(opened):
    desk = opened(with_tracker(FLOATING))
    desk.until(desk.dialog.size_button.isEnabled)
    desk.engine.scale = (1.08, 0.05)
    desk.until(lambda: not desk.dialog.size_button.isEnabled())
    assert "not certain yet" in desk.dialog.size_label.text()
    desk.engine.running = False
    desk.until(lambda: "No size yet" in desk.dialog.size_label.text())


def test_what_stands_in_the_way_is_said(opened):
    dialog = opened(msgspec.structs.replace(synthetic_rig(), depth=DepthSettings(mode="disparity"))).dialog
    assert not dialog.kinds["estimator"].isEnabled() and dialog.obstacle_label.isVisible()
    assert "distance from disparity" in dialog.obstacle_label.text()


def test_a_refusal_changes_nothing(opened):
    desk = opened(synthetic_rig())
    desk.engine.refuse_rig = "marker 'nose' sits nowhere on the hand."
    click_on_word(desk.dialog.kinds["estimator"])
    desk.settled("marker 'nose' sits nowhere on the hand.")
    assert desk.dialog.kinds["classic"].isChecked() and load_rig(desk.path).tracker.kind == "classic"
    assert not desk.dialog.undo_button.isEnabled() and versions(desk.path) == []


def test_the_window_follows_and_somebody_elses_change_is_not_taken_back(bench, tmp_path):
    path = tmp_path / "desk.json"
    save_rig(path, synthetic_rig())
    bench.window.open_rig(path)
    bench.until(lambda: bench.controller.rig is not None)
    bench.window.actions_.tracker.trigger()
    dialog = bench.window.dialogs.tracker
    click_on_word(dialog.kinds["estimator"])
    bench.until(lambda: bench.controller.rig.tracker == MODEL and dialog.undo_button.isEnabled())
    bench.backend.engine.rig = with_tracker(TrackerSettings(kind="estimator", variant="coupled"))
    bench.window.rig_watch.look_soon()
    bench.until(lambda: dialog.variant_box.currentData() == "coupled")
    assert not dialog.undo_button.isEnabled()
    bench.window.actions_.close_rig.trigger()
    bench.until(lambda: bench.window.dialogs.tracker is None)


def test_a_size_is_written_with_the_digits_that_mean_something():
    engine = FakeEngine(with_tracker(FLOATING))
    engine.scale = (1.0304, 0.0021)
    assert scale_text(engine.state(1.0)) == "1.030 ± 0.002"
    engine.scale = (1.004, 0.01)
    assert "it fits" in size_text(engine.state(1.0), engine.rig)
    assert size_text(engine.state(1.0), synthetic_rig()) == "", "nobody estimates it"


def test_earlier_versions_tell_of_the_tracker():
    rows = rows_of(synthetic_rig(), with_tracker(FLOATING))
    assert [(row.what, row.before, row.after) for row in rows] == [
        ("tracker", "classic", "estimator, full, anatomical limits, size estimated")]


def test_the_bare_hand_is_chosen_in_plain_words(opened):
    desk = opened(with_tracker(MODEL))
    dialog = desk.dialog
    assert dialog.observe_box.currentText() == "Paint"
    dialog.observe_box.setFocus()
    QTest.keyClicks(dialog.observe_box, "Con")
    desk.until(lambda: load_rig(desk.path).tracker.observe == "contours" and dialog.close_button.isEnabled())
    assert "Background and skin" in dialog.observe_words.text() and dialog.observe_box.currentText() == "Contours"
    click_on_word(dialog.kinds["classic"])
    desk.until(lambda: load_rig(desk.path).tracker == TrackerSettings() and dialog.close_button.isEnabled())
    QTest.mouseClick(dialog.undo_button, Qt.MouseButton.LeftButton)
    desk.until(lambda: load_rig(desk.path).tracker.observe == "contours")


def test_landmarks_are_a_choice_of_their_own_that_needs_a_set_with_landmarks(opened):
    desk = opened(with_tracker(MODEL))
    dialog = desk.dialog
    dialog.observe_box.setFocus()
    QTest.keyClicks(dialog.observe_box, "Landm")
    desk.until(lambda: "a set with landmarks" in dialog.sentence.text())
    assert dialog.observe_box.currentText() == "Paint" and load_rig(desk.path).tracker.observe == "markers"


def test_an_old_rig_with_landmarks_says_what_it_tracks(opened):
    landmarks = load_markers(resource_path("markers", "landmarks21.json"))
    desk = opened(msgspec.structs.replace(with_tracker(MODEL), markers=landmarks))
    dialog = desk.dialog
    assert "has landmarks, no paint" in dialog.observe_words.text()
    dialog.observe_box.setFocus()
    QTest.keyClicks(dialog.observe_box, "Landm")
    desk.until(lambda: load_rig(desk.path).tracker.observe == "landmarks" and dialog.close_button.isEnabled())
    assert "detector" in dialog.observe_words.text()
    assert tracker_text(desk.dialog.chosen).split(", ")[:3] == ["estimator", "landmarks", "full"]


def test_two_bare_hands_come_back_from_the_classic_tracker(opened):
    """It tracks markers, of which they have none; the form does not show then what the estimator observes."""
    rig = synthetic_rig()
    hand = msgspec.structs.replace(rig.hand, side="left" if rig.hand.side == "right" else "right")
    desk = opened(msgspec.structs.replace(rig, other_hand=hand, tracker=TrackerSettings(kind="classic")))
    click_on_word(desk.dialog.kinds["estimator"])
    desk.until(lambda: load_rig(desk.path).tracker == TrackerSettings(kind="estimator", observe="contours"))
