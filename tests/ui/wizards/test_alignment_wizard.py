"""The alignment wizard: clicked through once on a made-up tracker and hand; its recording and its fit on their own."""

from __future__ import annotations

import time
from collections import deque

import numpy as np
import pytest
from fake_engine import synthetic_rig
from moved_tracker import DELAY_S, FOREIGN_FROM_RIG, TRACKER_FROM_FINGER, MovedTracker
from msgspec.structs import replace
from patience import eventually
from PySide6.QtCore import Qt
from wizard_hand import RecordingClient

from rhot_app.calibration.kinds.alignment import propose, solve
from rhot_app.calibration.registry import InForce
from rhot_app.calibration.verdict import Grade
from rhot_app.geometry.transforms import inverse
from rhot_app.objects.alignment.alignment_file import alignment_path, load_alignment, save_alignment
from rhot_app.objects.alignment.fit import SEARCH_S
from rhot_app.sources.poses.open_source import open_source
from rhot_app.ui.backend.pose_feed import PoseFeed
from rhot_app.ui.models.proposal import use_all
from rhot_app.ui.wizards import alignment
from rhot_app.ui.wizards.alignment import TogetherStep
from rhot_app.ui.wizards.framework.step import AcceptStep

MARKERS = synthetic_rig().markers.ids


def test_from_another_tracker_to_a_file_beside_the_rig_and_back(open_wizard):
    tracker = MovedTracker()
    poses = PoseFeed(lambda name, body: tracker if name == "udp:5000" else open_source(name, body))
    hands = open_wizard("alignment", RecordingClient(synthetic_rig(), write=lambda log: None), listen=tracker.listen,
                        make=lambda context: alignment.make_wizard(context, poses, tracker.now_ns))
    page, path = hands.window.page, alignment_path(hands.path)
    assert [page.kind.itemText(row) for row in range(page.kind.count())][:2] == ["SteamVR", "libsurvive"]
    page.kind.setCurrentText("Program")
    hands.type(page.detail, "no-such-program")
    hands.click(page.connect_button)
    hands.until(lambda: "no program" in hands.hint)
    assert not hands.frame.next_button.isEnabled()
    page.kind.setCurrentText("UDP")
    hands.type(page.detail, "5000")
    hands.click(page.connect_button)
    hands.until(hands.frame.next_button.isEnabled)
    hands.keep("alignment-source")
    hands.next()
    assert hands.memory["pose source"] == "UDP"
    step = hands.window.step
    step.seconds = 12.0
    hands.until(step.seen)
    hands.key(Qt.Key.Key_Space)
    hands.until(lambda: all(bar.fraction > 0.3 for bar in hands.frame.bars.bars))
    hands.keep("alignment-move")
    hands.until(lambda: step.phase == "recorded")
    hands.next()
    assert hands.solved().solution.verdict.acceptable, hands.verdict
    assert len(hands.window.page.charts.plots) == 2
    hands.keep("alignment-result")
    hands.next()
    hands.keep("alignment-accept", 8)
    assert hands.window.page.table.text(0, 1) == "none" and not path.exists()
    hands.use()
    check(load_alignment(path))
    hands.restore()
    assert not path.exists()


def check(saved):
    """It is what the tracker was made with."""
    np.testing.assert_allclose(saved.rig_from_foreign.matrix, inverse(FOREIGN_FROM_RIG), atol=3e-3)
    np.testing.assert_allclose(saved.tracker_from_body.translation_m, TRACKER_FROM_FINGER[:3, 3], atol=2e-3)
    assert saved.time_offset_s == pytest.approx(-DELAY_S, abs=0.01)


class Movement:
    """The step in which both are moved, and time that passes."""

    def __init__(self, tracker: MovedTracker) -> None:
        self.tracker, self.poses = tracker, PoseFeed()
        self.states = deque(maxlen=200)
        self.step = TogetherStep(MARKERS, self.poses, lambda seconds: list(self.states), tracker.now_ns)

    def wait(self, seconds: float) -> None:
        end_ns = self.tracker.now_ns() + 1e9 * seconds
        while self.tracker.now_ns() < end_ns:
            self.poses.add(self.tracker.poll())
            self.states += self.tracker.states()
            self.step.view()

    def record(self, seconds: float) -> None:
        self.wait(2.0)
        self.step.seconds = seconds
        assert self.step.capture()
        self.wait(seconds + 0.5)
        assert self.step.phase == "recorded"

    def solve(self, rig_path):
        """The result, and what is proposed for the file beside the rig."""
        now = InForce(synthetic_rig(), rig_path)
        result = solve(self.step.recording, SEARCH_S, now, progress=lambda text, fraction: None)
        return result, propose(result, now), None if rig_path is None else alignment_path(rig_path)


def test_parallel_motion_is_refused_with_the_reason():
    movement = Movement(MovedTracker(turning=False))
    movement.record(6.0)
    view = movement.step.view()
    assert "Turn" in view.sentence and view.may_go_on and not view.done
    result, proposal, _ = movement.solve(None)
    verdict = result.solution.verdict
    assert verdict.grade is Grade.POOR and "no_rotation" in verdict.codes
    assert proposal.verdict is verdict, "which forbids its use"


def test_an_alignment_that_holds_no_longer_is_called_stale(tmp_path):
    movement = Movement(MovedTracker())
    movement.record(9.0)
    result, proposal, path = movement.solve(tmp_path / "desk.json")
    assert result.drift is None
    step = AcceptStep(lambda: propose(result, InForce(synthetic_rig(), tmp_path / "desk.json")), None)
    step.enter()
    entered_s = time.time()
    eventually(lambda: int(time.time()) > int(entered_s))  # files are stamped to the second
    step.enter()
    assert step.proposal == proposal, "coming back to the page later finds the same proposal"
    use_all(proposal.changes, None)
    saved = load_alignment(path)
    check(saved)
    x, y, z = saved.rig_from_foreign.translation_m
    save_alignment(path, replace(saved, rig_from_foreign=replace(
        saved.rig_from_foreign, translation_m=(x + 0.02, y, z))))
    movement.record(9.0)
    result, proposal, _ = movement.solve(tmp_path / "desk.json")
    assert result.drift.stale and result.drift.distance_m == pytest.approx(0.02, rel=0.2)
    assert "stale" in proposal.rows[0].before


def test_what_is_missing_is_said():
    tracker = MovedTracker()
    movement = Movement(tracker)
    assert not movement.step.capture() and "tracker" in movement.step.view().hint
    tracker.seen = False
    movement.wait(2.0)
    assert not movement.step.capture() and "not seen" in movement.step.view().hint
    assert movement.step.phase == "waiting"
