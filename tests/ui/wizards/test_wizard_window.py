"""The wizards' window: steps, keys, live pictures, long work, use and restore - on a small wizard made for it."""

from __future__ import annotations

from pathlib import Path

import pytest
import sample_wizard
from fake_engine import synthetic_rig
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QMessageBox
from wizard_hands import Hands
from wizard_rig import FakeMemory, FakeRigAsker

from rhot_app import rig_history
from rhot_app.project import load_rig, save_rig
from rhot_app.ui.common.guide import page_path
from rhot_app.ui.models.palette import DARK
from rhot_app.ui.wizards.framework.plan import WIZARDS, Kit
from rhot_app.ui.wizards.framework.window import WizardWindow


@pytest.fixture
def asker():
    return FakeRigAsker(synthetic_rig())


@pytest.fixture
def open_wizard(themed, asker, tmp_path, monkeypatch):
    """Opens the sample wizard on a rig file; closes it in the end."""
    monkeypatch.setenv("PYTHONPATH", str(Path(sample_wizard.__file__).parent))
    opened = []

    def open_(steps=3):
        path = tmp_path / "desk.json"
        save_rig(path, asker.rig)
        kit = Kit(asker.rig, path, asker.connect, DARK, FakeMemory())
        hands = Hands(WizardWindow(sample_wizard.make_plan(kit, steps), kit))
        hands.path = path
        opened.append(hands.window)
        return hands

    yield open_
    for window in opened:
        window.end().wait(5.0)
        window.deleteLater()


def capture_three(hands):
    """From the first page to three captured pictures."""
    hands.window.page.box.setValue(9)
    hands.next()
    for count in range(1, 4):
        hands.until(lambda: hands.window.step.seen is not None)
        hands.key(Qt.Key.Key_Space)
        assert len(hands.window.step.captured) == count


def test_from_the_first_page_to_a_saved_rig_and_back(open_wizard, asker):
    hands = open_wizard()
    frame = hands.window.frame
    used = []
    hands.window.rig_used.connect(lambda rig: used.append(rig.name))
    assert not frame.next_button.isEnabled() and frame.hint.text() == "Enter the number of squares."
    capture_three(hands)
    assert frame.steps.states == ["done", "current", "to come", "to come"]
    hands.next()
    hands.until(lambda: frame.verdict.verdict is not None)
    hands.next()
    assert load_rig(hands.path).name == "test bench", "nothing is saved before it is used"
    assert frame.next_button.text() == "Use this calibration"
    assert hands.window.page.table.item(0, 2).text() == "535.9 ± 0.4 px"
    hands.next()
    hands.until(lambda: frame.next_button.text() == "Close")
    assert load_rig(hands.path).name == "calibrated" and asker.rig.name == "calibrated"
    assert [version.replaced_by for version in rig_history.versions(hands.path)] == ["lens calibration"]
    hands.click(hands.window.page.restore_button)
    hands.until(lambda: hands.sentence == "The old one is back.")
    assert load_rig(hands.path).name == "test bench" and asker.rig.name == "test bench"
    assert used == ["calibrated", "test bench"]


def test_the_pictures_are_live_and_marked(open_wizard):
    hands = open_wizard()
    hands.window.page.box.setValue(9)
    hands.next()
    view = hands.window.frame.wall.views["left"]
    hands.until(lambda: view.shown is not None and len(view.overlay) == 4)
    first = view.shown.number
    hands.until(lambda: view.shown.number > first + 4)
    assert hands.window.feed.rate_hz("left") > 3.0


def test_back_is_always_safe(open_wizard):
    hands = open_wizard()
    capture_three(hands)
    hands.key(Qt.Key.Key_Left, Qt.KeyboardModifier.AltModifier)
    assert hands.title == "The board" and hands.window.page.box.value() == 9
    hands.key(Qt.Key.Key_Return)
    assert hands.title == "Take pictures" and len(hands.window.step.captured) == 3


def test_undo_takes_the_last_picture_back(open_wizard):
    hands = open_wizard()
    capture_three(hands)
    hands.key(Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    assert len(hands.window.step.captured) == 2 and not hands.window.frame.next_button.isEnabled()


def test_long_work_shows_progress_stays_live_and_can_be_cancelled(open_wizard):
    hands = open_wizard(steps=200)
    capture_three(hands)
    hands.next()
    work_view, window = hands.window.frame.work_view, hands.window
    hands.until(lambda: work_view.remaining.text().startswith("1") and "left" in work_view.remaining.text())
    view = window.frame.wall.views["left"]
    first = view.shown.number
    hands.until(lambda: view.shown.number > first + 4)
    assert not window.frame.next_button.isEnabled()
    hands.click(work_view.cancel_button)
    assert not window.work.running and "go back" in work_view.label.text()
    window.step.steps = 2
    hands.click(work_view.again_button)
    hands.until(lambda: window.step.result == 2)


def test_going_back_ends_long_work(open_wizard):
    hands = open_wizard(steps=200)
    capture_three(hands)
    hands.next()
    hands.until(lambda: hands.window.work.fraction > 0)
    hands.click(hands.window.frame.back_button)
    assert not hands.window.work.running and hands.title == "Take pictures"


def test_escape_asks_only_when_something_would_be_lost(open_wizard, monkeypatch):
    asked = []

    def answer(*args):
        asked.append(args[2])
        return QMessageBox.StandardButton.Cancel if len(asked) == 1 else QMessageBox.StandardButton.Discard

    monkeypatch.setattr(QMessageBox, "question", answer)
    hands = open_wizard()
    hands.key(Qt.Key.Key_Escape)
    assert not hands.window.isVisible() and asked == []
    hands = open_wizard()
    capture_three(hands)
    hands.key(Qt.Key.Key_Escape)
    assert hands.window.isVisible() and "is lost" in asked[0]
    hands.key(Qt.Key.Key_Escape)
    assert not hands.window.isVisible() and len(asked) == 2


def test_a_failure_to_save_is_said_and_changes_nothing(open_wizard, asker):
    hands = open_wizard()
    capture_three(hands)
    hands.next()
    hands.next()
    hands.until(lambda: hands.window.frame.next_button.text() == "Use this calibration")
    asker.refuse = "The engine does not answer."
    hands.next()
    hands.until(lambda: hands.window.frame.hint.text() == "The engine does not answer.")
    assert load_rig(hands.path).name == "test bench" and hands.window.step.usable


def test_every_wizard_has_its_section_in_the_guide():
    headings = [line.removeprefix("## ") for line in page_path("calibration").read_text().splitlines()]
    assert [heading for heading in headings if heading in {wizard.title for wizard in WIZARDS}] == [
        wizard.title for wizard in WIZARDS], "in the order of the menu"


def test_f1_opens_the_guide_beside_the_wizard(open_wizard):
    hands = open_wizard()
    hands.key(Qt.Key.Key_F1)
    hands.until(lambda: hands.window._guide is not None and hands.window._guide.isVisible())
    assert hands.window._guide.page == "calibration"
    hands.window._guide.open_page("calibration", "Put the cameras together")
    assert hands.window._guide.browser.verticalScrollBar().value() > 500
    hands.window._guide.close()


def test_a_drag_over_a_picture_is_in_its_own_pixels(open_wizard):
    hands = open_wizard()
    wall = hands.window.frame.wall
    hands.until(lambda: wall.views["left"].shown is not None)
    picked = []
    wall.picked.connect(lambda *args: picked.append(args))
    wall.set_pickable(True)
    view = wall.views["left"]
    place = view._place()
    for frame_at, event in (((100, 60), QTest.mousePress), ((180, 120), QTest.mouseRelease)):
        offset = QPoint(round(frame_at[0] * place.scale), round(frame_at[1] * place.scale))
        event(view, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier,
              place.target.topLeft().toPoint() + offset)
    QApplication.processEvents()
    camera, x, y, width, height = picked[0]
    assert camera == "left" and (abs(x - 100), abs(y - 60)) < (3, 3) and abs(width - 80) < 4 and abs(height - 60) < 4


def test_a_silent_camera_is_named_in_its_picture(open_wizard, asker):
    hands = open_wizard()
    asker.refuse = "node left does not answer on its control channel."
    view = hands.window.frame.wall.views["left"]
    hands.until(lambda: view._problem == asker.refuse)
    assert hands.window.isVisible()
