"""The alignment wizard on the simulated rig, by clicks and real processes: the tracker's world is found."""

from __future__ import annotations

import numpy as np
import pytest
from PySide6.QtCore import Qt

from rhot_app.geometry.transforms import inverse
from rhot_app.objects.alignment.alignment_file import alignment_path, load_alignment
from rhot_app.simulator.nodes.live_scene import DELAY_S, ForeignTracker
from rhot_app.simulator.scene.scene_description import HandShow
from rhot_app.ui.backend.contract import TwinChoice


@pytest.mark.study("rhot_app/ui/wizards", "rhot_app/objects/alignment")
def test_the_simulated_tracker_is_aligned(simulated_rig, open_on_rig):
    simulated_rig.stage.show(HandShow("roam"))
    hands = open_on_rig("alignment")
    page = hands.window.page
    assert page.kind.currentText() == "Simulated"
    hands.click(page.connect_button)
    hands.until(lambda: hands.window.frame.next_button.isEnabled())
    hands.keep("alignment-source")
    hands.next()
    step = hands.window.step
    hands.until(step.seen)
    hands.key(Qt.Key.Key_Space)
    hands.run(12.0)
    hands.keep("alignment-move")
    hands.until(lambda: step.phase == "recorded", 60.0)
    hands.next()
    hands.until(lambda: hands.window.step.report is not None or hands.window.step.view().hint, 120.0)
    assert hands.window.step.report is not None, hands.window.step.view().hint
    report = hands.window.step.report.report
    print(report.verdict.sentence, report.coverage, [each.sentence for each in report.verdict.findings])
    hands.keep("alignment-result")
    hands.next()
    hands.keep("alignment-accept", 8)
    hands.until(lambda: hands.window.frame.next_button.text() == "Use this calibration")
    hands.next()
    hands.until(lambda: hands.window.frame.next_button.text() == "Close", 40.0)
    saved = load_alignment(alignment_path(simulated_rig.path))
    truth = inverse(ForeignTracker(TwinChoice().seed).foreign_from_rig)
    centre = np.linalg.solve(truth, np.array([0.0375, 0.0, 0.6, 1.0]))
    error_m = np.linalg.norm((saved.rig_from_foreign.matrix @ centre)[:3] - [0.0375, 0.0, 0.6])
    cosine = 0.5 * (np.trace(saved.rig_from_foreign.matrix[:3, :3].T @ truth[:3, :3]) - 1.0)
    print(f"{1e3 * error_m:.1f} mm, {np.degrees(np.arccos(min(cosine, 1.0))):.2f} degrees, "
          f"{1e3 * saved.time_offset_s:+.1f} ms")
    assert error_m < 5e-3 and cosine > np.cos(np.radians(1.5))
    assert saved.time_offset_s == pytest.approx(-DELAY_S, abs=0.015)
