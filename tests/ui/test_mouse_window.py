"""The window of the 3-D mouse, worked as a person works it: by buttons, keys, and a hand that moves."""

from __future__ import annotations

import pytest
from fake_engine import synthetic_rig
from mouse_states import REST, SPREAD, hand_state, lost
from person import Person
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from screen_pictures import colours_in, picture_of

from rhot_app.ui.models.palette import DARK
from rhot_app.ui.mouse.scene import shadow_of
from rhot_app.ui.mouse.window import MouseWindow


class Hand:
    """In place of an engine's client: states come when a test lets them come."""

    def __init__(self) -> None:
        self.number = 0
        self.waiting: list = []
        self.closed = False
        self.clock_s = 0.0

    def poll(self) -> list:
        sent, self.waiting = self.waiting, []
        return sent

    def close(self) -> None:
        self.closed = True

    def be(self, *place: float, states: int = 1, **angles: float) -> None:
        for _ in range(states):
            self.waiting.append(hand_state(self.number, place or (0.0, 0.0, 0.0), **angles))
            self.number += 1


@pytest.fixture
def hand() -> Hand:
    return Hand()


@pytest.fixture
def window(themed, qtbot, hand):
    rig = synthetic_rig()
    window = MouseWindow(hand, lambda: rig, DARK, clock=lambda: hand.clock_s)
    qtbot.addWidget(window)
    Person(window)
    hand.be(states=REST)
    window.tick()
    yield window
    window.close()


def to(window: MouseWindow, ball: int) -> tuple[float, float, float]:
    """Palm place m that brings the cursor's foot under a ball, which lies low enough to be picked from there."""
    x, y, _ = window.pick.balls[ball].centre
    gain = window.mouse.settings.gain
    return (x / gain, y / gain, 0.0)


def carry(window: MouseWindow, hand: Hand, ball: int, *place: float) -> None:
    """Pick a ball, bring the palm to `place`, and let go."""
    start = to(window, ball)
    for where, angles in ((start, {}), (start, SPREAD["thumb"]), (place, SPREAD["thumb"]), (place, {})):
        hand.be(*where, **angles)
        window.tick()


def test_a_ball_is_picked_moved_and_brought_back_by_undo(window, hand):
    before = window.pick.balls[1].centre
    hand.be(*to(window, 1))
    window.tick()
    assert all(word in window.sentence.text() for word in ("thumb", "pick", "blue"))
    hand.be(*to(window, 1), **SPREAD["thumb"])
    window.tick()
    assert window.words["thumb"].text() == "Thumb DOWN"
    assert "moves with the cursor" in window.sentence.text()
    carry(window, hand, 1, 0.0, 0.0, 0.0)
    assert window.words["thumb"].text() == "Thumb up"
    assert window.pick.balls[1].centre[:2] == pytest.approx((0.0, 0.0), abs=1e-6)
    QTest.keyClick(window, Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    assert window.pick.balls[1].centre == before
    window.tick()
    assert "back where it was" in window.sentence.text()


def test_undo_without_a_move_is_a_sentence(window):
    QTest.mouseClick(window.undo_button, Qt.MouseButton.LeftButton)
    window.tick()
    assert "nothing to undo" in window.sentence.text()


def test_a_lost_hand_and_a_silent_engine_are_said_and_nothing_is_lost(window, hand):
    carry(window, hand, 1, 0.0, 0.0, 0.0)
    hand.waiting.append(lost(hand.number))
    window.tick()
    assert "No hand is tracked" in window.sentence.text() and window.badge.word == "LOST"
    moved = list(window.pick.balls)
    hand.clock_s += 100.0
    window.tick()
    assert "No engine is heard" in window.sentence.text() and window.badge.word == "NO RIG"
    assert window.pick.balls == moved
    hand.be(states=2)
    window.tick()
    assert window.badge.word == "TRACKING"


def test_h_takes_another_rest(window, hand):
    hand.be(0.05, 0.0, 0.0)
    window.tick()
    assert "+150 mm" in window.place.text()
    QTest.keyClick(window, Qt.Key.Key_H)
    hand.be(0.05, 0.0, 0.0, states=REST)
    window.tick()
    assert "right   +0 mm" in window.place.text()


def test_the_target_test_is_begun_clicked_through_and_ended(window, hand):
    balls = list(window.pick.balls)
    QTest.mouseClick(window.test_button, Qt.MouseButton.LeftButton)
    assert window.test_button.text() == "End the test"
    test = window.test
    while (wanted := test.wanted) is not None:
        x, y = test.targets[wanted] / window.mouse.settings.gain
        for angles in ({}, SPREAD["thumb"], {}):
            hand.be(x, y, 0.0, states=3, **angles)
            window.tick()
    assert "bit/s" in window.sentence.text() and "0 missed" in window.sentence.text()
    QTest.mouseClick(window.undo_button, Qt.MouseButton.LeftButton)
    window.tick()
    assert "moves no ball" in window.sentence.text()
    QTest.keyClick(window, Qt.Key.Key_T)
    assert window.test is None and window.pick.balls == balls


def test_a_ball_that_is_held_stays_while_the_target_test_is_done(window, hand):
    hand.be(*to(window, 1))
    window.tick()
    hand.be(*to(window, 1), **SPREAD["thumb"])
    window.tick()
    assert window.pick.held == 1
    QTest.keyClick(window, Qt.Key.Key_T)
    balls = list(window.pick.balls)
    hand.be(0.0, 0.05, 0.0, **SPREAD["thumb"])
    window.tick()
    QTest.keyClick(window, Qt.Key.Key_T)
    hand.be(0.0, 0.05, 0.0, states=2, **SPREAD["thumb"])
    window.tick()
    assert window.pick.held is None and window.pick.balls == balls


def test_the_palm_can_set_the_height(window, hand):
    window.height_box.setFocus()
    QTest.keyClick(window.height_box, Qt.Key.Key_Down)
    hand.be(states=REST)
    hand.be(0.0, 0.0, 0.02)
    window.tick()
    assert "height 120 mm" in window.place.text()


def test_f1_opens_the_guide_and_closing_ends_the_client(window, hand):
    QTest.keyClick(window, Qt.Key.Key_F1)
    assert window.tools.guide.page == "mouse" and window.tools.guide.isVisible()
    window.close()
    assert hand.closed


def test_a_shadow_lies_on_the_ground_beside_what_is_high():
    import numpy as np

    low, high = shadow_of(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.1]]))
    assert low == pytest.approx([0.0, 0.0, 0.0]) and high[2] == 0.0
    assert np.linalg.norm(high) > 0.03


def test_the_menu_opens_it_without_a_rig_and_with_one(bench):
    bench.window.actions_.mouse.trigger()
    opened = bench.window.dialogs.mouse
    bench.until(lambda: "No engine is heard" in opened.sentence.text())
    bench.click(bench.window.welcome.twin_button)
    bench.until(lambda: opened.badge.word in ("TRACKING", "PARTIAL"))
    opened.close()
    bench.until(lambda: bench.window.dialogs.mouse is None)


def test_picture(window, hand):
    person = Person(window)
    window.move(0, 0)
    carry(window, hand, 1, -0.01, 0.02, 0.0)
    start = to(window, 0)
    hand.be(*start)
    hand.be(*start, **SPREAD["thumb"])
    hand.be(0.015, -0.01, 0.0, index_mcp_flexion=2.0, **SPREAD["thumb"])
    person.until(lambda: colours_in(picture_of(window).copy(window.view.geometry())) > 20)  # the scene is drawn
    person.keep("mouse", 30, lambda: picture_of(window).copy(0, 0, window.width(), window.height()))
