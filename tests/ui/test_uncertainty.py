"""What the window tells of how well things are known: toolbar of the scene, hover, key, panels."""

from __future__ import annotations

from dataclasses import replace

import msgspec
import numpy as np
import pytest
from fake_backend import FakeBackend
from fake_engine import FakeEngine, synthetic_rig
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QHelpEvent, QImage
from PySide6.QtWidgets import QApplication, QToolButton, QToolTip
from test_tracker_dialog import FLOATING

from rhot_app.state import Knowledge
from rhot_app.ui.models.rows import sd_number, worst_sd
from rhot_app.ui.scene.ellipsoid_mesh import EllipsoidChoice
from rhot_app.ui.scene.labels import ellipsoid_text


@pytest.fixture(scope="module")
def rig():
    return msgspec.structs.replace(synthetic_rig(), tracker=FLOATING)


@pytest.fixture(scope="module")
def window(make_shared_bench, rig):
    return make_shared_bench(FakeBackend(FakeEngine(rig, running=False)))


@pytest.fixture
def estimating(window):
    """The window on a rig with the estimator, tracking, looking as at the first start."""
    window.window.reset_settings()
    window.track()
    return window


def button_for(bench, action):
    """The button of the scene's toolbar that triggers an action."""
    buttons = bench.window.pages.currentWidget().bar.findChildren(QToolButton)
    return next(button for button in buttons if button.defaultAction() is action)


def test_ellipsoids_are_switched_in_the_scenes_toolbar_and_remembered(estimating, make_bench):
    actions, scene = estimating.window.actions_, estimating.window.screen_parts.scene
    assert scene.ellipsoids == EllipsoidChoice()
    estimating.click(button_for(estimating, actions.cloud_sizes[1]))
    assert scene.ellipsoids == EllipsoidChoice(factor=10)
    actions.cloud_kinds[0].trigger()
    assert scene.ellipsoids == EllipsoidChoice(joints=False, factor=10)
    estimating.press(Qt.Key.Key_U)
    assert scene.ellipsoids is None and not actions.cloud_sizes[0].isEnabled()
    estimating.press(Qt.Key.Key_U)
    again = make_bench(settings=estimating.window.settings)
    assert again.window.screen_parts.scene.ellipsoids == EllipsoidChoice(joints=False, factor=10)


def test_the_mouse_over_a_joint_tells_how_well_it_is_known(estimating):
    scene, engine = estimating.window.screen_parts.scene, estimating.backend.engine
    scene.frame_hand()
    engine.running = False  # so that the hand stands still
    estimating.until(lambda: estimating.window.toolbar.badge.word == "IDLE")
    scene.show_state(engine.state(1.0))
    x, y = scene.to_widget(scene.state.joint_positions[14:15])[0]
    at = QPoint(round(x), round(y))
    told = scene.tool_tip_at(at)
    assert all(word in told for word in ("ring PIP joint", "inferred", "± 4.8 mm", "worst axis"))
    QApplication.sendEvent(scene, QHelpEvent(QHelpEvent.Type.ToolTip, at, scene.mapToGlobal(at)))
    estimating.until(lambda: QToolTip.text().startswith("ring PIP joint"))
    assert scene.tool_tip_at(QPoint(2, 2)) == ""
    QToolTip.hideText()


def picture(bench):
    """What stands in the scene, (H, W, 3) grey levels."""
    bench.run(0.0)
    image = bench.window.screen_parts.scene.grabFramebuffer().convertToFormat(QImage.Format.Format_RGB888)
    rows = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), image.bytesPerLine())
    return rows[:, :3 * image.width()].reshape(image.height(), image.width(), 3).astype(float)


def test_large_ellipsoids_of_guesses_leave_the_hand_in_sight(estimating):
    """The little finger is guessed; its ellipsoids, ten times as large, reach over the whole hand."""
    scene, engine = estimating.window.screen_parts.scene, estimating.backend.engine
    estimating.window.actions_.names.setChecked(False)
    engine.running = False
    estimating.let_pass(2.0)
    estimating.until(lambda: not scene.actors.visible)
    state = engine.state(1.0)
    scene.show_state(state)
    scene.frame_hand()
    scene.show_state(None)
    guesses = replace(state, joint_covariances=np.where(
        (state.joint_knowledge == Knowledge.GUESSED)[:, None, None], state.joint_covariances, np.nan))
    scene.show_ellipsoids(EllipsoidChoice(fingertips=False, markers=False, factor=10))
    blank = picture(estimating)
    scene.show_state(guesses)
    with_clouds = picture(estimating)
    assert "cut at 60 mm" in " ".join(scene.legend.rows[3:])
    scene.show_state(replace(guesses, joint_covariances=np.full_like(state.joint_covariances, np.nan)))
    alone = picture(estimating)
    key = round(scene.legend.size.height()) + 16
    alone, with_clouds, blank = (image[:-key] for image in (alone, with_clouds, blank))
    hand = np.abs(alone - blank).max(axis=2) > 20
    covered = hand & (np.abs(with_clouds - alone).max(axis=2) > 2)
    assert covered.sum() > 1000, "they do lie over the hand"
    assert np.abs(with_clouds - alone)[covered].mean() < 12.0


def test_the_key_of_the_scene_fits_it_and_names_the_tracker(estimating):
    scene, actions = estimating.window.screen_parts.scene, estimating.window.actions_
    estimating.click(button_for(estimating, actions.cloud_sizes[1]))
    estimating.until(lambda: any("cut at 60 mm" in row for row in scene.legend.rows))
    assert scene.tracker_word == "estimator"
    estimating.window.resize(1024, 700)
    estimating.until(lambda: scene.legend.size.width() < scene.width())
    rows = " ".join(scene.legend.rows[3:])
    assert all(words in rows for words in ("3 sigma", "10 ×", "cut at 60 mm"))


def test_panels_tell_standard_deviations(estimating):
    parts = estimating.window.screen_parts
    estimating.until(lambda: parts.markers.spreads == ["1.8"] * 6)
    assert [parts.hand.cells[last].text().partition(" ")[2] for last in (4, 8, 12, 16, 20)] == [
        "±1°", "±1°", "±3°", "±8°", "±20°"]
    estimating.until(lambda: all(words in parts.hand.palm.text() for words in (
        "measured", "± 0.50 mm", "± 1.1°", "size 1.03 ± 0.02")))


def test_the_key_says_how_large_ellipsoids_are_drawn():
    assert ellipsoid_text(None, cut=False) == "" == ellipsoid_text(EllipsoidChoice(False, False, False), cut=False)
    assert ellipsoid_text(EllipsoidChoice(), cut=False).split(", ")[0] == "3 sigma"
    assert all(words in ellipsoid_text(EllipsoidChoice(factor=10), cut=True) for words in ("10 ×", "cut at 60 mm"))


def test_the_worst_axis_may_lie_anywhere():
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    covariance = turn @ np.diag([1e-6, 4e-6, 9e-6]) @ turn.T
    found = worst_sd(np.stack([covariance, np.full((3, 3), np.nan)]))
    assert found[0] == pytest.approx(3e-3) and np.isnan(found[1])
    assert [sd_number(sd) for sd in (0.000314, 0.0024, 0.0181, np.nan)] == ["0.31", "2.4", "18", ""]
