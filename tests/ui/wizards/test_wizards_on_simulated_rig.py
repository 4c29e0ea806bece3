"""Wizards from start to saved rig on the simulated rig: real processes, real pictures, a board that is moved about."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest
from board_scene import compile_search
from PySide6.QtCore import Qt

from rhot_app.project import CameraPose
from rhot_app.simulator.shows import BoardShow


@pytest.fixture(scope="module", autouse=True)
def compiled():
    compile_search()


def baseline_of(rig):
    left, right = (np.array(node.pose.translation_m) for node in rig.nodes)
    return float(np.linalg.norm(right - left))


def test_cameras_are_put_together(simulated_rig, open_on_rig):
    truth = simulated_rig.truth
    right = msgspec.structs.replace(truth.nodes[1], pose=CameraPose(translation_m=(0.06, 0.0, 0.0)))
    simulated_rig.use(msgspec.structs.replace(truth, nodes=(truth.nodes[0], right)))
    hands = open_on_rig("stereo")
    simulated_rig.stage.show(BoardShow(size="9x6", square_mm=30.0))
    hands.until(lambda: hands.sentence == "Seen by left and right: this is the board.", 60.0)
    hands.next()
    hands.until(lambda: hands.sentence == "Enough: press Next.", 120.0)
    hands.next()
    hands.window.page.baseline.setValue(75.0)
    hands.next()
    hands.until(lambda: hands.window.frame.verdict.verdict is not None, 60.0)
    assert hands.window.frame.verdict.verdict.acceptable, hands.window.frame.verdict.verdict
    hands.next()
    simulated_rig.stage.show(BoardShow(on_table=True))
    for _ in range(20):  # pictures of before may still be on their way
        hands.run(0.5)
        hands.key(Qt.Key.Key_Space)
        if hands.sentence == "The table is known: press Next.":
            break
    assert hands.sentence == "The table is known: press Next.", hands.window.frame.hint.text()
    hands.next()
    hands.next()
    hands.until(lambda: hands.window.frame.next_button.text() == "Close", 40.0)
    saved = simulated_rig.saved
    assert saved.up == "z" and saved.nodes[0].pose.translation_m[2] > 0.1
    assert baseline_of(saved) == pytest.approx(baseline_of(truth), abs=0.0005)
