"""The page of recordings as a person uses it: look, open, rename, delete, take back."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from fake_backend import InProcessSolver
from person import Person
from PySide6.QtCore import QModelIndex, Qt
from PySide6.QtGui import QDesktopServices
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QLineEdit, QWidget

from rhot_app.errors import RecordingError
from rhot_app.project import Rig
from rhot_app.recording.raw_log import CONTINUES, LogReader, RecordKind, encode_header, encode_record
from rhot_app.recording.recorder import Recorder
from rhot_app.recording.video import Collected
from rhot_app.ui.models.palette import DARK
from rhot_app.ui.replay.library import BAR_PARTS, TRASH, Library, Summary, summarise_log
from rhot_app.ui.replay.library_table import BAR, LENGTH, NAME, RIG
from rhot_app.ui.replay.library_window import LibraryWindow
from rhot_app.ui.replay.run import NO_STATE, TRACKING
from rhot_node.video.recorder import VideoInfo


class Shelf(Person):
    """A person in front of the page."""

    def __init__(self, folder: Path, cache: Path) -> None:
        self.rig: Rig | None = None
        self.opened: list[Path] = []
        super().__init__(LibraryWindow(DARK, folder, cache, rig=lambda: self.rig, make_solver=InProcessSolver))
        self.window.open_asked.connect(self.opened.append)
        self.until(lambda: not self.window.listing)

    @property
    def names(self) -> list[str]:
        return [self.text(row, NAME) for row in range(len(self.window.table.records))]

    def text(self, row: int, column: int) -> str:
        return self.window.table.text(row, column)

    def index(self, name: str, column: int) -> QModelIndex:
        return self.window.table.records_model.index(self.names.index(name), column)

    def choose(self, name: str) -> None:
        self.window.table.setFocus()
        index = self.index(name, NAME)
        self.click(self.window.table.viewport(), self.window.table.visualRect(index).center())

    def type_name(self, name: str) -> None:
        edit = self.window.table.findChild(QLineEdit)
        edit.selectAll()
        QTest.keyClicks(edit, name)
        QTest.keyClick(edit, Qt.Key.Key_Return)


@pytest.fixture
def folder(log: Path) -> Path:
    """Three recordings: a hand that grasps, one of nothing, and a file of a later version."""
    reader = LogReader(log)
    reader.close()
    (log.parent / "nothing.rhotlog").write_bytes(encode_header(reader.rig, {"created": "2026-01-02T03:04:05+00:00"}))
    later = bytearray(log.read_bytes())
    later[8] = 99
    at = later.find(b"RHOTLOG", 10)
    later[at + 8] = 99
    (log.parent / "later.rhotlog").write_bytes(later)
    return log.parent


@pytest.fixture
def make_shelf(themed: Any) -> Iterator[Callable[[Path, Path], Shelf]]:
    shelves: list[Shelf] = []

    def make(folder: Path, cache: Path) -> Shelf:
        shelves.append(Shelf(folder, cache))
        return shelves[-1]

    yield make
    for shelf in shelves:
        shelf.window.close()
        shelf.window.deleteLater()


@pytest.fixture(scope="module")
def summary(grasp_log: Path) -> Summary:
    """Of the hand that grasps."""
    return summarise_log(grasp_log)


@pytest.fixture
def shelf(make_shelf: Callable[[Path, Path], Shelf], folder: Path, log: Path, summary: Summary,
          tmp_path: Path) -> Shelf:
    """The page, with what was found out about the recordings before."""
    Library(folder, tmp_path / "cache").keep_summary(log, summary)
    return make_shelf(folder, tmp_path / "cache")


GRASP = "2026-05-01_10-00-00"


def test_recordings_are_listed_with_rig_length_and_condition(make_shelf, folder, tmp_path):
    shelf = make_shelf(folder, tmp_path / "cache")
    window = shelf.window
    assert sorted(shelf.names) == sorted([GRASP, "nothing", "later"])
    assert shelf.names[-1] == "nothing", "the newest first"
    grasp, nothing, later = (shelf.names.index(name) for name in (GRASP, "nothing", "later"))
    shelf.until(lambda: shelf.text(grasp, LENGTH))
    assert shelf.text(grasp, LENGTH) == "0:04" and shelf.text(grasp, RIG)
    codes = np.array(shelf.index(GRASP, BAR).data(Qt.ItemDataRole.UserRole))
    assert len(codes) == BAR_PARTS and (codes == TRACKING).sum() > BAR_PARTS // 2
    shelf.until(lambda: shelf.text(nothing, LENGTH) == "0:00")
    assert "no datagrams" in shelf.index("nothing", BAR).data(Qt.ItemDataRole.ToolTipRole)
    assert shelf.text(later, BAR) == "cannot be read"
    shelf.choose("later")
    assert "version 99" in window.sentence.text() and not window.open_button.isEnabled()


def test_a_summary_is_made_once(make_shelf, log, summary, tmp_path, monkeypatch):
    def never(*args: Any, **options: Any) -> None:
        raise RecordingError("made again")

    Library(log.parent, tmp_path / "cache").keep_summary(log, summary)
    monkeypatch.setattr(InProcessSolver, "run", never)
    shelf = make_shelf(log.parent, tmp_path / "cache")
    shelf.until(lambda: shelf.text(0, LENGTH) == "0:04")


def test_a_recording_is_opened_by_button_and_by_double_click(shelf, log):
    shelf.choose(GRASP)
    shelf.click(shelf.window.open_button)
    index = shelf.index(GRASP, NAME)
    QTest.mouseDClick(shelf.window.table.viewport(), Qt.MouseButton.LeftButton,
                      pos=shelf.window.table.visualRect(index).center())
    QTest.keyClick(shelf.window.table, Qt.Key.Key_Return)
    assert shelf.opened == [log] * 3


def test_a_recording_is_renamed(shelf, log):
    renamed = []
    shelf.window.renamed.connect(lambda before, after: renamed.append((before, after)))
    shelf.choose(GRASP)
    shelf.click(shelf.window.rename_button)
    shelf.type_name("thumb test")
    shelf.until(lambda: "thumb test" in shelf.names)
    assert renamed == [(log, log.with_name("thumb test.rhotlog"))] and not log.exists()
    shelf.until(lambda: shelf.window.table.chosen_entry.path.stem == "thumb test")


@pytest.mark.parametrize(("name", "why"), [("nothing", "already"), ("a/b", "no name for a recording"),
                                           ("", "no name for a recording")])
def test_a_name_that_cannot_be_is_refused_in_a_sentence(shelf, log, name, why):
    shelf.choose(GRASP)
    QTest.keyClick(shelf.window.table, Qt.Key.Key_F2)
    edit = shelf.window.table.findChild(QLineEdit)
    edit.clear()
    shelf.type_name(name)
    shelf.until(lambda: why in shelf.window.sentence.text() and not shelf.window.listing)
    assert log.exists() and GRASP in shelf.names


def test_a_name_that_is_being_typed_stays_when_a_summary_comes(shelf, log, summary):
    shelf.choose(GRASP)
    shelf.click(shelf.window.rename_button)
    edit = shelf.window.table.findChild(QLineEdit)
    edit.selectAll()
    QTest.keyClicks(edit, "half a na")
    shelf.window.table.show_summary(log, summary, "")
    assert edit.text() == "half a na"
    QTest.keyClick(edit, Qt.Key.Key_Escape)


def test_a_deleted_recording_comes_back(shelf, log, folder):
    shelf.choose(GRASP)
    shelf.click(shelf.window.delete_button)
    shelf.until(lambda: GRASP not in shelf.names)
    assert not log.exists() and len(list((folder / TRASH).iterdir())) == 1
    assert f"Deleted {GRASP}" in shelf.window.sentence.text()
    shelf.choose("nothing")
    QTest.keyClick(shelf.window.table, Qt.Key.Key_Delete)
    shelf.until(lambda: shelf.names == ["later"])
    shelf.click(shelf.window.undo_button)
    shelf.until(lambda: "nothing" in shelf.names)
    shelf.window.table.setFocus()
    QTest.keyClick(shelf.window.table, Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    shelf.until(lambda: GRASP in shelf.names and log.exists())
    shelf.until(lambda: not shelf.window.undo_button.isEnabled())
    assert shelf.window.table.chosen_entry.path == log


def test_closing_the_page_makes_an_end_of_what_was_deleted(shelf, log, folder):
    shelf.choose(GRASP)
    shelf.click(shelf.window.delete_button)
    shelf.until(lambda: GRASP not in shelf.names)
    shelf.click(shelf.window.close_button)
    assert not (folder / TRASH).exists() and not log.exists() and (folder / "nothing.rhotlog").exists()


def test_what_is_being_recorded_is_left_alone(shelf, folder, log):
    reader = LogReader(log)
    reader.close()
    recorder = Recorder(folder / "now.rhotlog", reader.rig)
    try:
        shelf.window.refresh()
        shelf.until(lambda: "now" in shelf.names)
        shelf.choose("now")
        shelf.click(shelf.window.delete_button)
        assert "now is being recorded" in shelf.window.sentence.text() and recorder.path.exists()
        with pytest.raises(RecordingError, match="being recorded"):
            shelf.window.library.rename(recorder.path, "then")
    finally:
        recorder.close()


def test_a_part_is_shown_as_what_it_is(make_shelf, folder, log, tmp_path):
    reader = LogReader(log)
    reader.close()
    (folder / f"{GRASP}-part2.rhotlog").write_bytes(encode_header(reader.rig, {CONTINUES: log.name}))
    shelf = make_shelf(folder, tmp_path / "cache")
    shelf.choose(GRASP)
    assert not shelf.window.sentence.text()
    shelf.choose(f"{GRASP}-part2")
    assert "continues" in shelf.window.sentence.text() and GRASP in shelf.window.sentence.text()


def test_the_folder_is_opened_or_named(shelf, folder, monkeypatch):
    monkeypatch.setattr(QDesktopServices, "openUrl", lambda url: False)
    shelf.click(shelf.window.folder_button)
    assert str(folder) in shelf.window.sentence.text()


def test_an_empty_folder_says_what_to_do(make_shelf, tmp_path):
    shelf = make_shelf(tmp_path / "none", tmp_path / "cache")
    shelf.until(shelf.window.empty.isVisible)
    assert "Press Record" in shelf.window.empty.label.text() and not shelf.window.open_button.isEnabled()


def test_a_hand_that_is_gone_shows_in_the_bar(grasp_log, tmp_path):
    """From the middle of the recording on no camera sends anything for a while."""
    reader = LogReader(grasp_log)
    records = list(reader)
    reader.close()
    times = [record.t_master_ns for record in records if record.kind is RecordKind.DATAGRAM]
    begin, end = times[len(times) // 2], times[3 * len(times) // 4]
    kept = [record for record in records if record.kind is not RecordKind.DATAGRAM
            or not begin < record.t_master_ns < end]
    log = tmp_path / "gap.rhotlog"
    log.write_bytes(encode_header(reader.rig, {}) + b"".join(encode_record(record) for record in kept))
    codes = np.array(summarise_log(log).conditions)
    gap = codes == NO_STATE
    assert 20 < gap.sum() < 60 and gap[150:170].all() and (codes[20:110] == TRACKING).any()


def test_a_summary_is_made_anew_for_another_file(folder, tmp_path, log, summary):
    library = Library(folder, tmp_path / "cache")
    library.keep_summary(log, summary)
    assert library.known_summary(log) == summary
    assert library.known_summary(library.rename(log, "other")) == summary
    log.write_bytes((folder / "other.rhotlog").read_bytes()[:-1])
    assert library.known_summary(log) is None


def test_a_recording_made_meanwhile_is_there_when_the_page_is_looked_at_again(shelf, folder, log, qtbot):
    other = QWidget()
    qtbot.addWidget(other)
    other.show()
    other.activateWindow()
    assert QTest.qWaitForWindowActive(other)
    (folder / "new.rhotlog").write_bytes(log.read_bytes())
    shelf.window.activateWindow()
    shelf.until(lambda: "new" in shelf.names)


@pytest.fixture
def filmed(log: Path) -> Path:
    """A recording whose nodes recorded video, with one of them collected; of its neighbour, too."""
    path = log.with_name("filmed.rhotlog")
    path.write_bytes(encode_header(LogReader(log).rig, {"video": "20261124T231500Z-5f3a9c01"}))
    for name in ("filmed.left.avi", "filmed.left.csv", "filmed.right.avi.part", "filmed.left.too.avi", "filmed.txt"):
        path.with_name(name).write_bytes(name.encode())
    return path


def test_videos_go_where_their_recording_goes(filmed, tmp_path):
    library = Library(filmed.parent, tmp_path / "cache")
    ours = ["left.avi", "left.csv", "right.avi.part"]

    def there(stem: str, folder: Path = filmed.parent) -> list[bool]:
        return [(folder / f"{stem}.{name}").exists() for name in ours]
    other = filmed.with_name("taken.left.avi")
    other.write_bytes(b"of a recording that is gone")
    with pytest.raises(RecordingError, match="videos of another recording called taken"):
        library.rename(filmed, "taken")
    assert other.read_bytes() == b"of a recording that is gone" and there("filmed") == [True] * 3
    path = library.rename(filmed, "wave")
    assert there("wave") == [True] * 3 and there("filmed") == [False] * 3
    assert path.with_name("wave.left.avi").read_bytes() == b"filmed.left.avi"
    assert filmed.with_name("filmed.left.too.avi").exists() and filmed.with_name("filmed.txt").exists()
    library.delete(path)
    assert there("wave") == [False] * 3 and there("wave", filmed.parent / TRASH) == [True] * 3
    library.undo()
    assert there("wave") == [True] * 3
    library.delete(path)
    library.empty_trash()
    assert not (filmed.parent / TRASH).exists()


def test_videos_are_collected_in_the_background(shelf, filmed, monkeypatch):
    window, going = shelf.window, threading.Event()
    asked: list[tuple[Path, str]] = []

    def collect(log: Path, rig: Any, own: Any, *, progress: Any) -> list[Any]:
        asked.append((log, rig.nodes[0].address))
        while not going.wait(0.01):
            progress("video of left", 0.5)
        info = VideoInfo("a", 10, 3, 100, "")
        return [Collected("left", log.with_name("filmed.left.avi"), info)]
    monkeypatch.setattr("rhot_app.ui.replay.library_window.collect_videos", collect)
    window.refresh()
    shelf.until(lambda: "filmed" in shelf.names)
    shelf.choose(GRASP)
    assert not window.video_button.isEnabled(), "it has none"
    shelf.choose("filmed")
    shelf.click(window.video_button)
    shelf.until(lambda: window.strip.isVisible() and "video of left" in window.strip.label.text())
    assert not window.video_button.isEnabled()
    shelf.click(window.strip.cancel_button)
    shelf.until(lambda: not window.strip.isVisible() and window.video_button.isEnabled())
    going.set()
    moved = msgspec.structs.replace(LogReader(filmed).rig.nodes[0], address="10.0.0.7")
    shelf.rig = msgspec.structs.replace(LogReader(filmed).rig, nodes=(moved,))
    shelf.click(window.video_button)
    shelf.until(lambda: "Collected filmed.left.avi" in window.sentence.text())
    assert "3 frames" in window.sentence.text() and not window.strip.isVisible()
    assert [log for log, _ in asked] == [filmed] * 2 and asked[1][1] == "10.0.0.7"

    def fail(*args: Any, **options: Any) -> None:
        raise RecordingError("node left does not answer.")
    monkeypatch.setattr("rhot_app.ui.replay.library_window.collect_videos", fail)
    shelf.click(window.video_button)
    shelf.until(lambda: "left does not answer" in window.sentence.text() and window.video_button.isEnabled())
