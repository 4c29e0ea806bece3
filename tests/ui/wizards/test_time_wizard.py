"""The time wizard: a waving hand is recorded, the fit shown, the rig saved with the delay that was put in."""

from __future__ import annotations

from pathlib import Path

import msgspec
import pytest
from fake_engine import FakeEngine, synthetic_rig
from log_writing import write_log
from patience import PATIENCE_S
from PySide6.QtCore import Qt
from waving import see, waving
from wizard_hand import HeldMarker, RecordingClient

from rhot_app.calibration.registry import InForce
from rhot_app.project import load_rig

LATE_S = 0.006
ROW_NS = 48_000


@pytest.fixture
def hands(open_wizard):
    rig = synthetic_rig()

    def write(log):
        frames = see(rig, waving(rig, 10.0), 10.0, late_s=(0.0, LATE_S), row_times_ns=(ROW_NS, ROW_NS),
                     said_ns=(ROW_NS, ROW_NS))
        write_log(Path(log), rig, frames)

    return open_wizard("time", RecordingClient(rig, write=write), listen=HeldMarker(FakeEngine()).connect)


def test_from_waving_to_a_rig_that_knows_the_delay(hands):
    page = hands.window.page
    page.movement.seconds = 60.0
    hands.key(Qt.Key.Key_Space)
    hands.until(lambda: page.movement.phase == "recording" and page.button.text() == "Stop")
    assert "60 s left" in hands.sentence
    hands.click(page.button)
    assert hands.client.commands.index("start") < hands.client.commands.index("record"), "a rig at rest sends nothing"
    hands.until(lambda: page.movement.phase == "recorded")
    hands.next()
    hands.solved()
    assert len(hands.window.page.charts.plots) == 2
    hands.next()
    hands.use()
    assert load_rig(hands.path).nodes[1].time_offset_s == pytest.approx(LATE_S, abs=2e-4)


def test_what_the_engine_refuses_is_said_and_nothing_goes_on(hands):
    hands.client.refuse = "the disk is full."
    hands.click(hands.window.page.button)
    hands.until(lambda: "the disk is full" in hands.hint)
    assert not hands.window.frame.next_button.isEnabled()


def test_closing_while_it_records_ends_the_recording(hands):
    hands.click(hands.window.page.button)
    hands.until(lambda: hands.window.page.movement.phase == "recording")
    hands.window.end().wait(PATIENCE_S)
    assert hands.client.commands[-1] == "record_stop"


def test_a_wrong_row_time_is_told_to_its_node():
    from rhot_app.calibration.kinds.time import propose
    from rhot_app.calibration.observations import ObservationCollector
    from rhot_app.calibration.proposal import NodeChange
    from rhot_app.calibration.time.offset import calibrate_times

    rig = synthetic_rig()
    collector = ObservationCollector(tuple(node.name for node in rig.nodes), rig.markers.ids)
    for frame in see(rig, waving(rig, 12.0), 12.0, late_s=(0.0, LATE_S), row_times_ns=(ROW_NS, ROW_NS), said_ns=(0, 0)):
        collector.add(frame)
    proposal = propose(calibrate_times(collector.table(), rig), InForce(rig, node_settings={1: {}, 2: {}}))
    assert proposal is not None
    told = [change for change in proposal.changes if isinstance(change, NodeChange)]
    assert [change.node_id for change in told] == [1, 2]
    assert told[0].after["camera"]["row_time_us"] == pytest.approx(48.0, rel=0.1)
    assert proposal.rig is not None
    assert proposal.rig.nodes[1].time_offset_s == pytest.approx(LATE_S, abs=3e-4)
    assert msgspec.to_builtins(proposal.rig.nodes[0]) == msgspec.to_builtins(rig.nodes[0])
