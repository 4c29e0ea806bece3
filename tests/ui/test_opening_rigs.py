"""The window around a rig: the first page, opening, attaching, closing, what is remembered."""

from __future__ import annotations

from pathlib import Path

from fake_backend import FakeBackend
from fake_engine import FakeEngine, synthetic_rig
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFileDialog

from rhot_app.project import save_rig


def test_the_first_page_offers_three_ways(bench):
    welcome = bench.window.welcome
    assert bench.window.pages.currentWidget() is welcome
    assert welcome.twin_button.isVisible() and welcome.file_button.isVisible() and welcome.nodes_button.isVisible()
    assert not welcome.last_button.isVisible()
    assert bench.window.toolbar.badge.word == "NO RIG"
    assert not bench.window.actions_.start.isEnabled()
    assert not any(dock.isVisible() for dock in bench.window.docks.docks)


def test_opening_shows_progress_and_can_be_cancelled(bench):
    bench.backend.gate.clear()
    bench.click(bench.window.welcome.twin_button)
    bench.until(lambda: bench.window.welcome.progress_bar.isVisible())
    bench.until(lambda: "Starting" in bench.window.welcome.progress_label.text())
    bench.until(lambda: bench.window.welcome.progress_bar.value() == 40)
    bench.until(lambda: bench.window.toolbar.badge.word == "STARTING")
    bench.click(bench.window.welcome.cancel_button)
    bench.until(lambda: "give up" in bench.backend.calls and bench.window.welcome.twin_button.isVisible())
    bench.until(lambda: bench.window.toolbar.badge.word == "NO RIG")
    bench.run(0.2)
    assert bench.controller.opened is None and bench.window.toolbar.badge.word == "NO RIG"


def test_a_rig_that_cannot_be_opened_is_a_sentence(bench):
    bench.backend.refuse = "/tmp/x.json: line 3: not valid JSON. Is the file complete?"
    bench.window.open_rig(Path("/tmp/x.json"))
    bench.until(lambda: bench.window.advice.texts[:1] == [bench.backend.refuse])
    assert bench.window.welcome.twin_button.isVisible()


def test_a_rig_file_is_opened_and_offered_again(make_bench, tmp_path, monkeypatch):
    path = tmp_path / "desk.json"
    save_rig(path, synthetic_rig())
    monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *args: (str(path), ""))
    bench = make_bench()
    bench.click(bench.window.welcome.file_button)
    bench.until(lambda: bench.controller.rig is not None)
    assert bench.backend.calls == ["open desk.json"]
    assert "test bench" in bench.window.toolbar.rig_label.text()
    bench.window.close()
    again = make_bench()
    assert again.window.welcome.last_button.text() == "Open desk.json"
    again.click(again.window.welcome.last_button)
    again.until(lambda: again.backend.calls == ["open desk.json"])


def test_attaching_shows_the_running_state_at_once(make_bench):
    backend = FakeBackend(FakeEngine(running=True))
    backend.ours = False
    bench = make_bench(backend)
    bench.controller.attach()
    bench.until(lambda: bench.window.toolbar.badge.word == "TRACKING")
    bench.until(lambda: bench.said("lets it run on"))
    assert not any(name == "start" for name, _ in backend.engine.commands)
    bench.window.close()
    assert "goes on running" in bench.controller.shut_down()


def test_closing_the_rig_ends_everything_and_returns_to_the_first_page(tracking):
    tracking.window.actions_.close_rig.trigger()
    tracking.until(lambda: "close" in tracking.backend.calls and tracking.window.welcome.twin_button.isVisible())
    tracking.until(lambda: tracking.window.toolbar.badge.word == "NO RIG")
    assert tracking.controller.rig is None and not tracking.window.actions_.start.isEnabled()


def test_layout_and_look_are_remembered_and_can_be_reset(make_bench):
    bench = make_bench()
    bench.click(bench.window.welcome.twin_button)
    bench.until(lambda: bench.controller.rig is not None)
    bench.press(Qt.Key.Key_4)
    bench.window.actions_.names.setChecked(False)
    bench.window.actions_.light.trigger()
    bench.window.close()
    again = make_bench(scheme="light")
    again.click(again.window.welcome.twin_button)
    again.until(lambda: again.controller.rig is not None)
    assert not again.window.docks.docks[3].isVisible() and again.window.docks.docks[0].isVisible()
    assert not again.window.actions_.names.isChecked() and again.window.actions_.light.isChecked()
    again.window.actions_.reset.trigger()
    assert again.window.docks.docks[3].isVisible() and again.window.actions_.dark.isChecked()
    assert again.window.actions_.names.isChecked()
