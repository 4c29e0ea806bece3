"""The Calibrate menu: wizards open over the window, tell when they were used, and earlier versions come back."""

from __future__ import annotations

import sys
import threading

import msgspec
import pytest
import sample_wizard
from fake_engine import synthetic_rig
from patience import eventually
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from screen_pictures import check
from wizard_hands import Hands
from wizard_rig import RigBackend

from rhot_app import rig_history
from rhot_app.calibration.proposal import rows_of
from rhot_app.calibration.rig_figures import place_figures
from rhot_app.engine.status import Advice
from rhot_app.project import CameraPose, load_rig


@pytest.fixture
def bench(make_bench, tmp_path, monkeypatch, new_kinds):
    """The main window on a rig with a file, and the sample wizard in its menu."""
    monkeypatch.setitem(sys.modules, "rhot_app.ui.wizards.sample", sample_wizard)
    bench = make_bench(RigBackend(tmp_path / "desk.json"))
    bench.track()
    return bench


def test_a_wizard_opens_over_the_window_and_its_age_stands_in_the_menu(bench):
    window = bench.window
    action = window.actions_.wizards[-2]
    window.menus.calibrate.aboutToShow.emit()
    assert action.text() == "Sample …\tnot yet"
    window.wizards.show_ages(window.actions_.wizards, "")
    assert action.text() == "Sample …", "no rig is open"
    action.trigger()
    bench.until(lambda: window.wizards.wizard is not None)
    wizard = Hands(window.wizards.wizard)
    wizard.window.page.box.setValue(9)
    wizard.next()
    for _ in range(3):
        wizard.until(lambda: wizard.window.step.seen is not None)
        wizard.key(Qt.Key.Key_Space)
    for _ in range(3):
        wizard.next()
    wizard.until(lambda: wizard.window.step.state == "used")
    wizard.next()
    bench.until(lambda: window.wizards.wizard is None)
    window.menus.calibrate.aboutToShow.emit()
    assert action.text() == "Sample …\ttoday"
    assert load_rig(bench.backend.path).name == "calibrated"


def test_a_wizard_that_cannot_open_says_why(bench):
    bench.backend.rig_client.refuse = "The engine does not answer."
    bench.window.actions_.wizards[-2].trigger()
    bench.until(lambda: bench.said(bench.backend.rig_client.refuse))
    assert bench.window.wizards.wizard is None


def test_a_stale_calibration_offers_the_wizard_that_mends_it(bench):
    bench.backend.engine.advice = (Advice("warning", "The cameras' rays miss each other.", "sample"),)
    bench.until(lambda: bench.said("rays miss"))
    bench.click(bench.window.advice.buttons["Sample …"])
    bench.until(lambda: bench.window.wizards.wizard is not None)
    assert bench.window.wizards.wizard.windowTitle() == "Sample"


def test_closing_the_app_ends_an_open_wizard_without_a_question(bench):
    bench.window.actions_.wizards[-2].trigger()
    bench.until(lambda: bench.window.wizards.wizard is not None)
    bench.window.close()
    eventually(lambda: not any("pictures of" in thread.name for thread in threading.enumerate()))


def test_an_earlier_version_is_brought_back_and_that_is_undone(bench):
    path, client = bench.backend.path, bench.backend.rig_client
    moved = msgspec.structs.replace(client.rig, name="newer", nodes=(
        client.rig.nodes[0], msgspec.structs.replace(client.rig.nodes[1], time_offset_s=0.002)))
    client.rig = moved
    rig_history.accept(path, moved, "time calibration")
    bench.window.actions_.earlier.trigger()
    bench.until(lambda: bench.window.wizards.versions is not None)
    dialog = bench.window.wizards.versions
    assert "before time calibration" in dialog.list.item(0).text()
    assert [dialog.table.text(0, c) for c in range(3)] == [
        "right: time offset", "2.00 ms, not measured", "0.00 ms, not measured"]
    check("earlier-calibrations", dialog.grab().toImage(), 8)
    bench.click(dialog.back_button)
    bench.until(lambda: "back in force" in dialog.sentence.text())
    assert client.rig.name == "test bench" == load_rig(path).name and dialog.list.count() == 2
    bench.click(dialog.back_button)
    bench.until(lambda: load_rig(path).name == "newer")
    assert client.rig.name == "newer"
    QTest.keyClick(dialog, Qt.Key.Key_Escape)


def test_two_rigs_are_compared_in_figures_for_people():
    rig = synthetic_rig()
    lens = msgspec.structs.replace(rig.nodes[0].intrinsics, fx=540.04)
    other = msgspec.structs.replace(rig, nodes=(msgspec.structs.replace(rig.nodes[0], intrinsics=lens), rig.nodes[1]))
    assert rows_of(rig, rig) == ()
    assert [(row.what, row.before, row.after) for row in rows_of(rig, other)] == [
        ("left: focal length", "530.0, 530.0 px", "540.0, 530.0 px")]


def test_a_figure_has_no_negative_zero():
    node = msgspec.structs.replace(synthetic_rig().nodes[0], pose=CameraPose(translation_m=(-1e-6, 0.0, 0.1)))
    assert next(place_figures(node)).text == "0.0, 0.0, 100.0 mm"
