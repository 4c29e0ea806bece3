"""The replay as a person uses it: open a recording, play, step, scrub, loop, bookmark, track again, compare."""

from __future__ import annotations

import itertools
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fake_backend import InProcessSolver
from person import Person
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QFileDialog, QLineEdit

from rhot_app.hand.anatomy import load_hand
from rhot_app.recording.bookmarks import Bookmark, append_bookmark, read_bookmarks
from rhot_app.ui.common.settings import Settings
from rhot_app.ui.models.pacing import FramePacer
from rhot_app.ui.models.palette import DARK
from rhot_app.ui.replay.timeline import FLAG_PX
from rhot_app.ui.replay.window import ReplayWindow
from rhot_node.files import resource_path


class Desk(Person):
    """A person in front of a replay's window, and time that passes at once."""

    def __init__(self, folder: Path) -> None:
        self.states = folder / "states"
        self._passed_s = 0.0
        super().__init__(ReplayWindow(Settings(folder / "app.ini"), DARK, self.states, make_solver=InProcessSolver,
                                      clock=lambda: time.monotonic() + self._passed_s))
        self.window.parts.pacer = FramePacer(most_hz=8.0)

    def let_pass(self, seconds: float) -> None:
        self._passed_s += seconds
        self.window.tick()

    def told(self) -> Any:
        return self.window.advice.texts

    def said(self, *words: str) -> bool:
        """Whether one of the sentences at the bottom has all these words."""
        return any(all(word in text for word in words) for text in self.window.advice.texts)

    def open(self, path: Path) -> None:
        self.window.open(path)
        self.until(lambda: not self.window.work.running)
        assert self.window.replay is not None and self.window.replay.path == path

    def scrub(self, begin_s: float, *ends_s: float) -> None:
        """Drag over the timeline."""
        line = self.window.parts.timeline
        self.drag(line, *(QPoint(round(line.x_of(s)), FLAG_PX + 10) for s in (begin_s, *ends_s)))

    @property
    def position_s(self) -> float:
        return self.window.replay.player.position_s

    @property
    def drawn_ns(self) -> int | None:
        """The moment of the hand in the scene."""
        state = self.window.parts.scene.state
        return None if state is None else state.t_master_ns

    def number(self) -> int:
        """The state that the window names."""
        return int(self.window.parts.transport.place.text().split("state ")[1].split(" of ")[0])


@pytest.fixture(scope="module")
def one_desk(themed: Any, tmp_path_factory: pytest.TempPathFactory, grasp_log: Path) -> Iterator[Desk]:
    """One window for all tests."""
    folder = tmp_path_factory.mktemp("desk")
    desk = Desk(folder)
    log = folder / "grasp.rhotlog"
    log.write_bytes(grasp_log.read_bytes())
    desk.open(log)
    yield desk
    desk.window.close()
    assert not list(desk.states.iterdir())
    desk.window.deleteLater()


@pytest.fixture
def desk(one_desk: Desk) -> Desk:
    """The recording at its beginning, one run, nothing repeated."""
    window = one_desk.window
    player = window.replay.player
    player.pause()
    player.clear_loop()
    player.seek(0.0)
    player.speed = 1.0
    window.passing.clear()
    window.stop_comparing()
    window.setFocus()
    window.tick()
    return one_desk


def test_a_recording_is_shown_with_its_name(desk):
    window = desk.window
    assert "grasp.rhotlog" in window.toolbar.name.text() and "grasp.rhotlog" in window.windowTitle()
    assert window.toolbar.word.text() == "REPLAY"
    assert desk.window.parts.transport.place.text().startswith("0:00.00 of 0:03.9")
    assert not list(desk.states.iterdir()), "the states' file has no name any more"
    assert window.parts.timeline.codes is not None and len(window.parts.timeline.codes) > 500
    assert "tracking" in window.parts.timeline.tool_tip_at(window.parts.timeline.x_of(2.0))


def test_space_plays_and_pauses(desk):
    desk.press(Qt.Key.Key_Space)
    desk.let_pass(0.5)
    desk.until(lambda: desk.position_s > 0.5 and desk.window.toolbar.badge.word in ("TRACKING", "PARTIAL"))
    desk.press(Qt.Key.Key_Space)
    stood = desk.position_s
    desk.let_pass(0.5)
    assert desk.position_s == stood
    desk.until(lambda: desk.drawn_ns == desk.window.replay.run.tracked.times_ns[desk.window.replay.player.number])


def test_it_plays_to_the_end_and_begins_again(desk):
    box = desk.window.parts.transport.speed_box
    box.setCurrentIndex(box.findData(4.0))
    box.activated.emit(box.currentIndex())
    desk.click(desk.window.parts.transport.play_button)
    desk.let_pass(0.5)
    assert 2.0 < desk.position_s < 3.9, "four times as fast"
    desk.let_pass(0.6)
    desk.until(lambda: desk.window.replay.player.at_end)
    desk.until(lambda: not desk.window.parts.transport.is_playing)
    desk.click(desk.window.parts.transport.play_button)
    assert desk.position_s < 2.0 and desk.window.replay.player.playing


def test_a_click_leaves_the_space_bar_to_the_player(desk):
    desk.click(desk.window.parts.transport.on_button)
    desk.press(Qt.Key.Key_Space)
    assert desk.window.replay.player.playing


def test_arrows_go_from_state_to_state(desk):
    times = desk.window.replay.run.tracked.times_ns
    for _ in range(3):
        desk.press(Qt.Key.Key_Right)
    desk.until(lambda: desk.number() == 4 and desk.drawn_ns == times[3])
    desk.press(Qt.Key.Key_Left)
    desk.until(lambda: desk.number() == 3 and desk.drawn_ns == times[2])
    desk.press(Qt.Key.Key_End)
    desk.until(lambda: desk.number() == len(times) and desk.drawn_ns == times[-1])
    desk.press(Qt.Key.Key_Home)
    desk.until(lambda: desk.number() == 1)
    row = desk.window.parts.transport
    for button, number in ((row.on_button, 2), (row.last_button, len(times)), (row.back_button, len(times) - 1),
                           (row.first_button, 1)):
        desk.click(button)
        desk.until(lambda number=number: desk.number() == number)


def test_arrows_step_although_the_scene_has_the_focus(desk):
    desk.window.parts.scene.setFocus()
    view = desk.window.parts.scene.cameraParams()
    QTest.keyClick(desk.window.parts.scene, Qt.Key.Key_Right)
    desk.until(lambda: desk.number() == 2)
    assert desk.window.parts.scene.cameraParams() == view


def test_scrubbing_goes_there_at_once(desk):
    desk.scrub(1.0, 2.0, 3.0)
    assert abs(desk.position_s - 3.0) < 0.02
    number = desk.window.replay.player.number
    desk.until(lambda: desk.drawn_ns == desk.window.replay.run.tracked.times_ns[number])
    jitter = desk.window.parts.jitter
    desk.until(lambda: jitter.seconds.size and jitter.seconds[0] > -3.2)
    desk.scrub(0.5)
    desk.until(lambda: jitter.seconds.size and jitter.seconds[0] > -0.6)


def test_a_range_is_repeated(desk):
    desk.scrub(1.0)
    desk.press(Qt.Key.Key_BracketLeft)
    desk.scrub(1.4)
    desk.press(Qt.Key.Key_BracketRight)
    begin, end = desk.window.replay.player.loop
    assert abs(begin - 1.0) < 0.02 and abs(end - 1.4) < 0.02
    desk.press(Qt.Key.Key_Space)
    seen = []
    for _ in range(10):
        desk.let_pass(0.1)
        seen.append(desk.position_s)
    assert any(b < a for a, b in itertools.pairwise(seen))
    assert min(seen) >= begin - 1e-9 and max(seen) <= end + 1e-9
    desk.until(desk.window.parts.transport.loop_clear_button.isEnabled)
    desk.click(desk.window.parts.transport.loop_clear_button)
    desk.let_pass(0.5)
    assert desk.position_s > end + 0.05


def test_a_bookmark_is_set_found_and_removed(desk):
    window = desk.window
    desk.scrub(2.0)
    at_s = desk.position_s
    desk.press(Qt.Key.Key_B)
    edit = window.bookmarks.dialog.findChild(QLineEdit)
    QTest.keyClicks(edit, "thumb behind the palm")
    QTest.keyClick(edit, Qt.Key.Key_Return)
    desk.until(lambda: window.replay.bookmarks)
    (mark,) = read_bookmarks(window.replay.path)
    assert mark.text == "thumb behind the palm"
    assert abs(window.replay.seconds_of(mark.t_master_ns) - at_s) < 1e-6
    desk.press(Qt.Key.Key_Home)
    window.toolbar.menu.actions()[0].trigger()
    assert abs(desk.position_s - at_s) < 1e-6 and "0:0" in window.toolbar.menu.actions()[0].text()
    desk.press(Qt.Key.Key_Home)
    line = window.parts.timeline
    assert "thumb behind the palm" in line.tool_tip_at(line.x_of(at_s) + 2)
    desk.click(line, QPoint(round(line.x_of(at_s)) + 3, 5))
    assert abs(desk.position_s - at_s) < 1e-6, "a click on a flag meets it exactly"
    desk.until(window.toolbar.remove.isEnabled)
    window.toolbar.remove.trigger()
    desk.until(lambda: not window.replay.bookmarks)
    assert read_bookmarks(window.replay.path) == []


def test_a_bookmark_that_cannot_be_written_is_said(desk, monkeypatch):
    def refuse(path: Path, mark: Bookmark) -> None:
        raise OSError("the disk is full")

    monkeypatch.setattr("rhot_app.ui.replay.toolbar.append_bookmark", refuse)
    desk.click(desk.window.parts.transport.bookmark_button)
    edit = desk.window.bookmarks.dialog.findChild(QLineEdit)
    QTest.keyClicks(edit, "x")
    QTest.keyClick(edit, Qt.Key.Key_Return)
    desk.until(lambda: desk.said("disk is full"))
    assert desk.window.replay.bookmarks == []


def test_two_runs_are_compared_side_by_side(desk):
    window = desk.window
    window.toolbar.compare.trigger()
    dialog = window.dialog
    dialog.tracker_box.setCurrentIndex(dialog.tracker_box.findData("estimator"))
    desk.click(dialog.start_button)
    desk.until(lambda: window.replay.second is not None)
    assert window.replay.run.rig.tracker.kind == "classic" and window.replay.second.rig.tracker.kind == "estimator"
    desk.scrub(2.5)
    desk.until(lambda: desk.drawn_ns == window.replay.run.tracked.times_ns[window.replay.player.number])
    first, second = (actors.hands[0].items[3] for actors in (window.parts.scene.actors, window.parts.scene.second))
    assert first.visible() and second.visible()
    assert 0 < second.colours[:, 3].max() < first.colours[:, 3].max()
    assert abs(np.mean(first.vertices - second.vertices)) < 0.02
    desk.until(window.parts.difference.isVisible)
    desk.until(lambda: [values[0] != "–" for values in window.parts.difference.legend.values] == [True] * 5)
    desk.until(lambda: desk.said("Solid: as recorded", "translucent: estimator"))
    window.toolbar.alone.trigger()
    assert window.parts.scene.second is None and window.replay.second is None
    assert not window.parts.difference.isVisible()


def test_it_is_tracked_again_with_another_hand_at_the_same_moment(desk, tmp_path, monkeypatch):
    window = desk.window
    desk.scrub(3.0)
    at_ns = window.replay.position_ns
    path = resource_path("hands", "left.json")
    monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *args: (str(path), ""))
    window.toolbar.again.trigger()
    desk.click(window.dialog.hand_choice.choose_button)
    assert window.dialog.hand_choice.label.text() == "left.json"
    desk.click(window.dialog.start_button)
    desk.until(lambda: window.replay.choice.hand is not None)
    assert window.replay.run.rig.hand == load_hand(path) and abs(window.replay.position_ns - at_ns) < 2
    desk.until(lambda: desk.said("Tracked", "left.json"))
    window.toolbar.again.trigger()
    desk.click(window.dialog.start_button)
    desk.until(lambda: window.replay.choice.hand is None)


def test_a_rig_file_that_is_none_is_said_and_the_run_stays(desk, tmp_path, monkeypatch):
    window, before = desk.window, desk.window.replay.run
    path = tmp_path / "broken.json"
    path.write_text("{}")
    monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *args: (str(path), ""))
    window.toolbar.again.trigger()
    desk.click(window.dialog.rig_choice.choose_button)
    desk.click(window.dialog.start_button)
    desk.until(lambda: desk.said(str(path)))
    assert window.replay.run is before


def test_tracking_can_be_cancelled(desk):
    window, before = desk.window, desk.window.replay.run
    window.toolbar.again.trigger()
    desk.click(window.dialog.start_button)
    desk.click(window.strip.cancel_button)
    desk.until(lambda: not window.strip.isVisible())
    desk.until(lambda: not list(desk.states.iterdir()))
    assert window.replay.run is before


def test_files_that_are_no_recordings_are_said(desk, tmp_path):
    window, before = desk.window, desk.window.replay.path
    foreign = tmp_path / "notes.txt"
    foreign.write_text("shopping")
    window.open(foreign)
    desk.until(lambda: desk.said("notes.txt", "raw log"))
    assert window.replay.path == before


def test_a_torn_recording_is_played_and_said(desk, log):
    before = desk.window.replay.path
    log.write_bytes(log.read_bytes()[:-9])
    desk.open(log)
    desk.until(lambda: desk.said("torn"))
    desk.press(Qt.Key.Key_End)
    desk.until(lambda: desk.drawn_ns is not None)
    desk.open(before)


def test_bookmarks_of_the_recording_are_there(desk, log):
    before, first_ns = desk.window.replay.path, int(desk.window.replay.run.tracked.times_ns[0])
    append_bookmark(log, Bookmark(first_ns + 1_500_000_000, "set while recording"))
    desk.open(log)
    assert desk.window.toolbar.menu.actions()[0].text().split("  ") == ["0:01.50", "set while recording"]
    desk.open(before)


def test_the_window_stays_quick(desk):
    """No tick may hold the window for long; other programs may hold it."""
    costs = []
    desk.press(Qt.Key.Key_Space)
    for _ in range(30):
        begin = time.thread_time()
        desk.let_pass(0.1)
        costs.append(time.thread_time() - begin)
    assert sorted(costs)[len(costs) // 2] < 0.05
