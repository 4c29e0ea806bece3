"""Recordings in the main window: what is told while recording, bookmarks, the menu, and engines that replay."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QFileDialog, QLineEdit

from rhot_app.errors import EngineError
from rhot_app.ui.backend.solver import Solver


def test_length_and_size_are_told_while_recording(tracking):
    label = tracking.window.toolbar.source_label
    assert label.text() == ""
    tracking.press(Qt.Key.Key_R)
    tracking.until(lambda: label.text() == "REC 0:00, 120.0 kB")
    tracking.press(Qt.Key.Key_R)
    tracking.until(lambda: label.text() == "" and not label.isVisible())


def test_b_sets_a_bookmark_of_the_moment_it_was_pressed(tracking):
    tracking.press(Qt.Key.Key_R)
    tracking.until(lambda: tracking.controller.recording)
    before_s = tracking.clock()
    tracking.press(Qt.Key.Key_B)
    after_s = tracking.clock()
    edit = tracking.window.recordings.dialog.findChild(QLineEdit)
    QTest.keyClicks(edit, "thumb lost")
    QTest.keyClick(edit, Qt.Key.Key_Return)
    tracking.until(lambda: tracking.said("Bookmark", "thumb lost"))
    name, arguments = tracking.backend.engine.commands[-1]
    assert name == "bookmark" and arguments["text"] == "thumb lost"
    assert before_s <= 1e-9 * arguments["t_master_ns"] <= after_s
    tracking.click(tracking.window.toolbar.source_label)
    QTest.keyClick(tracking.window.recordings.dialog.findChild(QLineEdit), Qt.Key.Key_Return)
    tracking.until(lambda: tracking.backend.engine.commands[-1][1].get("text") == "bookmark")
    tracking.press(Qt.Key.Key_R)
    tracking.until(lambda: not tracking.controller.recording)


def test_b_says_so_when_nothing_is_recorded(tracking):
    tracking.press(Qt.Key.Key_B)
    tracking.until(lambda: tracking.said("Nothing is being recorded"))
    assert tracking.window.recordings.dialog is None


def test_the_menu_opens_the_page_and_the_page_a_replay(bench, log, monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    window, desk = bench.window, bench.window.replays
    window.actions_.recordings.trigger()
    page = desk.library
    bench.until(lambda: [entry.path for entry in page.table.entries] == [log])
    bench.click(page.open_button)
    bench.until(lambda: desk.window is not None and desk.window.replay is not None)
    assert desk.window.replay.path == log and desk.window.isVisible()
    renamed = page.library.rename(log, "better name")
    page.renamed.emit(log, renamed)
    assert "better name" in desk.window.windowTitle() and desk.window.replay.path == renamed
    window.actions_.light.trigger()
    assert desk.window.parts.scene.scheme.name == "light"
    window.actions_.dark.trigger()
    window.actions_.recordings.trigger()
    assert desk.library is page
    window.close()
    assert desk.window is None and desk.library is None


def test_a_recording_is_opened_by_its_file_and_tracked_in_a_process_of_its_own(make_bench, log, monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *args: (str(log), ""))
    bench = make_bench(make_solver=lambda: Solver(niceness=0))
    bench.press(Qt.Key.Key_O, modifier=Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.ShiftModifier)
    bench.until(lambda: bench.window.replays.window is not None)
    bench.until(lambda: bench.window.replays.window.replay is not None)
    bench.window.replays.window.close()
    assert bench.window.isVisible()


def test_a_window_attaches_to_an_engine_that_begins_to_replay(bench):
    assert bench.controller.opened is None
    bench.backend.ours = False
    bench.backend.engine.running = True
    bench.backend.engine.replaying = "/data/thumb.rhotlog"
    bench.backend.already_running = True
    bench.let_pass(1.5)
    bench.until(lambda: bench.window.toolbar.badge.word == "TRACKING")
    bench.until(lambda: bench.window.toolbar.source_label.text() == "REPLAY thumb.rhotlog")
    bench.controller.close_rig()
    bench.until(lambda: bench.window.toolbar.badge.word == "NO RIG")
    look(bench)
    assert bench.controller.opened is None, "who closes an engine that runs on is left in peace"
    bench.backend.already_running = False
    look(bench)
    bench.backend.already_running = True
    bench.let_pass(1.5)
    bench.until(lambda: bench.controller.opened is not None)


def look(bench):
    """Let the window look whether an engine runs, once more."""
    looks = bench.backend.looks
    bench.let_pass(1.5)
    bench.until(lambda: bench.backend.looks > looks)
    bench.run(0.05)


def test_an_engine_that_does_not_answer_yet_is_asked_again_quietly(bench, monkeypatch):
    answers = [EngineError("the engine does not answer")]
    attach = bench.backend.attach

    def later(report):
        if answers:
            raise answers.pop()
        return attach(report)

    monkeypatch.setattr(bench.backend, "attach", later)
    bench.backend.already_running = True
    bench.until(lambda: bench.let_pass(0.5) or bench.controller.opened is not None)
    assert not answers and not bench.said("does not answer")
