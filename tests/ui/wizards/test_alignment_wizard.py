"""The alignment wizard by clicks: a real program as the tracker, a made-up hand; solved, refused, saved, undone."""

from __future__ import annotations

import sys
import time
from dataclasses import replace
from pathlib import Path

import moved_tracker
import numpy as np
import pytest
from fake_engine import FakeEngine, synthetic_rig
from PySide6.QtCore import Qt
from wizard_hand import HeldMarker, RecordingAsker
from wizard_hands import Hands
from wizard_rig import FakeMemory

from rhot_app.calibration.verdict import Grade
from rhot_app.geometry.transforms import inverse
from rhot_app.objects.alignment.alignment_file import alignment_path, load_alignment
from rhot_app.project import save_rig
from rhot_app.state import HandState
from rhot_app.ui.models.palette import DARK
from rhot_app.ui.wizards import alignment
from rhot_app.ui.wizards.framework.plan import Kit
from rhot_app.ui.wizards.framework.window import WizardWindow

ROOT = Path(__file__).parents[3]


class MovingFinger(HeldMarker):
    """States in which the index fingertip moves with the tracker."""

    turning = True
    seen = True

    def poll(self) -> list[HandState]:
        state = self.engine.state(self.engine.clock())
        now_ns = time.monotonic_ns()
        places = np.full_like(state.marker_raw_positions, np.nan)
        index = state.marker_ids.index("index")
        if self.seen:
            noise = 2e-4 * self._random.standard_normal(3)
            places[index] = moved_tracker.place_of_finger(1e-9 * now_ns, self.turning) + noise
        return [replace(state, t_master_ns=now_ns, marker_raw_positions=places)]


@pytest.fixture
def make_hands(themed, tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", f"{ROOT}:{Path(moved_tracker.__file__).parent}")
    opened = []

    def make(finger: MovingFinger) -> Hands:
        rig, path = synthetic_rig(), tmp_path / "desk.rig.json"
        save_rig(path, rig)
        asker = RecordingAsker(rig, write=lambda log: None)
        kit = Kit(rig, path, asker.connect, DARK, FakeMemory(), {}, finger.connect)
        hands = Hands(WizardWindow(alignment.make_plan(kit), kit))
        hands.path, hands.memory = alignment_path(path), kit.memory
        opened.append(hands)
        return hands

    yield make
    for hands in opened:
        hands.window.end().wait(8.0)
        hands.window.deleteLater()


def connected(hands, how="turning", keep=False):
    page = hands.window.page
    assert [page.kind.itemText(row) for row in range(page.kind.count())][:2] == ["SteamVR", "libsurvive"]
    page.kind.setCurrentText("Program")
    hands.type(page.detail, f"{sys.executable} -m moved_tracker {how}")
    hands.click(page.connect_button)
    hands.until(lambda: hands.window.frame.next_button.isEnabled())
    if keep:
        hands.keep("alignment-source")
    hands.next()


def recorded(hands, seconds=9.0, keep=False):
    step = hands.window.step
    step.seconds = seconds
    hands.until(step.seen)
    hands.key(Qt.Key.Key_Space)
    if keep:
        hands.run(0.6 * seconds)
        hands.keep("alignment-move")
    hands.until(lambda: step.phase == "recorded", seconds + 30.0)


def solved(hands):
    hands.next()
    step = hands.window.step
    hands.until(lambda: step.report is not None or step.view().hint, 90.0)
    assert step.report is not None, step.view().hint
    return step.report


def test_from_another_tracker_to_a_file_beside_the_rig_and_back(make_hands):
    hands = make_hands(MovingFinger(FakeEngine()))
    connected(hands, keep=True)
    assert hands.memory["pose source"] == "Program"
    recorded(hands, 12.0, keep=True)
    report = solved(hands).report
    assert report.verdict.acceptable, report.verdict
    assert len(hands.window.page.charts.plots) == 2
    hands.keep("alignment-result")
    hands.next()
    hands.keep("alignment-accept", 8)
    assert hands.window.page.table.item(0, 1).text() == "none" and not hands.path.exists()
    hands.next()
    hands.until(lambda: hands.window.step.state == "used")
    saved = load_alignment(hands.path)
    np.testing.assert_allclose(saved.rig_from_foreign.matrix, inverse(moved_tracker.FOREIGN_FROM_RIG), atol=3e-3)
    np.testing.assert_allclose(saved.tracker_from_body.translation_m, moved_tracker.TRACKER_FROM_FINGER[:3, 3],
                               atol=2e-3)
    assert saved.time_offset_s == pytest.approx(-moved_tracker.DELAY_S, abs=0.01)
    hands.click(hands.window.page.restore_button)
    hands.until(lambda: hands.window.step.state == "restored")
    assert not hands.path.exists()


def test_parallel_motion_is_refused_with_the_reason(make_hands):
    finger = MovingFinger(FakeEngine())
    finger.turning = False
    hands = make_hands(finger)
    connected(hands, "parallel")
    recorded(hands, 6.0)
    assert "Turn the tracker" in hands.sentence and not hands.window.step.view().done
    verdict = solved(hands).report.verdict
    assert verdict.grade is Grade.POOR and any(each.code == "no_rotation" for each in verdict.findings)
    hands.next()
    assert "must not be used" in hands.sentence and not hands.window.frame.next_button.isEnabled()


def test_an_alignment_that_holds_no_longer_is_called_stale(make_hands):
    finger = MovingFinger(FakeEngine())
    hands = make_hands(finger)
    connected(hands)
    recorded(hands)
    solved(hands)
    hands.next()
    hands.next()
    hands.until(lambda: hands.window.step.state == "used")
    saved = load_alignment(hands.path)
    x, y, z = saved.rig_from_foreign.translation_m
    from msgspec.structs import replace as changed

    from rhot_app.objects.alignment.alignment_file import save_alignment
    save_alignment(hands.path, changed(saved, rig_from_foreign=changed(
        saved.rig_from_foreign, translation_m=(x + 0.02, y, z))))
    hands.window.end().wait(8.0)
    again = make_hands(finger)
    connected(again)
    recorded(again)
    drift = solved(again).drift
    assert drift is not None and drift.stale and drift.distance_m == pytest.approx(0.02, rel=0.2)
    again.next()
    assert "stale: " in again.window.page.table.item(0, 1).text()


def test_what_is_missing_is_said(make_hands):
    finger = MovingFinger(FakeEngine())
    finger.seen = False
    hands = make_hands(finger)
    page = hands.window.page
    page.kind.setCurrentText("Program")
    hands.type(page.detail, "no-such-program")
    hands.click(page.connect_button)
    hands.until(lambda: "no program" in hands.window.frame.hint.text())
    assert not hands.window.frame.next_button.isEnabled()
    connected(hands)
    hands.run(0.5)
    hands.click(hands.window.page.button)
    hands.until(lambda: "not seen by two cameras" in hands.window.frame.hint.text())
    assert hands.window.step.phase == "waiting"
