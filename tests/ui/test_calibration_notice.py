"""A rig that nobody calibrated says so for as long as it is so, states no precision, and offers the wizard."""

from __future__ import annotations

import msgspec
import pytest
from fake_engine import synthetic_rig
from test_tracker_dialog import FLOATING

from rhot_app.calibration.check.camera_calibration import calibration_error
from rhot_app.calibration.registry import calibration
from rhot_app.engine.status import Advice
from rhot_app.project import CameraCalibration, CameraPose, Intrinsics, load_rig
from rhot_app.ui.panels.advice_bar import RESERVED
from rhot_app.ui.scene.hands import spots
from rhot_node.files import resource_path

HEADLINE = "Not calibrated"


def calibrated_rig(lengths="ruler"):
    """As a calibration with a board leaves it."""
    lens = Intrinsics(640, 480, 530.0, 530.0, 318.0, 241.0, (-0.2, 0.05, 0.0, 0.0, 0.0))
    rig = synthetic_rig(calibration=CameraCalibration("board", lengths, 1e-3))
    left, right = (msgspec.structs.replace(node, intrinsics=lens) for node in rig.nodes)
    turned = CameraPose((0.99995, 0.01, 0.0, 0.0), right.pose.translation_m)
    return msgspec.structs.replace(rig, nodes=(left, msgspec.structs.replace(right, pose=turned)))


@pytest.fixture
def tracked(shared_bench):
    """Has the window's engine track on another rig."""
    bench = shared_bench
    bench.track()

    def track(rig):
        bench.backend.engine.rig = rig
        bench.window.rig_watch.look_soon()
        bench.until(lambda: bench.controller.rig == rig and bench.window.toolbar.badge.word == "TRACKING")
        bench.until(lambda: any(bench.window.screen_parts.markers.spreads))
        return bench

    yield track
    if bench.window.wizards.wizard is not None:
        bench.window.wizards.wizard.reject()
        bench.until(lambda: bench.window.wizards.wizard is None)
    track(synthetic_rig())


def place_of_button(bench):
    """How far the only button's lower left corner is from the window's, px."""
    (button,) = bench.window.advice.buttons.values()
    at = button.mapTo(bench.window, button.rect().bottomLeft())
    return at.x(), bench.window.height() - at.y()


def laid_out(bench):
    """Whether the toolbar around the sentences has taken their height, which it does a moment after they changed."""
    return bench.window.advice.parentWidget().height() > bench.window.advice.height()


def test_an_uncalibrated_rig_says_so_and_its_button_opens_the_lens_wizard(tracked):
    rig = load_rig(resource_path("rigs", "two_pis.json"))
    bench = tracked(rig)
    advice = bench.window.advice
    bench.until(lambda: len(advice.texts) == 2 and list(advice.buttons) == ["Calibrate …"])
    operational, lasting = advice.texts
    assert "hand is tracked" in operational and HEADLINE in lasting and not bench.calm
    assert set(bench.window.screen_parts.markers.spreads) == {"≥ 1.8"}
    bench.click(advice.buttons["Calibrate …"])
    bench.until(lambda: bench.window.wizards.wizard is not None)
    assert bench.window.wizards.wizard.windowTitle() == calibration("lens").title


def test_the_notice_stays_where_it_is_while_other_sentences_come_and_go(tracked):
    bench = tracked(synthetic_rig(calibration=None))
    advice = bench.window.advice
    bench.until(lambda: len(advice.texts) == 2 and len(advice.buttons) == 1 and laid_out(bench))
    place = place_of_button(bench)
    bench.backend.engine.advice = (Advice("error", "Node left does not answer."), Advice("warning", "It is dark."),
                                   Advice("warning", "Camera right has seen no marker for 5 s."))
    bench.until(lambda: bench.said("left does not answer"))
    assert len(advice.texts) == RESERVED + 1 and HEADLINE in advice.texts[-1]
    bench.until(lambda: laid_out(bench) and place_of_button(bench) == place)


def test_a_simulated_rig_is_exact_and_needs_no_notice(tracked):
    bench = tracked(synthetic_rig())
    bench.until(lambda: bench.calm)
    assert bench.window.screen_parts.markers.spreads == ["1.8"] * 6


def test_what_is_stated_is_what_is_published_which_has_the_error_of_the_calibration(tracked):
    bench = tracked(calibrated_rig())
    bench.until(lambda: bench.calm)
    bench.until(lambda: bench.window.screen_parts.markers.spreads == ["1.8"] * 6)


def test_the_notice_is_gone_and_figures_are_back_once_the_rig_is_calibrated(tracked):
    bench = tracked(synthetic_rig(calibration=None))
    bench.until(lambda: bench.said(HEADLINE))
    tracked(calibrated_rig())
    bench.until(lambda: bench.calm)
    bench.until(lambda: any(text and "≥" not in text for text in bench.window.screen_parts.markers.spreads))


def test_lengths_that_were_never_checked_are_said_with_the_stereo_wizard(tracked):
    bench = tracked(calibrated_rig("skipped"))
    advice = bench.window.advice
    bench.until(lambda: len(advice.texts) == 2 and len(advice.buttons) == 1)
    assert "never checked" in advice.texts[-1]
    bench.click(*advice.buttons.values())
    bench.until(lambda: bench.window.wizards.wizard is not None)
    assert bench.window.wizards.wizard.windowTitle() == calibration("stereo").title


def test_the_hand_and_the_scene_state_no_precision_that_nobody_knows(tracked):
    rig = msgspec.structs.replace(synthetic_rig(calibration=None), tracker=FLOATING)
    bench = tracked(rig)
    parts = bench.window.screen_parts
    bench.until(lambda: parts.hand.palm.text() == "measured; size 1.03")
    assert not any("±" in cell.text() for cell in parts.hand.cells)
    assert "not calibrated" in parts.hand.palm.toolTip()
    spot = spots(bench.backend.engine.state(1.0))[0]
    assert "±" not in spot.text(calibration_error(rig)) and "not calibrated" in spot.text(calibration_error(rig))
    assert "±" in spot.text(calibration_error(synthetic_rig()))
