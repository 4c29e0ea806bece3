"""What the person at the screen hears after something was done: recorded, saved, slowed down."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from fake_engine import synthetic_rig
from PySide6.QtCore import Qt
from PySide6.QtGui import QDesktopServices
from PySide6.QtWidgets import QLabel

from rhot_app.project import load_rig, save_rig
from rhot_app.ui.backend.contract import TwinPace
from rhot_app.ui.common.settings import Settings
from rhot_app.ui.models.notice import Notice, TransientNotices


def test_r_records_and_says_where_the_file_is(tracking, tmp_path, monkeypatch):
    engine = tracking.backend.engine
    tracking.press(Qt.Key.Key_R)
    tracking.until(lambda: engine.log_path)
    path = Path(engine.log_path)
    assert path.suffix == ".rhotlog" and path.parent == tmp_path / "RHOT"
    tracking.until(lambda: tracking.said("Recording", str(path), "0:00", "120.0 kB"))
    tracking.press(Qt.Key.Key_R)
    tracking.until(lambda: tracking.said("Recorded 120.0 kB", str(path)) and not tracking.said("Recording"))
    opened = []
    monkeypatch.setattr(QDesktopServices, "openUrl", lambda url: bool(opened.append(url.toLocalFile())))
    tracking.click(tracking.window.advice.buttons["Show in folder"])
    assert opened == [str(path.parent)]
    tracking.until(lambda: tracking.said(f"in {path.parent}"))


def test_a_recording_that_continues_in_another_part_is_not_called_finished(tracking, tmp_path):
    tracking.press(Qt.Key.Key_R)
    tracking.until(lambda: tracking.controller.recording)
    part = Path(tracking.backend.engine.log_path).with_name("part2.rhotlog")
    part.write_bytes(bytes(1000))
    tracking.backend.engine.log_path = str(part)
    tracking.until(lambda: tracking.said("Recording to", str(part)))
    assert not tracking.said("Recorded")
    tracking.press(Qt.Key.Key_R)
    tracking.until(lambda: tracking.said("Recorded 1.0 kB", str(part)))


def test_video_is_recorded_when_it_is_switched_on_and_the_switch_is_remembered(tracking):
    commands, switch = tracking.backend.engine.commands, tracking.window.actions_.video

    def record() -> dict:
        tracking.press(Qt.Key.Key_R)
        tracking.until(lambda: tracking.controller.recording)
        asked = [arguments for name, arguments in commands if name == "record"][-1]
        tracking.press(Qt.Key.Key_R)
        tracking.until(lambda: not tracking.controller.recording)
        return asked
    assert record()["video"] is False
    switch.trigger()
    assert record()["video"] is True
    tracking.until(lambda: tracking.said("Recordings", "collects"))
    tracking.window.settings.sync()
    assert Settings(tracking.window.settings.path).video
    switch.trigger()


def test_a_recording_that_vanished_is_said(tracking):
    tracking.press(Qt.Key.Key_R)
    tracking.until(lambda: tracking.controller.recording)
    Path(tracking.backend.engine.log_path).unlink()
    tracking.press(Qt.Key.Key_R)
    tracking.until(lambda: tracking.said("cannot be found"))
    tracking.until(lambda: not tracking.controller.recording)
    assert not Path(tracking.backend.engine.log_path or "none").exists()


def test_a_rig_that_differs_from_its_file_is_marked_and_saved(make_bench, tmp_path):
    path = tmp_path / "desk.json"
    save_rig(path, synthetic_rig())
    bench = make_bench()
    bench.window.open_rig(path)
    bench.until(lambda: bench.controller.rig is not None)
    label, action = bench.window.toolbar.rig_label, bench.window.actions_.save_rig
    bench.until(lambda: label.text().strip() == "rig: test bench" and not action.isEnabled())
    bench.backend.engine.rig = synthetic_rig("moved cameras")
    bench.let_pass(2.0)
    bench.until(lambda: label.text().strip() == "rig: moved cameras (edited)" and action.isEnabled())
    assert bench.controller.rig.name == "moved cameras" and load_rig(path).name == "test bench"
    bench.press(Qt.Key.Key_S, modifier=Qt.KeyboardModifier.ControlModifier)
    bench.until(lambda: label.text().strip() == "rig: moved cameras" and not action.isEnabled())
    assert load_rig(path).name == "moved cameras"
    bench.until(lambda: bench.said(f"saved to {path}"))


def test_slow_simulated_cameras_are_told_calmly(tracking):
    tracking.backend.pace = TwinPace(11.2, 40.0)
    tracking.until(lambda: tracking.let_pass(0.5) or tracking.said("11 of 40 Hz"))
    assert not tracking.window.advice.buttons and not tracking.calm
    tracking.backend.pace = None
    tracking.until(lambda: tracking.let_pass(0.5) or (tracking.calm and not tracking.said("11 of 40 Hz")))
    tracking.until(lambda: tracking.window.toolbar.badge.word == "TRACKING")


def test_the_bar_keeps_its_height_while_sentences_come_and_go(bench):
    advice = bench.window.advice
    bench.until(lambda: len(advice.texts) == 1 and advice.parentWidget().height() > 40)
    height = advice.parentWidget().height()
    bench.window.tell(Notice("error", "Something is wrong."))
    bench.window.tell(Notice("info", "Something was done."))
    bench.until(lambda: len(advice.texts) == 2)
    bench.run(0.05)
    assert advice.parentWidget().height() == height
    bench.window.passing.clear()
    bench.until(lambda: not bench.said("wrong"))
    bench.run(0.05)
    assert advice.parentWidget().height() == height


def test_a_long_sentence_takes_both_lines_and_the_others_wait_in_the_menu(bench):
    """As many sentences as before, one of them longer."""
    advice = bench.window.advice
    bench.until(lambda: len(advice.texts) == 1)
    height, label = advice.height(), advice.findChildren(QLabel)[0]
    bench.window.tell(Notice("info", "Something was done."))
    bench.window.tell(Notice("error", "The simulated cameras did not start. " * 5))
    bench.until(lambda: label.height() > 30)
    assert label.height() >= label.heightForWidth(label.width()) and advice.height() == height
    assert advice.waiting[0] == "Something was done."


def test_what_was_done_comes_first_then_yields_then_goes():
    passing, done, failed = TransientNotices(), Notice("info", "done"), Notice("error", "failed")
    alarm = Notice("error", "alarm", subject="recording")
    passing.show(done, 100.0)
    passing.show(failed, 101.0)
    assert passing.among([alarm], 109.9) == [failed, done, alarm]
    assert passing.among([alarm], 110.0) == [failed, alarm, done]
    passing.show(done, 111.0)
    assert passing.among([alarm], 115.9) == [done, failed, alarm]
    assert passing.among([alarm], 116.1) == [done, alarm, failed]
    assert passing.among([alarm], 130.0) == [alarm, done, failed]
    assert passing.among([alarm], 161.0) == [alarm, done] and passing.among([alarm], 171.0) == [alarm]


def test_a_sentence_stands_once_where_it_is_most_urgent():
    passing, failed = TransientNotices(), Notice("error", "It is gone.")
    passing.show(failed, 100.0)
    standing = [Notice("warning", "It is dark.", subject="sight"), replace(failed, subject="tracking")]
    assert [notice.text for notice in passing.among(standing, 101.0)] == ["It is gone.", "It is dark."]
    assert [notice.text for notice in passing.among(standing[:1], 120.0)] == ["It is dark.", "It is gone."]
