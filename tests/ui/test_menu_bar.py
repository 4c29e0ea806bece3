"""The menu bar, worked by mouse and by keys."""

from __future__ import annotations

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QAction, QCursor, QKeySequence
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QMenuBar

from rhot_app.ui.common.menu import Menu, literal, without_letter

ALT = Qt.KeyboardModifier.AltModifier


def letters(menu):
    """The letters that choose the entries of an open menu."""
    return [QKeySequence.mnemonic(entry.text()).toString() for entry in menu.actions() if not entry.isSeparator()]


@pytest.mark.parametrize("key, name", [(Qt.Key.Key_R, "rig"), (Qt.Key.Key_C, "calibrate"), (Qt.Key.Key_V, "view"),
                                       (Qt.Key.Key_H, "help")])
def test_alt_and_a_letter_open_a_menu_whose_entries_have_letters(tracking, key, name):
    tracking.press(key, modifier=ALT)
    menu = getattr(tracking.window.menus, name)
    tracking.until(menu.isVisible)
    given = [letter for letter in letters(menu) if letter]
    assert len(given) == len(set(given)) >= 0.9 * len([one for one in menu.actions() if one.isVisible() and one.text()])
    tracking.press(Qt.Key.Key_Escape, menu)
    tracking.until(lambda: not menu.isVisible())
    tracking.press(Qt.Key.Key_Escape, tracking.window.menus)


def test_two_letters_choose_an_entry(tracking):
    window, alone = tracking.window, tracking.window.actions_.alone
    tracking.press(Qt.Key.Key_V, modifier=ALT)
    tracking.until(window.menus.view.isVisible)
    tracking.press(Qt.Key(ord(QKeySequence.mnemonic(alone.text()).toString()[-1])), window.menus.view)
    tracking.until(lambda: alone.isChecked() and not window.menus.view.isVisible())
    tracking.choose(window.menus.view, alone)
    tracking.until(lambda: not alone.isChecked())


def test_the_alt_key_reaches_the_menus_and_arrows_go_through_them(tracking):
    menus = tracking.window.menus
    QTest.keyPress(tracking.window, Qt.Key.Key_Alt)
    QTest.keyRelease(tracking.window, Qt.Key.Key_Alt)
    tracking.until(lambda: menus.activeAction() is not None)
    tracking.press(Qt.Key.Key_Right, menus)
    tracking.press(Qt.Key.Key_Down, menus)
    tracking.until(menus.calibrate.isVisible)
    tracking.press(Qt.Key.Key_Escape, menus.calibrate)
    tracking.press(Qt.Key.Key_Escape, menus)
    tracking.until(lambda: QApplication.activePopupWidget() is None)


def test_the_menus_take_no_row_of_their_own(tracking):
    window = tracking.window
    bar, badge = window.menus, window.toolbar.badge
    assert isinstance(bar, QMenuBar) and bar.isVisible()
    assert abs(bar.mapTo(window, bar.rect().center()).y() - badge.mapTo(window, badge.rect().center()).y()) <= 2
    assert window.toolbar.height() <= badge.sizeHint().height() + 16


def test_a_menu_that_was_escaped_leaves_no_light_on_its_name(tracking):
    bar = tracking.window.menus
    QCursor.setPos(tracking.window.mapToGlobal(tracking.window.rect().center()))
    tracking.run(0.1)
    idle = bar.grab().toImage()
    place = bar.actionGeometry(bar.rig.menuAction()).center()
    tracking.click(bar, place)
    tracking.until(bar.rig.isVisible)
    assert bar.grab().toImage() != idle
    tracking.press(Qt.Key.Key_Escape, bar.rig)
    tracking.press(Qt.Key.Key_Escape, bar)
    QTest.mouseMove(tracking.window, QPoint(400, 400))
    tracking.until(lambda: bar.grab().toImage() == idle)


def test_a_key_that_opens_a_menu_is_refused_with_the_menus_name(bench):
    keys = bench.window.keys
    assert "the menu Rig" in keys.choose(keys.named("frame"), QKeySequence("Alt+R"))
    assert keys.named("frame").shortcut().toString() == "F"


def test_a_name_with_an_ampersand_keeps_it_beside_its_letter(bench):
    menu = Menu("Objects", bench.window)
    for name in ("R&D cube", "R&D ball", "&"):
        menu.addAction(literal(name))
    menu.popup(bench.window.mapToGlobal(QPoint(200, 200)))
    bench.until(menu.isVisible)
    assert [without_letter(entry.text()) for entry in menu.actions()] == ["R&D cube", "R&D ball", "&"]
    assert letters(menu) == ["Alt+R", "Alt+B", ""]
    menu.close()


def test_letters_stay_the_menus_own(bench):
    """Buttons and the table of keys call an action by its name alone, after its menu was open, too."""
    window, action = bench.window, bench.window.actions_.names
    bench.choose(window.menus.view, window.actions_.dark)
    assert "&" in action.text() and isinstance(action, QAction)
    button = window.scene_page.bar.widgetForAction(action)
    assert button.text() == "Marker names"
    window.dialogs.show_settings(window.settings, window.keys)
    page = window.dialogs.settings
    named = [page.keys.table.text(row, 0) for row in range(len(page.keys.table.records))]
    assert "Marker names" in named and not [one for one in named if "&" in one]
