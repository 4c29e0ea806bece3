"""Exporting a recording from the window: a look at the first rows, a file, a cancel that leaves nothing."""

from __future__ import annotations

import multiprocessing
import os
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pandas
import pytest
from patience import PATIENCE_MS
from PySide6.QtWidgets import QFileDialog, QMessageBox
from screen_pictures import check, picture_of

from rhot_app.evaluation.data_sets import LOG_NAME, Order, data_set
from rhot_app.export.formats import all_formats
from rhot_app.simulator.scene.scene import make_scene, twin_defaults
from rhot_app.ui.dialogs.export_dialog import ExportDialog


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """1.2 s of grasping."""
    order = Order(make_scene(twin_defaults(), 1), "grasp", 1.2, sketched=True)
    return data_set(order, tmp_path_factory.mktemp("takes")).folder / LOG_NAME


@pytest.fixture
def dialog(themed: Any, qtbot: Any, log: Path, tmp_path: Path) -> Iterator[ExportDialog]:
    """Open, with the first rows."""
    copy = tmp_path / "grasp.rhotlog"
    copy.write_bytes(log.read_bytes())
    dialog = ExportDialog(copy, tmp_path)
    qtbot.addWidget(dialog)
    dialog.show()
    qtbot.waitUntil(lambda: bool(dialog.table.records), timeout=PATIENCE_MS)
    yield dialog
    dialog.close()


def choose(box: Any, value: Any) -> None:
    box.setCurrentIndex(box.findData(value))


def cells(dialog: ExportDialog, name: str) -> list[str]:
    """A column of the preview."""
    heads = dialog.table.heads()
    return [dialog.table.text(row, heads.index(name)) for row in range(len(dialog.table.records))]


def test_the_first_rows_follow_the_choices(dialog: ExportDialog, qtbot: Any) -> None:
    assert cells(dialog, "condition")[0] == "SEARCHING" and 100.0 < float(cells(dialog, "index_z_mm")[-1]) < 1000.0
    choose(dialog.units_box, "m")
    dialog.rate_box.setValue(50.0)
    qtbot.waitUntil(lambda: "index_z_m" in dialog.table.heads(), timeout=PATIENCE_MS)
    assert cells(dialog, "time_s")[1] == "0.0200"
    choose(dialog.format_box, "gltf")
    assert dialog.units_box.currentData() == "m" and not dialog.units_box.isEnabled()
    assert dialog.options().units is None and not dialog.options().smooth
    choose(dialog.tracker_box, "classic")
    dialog.smooth_box.setChecked(True)
    assert dialog.options().smooth
    qtbot.waitUntil(lambda: "only the estimator smooths" in dialog.sentence.text(), timeout=PATIENCE_MS)


def test_every_format_can_be_chosen(dialog: ExportDialog) -> None:
    box = dialog.format_box
    assert {box.itemData(k) for k in range(box.count())} == set(all_formats()) and box.currentData() == "csv"


def test_a_file_is_written_in_a_process_of_its_own(dialog: ExportDialog, qtbot: Any, tmp_path: Path) -> None:
    choose(dialog.tracker_box, "classic")
    dialog.rate_box.setValue(25.0)
    dialog.export(tmp_path / "a.csv")
    assert dialog.export_button.text() == "Cancel"
    qtbot.waitUntil(lambda: "Exported" in dialog.sentence.text(), timeout=PATIENCE_MS)
    assert dialog.export_button.text() == "Export …" and not dialog.bar.isVisible()
    assert len(pandas.read_csv(tmp_path / "a.csv")) == pytest.approx(30, abs=1)


def test_a_cancelled_export_leaves_nothing(dialog: ExportDialog, qtbot: Any, tmp_path: Path) -> None:
    dialog.export(tmp_path / "a.csv")
    dialog.export_button.click()
    assert "nothing was written" in dialog.sentence.text()
    qtbot.waitUntil(lambda: not multiprocessing.active_children(), timeout=PATIENCE_MS)
    assert [path.name for path in tmp_path.iterdir()] == ["grasp.rhotlog"]


def test_what_stands_against_it_is_a_sentence(dialog: ExportDialog, qtbot: Any, tmp_path: Path) -> None:
    dialog.export(tmp_path / "nowhere" / "a.csv")
    qtbot.waitUntil(lambda: "nowhere does not exist" in dialog.sentence.text(), timeout=PATIENCE_MS)
    (tmp_path / "other.rhotlog").write_bytes(b"something else")
    dialog.show_log(tmp_path / "other.rhotlog")
    qtbot.waitUntil(lambda: "raw log" in dialog.sentence.text(), timeout=PATIENCE_MS)


def test_picture_of_the_export(dialog: ExportDialog, qtbot: Any) -> None:
    dialog.log_label.setText("/home/me/Documents/RHOT/grasp.rhotlog")
    check("export", picture_of(dialog), 20)


def test_the_menu_opens_it(make_bench: Callable[..., Any]) -> None:
    bench = make_bench()
    bench.window.actions_.export.trigger()
    opened = bench.window.dialogs.export
    bench.until(opened.isVisible)
    assert not opened.export_button.isEnabled() and "Choose a recording" in opened.log_label.text()
    opened.close()


def test_the_newest_recording_and_its_own_rate_are_chosen_to_begin_with(
        themed: Any, qtbot: Any, log: Path, tmp_path: Path) -> None:
    for age_s, name in ((100, "old"), (0, "new"), (200, "older")):
        path = tmp_path / f"{name}.rhotlog"
        path.write_bytes(log.read_bytes())
        os.utime(path, (time.time() - age_s, time.time() - age_s))
    dialog = ExportDialog(None, tmp_path)
    qtbot.addWidget(dialog)
    assert dialog.log == tmp_path / "new.rhotlog" and dialog.export_button.isEnabled()
    qtbot.waitUntil(lambda: dialog.rate_box.text() == "as recorded, 40 Hz", timeout=PATIENCE_MS)
    assert dialog.options().rate_hz is None, "every state keeps its own time"
    dialog.close()


def test_without_a_recording_one_is_asked_for(themed: Any, qtbot: Any, tmp_path: Path) -> None:
    dialog = ExportDialog(None, tmp_path / "nowhere")
    qtbot.addWidget(dialog)
    assert dialog.log is None and not dialog.export_button.isEnabled()


def test_a_name_without_ending_writes_over_nothing_unasked(dialog, monkeypatch, tmp_path):
    ending = all_formats()[dialog.format].endings[0]
    kept, asked = tmp_path / f"kept{ending}", []
    kept.write_text("somebody's work")

    def refuse(*args):
        asked.append(str(args[2]))
        return QMessageBox.StandardButton.No

    monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *args: (str(kept.with_suffix("")), ""))
    monkeypatch.setattr(QMessageBox, "question", refuse)
    dialog.export_button.click()
    assert len(asked) == 1 and str(kept) in asked[0]
    assert kept.read_text() == "somebody's work" and dialog.export_button.text() == "Export …"
