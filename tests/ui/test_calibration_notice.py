"""A rig that nobody calibrated says so for as long as it is so, states no precision, and offers the wizard."""

from __future__ import annotations

import msgspec
import pytest
from fake_backend import FakeBackend
from fake_engine import FakeEngine, synthetic_rig
from PySide6.QtWidgets import QPushButton
from test_tracker_dialog import FLOATING

from rhot_app.calibration.check.camera_calibration import calibration_error
from rhot_app.engine.status import Advice
from rhot_app.project import CameraCalibration, CameraPose, Intrinsics, load_rig
from rhot_app.ui.models.notice import Notice
from rhot_app.ui.panels.advice_bar import SHOWN, chosen_of
from rhot_app.ui.scene.hands import spots
from rhot_node.files import resource_path

HEADLINE = "Not calibrated: millimetres are not reliable."
TRACKED = "The hand is tracked and every marker is seen."


def calibrated_rig(lengths="ruler"):
    """As a calibration with a board leaves it."""
    lens = Intrinsics(640, 480, 530.0, 530.0, 318.0, 241.0, (-0.2, 0.05, 0.0, 0.0, 0.0))
    rig = synthetic_rig(calibration=CameraCalibration("board", lengths, 1e-3))
    left, right = (msgspec.structs.replace(node, intrinsics=lens) for node in rig.nodes)
    turned = CameraPose((0.99995, 0.01, 0.0, 0.0), right.pose.translation_m)
    return msgspec.structs.replace(rig, nodes=(left, msgspec.structs.replace(right, pose=turned)))


@pytest.fixture
def tracked(make_bench):
    """Opens a window on a rig and starts tracking, as a person does."""

    def track(rig):
        bench = make_bench(FakeBackend(FakeEngine(rig, running=False)))
        bench.until(lambda: bench.window.welcome.twin_button.isVisible())
        bench.click(bench.window.welcome.twin_button)
        bench.until(lambda: bench.window.toolbar.badge.word == "TRACKING" and any(bench.window.screen_parts.markers
                                                                                  .spreads))
        return bench

    return track


def buttons(bench):
    """The buttons at the bottom of the window that can be clicked."""
    return [button for button in bench.window.advice.findChildren(QPushButton) if button.isVisible()]


def place_of_button(bench):
    """How far the only button's lower left corner is from the window's, px."""
    (button,) = buttons(bench)
    at = button.mapTo(bench.window, button.rect().bottomLeft())
    return at.x(), bench.window.height() - at.y()


def laid_out(bench):
    """Whether the toolbar around the sentences has taken their height, which it does a moment after they changed."""
    return bench.window.advice.parentWidget().height() > bench.window.advice.height()


def test_an_uncalibrated_rig_says_so_and_its_button_opens_the_lens_wizard(tracked):
    rig = load_rig(resource_path("rigs", "two_pis.json"))
    bench = tracked(rig)
    bench.until(lambda: len(bench.window.advice.texts) == 2 and len(buttons(bench)) == 1)
    operational, lasting = bench.window.advice.texts
    assert operational == TRACKED and lasting.startswith(HEADLINE)
    assert "Everything is in order." not in bench.window.advice.texts
    assert set(bench.window.screen_parts.markers.spreads) == {"?"}
    (button,) = buttons(bench)
    assert button.text() == "Calibrate …"
    bench.click(button)
    bench.until(lambda: bench.window.wizards.wizard is not None)
    assert bench.window.wizards.wizard.plan.title == "Find the lens of a camera"
    bench.window.wizards.wizard.reject()


def test_the_notice_stays_where_it_is_while_other_sentences_come_and_go(tracked):
    bench = tracked(synthetic_rig(calibration=None))
    bench.until(lambda: len(bench.window.advice.texts) == 2 and len(buttons(bench)) == 1)
    bench.until(lambda: laid_out(bench))
    place = place_of_button(bench)
    bench.backend.engine.advice = (Advice("error", "Node left does not answer."), Advice("warning", "It is dark."),
                                   Advice("warning", "Camera right has seen no marker for 5 s."))
    bench.until(lambda: bench.window.advice.texts[0] == "Node left does not answer.")
    assert len(bench.window.advice.texts) == SHOWN and bench.window.advice.texts[-1].startswith(HEADLINE)
    bench.until(lambda: laid_out(bench) and place_of_button(bench) == place)


def test_a_simulated_rig_is_exact_and_needs_no_notice(tracked):
    bench = tracked(synthetic_rig())
    bench.until(lambda: bench.window.advice.texts == ["Everything is in order."])
    assert bench.window.screen_parts.markers.spreads == ["1.8"] * 6


def test_what_the_calibration_does_not_know_is_in_what_is_stated(tracked):
    bench = tracked(calibrated_rig())
    bench.until(lambda: bench.window.advice.texts == ["Everything is in order."])
    spreads = [float(text) for text in bench.window.screen_parts.markers.spreads]
    assert all(1.85 < spread < 2.6 for spread in spreads), "1.8 mm by noise, 0.8 to 1 mm by the calibration at 0.55 m"


def test_the_notice_is_gone_and_figures_are_back_once_the_rig_is_calibrated(tracked):
    bench = tracked(synthetic_rig(calibration=None))
    bench.until(lambda: bench.window.advice.texts[-1].startswith(HEADLINE))
    bench.backend.engine.rig = calibrated_rig()
    bench.window.rig_watch.look_soon()
    bench.until(lambda: bench.window.advice.texts == ["Everything is in order."])
    bench.until(lambda: any(text not in ("", "?") for text in bench.window.screen_parts.markers.spreads))


def test_lengths_that_were_never_checked_are_said_with_the_stereo_wizard(tracked):
    bench = tracked(calibrated_rig("skipped"))
    bench.until(lambda: len(bench.window.advice.texts) == 2 and len(buttons(bench)) == 1)
    assert bench.window.advice.texts[-1].startswith("Lengths were never checked against a ruler.")
    bench.click(buttons(bench)[0])
    bench.until(lambda: bench.window.wizards.wizard is not None)
    assert bench.window.wizards.wizard.plan.title == "Put the cameras together"
    bench.window.wizards.wizard.reject()


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


def test_a_lasting_notice_gives_way_to_none_and_takes_one_line_only():
    lasting = Notice("info", "lasting", lasting=True)
    errors = [Notice("error", f"error {number}") for number in range(5)]
    assert chosen_of([lasting, *errors]) == [*errors[:2], lasting]
    assert chosen_of(errors) == errors[:SHOWN]
