"""The wizard that puts cameras together, clicked through on drawn boards; its models on their own."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest
from board_scene import BoardScene, compile_search
from fake_engine import EXACT, synthetic_rig
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from wizard_hands import Hands
from wizard_rig import FakeMemory, FakeRigAsker

from rhot_app.calibration.board.boards import STANDARD_BOARD, Chessboard
from rhot_app.calibration.check.checks import check_rig
from rhot_app.geometry.transforms import rotation_from_quaternion
from rhot_app.project import CameraPose, load_rig, save_rig
from rhot_app.ui.backend.feed import Picture
from rhot_app.ui.models.palette import DARK
from rhot_app.ui.wizards.framework.plan import Kit
from rhot_app.ui.wizards.framework.window import WizardWindow
from rhot_app.ui.wizards.steps.known_step import KnownStep
from rhot_app.ui.wizards.stereo import make_plan

TRUE_BASELINE_M = 0.075
PLACES = [((0.0, 0.0, 0.0), (0.037, 0.0, 0.62)), ((0.5, 0.0, 0.0), (0.037, 0.03, 0.6)),
          ((-0.5, 0.0, 0.1), (0.04, -0.04, 0.6)), ((0.0, 0.5, 0.0), (-0.02, 0.0, 0.6)),
          ((0.0, -0.5, 0.0), (0.1, 0.0, 0.6)), ((0.3, 0.3, 0.0), (-0.06, -0.07, 0.62)),
          ((-0.3, 0.3, 0.0), (0.12, -0.08, 0.62)), ((0.3, -0.3, 0.2), (0.12, 0.08, 0.62)),
          ((-0.3, -0.3, -0.2), (-0.05, 0.08, 0.62)), ((0.4, 0.4, 0.3), (0.037, 0.0, 0.95)),
          ((-0.4, 0.4, 0.0), (-0.1, -0.12, 0.95)), ((0.4, -0.4, 0.0), (0.2, 0.12, 0.95)),
          ((0.0, 0.0, 0.4), (0.2, -0.14, 0.95)), ((0.5, 0.3, 0.0), (-0.12, 0.14, 0.95)),
          ((0.0, 0.6, 0.2), (0.04, 0.1, 0.75)), ((0.2, -0.6, 0.0), (0.04, -0.1, 0.75)),
          ((0.6, 0.0, 0.3), (-0.1, 0.0, 0.8)), ((-0.6, 0.2, 0.0), (0.17, 0.0, 0.8))]
TABLE = ((-1.15, 0.0, 0.0), (0.037, 0.12, 0.7))


@pytest.fixture
def wrong_rig():
    """The rig as a beginner has it: the cameras stand 60 mm apart by its file, 75 mm in truth."""
    rig = synthetic_rig()
    right = msgspec.structs.replace(rig.nodes[1], pose=CameraPose(translation_m=(0.06, 0.0, 0.0)))
    return msgspec.structs.replace(rig, nodes=(rig.nodes[0], right))


@pytest.fixture(scope="module", autouse=True)
def compiled():
    compile_search()


@pytest.fixture
def scene():
    return BoardScene(synthetic_rig(), STANDARD_BOARD)


@pytest.fixture
def hands(themed, wrong_rig, scene, tmp_path):
    """The wizard on a rig file, before drawn boards."""
    path = tmp_path / "desk.json"
    save_rig(path, wrong_rig)
    asker = FakeRigAsker(wrong_rig, scene.draw)
    kit = Kit(wrong_rig, path, asker.connect, DARK, FakeMemory())
    hands = Hands(WizardWindow(make_plan(kit), kit))
    hands.path, hands.asker = path, asker
    yield hands
    hands.window.end().wait(5.0)
    hands.window.deleteLater()


def show_all_places(hands, scene, most=99):
    """Hold the board wherever the wizard may want it, until it has enough."""
    for place in PLACES * 2:
        if hands.sentence == "Enough: press Next." or len(hands.window.step.views.shots) >= most:
            return
        kept = len(hands.window.step.views.shots)
        scene.place(*place)
        hands.until(lambda kept=kept: len(hands.window.step.views.shots) > kept
                    or (scene.seen_in(hands.window.step.seen)
                        and "is there already" in hands.window.frame.hint.text()))


def test_from_the_board_to_a_saved_rig(hands, scene):
    scene.place(*PLACES[0])
    hands.type(hands.window.page.square, "25,0")
    hands.until(lambda: hands.sentence == "Seen by left and right: this is the board.")
    hands.next()
    show_all_places(hands, scene)
    assert hands.sentence == "Enough: press Next." and hands.window.frame.bars.bars[0].full
    hands.next()
    assert hands.title == "A known length"
    hands.window.page.baseline.setValue(75.0)
    hands.next()
    hands.until(lambda: hands.window.frame.verdict.verdict is not None, timeout_s=120.0)
    assert hands.window.frame.verdict.verdict.acceptable
    hands.next()
    scene.place(*TABLE)
    hands.until(lambda: all(view is not None for view in hands.window.step.seen.values()))
    hands.run(0.4)
    hands.key(Qt.Key.Key_Space)
    hands.until(lambda: hands.sentence == "The table is known: press Next.")
    hands.next()
    texts = [hands.window.page.table.item(0, column).text() for column in range(3)]
    assert load_rig(hands.path).calibration == EXACT, "nothing is written yet"
    assert texts[0] == "left to right: distance" and texts[1] == "60.00 mm"
    assert float(texts[2].split(" ± ")[0]) == pytest.approx(75.0, abs=0.2)
    assert np.linalg.norm(hands.asker.rig.nodes[1].pose.translation_m) == pytest.approx(0.06)
    hands.next()
    hands.until(lambda: hands.window.frame.next_button.text() == "Close")
    left, right = load_rig(hands.path).nodes
    baseline = np.linalg.norm(np.subtract(right.pose.translation_m, left.pose.translation_m))
    assert baseline == pytest.approx(TRUE_BASELINE_M, abs=0.0003)
    record = load_rig(hands.path).calibration
    assert (record.method, record.lengths) == ("board", "baseline") and 0.0 < record.error_m < 2e-3
    assert left.pose.translation_m[2] > 0.1, "the camera stands above the table"
    assert rotation_from_quaternion(left.pose.rotation_wxyz)[2, 2] < 0.0, "and looks down on it"


def test_nobody_gets_past_the_board_without_measuring_it(hands, scene):
    scene.place(*PLACES[0])
    page, button = hands.window.page, hands.window.frame.next_button
    assert page.square.text() == "" and "measure" in page.square.placeholderText()
    hands.until(lambda: len(hands.window.step._views) == 2)
    assert not button.isEnabled() and hands.sentence == "Measure the squares and type their size."
    assert "Next waits for the size" in hands.window.frame.hint.text()
    hands.key(Qt.Key.Key_Return)
    QTest.mouseClick(button, Qt.MouseButton.LeftButton)
    assert hands.title == "Your board"
    hands.type(page.square, "24.6")
    hands.until(button.isEnabled)
    hands.next()
    assert hands.window.step.board == Chessboard(9, 6, 0.0246)
    hands.click(hands.window.frame.back_button)
    assert page.square.text() == "24.6", "going back loses nothing"
    page.square.clear()
    hands.until(lambda: not button.isEnabled())


def test_a_length_check_is_skipped_knowingly_and_the_rig_says_so(hands, scene):
    hands.type(hands.window.page.square, "25")
    hands.next()
    show_all_places(hands, scene)
    hands.next()
    page, button = hands.window.page, hands.window.frame.next_button
    hands.run(0.3)
    assert hands.title == "A known length" and not button.isEnabled() and "Skip" in hands.window.frame.hint.text()
    hands.click(page.skip)
    hands.until(button.isEnabled)
    hands.click(page.skip)
    hands.until(lambda: not button.isEnabled(), timeout_s=5.0)
    hands.click(page.skip)
    hands.until(button.isEnabled)
    assert hands.sentence == "Lengths stay unproven: press Next."
    hands.next()
    hands.until(lambda: hands.window.frame.verdict.verdict is not None, timeout_s=120.0)
    assert hands.window.frame.verdict.verdict.codes >= {"lengths_unproven"}
    hands.next()
    hands.next()
    assert any("never checked against a ruler" in hands.window.page.table.item(row, 2).text()
               for row in range(hands.window.page.table.rowCount()))
    hands.next()
    hands.until(lambda: hands.window.frame.next_button.text() == "Close")
    saved = load_rig(hands.path)
    assert (saved.calibration.method, saved.calibration.lengths) == ("board", "skipped")
    assert "lengths_unproven" in check_rig(saved).verdict.codes


def test_a_wrong_square_size_is_found_by_the_baseline(hands, scene):
    scene.board = Chessboard(9, 6, 0.0275)  # printed too large, and not measured
    hands.type(hands.window.page.square, "25")
    hands.next()
    show_all_places(hands, scene)
    hands.next()
    hands.window.page.baseline.setValue(75.0)
    hands.next()
    hands.until(lambda: hands.window.frame.verdict.verdict is not None, timeout_s=120.0)
    verdict = hands.window.frame.verdict.verdict
    assert not verdict.acceptable and "baseline" in verdict.codes
    assert not hands.window.frame.next_button.isEnabled()
    assert hands.sentence == "Do what the verdict says, then come back."


def test_undo_forgets_the_last_shot_and_another_board_all(hands, scene):
    hands.type(hands.window.page.square, "25")
    hands.next()
    scene.place(*PLACES[0])
    hands.until(lambda: len(hands.window.step.views.shots) == 1)
    scene.world_from_board = None
    hands.until(lambda: not any(hands.window.step.seen.values()))
    hands.key(Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    assert not hands.window.step.views.shots
    hands.click(hands.window.frame.back_button)
    hands.window.page.cols.setValue(8)
    hands.next()
    assert hands.window.step.views.board.cols == 8


def frozen_pictures():
    blank = np.zeros((480, 640, 3), np.uint8)
    return {name: Picture(name, blank, 1, 0, 0) for name in ("left", "right")}


def test_a_ruler_needs_both_ends_in_two_pictures():
    step = KnownStep(("left", "right"))
    assert not step.view().may_go_on and step.known.ruler is None
    step.set_lengths(0.0, 200.0)
    step.take(frozen_pictures())
    assert step.capture() and not step.view().passable
    for camera, x in (("left", 100.0), ("left", 300.0), ("right", 60.0)):
        step.pick(camera, x, 240.0)
    assert step.known.ruler is None and "Click both ends" in step.view().sentence
    step.pick("right", 260.0, 240.0)
    assert step.view().done and step.known.ruler.length_m == pytest.approx(0.2)
    assert np.allclose(step.known.ruler.ends[1], [[60.0, 240.0], [260.0, 240.0]])
    step.undo()
    assert step.known.ruler is None


def test_the_ruler_is_clicked_in_held_pictures(hands, scene):
    hands.type(hands.window.page.square, "25")
    hands.next()
    show_all_places(hands, scene, most=5)
    hands.next()
    page, wall = hands.window.page, hands.window.frame.wall
    page.ruler.setValue(240.0)
    hands.until(lambda: page.hold.isEnabled() and hands.window.step._live)
    hands.click(page.hold)
    hands.until(lambda: len(hands.window.step.frozen) == 2)
    for view in wall.views.values():
        for share in (0.3, 0.7):
            QTest.mouseClick(view, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier,
                             QPoint(round(share * view.width()), view.height() // 2))
    hands.until(lambda: hands.sentence == "The scale will be checked: press Next.")
    assert hands.window.step.known.ruler.length_m == pytest.approx(0.24)
