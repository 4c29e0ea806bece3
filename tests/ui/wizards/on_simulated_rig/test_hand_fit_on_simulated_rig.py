"""The hand fitted to pictures of the simulated rig: by clicks, real nodes and a real engine, to a saved rig."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from screen_pictures import check
from wizard_hands import Hands, opened

from rhot_app.hand.anthropometry import scaled_hand
from rhot_app.hand.kinematics import forward
from rhot_app.hand.model import build_model
from rhot_app.hand.skeleton import JOINTS
from rhot_app.rig_history import versions
from rhot_app.simulator.scene.motion_file import load_motion
from rhot_app.simulator.scene.scene import twin_defaults
from rhot_app.simulator.scene.scene_description import HandShow


@pytest.fixture
def window(rig_launcher, simulated_rig):
    """The window on the simulated rig, whose rig file has a hand a tenth too small."""
    truth = simulated_rig.truth
    simulated_rig.use(msgspec.structs.replace(truth, hand=scaled_hand(truth.hand, 0.9)))
    simulated_rig.twin.show(HandShow("still"))
    rig_launcher.open_fit()
    fit = opened(rig_launcher, "fit")
    fit.resize(1280, 800)
    return fit


def drag(view, joint, to):
    """With the mouse, from where a joint is drawn to px `to` of the picture."""
    ends = [view.to_widget(*place) for place in (view.joints[joint], to)]
    start, end = (QPoint(round(point.x()), round(point.y())) for point in ends)
    QTest.mousePress(view, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, start)
    QTest.mouseMove(view, start + QPoint(4, 4))  # farther than a click
    QTest.mouseMove(view, (start + end) / 2)
    QTest.mouseRelease(view, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, end)


@pytest.mark.study("rhot_app/ui/wizards", "rhot_app/handfit", "rhot_app/ui/handfit")
def test_a_hand_of_the_wrong_size_is_fitted_by_anchors_and_used(window, simulated_rig):
    fit, frame = window.fit, window.frame
    Hands.wait(lambda: all(view.shown is not None for view in frame.views))
    assert window.live and not frame.contours_button.isEnabled()
    QTest.mouseClick(frame.take_button, Qt.MouseButton.LeftButton)
    Hands.wait(lambda: fit.instant is not None, 10.0)
    assert set(fit.instant.images) == {0, 1}
    truth, twin = simulated_rig.truth, twin_defaults()
    model = build_model(truth.hand)
    standing = load_motion("still", model, np.array([0.5e-3 * twin.baseline_mm, 0.0, twin.distance_m]), 1).pose(0.0)
    joints = forward(model, standing).joints
    for camera, view in enumerate(frame.views):
        for name in ("wrist", "index_mcp", "little_mcp", "thumb_mcp", "thumb_tip", "index_tip", "middle_tip",
                     "ring_tip", "little_tip"):
            drag(view, JOINTS.index(name), fit.cameras[camera].project(joints)[JOINTS.index(name)])
    frame.freedom_box.setCurrentIndex(1)
    QTest.mouseClick(frame.anchors_button, Qt.MouseButton.LeftButton)
    Hands.wait(lambda: "Fitted to the anchors" in window.message, 30.0)
    QTest.mouseClick(frame.contours_button, Qt.MouseButton.LeftButton)
    Hands.wait(lambda: "contour was found" in window.message, 120.0)
    frame.form.show_group("Lengths")
    window.frame_hand()
    for view in frame.views:
        view.choose(-1)
    check("hand-fit-live", window.grab().toImage(), 60)
    QTest.mouseClick(frame.use_button, Qt.MouseButton.LeftButton)
    Hands.wait(lambda: "The rig has this hand now" in window.message, 60.0)
    saved = simulated_rig.saved.hand
    for finger in saved.fingers:
        length_mm = sum(truth.hand.fingers[finger].bones_mm)
        assert sum(saved.fingers[finger].bones_mm) == pytest.approx(length_mm, rel=0.05), finger
    assert versions(simulated_rig.path)[0].replaced_by == "hand fitted to pictures"
