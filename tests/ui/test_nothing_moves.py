"""What a person aims at stays where it is, in large and in small windows."""

from __future__ import annotations

import pytest
from person import wait
from PySide6.QtCore import Qt, QTimer
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QAbstractButton, QApplication, QComboBox, QLineEdit, QPushButton, QToolButton, QWidget
from test_open_and_close import OPENERS, LendingBackend

from rhot_app.engine.status import Advice
from rhot_app.sources.discovery import Search
from rhot_app.ui.common.sentence import Sentence
from rhot_app.ui.dialogs.nodes_dialog import NodesDialog, PairDialog
from rhot_app.ui.models.notice import Notice
from rhot_app.ui.models.palette import DARK

NO_ROOM = (1024, 700)
LONG = "The engine does not take the rig: the hand has no markers, and the other one's are not all in the set. " * 4
AIMS = (QAbstractButton, QComboBox, QLineEdit)


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
    before = place(desk, desk.window.menus)
    desk.click(toolbar.widgetForAction(record))
    desk.until(lambda: record.text() == "Stop recording" and toolbar.source_label.isVisible() and steady(desk))
    assert place(desk, desk.window.menus)[:2] == before[:2]
    desk.click(toolbar.widgetForAction(record))
    desk.until(lambda: record.text() == "Record" and steady(desk))
    assert place(desk, desk.window.menus) == before


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


def test_menus_that_do_not_fit_stand_behind_an_arrow(desk):
    window, menus = desk.window, desk.window.menus
    arrow = menus.findChild(QToolButton, "qt_menubar_ext_button")
    assert not arrow.isVisible()
    desk.backend.engine.log_path = "/recordings/a_recording_with_a_long_name.rhotlog"
    window.resize(*NO_ROOM)
    desk.until(lambda: desk.window.toolbar.source_label.isVisible() and arrow.isVisible())
    hidden = [menu.text() for menu in menus.actions() if menus.actionGeometry(menu).right() >= arrow.x()
              or menus.actionGeometry(menu).isEmpty()]
    found, timer = [], QTimer()

    def read():
        if arrow.menu() is not None and arrow.menu().isVisible():
            found.append([entry.text() for entry in arrow.menu().actions()])
            arrow.menu().close()

    timer.timeout.connect(read)
    timer.start(10)  # an open menu keeps the click waiting
    desk.click(arrow)
    timer.stop()
    assert found == [hidden] and hidden[-1] == "&Help"


# -- dialogs and other windows -----------------------------------------------------------------------------------------

def aims(window):
    """Where everything stands that a mouse may aim at, and how large the window is."""
    QApplication.processEvents()
    return {**{(kind.__name__, number): part.mapTo(window, part.rect().topLeft()).toTuple()
               for kind in AIMS for number, part in enumerate(window.findChildren(kind)) if part.isVisible()},
            "window": window.size().toTuple()}


def stays(window):
    """Nothing moves, whatever its sentences say."""
    sentences = [one for one in window.findChildren(Sentence) if one.isVisible()]
    for one in sentences:
        one.setText("Done.")
    before = aims(window)
    for one in sentences:
        one.setText(LONG)
        assert aims(window) == before, one.objectName()
        assert one.verticalScrollBar().maximum() > 0 or one.whole
    return len(sentences)


@pytest.fixture(scope="module")
def lent(make_shared_bench, tmp_path_factory):
    """The main window on an engine that answers everything."""
    bench = make_shared_bench(LendingBackend(tmp_path_factory.mktemp("rig") / "desk.json"))
    bench.track()
    return bench


WITH_SENTENCES = [one for one in OPENERS if one.name not in ("guide", "rig", "replay", "settings", "about")]


@pytest.mark.parametrize("opener", WITH_SENTENCES, ids=lambda one: one.name)
def test_a_long_sentence_moves_no_button(opener, lent):
    opener.open(lent.window)
    wait(lambda: (shown := opener.find(lent.window)) is not None and shown.isVisible())
    shown = opener.find(lent.window)
    try:
        assert stays(shown) > 0
    finally:
        shown.reject()
        wait(lambda: opener.find(lent.window) is None)


def test_dialogs_of_nodes_keep_their_buttons_in_place(themed, qtbot):
    for dialog in (NodesDialog(DARK, None, lambda progress: Search((), (), ())),
                   PairDialog("left", None, lambda address, code: "left")):
        qtbot.addWidget(dialog)
        dialog.show()
        assert stays(dialog) > 0


# -- the space bar -----------------------------------------------------------------------------------------------------

SPACED = [one for one in OPENERS if one.name in ("lens", "colours", "certificate", "layers", "fit")]


def has_menu(button):
    return button.menu() is not None or (isinstance(button, QToolButton) and button.defaultAction() is not None
                                         and button.defaultAction().menu() is not None)


def no_menu_by_space(window):
    """Press Space wherever the Tab key leads: neither a menu nor a list opens. Alt+Down opens them."""
    parts = [one for kind in (QComboBox, QPushButton, QToolButton) for one in window.findChildren(kind)
             if one.isVisible() and one.isEnabled() and one.focusPolicy() & Qt.FocusPolicy.TabFocus
             and (isinstance(one, QComboBox) or has_menu(one))]
    for one in parts:
        one.setFocus(Qt.FocusReason.TabFocusReason)
        QTest.keyClick(one, Qt.Key.Key_Space)
        opened = QApplication.activePopupWidget()
        if opened is not None:
            opened.close()
        assert opened is None, one
    return parts


@pytest.mark.parametrize("opener", SPACED, ids=lambda one: one.name)
def test_space_opens_no_menu_in_a_window(opener, lent):
    opener.open(lent.window)
    wait(lambda: (shown := opener.find(lent.window)) is not None and shown.isVisible())
    shown = opener.find(lent.window)
    shown.activateWindow()
    assert QTest.qWaitForWindowActive(shown)
    try:
        assert no_menu_by_space(shown)
    finally:
        shown.reject()
        wait(lambda: opener.find(lent.window) is None)


def test_space_opens_no_menu_of_the_main_window(desk):
    desk.window.activateWindow()
    assert QTest.qWaitForWindowActive(desk.window)
    button = desk.window.scene_page.bar.uncertainty_button
    assert button in no_menu_by_space(desk.window)
    button.setFocus(Qt.FocusReason.TabFocusReason)
    opened, timer = [], QTimer()

    def close():
        if QApplication.activePopupWidget() is not None:
            opened.append(QApplication.activePopupWidget())
            opened[-1].close()

    timer.timeout.connect(close)
    timer.start(10)  # an open menu keeps the key press waiting
    QTest.keyClick(button, Qt.Key.Key_Down, Qt.KeyboardModifier.AltModifier)
    desk.until(lambda: len(opened) == 1)
    timer.stop()


def test_a_button_that_was_clicked_leaves_space_to_the_window(lent):
    opener = next(one for one in OPENERS if one.name == "colours")
    opener.open(lent.window)
    wait(lambda: opener.find(lent.window) is not None and opener.find(lent.window).isVisible())
    shown = opener.find(lent.window)
    button = next(one for one in shown.findChildren(QPushButton) if one.text() == "Hold the pictures")
    focus = shown.focusWidget()
    QTest.mouseClick(button, Qt.MouseButton.LeftButton)
    assert shown.focusWidget() is focus is not button
    shown.reject()
    wait(lambda: opener.find(lent.window) is None)
