"""Pictures of the replay and of the page of recordings for the guide; see tests/ui/test_screenshots.py."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from fake_backend import InProcessSolver
from fault_injection import silent
from person import Person
from PySide6.QtCore import Qt
from screen_pictures import SIZE, UPDATE

from rhot_app.evaluation.data_sets import LOG_NAME, Order, data_set
from rhot_app.recording.bookmarks import Bookmark, append_bookmark
from rhot_app.recording.raw_log import LogReader, encode_header, encode_record
from rhot_app.simulator.scene.scene import make_scene, twin_defaults
from rhot_app.ui.common.settings import Settings
from rhot_app.ui.models.palette import DARK
from rhot_app.ui.replay.library_window import LibraryWindow
from rhot_app.ui.replay.session import TrackerChoice
from rhot_app.ui.replay.window import ReplayWindow

PART = 1.0 if UPDATE else 0.25
"""Of the length of the recordings in the pictures."""


@pytest.fixture(scope="module")
def recordings(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with three recordings, one of them with bookmarks, one of a camera that fell silent for a while."""
    folder = tmp_path_factory.mktemp("recordings")
    for name, motion, seconds in (("two cups", "grasp", 12.0), ("pinch, first try", "pinch", 6.0)):
        order = Order(make_scene(twin_defaults(), 5), motion, PART * seconds, sketched=True)
        shutil.copy(data_set(order, tmp_path_factory.mktemp("takes")).folder / LOG_NAME, folder / f"{name}.rhotlog")
    reader = LogReader(folder / "two cups.rhotlog")
    records = list(reader)
    reader.close()
    first_ns = records[-1].t_master_ns - round(12e9 * PART)
    append_bookmark(reader.path, Bookmark(first_ns + round(3e9 * PART), "reaches for the first cup"))
    append_bookmark(reader.path, Bookmark(first_ns + round(8e9 * PART), "second cup"))
    left = silent(records, 2, 4.0 * PART, 7.0 * PART)
    (folder / "right camera unplugged.rhotlog").write_bytes(
        encode_header(reader.rig, {}) + b"".join(encode_record(one) for one in left))
    return folder


def test_the_replay(themed, recordings, tmp_path):
    window = ReplayWindow(Settings(tmp_path / "app.ini"), DARK, tmp_path / "states", make_solver=InProcessSolver)
    window.resize(SIZE)
    person = Person(window)
    log = recordings / "two cups.rhotlog"
    window.open(log)
    person.until(lambda: window.replay is not None)
    window.work.start(log, TrackerChoice("estimator", beside=True))
    person.until(lambda: window.replay.second is not None)
    window.seek(9.5 * PART)
    person.press(Qt.Key.Key_BracketRight)
    window.seek(6.5 * PART)
    person.press(Qt.Key.Key_BracketLeft)
    window.seek(7.6 * PART)
    person.until(lambda: window.parts.scene.state is not None and window.parts.pacer.cost_s > 0.0)
    window.parts.scene.frame_hand()
    badge = window.toolbar.badge
    for width in (1024, SIZE.width()):
        window.resize(width, SIZE.height())
        person.until(lambda width=width: window.width() == width and badge.isVisible()
                     and badge.mapTo(window, badge.rect().topRight()).x() < width)
    assert window.toolbar.height() <= badge.height() + 16
    person.keep("replay", 60)
    window.close()
    window.deleteLater()


def test_the_page_of_recordings(themed, recordings, tmp_path):
    window = LibraryWindow(DARK, recordings, tmp_path / "cache", make_solver=InProcessSolver)
    window.resize(1080, 400)
    person = Person(window)
    person.until(lambda: len(window.table.entries) == 3)
    person.until(lambda: all(window.summaries.of(entry.path) is not None for entry in window.table.entries))
    person.keep("recordings", 12)
    window.close()
    window.deleteLater()
