"""The time wizard: a waving hand is recorded, the fit shown, the rig saved with the delay that was put in."""

from __future__ import annotations

from pathlib import Path

import msgspec
import pytest
from fake_engine import FakeEngine, synthetic_rig
from log_writing import write_log
from PySide6.QtCore import Qt
from waving import see, waving
from wizard_hand import HeldMarker, RecordingAsker
from wizard_hands import Hands
from wizard_rig import FakeMemory

from rhot_app.project import load_rig, save_rig
from rhot_app.ui.models.palette import DARK
from rhot_app.ui.wizards import time as time_wizard
from rhot_app.ui.wizards.framework.plan import Kit
from rhot_app.ui.wizards.framework.window import WizardWindow

LATE_S = 0.006
ROW_NS = 48_000


@pytest.fixture
def hands(themed, tmp_path):
    rig, path = synthetic_rig(), tmp_path / "desk.json"

    def write(log):
        frames = see(rig, waving(rig, 10.0), 10.0, late_s=(0.0, LATE_S), row_times_ns=(ROW_NS, ROW_NS),
                     said_ns=(ROW_NS, ROW_NS))
        write_log(Path(log), rig, frames)

    asker = RecordingAsker(rig, write=write)
    save_rig(path, rig)
    kit = Kit(rig, path, asker.connect, DARK, FakeMemory(), {}, HeldMarker(FakeEngine()).connect)
    hands = Hands(WizardWindow(time_wizard.make_plan(kit), kit))
    hands.path, hands.asker = path, asker
    yield hands
    hands.window.end().wait(5.0)
    hands.window.deleteLater()


def test_from_waving_to_a_rig_that_knows_the_delay(hands):
    page = hands.window.page
    page.movement.seconds = 0.5
    hands.key(Qt.Key.Key_Space)
    hands.until(lambda: page.movement.phase == "recording")
    assert "left" in hands.sentence and page.button.text() == "Stop"
    assert hands.asker.commands.index("start") < hands.asker.commands.index("record"), "a rig at rest sends nothing"
    hands.until(lambda: page.movement.phase == "recorded")
    hands.next()
    hands.until(lambda: hands.window.step.report is not None, timeout_s=60.0)
    assert len(hands.window.page.charts.plots) == 2
    hands.next()
    hands.click(hands.window.frame.next_button)
    hands.until(lambda: hands.window.step.state == "used")
    assert load_rig(hands.path).nodes[1].time_offset_s == pytest.approx(LATE_S, abs=2e-4)


def test_what_the_engine_refuses_is_said_and_nothing_goes_on(hands):
    hands.asker.refuse = "the disk is full."
    hands.click(hands.window.page.button)
    hands.until(lambda: "the disk is full" in hands.window.frame.hint.text())
    assert not hands.window.frame.next_button.isEnabled()


def test_closing_while_it_records_ends_the_recording(hands):
    hands.click(hands.window.page.button)
    hands.until(lambda: hands.window.page.movement.phase == "recording")
    hands.window.end().wait(5.0)
    assert hands.asker.commands[-1] == "record_stop"


def test_a_wrong_row_time_is_told_to_its_node():
    from rhot_app.calibration.observations import ObservationCollector
    from rhot_app.calibration.time.offset import calibrate_times
    from rhot_app.ui.models.proposal import NodeChange
    from rhot_app.ui.wizards.steps.time_steps import propose

    rig = synthetic_rig()
    collector = ObservationCollector(tuple(node.name for node in rig.nodes), rig.markers.ids)
    for frame in see(rig, waving(rig, 12.0), 12.0, late_s=(0.0, LATE_S), row_times_ns=(ROW_NS, ROW_NS), said_ns=(0, 0)):
        collector.add(frame)
    proposal = propose(calibrate_times(collector.table(), rig), rig, None, {1: {}, 2: {}})
    assert proposal is not None
    told = [change for change in proposal.changes if isinstance(change, NodeChange)]
    assert [change.node_id for change in told] == [1, 2]
    assert told[0].after["camera"]["row_time_us"] == pytest.approx(48.0, rel=0.1)
    assert proposal.rig is not None
    assert proposal.rig.nodes[1].time_offset_s == pytest.approx(LATE_S, abs=3e-4)
    assert msgspec.to_builtins(proposal.rig.nodes[0]) == msgspec.to_builtins(rig.nodes[0])
