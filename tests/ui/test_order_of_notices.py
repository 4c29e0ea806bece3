"""Many sentences at once: what must be done now comes first, what was just done before that, and none is lost."""

from __future__ import annotations

import pytest
from PySide6.QtCore import Qt, QTimer

from rhot_app.engine.status import Advice
from rhot_app.ui.models.notice import Notice
from rhot_app.ui.panels.advice_bar import NoticeLine

STALE = Advice("error", "The right camera has moved: " + "its rays miss those of the left one by 1.4 px. " * 4,
               "stereo", subject="calibration")
LOSSY = Advice("warning", "Node left: 12 % of the datagrams are lost.")
BLIND = Advice("warning", "No camera has seen a marker for 56 s.", "colours", subject="sight")
FULL = Advice("error", "The disk will be full in less than a minute.", subject="recording")


@pytest.fixture
def desk(tracking):
    """The shared window at the size of a small laptop."""
    tracking.window.resize(1280, 800)
    yield tracking
    tracking.backend.calm()
    tracking.window.passing.clear()


def say(desk, *advice):
    """Have the engine say so and nothing else; every sentence is shown or listed."""
    desk.backend.engine.advice = advice
    bar = desk.window.advice
    desk.until(lambda: {one.text for one in advice} == {*bar.texts, *bar.waiting})


def opened_list(desk, open_it, then=lambda menu: menu.close()):
    """The sentences of the list that `open_it` opens, in order; `then` is done with it."""
    menu, seen = desk.window.advice.more.menu(), []

    def look():
        if menu.isVisible() and not seen:
            seen.extend(line.label.text() for entry in menu.actions() for line in [entry.defaultWidget()])
            then(menu)

    timer = QTimer()
    timer.timeout.connect(look)
    timer.start(10)
    open_it()
    desk.until(lambda: seen and not menu.isVisible())
    timer.stop()
    return seen


def test_what_must_be_done_now_comes_before_a_doubt_about_the_calibration(desk):
    bar = desk.window.advice
    say(desk, STALE, LOSSY, BLIND)
    assert bar.texts == [BLIND.text, LOSSY.text] and bar.waiting == [STALE.text]
    say(desk, STALE, LOSSY, BLIND, FULL)
    assert bar.texts == [FULL.text, BLIND.text] and bar.waiting == [LOSSY.text, STALE.text]
    say(desk, STALE)
    assert bar.texts == [STALE.text]


def test_a_finished_recording_is_said_before_all_alarms_and_then_yields(desk):
    bar = desk.window.advice
    say(desk, STALE, LOSSY, BLIND)
    desk.press(Qt.Key.Key_R)
    desk.until(lambda: desk.controller.recording)
    desk.press(Qt.Key.Key_R)
    desk.until(lambda: bar.texts[0].startswith("Recorded ") and "Show in folder" in bar.buttons)
    recorded = bar.texts[0]
    assert bar.texts == [recorded, BLIND.text] and bar.waiting[-2:] == [LOSSY.text, STALE.text]
    desk.let_pass(10.0)
    desk.until(lambda: bar.texts == [BLIND.text, LOSSY.text])
    assert bar.waiting == [STALE.text, recorded]
    desk.let_pass(60.0)
    desk.until(lambda: bar.waiting == [STALE.text])


def test_a_long_confirmation_takes_one_line_while_others_wait(desk):
    bar = desk.window.advice
    say(desk, BLIND)
    desk.window.tell(Notice("info", "Recorded to a folder with a long name. " * 8))
    desk.until(lambda: bar.texts[0].startswith("Recorded"))
    assert bar.texts[1:] == [BLIND.text] and bar.waiting == bar.texts[:1]


def test_the_list_opens_by_key_and_by_mouse_and_holds_whole_sentences(desk):
    bar = desk.window.advice
    say(desk, STALE, LOSSY, BLIND, FULL)
    alt = Qt.KeyboardModifier.AltModifier
    assert opened_list(desk, lambda: desk.press(Qt.Key.Key_M, modifier=alt)) == [LOSSY.text, STALE.text]
    assert opened_list(desk, lambda: desk.click(bar.more)) == [LOSSY.text, STALE.text]
    assert all(text in bar.more.toolTip() for text in (LOSSY.text, STALE.text))


def test_a_sentence_that_is_cut_stands_whole_in_the_list(desk):
    bar, long = desk.window.advice, Advice("warning", "Camera right is black. " * 12, subject="sight")
    say(desk, FULL, long)
    assert bar.texts == [FULL.text, long.text] and bar.waiting == [long.text]
    shown = next(line for line in bar.findChildren(NoticeLine) if line.notice and line.notice.text == long.text)
    assert shown.label.text().endswith("…") and shown.label.height() < 2 * shown.label.fontMetrics().height()
    assert opened_list(desk, lambda: desk.click(bar.more)) == [long.text]


@pytest.mark.parametrize("by_key", [True, False])
def test_a_step_of_the_list_is_taken(desk, by_key):
    bar = desk.window.advice
    say(desk, FULL, LOSSY, BLIND, STALE)
    desk.backend.engine.advice = (FULL, Advice("error", "Node left does not answer.", subject="tracking"), BLIND)
    desk.until(lambda: bar.waiting == [BLIND.text])

    def take(menu):
        if by_key:
            desk.press(Qt.Key.Key_Down, menu)
            desk.press(Qt.Key.Key_Return, menu)
        else:
            desk.click(menu.actions()[0].defaultWidget().button)

    opened_list(desk, lambda: desk.click(bar.more), take)
    desk.until(lambda: desk.window.wizards.wizard is not None)
    desk.window.wizards.wizard.reject()
    desk.until(lambda: desk.window.wizards.wizard is None)
