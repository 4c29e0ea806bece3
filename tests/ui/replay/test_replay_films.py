"""The replay's pictures, its export and its trim, as a person uses them."""

from __future__ import annotations

import contextlib
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from film_writing import LEVELS, write_film
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QFileDialog
from test_replay_window import Desk

from rhot_app.recording.raw_log import LogReader
from rhot_app.recording.video import video_path
from rhot_app.sources.replay import LogValidator
from rhot_app.tracking.tracker import CameraObservations


@pytest.fixture(scope="module")
def filmed(grasp_log: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The recording with the video of its first camera."""
    log = tmp_path_factory.mktemp("filmed") / "grasp.rhotlog"
    shutil.copy(grasp_log, log)
    with contextlib.closing(LogReader(log)) as reader:
        door = LogValidator(reader.rig)
        frames = [frame for record in reader if isinstance(frame := door.feed(record), CameraObservations)]
        write_film(video_path(log, reader.rig.nodes[0].name),
                   [frame.t_row0_node_ns for frame in frames if frame.camera == 0])
    return log


@pytest.fixture
def desk(themed: Any, filmed: Path, tmp_path: Path) -> Iterator[Desk]:
    for path in filmed.parent.iterdir():
        shutil.copy(path, tmp_path / path.name)
    desk = Desk(tmp_path)
    desk.open(tmp_path / filmed.name)
    yield desk
    desk.window.close()
    desk.window.deleteLater()


def shown_picture(desk: Desk) -> int:
    """The number of the picture on the screen, by its brightness near a corner, where there are no bones."""
    [view] = [view for view in desk.window.parts.films.views.values() if view.isVisible()]
    scale = min(view.width() / 640, view.height() / 480)  # it is as large as fits, in the middle
    x, y = view.width() / 2 + 300 * scale, view.height() / 2 + 220 * scale
    return round((view.grab().toImage().pixelColor(round(x), round(y)).value() - 30.0) / 5.0)


def test_the_picture_follows_the_moment_with_the_hand_over_it(desk: Desk) -> None:
    films = desk.window.parts.films
    assert films.isVisible() and [name for name, view in films.views.items() if view.isVisible()] == ["left"]
    times_ns = films.films[0].video.times_ns
    for number in (100, 37):
        desk.window.seek(desk.window.replay.seconds_of(int(times_ns[number])))
        desk.until(lambda number=number: shown_picture(desk) == number % LEVELS)
    assert films.views["left"].skeletons, "the hand is tracked at this moment"
    desk.window.seek(0.0)
    desk.window.step(0)
    desk.until(lambda: not films.views["left"].skeletons or desk.window.parts.state is not None)


def test_p_hides_the_pictures_and_the_choice_is_remembered(desk: Desk, tmp_path: Path) -> None:
    desk.press(Qt.Key.Key_P)
    desk.until(lambda: not desk.window.parts.films.isVisible())
    other = Desk(tmp_path)
    other.open(tmp_path / "grasp.rhotlog")
    assert not other.window.parts.films.isVisible() and not other.window.toolbar.pictures.isChecked()
    other.window.close()
    other.window.deleteLater()
    desk.window.activateWindow()
    assert QTest.qWaitForWindowActive(desk.window)
    desk.press(Qt.Key.Key_P)
    desk.until(desk.window.parts.films.isVisible)


def test_a_recording_without_video_says_how_to_get_it(desk: Desk, grasp_log: Path, tmp_path: Path) -> None:
    bare = tmp_path / "bare" / "a.rhotlog"
    bare.parent.mkdir()
    shutil.copy(grasp_log, bare)
    desk.open(bare)
    desk.until(lambda: not desk.window.parts.films.isVisible())
    desk.press(Qt.Key.Key_P)
    desk.press(Qt.Key.Key_P)
    desk.until(lambda: desk.said("No video", "Collect video"))


def test_the_repeated_range_is_saved_with_its_pictures(desk: Desk, tmp_path: Path,
                                                       monkeypatch: pytest.MonkeyPatch) -> None:
    out = tmp_path / "part.rhotlog"
    monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *arguments: (str(out), ""))
    desk.window.toolbar.trim.trigger()
    desk.until(lambda: desk.said("Choose the part first"))
    assert not out.exists()
    desk.window.seek(1.0)
    desk.press(Qt.Key.Key_BracketLeft)
    desk.window.seek(2.0)
    desk.press(Qt.Key.Key_BracketRight)
    desk.window.toolbar.trim.trigger()
    desk.until(lambda: desk.said("Saved", "part.rhotlog"))
    desk.open(out)
    assert 0.9 < desk.window.replay.player.duration_s < 1.1 and desk.window.parts.films.isVisible()


def test_a_trim_that_fails_says_why(desk: Desk, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    nowhere = tmp_path / "nowhere" / "a.rhotlog"
    monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *arguments: (str(nowhere), ""))
    desk.window.seek(1.0)
    desk.press(Qt.Key.Key_BracketLeft)
    desk.window.toolbar.trim.trigger()
    desk.until(lambda: desk.said("nowhere", "does not exist"))


def test_export_begins_as_the_recording_is_shown(desk: Desk, tmp_path: Path) -> None:
    desk.press(Qt.Key.Key_E, modifier=Qt.KeyboardModifier.ControlModifier)
    dialog = desk.window.exporting
    assert dialog is not None and str(tmp_path / "grasp.rhotlog") in dialog.log_label.text()
    assert not dialog.smooth_box.isChecked() and dialog.options().fill_s is None
    dialog.fill_box.setValue(0.3)
    assert dialog.options().fill_s == pytest.approx(0.3)
    desk.until(lambda: dialog.table.records)
    desk.click(dialog.close_button)
    desk.until(lambda: desk.window.exporting is None)
