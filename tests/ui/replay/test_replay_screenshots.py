"""Pictures of the replay and of the page of recordings for the guide; see tests/ui/test_screenshots.py."""

from __future__ import annotations

import shutil
import time
from pathlib import Path
from typing import Any

import pytest
from patience import PATIENCE_S
from PySide6.QtTest import QTest
from screen_pictures import SIZE, check, picture_of

from rhot_app.evaluation.data_sets import LOG_NAME, Order, data_set
from rhot_app.evaluation.fault_injection import silent
from rhot_app.recording.bookmarks import Bookmark, append_bookmark
from rhot_app.recording.raw_log import LogReader, encode_header, encode_record
from rhot_app.simulator.scene.scene import make_scene, twin_defaults
from rhot_app.ui.common.settings import Settings
from rhot_app.ui.models.palette import DARK
from rhot_app.ui.replay.library_window import LibraryWindow
from rhot_app.ui.replay.session import TrackerChoice
from rhot_app.ui.replay.window import ReplayWindow


def until(condition: Any) -> None:
    end = time.monotonic() + 2 * PATIENCE_S
    while time.monotonic() < end and not condition():
        QTest.qWait(10)
    assert condition()


@pytest.fixture(scope="module")
def recordings(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with three recordings, one of them with bookmarks, one of a camera that fell silent for a while."""
    folder = tmp_path_factory.mktemp("recordings")
    for name, motion, seconds in (("two cups", "grasp", 12.0), ("pinch, first try", "pinch", 6.0)):
        order = Order(make_scene(twin_defaults(), 5), motion, seconds, sketched=True)
        shutil.copy(data_set(order, tmp_path_factory.mktemp("takes")).folder / LOG_NAME, folder / f"{name}.rhotlog")
    reader = LogReader(folder / "two cups.rhotlog")
    records = list(reader)
    reader.close()
    first_ns = records[-1].t_master_ns - 12_000_000_000
    append_bookmark(reader.path, Bookmark(first_ns + 3_000_000_000, "reaches for the first cup"))
    append_bookmark(reader.path, Bookmark(first_ns + 8_000_000_000, "second cup"))
    (folder / "right camera unplugged.rhotlog").write_bytes(
        encode_header(reader.rig, {}) + b"".join(encode_record(one) for one in silent(records, 2, 4.0, 7.0)))
    return folder


def test_the_replay(themed, recordings, tmp_path):
    window = ReplayWindow(Settings(tmp_path / "app.ini"), DARK, tmp_path / "states")
    window.resize(SIZE)
    window.show()
    log = recordings / "two cups.rhotlog"
    window.open(log)
    until(lambda: window.replay is not None)
    window.work.start(log, TrackerChoice("estimator", beside=True))
    until(lambda: window.replay.second is not None)
    window.seek(9.5)
    window._loop("end")
    window.seek(6.5)
    window._loop("begin")
    window.seek(7.6)
    until(lambda: window.parts.scene._state is not None and window.parts.pacer.cost_s > 0.0)
    QTest.qWait(700)
    window.parts.scene.frame_hand()
    QTest.qWait(700)
    check("replay", picture_of(window), 60)
    window.close()
    window.deleteLater()


def test_the_page_of_recordings(themed, recordings, tmp_path):
    window = LibraryWindow(DARK, recordings, tmp_path / "cache")
    window.resize(1080, 400)
    window.show()
    until(lambda: len(window.table.entries) == 3)
    until(lambda: all(window.summaries.of(entry.path) is not None for entry in window.table.entries))
    QTest.qWait(300)
    check("recordings", picture_of(window), 12)
    window.close()
    window.deleteLater()
