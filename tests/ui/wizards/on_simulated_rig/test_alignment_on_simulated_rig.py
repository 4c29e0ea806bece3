"""The alignment wizard on the simulated rig, by clicks and real processes: the tracker's world is found."""

from __future__ import annotations

import numpy as np
import pytest

from rhot_app.geometry.transforms import inverse
from rhot_app.objects.alignment.alignment_file import alignment_path, load_alignment
from rhot_app.simulator.nodes.live_scene import DELAY_S, ForeignTracker
from rhot_app.simulator.scene.scene_description import HandShow
from rhot_app.ui.backend.contract import TwinChoice


@pytest.mark.study("rhot_app/ui/wizards", "rhot_app/objects/alignment")
def test_the_simulated_tracker_is_aligned(simulated_rig, open_on_rig):
    simulated_rig.twin.show(HandShow("roam"))
    hands = open_on_rig("alignment")
    page = hands.window.page
    assert page.kind.currentText() == "Simulated"
    hands.click(page.connect_button)
    hands.until(lambda: hands.frame.next_button.isEnabled())
    hands.keep("alignment-source")
    hands.next()
    step = hands.window.step
    hands.until(step.seen)
    hands.record(20.0, "alignment-move", times=3)
    hands.next()
    hands.solved(120.0)
    hands.keep("alignment-result")
    hands.next()
    hands.keep("alignment-accept", 8)
    hands.use()
    saved = load_alignment(alignment_path(simulated_rig.path))
    truth = inverse(ForeignTracker(TwinChoice().seed).foreign_from_rig)
    centre = np.linalg.solve(truth, np.array([0.0375, 0.0, 0.6, 1.0]))
    error_m = np.linalg.norm((saved.rig_from_foreign.matrix @ centre)[:3] - [0.0375, 0.0, 0.6])
    cosine = 0.5 * (np.trace(saved.rig_from_foreign.matrix[:3, :3].T @ truth[:3, :3]) - 1.0)
    assert error_m < 5e-3 and cosine > np.cos(np.radians(1.5))
    assert saved.time_offset_s == pytest.approx(-DELAY_S, abs=0.015)
