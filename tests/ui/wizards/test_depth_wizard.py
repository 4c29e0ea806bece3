"""The depth wizard: a marker held at measured distances, from the first page to the saved rig and back."""

from __future__ import annotations

import pytest
from fake_engine import FakeEngine, synthetic_rig
from PySide6.QtCore import Qt
from wizard_hand import HeldMarker
from wizard_hands import Hands
from wizard_rig import FakeMemory, FakeRigAsker

from rhot_app.project import load_rig, save_rig
from rhot_app.ui.models.palette import DARK
from rhot_app.ui.wizards import depth
from rhot_app.ui.wizards.framework.plan import Kit
from rhot_app.ui.wizards.framework.window import WizardWindow

DISTANCES_CM = (25.0, 30.0, 40.0, 50.0, 60.0, 70.0, 85.0, 100.0)


@pytest.fixture
def marker():
    return HeldMarker(FakeEngine())


@pytest.fixture
def hands(themed, marker, tmp_path):
    asker, path = FakeRigAsker(synthetic_rig()), tmp_path / "desk.json"
    save_rig(path, asker.rig)
    kit = Kit(asker.rig, path, asker.connect, DARK, FakeMemory(), listen=marker.connect)
    hands = Hands(WizardWindow(depth.make_plan(kit), kit))
    hands.path, hands.asker = path, asker
    yield hands
    hands.window.end().wait(5.0)
    hands.window.deleteLater()


def measure(hands, marker, distance_cm):
    """Hold the marker there, enter the distance, take it; a second later the next one may come."""
    page = hands.window.page
    count = len(page.distances.rows)
    marker.distance_m = 0.01 * distance_cm
    page.distance.setValue(distance_cm)
    expected_px = 0.075 * 530.0 / marker.distance_m
    hands.until(lambda: len(page.distances.disparities()) > 5
                and abs(page.distances.disparities() - expected_px).max() < 1.0)
    hands.click(page.take_button)
    assert len(page.distances.rows) == count + 1, hands.window.step.problem


def test_from_distances_to_a_rig_that_uses_them(hands, marker):
    page = hands.window.page
    assert not hands.window.frame.next_button.isEnabled()
    for distance_cm in DISTANCES_CM:
        measure(hands, marker, distance_cm)
    assert page.table.rowCount() == len(DISTANCES_CM)
    assert set(hands.window.step.view().overlays) == {"left", "right"}
    hands.next()
    assert hands.title == "The law" and hands.window.page.charts.plots
    hands.next()
    assert "distance from" in hands.window.page.table.item(0, 0).text()
    hands.click(hands.window.frame.next_button)
    hands.until(lambda: hands.window.step.state == "used")
    saved = load_rig(hands.path).depth
    assert saved.mode == "disparity"
    assert saved.k == pytest.approx(0.075 * 530.0, rel=0.02) and saved.z == pytest.approx(-1.0, abs=0.01)
    hands.click(hands.window.page.restore_button)
    hands.until(lambda: hands.window.step.state == "restored")
    assert load_rig(hands.path).depth.mode == "stereo"


def test_what_cannot_be_measured_is_said(hands, marker):
    page = hands.window.page
    marker.distance_m = None
    hands.run(1.2)
    hands.click(page.take_button)
    assert "thumb is not seen by both cameras" in hands.window.frame.hint.text()
    marker.distance_m, marker.noise_px = 0.3, 5.0
    hands.run(1.2)
    hands.click(page.take_button)
    assert "moves" in hands.window.frame.hint.text() and not page.distances.rows


def test_rows_can_be_taken_out_again(hands, marker):
    page = hands.window.page
    for distance_cm in (30.0, 60.0):
        measure(hands, marker, distance_cm)
    page.table.selectRow(0)
    hands.click(page.remove_button)
    assert [row.distance_m for row in page.distances.rows] == [pytest.approx(0.6)]
    page.take_button.setFocus()
    hands.key(Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    assert page.distances.rows == [] and hands.window.frame.next_button.isEnabled() is False
