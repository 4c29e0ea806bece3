"""Settings and About, used as a person does: from the menus, with clicks and keys; remembered by the next window."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QFileDialog
from screen_pictures import cut_texts, picture_of

from rhot_app.ui.common.settings import Settings
from rhot_app.ui.dialogs.about_dialog import parts


@pytest.fixture
def page(bench):
    """The settings, opened from the Rig menu."""
    bench.choose(bench.window.menus.rig, bench.window.actions_.settings)
    bench.until(lambda: bench.window.dialogs.settings is not None and bench.window.dialogs.settings.isVisible())
    return bench.window.dialogs.settings


def select(bench, box, number):
    """Choose an entry of a list by keys."""
    box.setFocus()
    bench.press(Qt.Key.Key_Home, box)
    for _ in range(number):
        bench.press(Qt.Key.Key_Down, box)


def select_action(bench, page, title):
    """Click an action's row in the table of keys."""
    page.tabs.setCurrentIndex(1)
    table = page.keys.table
    row = [table.text(k, 0) for k in range(len(table.records))].index(title)
    table.scrollTo(table.records_model.index(row, 0))
    bench.click(table.viewport(), table.visualRect(table.records_model.index(row, 0)).center())
    return row


def press_new_key(bench, page, key, modifier=Qt.KeyboardModifier.NoModifier):
    bench.click(page.keys.edit)
    bench.press(key, page.keys.edit, modifier)


def close(bench, page):
    """Close the page, and give the window the keyboard again."""
    bench.click(page.close_button)
    bench.window.activateWindow()
    bench.until(bench.window.isActiveWindow)


def test_the_look_of_the_page_and_of_the_menu_are_one(bench, page):
    select(bench, page.general.look_box, 1)
    assert bench.window.actions_.light.isChecked() and bench.window.settings.scheme == "light"
    bench.window.actions_.dark.trigger()
    assert page.general.look_box.currentText() == "Dark"


def test_recordings_go_to_the_folder_that_was_chosen(bench, page, tmp_path, monkeypatch):
    assert page.general.recordings.label.text() == str(tmp_path / "RHOT")
    folder = tmp_path / "elsewhere"
    folder.mkdir()
    monkeypatch.setattr(QFileDialog, "getExistingDirectory", lambda *args: str(folder))
    bench.click(page.general.recordings.choose_button)
    bench.click(page.general.exports.choose_button)
    assert page.general.exports.label.text() == str(folder)
    close(bench, page)
    bench.track()
    bench.press(Qt.Key.Key_R)
    bench.until(lambda: any("elsewhere" in call for call in map(str, (*bench.backend.calls,
                                                                        *bench.backend.engine.commands))))
    bench.window.replays.list()
    assert bench.window.replays.library.library.folder == folder
    bench.window.dialogs.export_recording(bench.window.settings, folder / "wave.rhotlog")
    offered = []
    monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *args: offered.append(args[2]) or ("", ""))
    bench.click(bench.window.dialogs.export.export_button)
    assert Path(offered[0]).parent == folder


@pytest.mark.parametrize("number, calls", [(0, 0), (2, 1)])
def test_what_was_chosen_opens_at_the_next_start(bench, page, make_bench, tmp_path, number, calls):
    select(bench, page.general.start_box, number)
    page.close()
    later = make_bench(settings=Settings(tmp_path / "app.ini"))
    later.window.open_as_chosen()
    later.until(lambda: not later.controller.working)
    assert sum("twin" in str(call) for call in later.backend.calls) == calls


def test_steps_and_video_are_the_switches_that_were_there(bench, page):
    bench.click(page.general.steps_check, page.general.steps_check.rect().center() * 0.1)
    assert bench.window.next_steps.never.isChecked()
    bench.window.next_steps.never.click()
    assert page.general.steps_check.isChecked()
    bench.window.actions_.video.trigger()
    assert page.general.video_check.isChecked() and bench.window.settings.video


def test_start_says_its_own_key_beside_the_space_bar(bench, page):
    start = bench.window.actions_.start
    assert start.toolTip().endswith("or to stop (Space).")
    select_action(bench, page, "Start")
    press_new_key(bench, page, Qt.Key.Key_G)
    bench.until(lambda: start.toolTip().endswith("or to stop (Space, G)."))


def test_a_key_of_ones_own_works_now_and_after_a_start(bench, page, make_bench, tmp_path):
    row = select_action(bench, page, "Scene alone")
    press_new_key(bench, page, Qt.Key.Key_F11)
    bench.until(lambda: page.keys.table.text(row, 1) == "F11")
    assert bench.window.actions_.alone.toolTip().endswith("(F11).")
    close(bench, page)
    bench.press(Qt.Key.Key_6)
    assert not bench.window.actions_.alone.isChecked()
    bench.press(Qt.Key.Key_F11)
    assert bench.window.actions_.alone.isChecked()
    later = make_bench(settings=Settings(tmp_path / "app.ini"))
    assert later.window.actions_.alone.shortcut().toString() == "F11"


def test_a_key_of_another_action_is_refused_with_its_name(bench, page):
    row = select_action(bench, page, "Frame the hand")
    for key, holder in ((Qt.Key.Key_R, "Record"), (Qt.Key.Key_Space, "Start and Stop")):
        press_new_key(bench, page, key)
        bench.until(lambda holder=holder: holder in page.keys.sentence.text())
        assert page.keys.table.text(row, 1) == "F"


def test_keys_and_folders_return_to_what_they_were_at_first(bench, page, tmp_path):
    row = select_action(bench, page, "Guide")
    press_new_key(bench, page, Qt.Key.Key_F2)
    bench.until(lambda: page.keys.table.text(row, 1) == "F2")
    bench.click(page.keys.own_button)
    assert page.keys.table.text(row, 1) == "F1" and not page.keys.own_button.isEnabled()
    press_new_key(bench, page, Qt.Key.Key_F2)
    bench.until(lambda: page.keys.table.text(row, 1) == "F2")
    bench.window.settings.choose_folder("recordings", tmp_path / "gone")
    bench.click(page.reset_button)
    assert page.keys.table.text(row, 1) == "F1"
    assert page.general.recordings.label.text() == str(tmp_path / "RHOT")


def test_every_action_has_a_name_of_its_own(bench):
    names = [action.objectName() for action in bench.window.keys.actions]
    assert all(names) and len(set(names)) == len(names)


def test_about_says_the_versions_and_copies_them(bench):
    bench.choose(bench.window.menus.help, bench.window.actions_.about)
    bench.until(lambda: bench.window.dialogs.about is not None and bench.window.dialogs.about.isVisible())
    about = bench.window.dialogs.about
    text = about.versions.toPlainText()
    for name in ("RHOT", "Python", "Qt", "PySide6-Essentials", "numpy", "opencv-python-headless"):
        assert re.search(rf"^{name} \d", text, re.MULTILINE), name
    bench.click(about.copy_button)
    assert QGuiApplication.clipboard().text() == text
    assert not cut_texts(about)


def test_every_package_has_a_licence():
    found = {part.name.lower(): part.licence for part in parts()}
    assert {"numpy", "numba", "scipy", "pyside6_essentials", "pyqtgraph"} <= {name.replace("-", "_") for name in found}
    unknown = [name for name, licence in found.items() if "own files" in licence]
    assert not unknown


def test_pictures(bench, page):
    for number in range(2):
        page.tabs.setCurrentIndex(number)
        assert not cut_texts(page)
    page.tabs.setCurrentIndex(0)
    page.general.recordings.show_folder("/home/rhot/Documents/RHOT")
    page.file_label.setText("/home/rhot/.config/rhot/app.ini")
    bench.keep("settings", 12, take=lambda: picture_of(page))
