"""The bones wizard: a minute of movement, or a ruler; what is known of each bone; a rig with that hand."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bones_twin import SIX, Sloppiness, person, record
from fake_engine import FakeEngine
from landmark_detector import landmark_rig, moving_hand
from log_writing import write_log
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from synthetic_rig import WIDE, Viewing, make_rig, observe
from wizard_hand import HeldMarker, RecordingClient

from rhot_app.calibration.hand.bones import solve_bones
from rhot_app.calibration.hand.marker_places import tracks_of
from rhot_app.calibration.kinds.bones import propose
from rhot_app.calibration.registry import InForce
from rhot_app.hand.skeleton import FINGERS
from rhot_app.project import load_rig
from rhot_app.ui.wizards.bones import SweepGuide, make_guide
from rhot_app.ui.wizards.framework.movement import QuietGuide
from rhot_app.ui.wizards.framework.step import Bar

SECONDS = 8.0
SIZE = 1.06


def write_movement(rig, path):
    """What the engine would have recorded of a larger hand with six painted markers."""
    tracks = record(person(3, SIZE), SIX, 3, seconds=SECONDS, sloppiness=Sloppiness(0.0, 0.0, 0.0))

    def trajectory(times):
        columns = tracks.positions.reshape(len(tracks.times_s), -1).T
        return np.stack([np.interp(times, tracks.times_s, column) for column in columns], axis=1).reshape(-1, 6, 3)

    write_log(Path(path), rig, observe(rig, WIDE, trajectory, SECONDS - 0.5, Viewing(noise_px=0.05)))


@pytest.fixture
def hands(open_wizard):
    rig = make_rig()
    return open_wizard("bones", RecordingClient(rig, write=lambda log: write_movement(rig, log)),
                       listen=HeldMarker(FakeEngine()).connect)


def enter(box, text):
    box.setFocus()
    box.selectAll()
    QTest.keyClicks(box, text)
    QTest.keyClick(box, Qt.Key.Key_Tab)


def test_from_a_movement_to_a_rig_with_that_hand(hands):
    hands.next()
    hands.record()
    hands.next()
    report, page = hands.solved(), hands.window.page
    assert page.table.records_model.rowCount() == 15
    words = {page.table.text(row, 3) for row in range(15)}
    assert "observed" not in words, "six markers show no single phalanx"
    styles = {page.table.records_model.index(row, 3).data(Qt.ItemDataRole.BackgroundRole).style() for row in range(15)}
    assert Qt.BrushStyle.BDiagPattern in styles, "what is only usual is hatched"
    assert "index" in page.reaches.text()
    hands.until(lambda: page.reaches.height() >= page.reaches.heightForWidth(page.reaches.width()))
    before = load_rig(hands.path).hand
    hands.next()
    hands.use()
    saved = load_rig(hands.path).hand
    ratio = sum(saved.fingers["index"].bones_mm) / sum(before.fingers["index"].bones_mm)
    assert ratio == pytest.approx(report.hand.fingers["index"].bones_mm[0] / before.fingers["index"].bones_mm[0],
                                  rel=0.05) and saved != before
    hands.restore()
    assert load_rig(hands.path).hand == before


def test_bones_entered_by_hand_need_no_movement(hands):
    page, step = hands.window.page, hands.window.step
    enter(page.boxes["index.proximal"], "47.5")
    assert step.lengths == {"index.proximal": 47.5} and hands.verdict.acceptable
    enter(page.boxes["index.medial"], "25")
    hands.undo()
    assert step.lengths == {"index.proximal": 47.5}
    hands.until(lambda: page.boxes["index.medial"].value() == 0.0)
    hands.next()
    assert "entered" in hands.sentence
    hands.next()
    table = hands.window.page.table
    known = {table.text(row, 0): table.text(row, 3) for row in range(15)}
    assert known["index.proximal"] == "entered" and known["ring.medial"].startswith(("not observed", "partly"))
    hands.next()
    hands.use()
    saved = load_rig(hands.path).hand
    assert saved.fingers["index"].bones_mm[0] == 47.5
    assert saved.fingers["ring"] == hands.rig.hand.fingers["ring"]


def test_centimetres_are_found_out(hands):
    enter(hands.window.page.boxes["middle.proximal"], "4.9")
    verdict = hands.verdict
    assert verdict is not None and not verdict.acceptable and "centimetres" in verdict.findings[0].sentence
    assert "Next" not in hands.sentence and not hands.frame.next_button.isEnabled()


def test_the_guide_counts_what_each_finger_has_done():
    tracks = record(person(3), SIX, 3, seconds=40.0, rate_hz=30.0, sloppiness=Sloppiness(0.0, 0.0, 0.0))
    engine, guide = FakeEngine(make_rig()), make_guide(make_rig())
    assert isinstance(guide, SweepGuide)
    states = [replace(engine.state(float(t_s)), marker_raw_positions=at)
              for t_s, at in zip(tracks.times_s, tracks.positions, strict=True)]
    guide.watch(states[:60])
    early = sum(bar.fraction for bar in guide.bars())
    for end in range(120, len(states), 60):
        guide.watch(states[end - 120:end])
        assert all(bar.full for bar in guide.bars()) == (guide.shortfall() == ""), "bars and words agree"
        for bar in guide.bars():
            assert not (bar.full and f"the {bar.name}" in guide.sentence()), "what is ticked is not asked for again"
        assert " s done" not in guide.sentence(), "the time that is left is said already"
    assert len(guide.bars()) == 6 and sum(bar.fraction for bar in guide.bars()) > early + 1.0
    assert guide.sentence()


def test_every_bar_of_the_movement_is_in_sight(hands):
    """Time, sight and five fingers are more than the usual rows."""
    hands.next()
    bars = hands.frame.bars
    bars.show_bars(tuple(Bar(name, 0.5) for name in ("time", "in sight", *FINGERS)))
    hands.until(lambda: bars.visibleRegion().boundingRect().bottom() + 1 >= len(bars.bars) * bars.row_px)


def test_markers_that_name_no_place_get_a_quiet_guide():
    import msgspec

    rig = make_rig()
    free = tuple(msgspec.structs.replace(marker, id=f"m{k}", role=None)
                 for k, marker in enumerate(rig.markers.markers))
    rig = msgspec.structs.replace(rig, markers=msgspec.structs.replace(rig.markers, markers=free))
    assert isinstance(make_guide(rig), QuietGuide)


def test_bones_by_landmarks_are_proposed():
    rig = landmark_rig()
    places = moving_hand(rig, "grasp", 4.0, 30.0, 1, 0.05).joints()
    roles = {marker.id: marker.role for marker in rig.markers.markers}
    report = solve_bones(tracks_of(np.arange(len(places)) / 30.0, places, rig.markers.ids, roles), rig.hand)
    proposal = propose(report, InForce(rig))
    assert "landmarks" in proposal.rig.hand.name and proposal.rig.hand.fingers == report.hand.fingers
