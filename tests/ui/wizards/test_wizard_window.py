"""The wizards' window: steps, keys, live pictures, long work, use and restore - on a small wizard made for it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import sample_wizard
from fake_engine import synthetic_rig
from patience import eventually
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QMessageBox
from sample_wizard import brightest
from wizard_rig import FakeRigClient

from rhot_app import rig_history
from rhot_app.calibration.registry import calibrations
from rhot_app.project import load_rig
from rhot_app.ui.backend.feed import Picture
from rhot_app.ui.backend.solver import Solver
from rhot_app.ui.common.guide import page_path
from rhot_app.ui.models.palette import DARK
from rhot_app.ui.wizards.framework.drawing import Cells, Dots, Tag
from rhot_app.ui.wizards.framework.picture_view import PictureGrid
from rhot_app.ui.wizards.framework.step import AnnotatedPicture, StepView


@pytest.fixture
def client():
    return FakeRigClient(synthetic_rig())


@pytest.fixture
def open_sample(open_wizard, client):
    """Opens the sample wizard on a rig file."""
    return lambda steps=3, **options: open_wizard(
        "Sample", client, make=lambda context: sample_wizard.make_wizard(context, steps), **options)


@pytest.fixture
def real_solver(monkeypatch):
    """Makes a process that can import the sample's work."""
    monkeypatch.setenv("PYTHONPATH", str(Path(sample_wizard.__file__).parent))
    return lambda: Solver(niceness=0)


def capture_three(hands):
    """From the first page to three captured pictures."""
    hands.window.page.box.setValue(9)
    hands.next()
    for count in range(1, 4):
        hands.until(lambda: hands.window.step.seen is not None)
        hands.key(Qt.Key.Key_Space)
        assert len(hands.window.step.captured) == count


def test_from_the_first_page_to_a_saved_rig_and_back(open_sample, client):
    hands = open_sample()
    frame = hands.window.frame
    used = []
    hands.window.rig_used.connect(lambda rig: used.append(rig.name))
    assert not frame.next_button.isEnabled() and "number of squares" in hands.hint
    capture_three(hands)
    assert frame.steps.states == ["done", "current", "to come", "to come"]
    hands.next()
    hands.until(lambda: frame.verdict.verdict is not None)
    hands.next()
    assert load_rig(hands.path).name == "test bench", "nothing is saved before it is used"
    assert frame.next_button.text() == "Use this calibration"
    assert hands.window.page.table.text(0, 2) == "535.9 ± 0.4 px"
    hands.use()
    assert frame.next_button.text() == "Close"
    assert load_rig(hands.path).name == "calibrated" and client.rig.name == "calibrated"
    assert [version.replaced_by for version in rig_history.versions(hands.path)] == ["lens calibration"]
    hands.restore()
    assert load_rig(hands.path).name == "test bench" and client.rig.name == "test bench"
    assert used == ["calibrated", "test bench"]


def test_the_pictures_are_live_and_marked(open_sample):
    hands = open_sample()
    hands.window.page.box.setValue(9)
    hands.next()
    view = hands.frame.grid.views["left"]
    hands.until(lambda: view.shown is not None and len(view.overlay) == 4)
    first = view.shown.number
    hands.until(lambda: view.shown.number > first + 4)


def test_what_is_drawn_was_found_in_the_very_picture_that_is_shown(open_sample):
    """Something moves in the pictures, and they are looked at more slowly than they come."""
    hands = open_sample()
    hands.window.page.box.setValue(9)
    hands.next()
    observe, feed = hands.window.step.observe, hands.window.feed

    def slow(pictures):
        eventually(lambda: all(feed.newest(name).number > picture.number for name, picture in pictures.items()))
        return observe(pictures)

    hands.window.step.observe = slow
    numbers, views = {}, hands.frame.grid.views

    def drawn():
        for name, view in views.items():
            dots = [mark for mark in view.overlay if isinstance(mark, Dots)]
            if view.shown is not None and dots:
                assert dots[0].points[0, 0] == brightest(view.shown), "marks of another picture"
                numbers.setdefault(name, set()).add(view.shown.number)
        return all(len(numbers.get(name, ())) > 5 for name in views)

    hands.until(drawn)


def picture(number, at_s):
    return Picture("left", np.zeros((240, 320, 3), np.uint8), number, 0, round(1e9 * at_s))


def test_a_picture_without_results_is_drawn_without_any(qtbot, themed):
    class Feed:
        def newest(self, name):
            return newest

        def problem(self, name):
            return ""

    wall = PictureGrid(("left",), DARK)
    qtbot.addWidget(wall)
    wall.show()
    view, fixed, own = wall.views["left"], Cells(np.eye(2)), Tag(1.0, 2.0, "a marker")
    looked_at, newest = picture(1, 10.0), picture(9, 10.9)
    step_view = StepView("", overlays={"left": (fixed,)}, annotated={"left": AnnotatedPicture(looked_at, (own,))})
    wall.show_view(step_view)
    wall.refresh(Feed())
    assert view.shown is looked_at and view.overlay == (fixed, own)
    newest = picture(10, 11.1)
    wall.refresh(Feed())
    assert view.shown is newest and view.overlay == (fixed,), "nobody has looked at this one, nor will soon"
    held = picture(5, 10.5)
    wall.show_view(replace(step_view, pictures={"left": held}))
    wall.refresh(Feed())
    assert view.shown is held and view.overlay == (fixed,)
    wall.show_view(replace(step_view, pictures={"left": looked_at}))
    wall.refresh(Feed())
    assert view.shown is looked_at and view.overlay == (fixed, own)


def test_back_is_always_safe(open_sample):
    hands = open_sample()
    capture_three(hands)
    hands.key(Qt.Key.Key_Left, Qt.KeyboardModifier.AltModifier)
    assert hands.title == "The board" and hands.window.page.box.value() == 9
    hands.key(Qt.Key.Key_Return)
    assert hands.title == "Take pictures" and len(hands.window.step.captured) == 3


def test_undo_takes_the_last_picture_back(open_sample):
    hands = open_sample()
    capture_three(hands)
    hands.undo()
    assert len(hands.window.step.captured) == 2 and not hands.frame.next_button.isEnabled()


def test_long_work_shows_progress_stays_live_and_can_be_cancelled(open_sample, real_solver):
    hands = open_sample(steps=200, make_solver=real_solver)
    capture_three(hands)
    hands.next()
    work_view, window = hands.frame.work_view, hands.window
    hands.until(lambda: "left" in work_view.remaining.text())
    view = window.frame.grid.views["left"]
    first = view.shown.number
    hands.until(lambda: view.shown.number > first + 4)
    assert not window.frame.next_button.isEnabled()
    hands.click(work_view.cancel_button)
    assert not window.work.running and "go back" in work_view.label.text()
    window.step.steps = 2
    hands.click(work_view.again_button)
    hands.until(lambda: window.step.result == 2)


def test_going_back_ends_long_work(open_sample):
    hands = open_sample(steps=200)
    capture_three(hands)
    hands.next()
    hands.until(lambda: hands.window.work.fraction > 0)
    hands.click(hands.frame.back_button)
    assert not hands.window.work.running and hands.title == "Take pictures"


def test_escape_asks_only_when_something_would_be_lost(open_sample, monkeypatch):
    asked = []

    def answer(*args):
        asked.append(args[2])
        return QMessageBox.StandardButton.Cancel if len(asked) == 1 else QMessageBox.StandardButton.Discard

    monkeypatch.setattr(QMessageBox, "question", answer)
    hands = open_sample()
    hands.key(Qt.Key.Key_Escape)
    assert not hands.window.isVisible() and asked == []
    hands = open_sample()
    capture_three(hands)
    hands.key(Qt.Key.Key_Escape)
    assert hands.window.isVisible() and "is lost" in asked[0]
    hands.key(Qt.Key.Key_Escape)
    assert not hands.window.isVisible() and len(asked) == 2


def test_a_failure_to_save_is_said_and_changes_nothing(open_sample, client):
    hands = open_sample()
    capture_three(hands)
    hands.next()
    hands.next()
    hands.until(lambda: hands.frame.next_button.text() == "Use this calibration")
    client.refuse = "The engine does not answer."
    hands.next()
    hands.until(lambda: hands.hint == client.refuse)
    assert load_rig(hands.path).name == "test bench" and hands.window.step.usable


def test_every_wizard_has_its_section_in_the_guide():
    headings = [line.removeprefix("## ") for line in page_path("calibration").read_text().splitlines()]
    assert [heading for heading in headings if heading in {wizard.title for wizard in calibrations()}] == [
        wizard.title for wizard in calibrations()], "in the order of the menu"


def test_f1_opens_the_guide_beside_the_wizard(open_sample):
    hands = open_sample()
    hands.key(Qt.Key.Key_F1)
    hands.until(lambda: hands.window.tools.guide is not None and hands.window.tools.guide.isVisible())
    guide = hands.window.tools.guide
    assert guide.page == "calibration"
    guide.open_page("calibration", "Stereo calibration")
    assert guide.browser.verticalScrollBar().value() > 500
    guide.close()


def test_a_drag_over_a_picture_is_in_its_own_pixels(open_sample):
    hands = open_sample()
    wall = hands.frame.grid
    hands.until(lambda: wall.views["left"].shown is not None)
    picked = []
    wall.picked.connect(lambda *args: picked.append(args))
    wall.set_pickable(True)
    view = wall.views["left"]
    hands.drag(view, view.to_widget(100, 60), view.to_widget(180, 120))
    (picture, *box), = picked
    assert picture.camera == "left" and box == pytest.approx([100, 60, 80, 60], abs=2.0)


def test_a_silent_camera_is_named_in_its_picture(open_sample, client):
    hands = open_sample()
    client.refuse = "node left does not answer on its control channel."
    view = hands.frame.grid.views["left"]
    hands.until(lambda: view.problem == client.refuse)
    assert hands.window.isVisible()
