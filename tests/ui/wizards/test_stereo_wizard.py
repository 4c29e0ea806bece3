"""The wizard of the stereo calibration, clicked through on drawn boards; its steps on their own."""

from __future__ import annotations

from dataclasses import replace

import msgspec
import numpy as np
import pytest
from board_scene import BoardScene, compile_search
from fake_engine import EXACT, synthetic_rig
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from wizard_rig import FakeRigClient

from rhot_app.calibration.board.boards import STANDARD_BOARD, Chessboard
from rhot_app.calibration.board.size_check import Beyond
from rhot_app.calibration.check.checks import check_rig
from rhot_app.calibration.kinds.stereo import StereoViews, propose, solve
from rhot_app.calibration.registry import InForce
from rhot_app.calibration.stereo.calibrate import lens_of
from rhot_app.estimation.se3 import rotation_from_quaternion
from rhot_app.project import CameraPose, load_rig
from rhot_app.ui.backend.feed import Picture
from rhot_app.ui.wizards.framework.board import BoardFields, BoardStep
from rhot_app.ui.wizards.framework.definition import Definition
from rhot_app.ui.wizards.known_length import LengthsPage, LengthsStep
from rhot_app.ui.wizards.stereo import ShowStep

CAMERAS = ("left", "right")
replace_fields = msgspec.structs.replace
TRUE_BASELINE_M = 0.075
PLACES = [((0.0, 0.0, 0.0), (0.037, 0.0, 0.62)), ((-0.5, 0.0, 0.1), (0.04, -0.04, 0.6)),
          ((0.0, 0.5, 0.0), (-0.02, 0.0, 0.6)), ((0.0, -0.5, 0.0), (0.1, 0.0, 0.6)),
          ((0.3, 0.3, 0.0), (-0.06, -0.07, 0.62)), ((-0.3, 0.3, 0.0), (0.12, -0.08, 0.62)),
          ((0.3, -0.3, 0.2), (0.12, 0.08, 0.62)), ((-0.3, -0.3, -0.2), (-0.05, 0.08, 0.62)),
          ((0.4, 0.4, 0.3), (0.037, 0.0, 0.95)), ((-0.4, 0.4, 0.0), (-0.1, -0.12, 0.95)),
          ((0.4, -0.4, 0.0), (0.2, 0.12, 0.95)), ((0.0, 0.0, 0.4), (0.2, -0.14, 0.95)),
          ((0.5, 0.3, 0.0), (-0.12, 0.14, 0.95)), ((0.0, 0.6, 0.2), (0.04, 0.1, 0.75)),
          ((0.2, -0.6, 0.0), (0.04, -0.1, 0.75))]
TABLE = ((-1.15, 0.0, 0.0), (0.037, 0.12, 0.7))


@pytest.fixture(scope="module")
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
def hands(open_wizard, wrong_rig, scene):
    """The wizard on a rig file, before drawn boards."""
    return open_wizard("stereo", FakeRigClient(wrong_rig, scene.draw))


def test_from_the_board_to_a_saved_rig(hands, scene):
    scene.place(*PLACES[0])
    hands.type(hands.window.page.square, "25,0")
    hands.until(lambda: hands.window.step.view().done and "left, right" in hands.sentence)
    hands.next()
    for count, place in enumerate(PLACES):
        scene.place(*place)
        hands.until(lambda count=count: len(hands.window.step.views.shots) > count)
    hands.until(lambda: "Next" in hands.sentence and hands.frame.bars.bars[0].full)
    hands.next()
    page, button = hands.window.page, hands.frame.next_button
    hands.until(lambda: "Skip" in hands.hint and not button.isEnabled())
    hands.click(page.skip)
    hands.until(button.isEnabled)
    hands.click(page.skip)
    hands.until(lambda: not button.isEnabled())
    page.baseline.setValue(75.0)
    hands.next()
    hands.solved()
    assert hands.verdict.acceptable
    hands.next()
    scene.place(*TABLE)
    hands.until(lambda: scene.seen_in(hands.window.step.seen))
    hands.key(Qt.Key.Key_Space)
    hands.until(lambda: hands.window.step.view().done)
    hands.next()
    texts = [hands.window.page.table.text(0, column) for column in range(3)]
    assert load_rig(hands.path).calibration == EXACT, "nothing is written yet"
    assert texts[0] == "left to right: distance" and texts[1] == "60.00 mm"
    assert float(texts[2].split(" ± ")[0]) == pytest.approx(75.0, abs=0.2)
    assert np.linalg.norm(hands.client.rig.nodes[1].pose.translation_m) == pytest.approx(0.06)
    hands.use()
    saved = load_rig(hands.path)
    left, right = saved.nodes
    baseline = np.linalg.norm(np.subtract(right.pose.translation_m, left.pose.translation_m))
    assert baseline == pytest.approx(TRUE_BASELINE_M, abs=0.0003)
    assert (saved.calibration.method, saved.calibration.lengths) == ("board", "baseline")
    assert 0.0 < saved.calibration.error_m < 2e-3
    assert left.pose.translation_m[2] > 0.1, "the camera stands above the table"
    assert rotation_from_quaternion(left.pose.rotation_wxyz)[2, 2] < 0.0, "and looks down on it"


def test_nobody_gets_past_the_board_without_measuring_it(hands, scene):
    scene.place(*PLACES[0])
    page, button = hands.window.page, hands.frame.next_button
    assert page.square.text() == "" and "measure" in page.square.placeholderText()
    hands.until(lambda: len(hands.window.step.view().annotated) == 2)
    hands.until(lambda: "Measure the squares" in hands.sentence and "Next waits" in hands.hint)
    assert not button.isEnabled()
    hands.key(Qt.Key.Key_Return)
    QTest.mouseClick(button, Qt.MouseButton.LeftButton)
    assert hands.title == "Your board"
    hands.type(page.square, "24.6")
    hands.until(button.isEnabled)
    hands.next()
    assert hands.window.step.board == Chessboard(9, 6, 0.0246)
    hands.click(hands.frame.back_button)
    assert page.square.text() == "24.6", "going back loses nothing"
    page.square.clear()
    hands.until(lambda: not button.isEnabled())


def test_the_ruler_is_clicked_in_held_pictures(open_wizard, wrong_rig):
    hands = open_wizard("Ruler", FakeRigClient(wrong_rig),
                        make=lambda context: Definition((LengthsPage(LengthsStep(CAMERAS)),)))
    page, step = hands.window.page, hands.window.step
    assert not page.hold.isEnabled()
    page.ruler.setValue(240.0)
    hands.until(page.hold.isEnabled)
    hands.until(lambda: set(step.frozen) == set(CAMERAS) or page.hold.click())  # once both have a picture
    for view in hands.frame.grid.views.values():
        for share in (0.3, 0.7):
            hands.click(view, QPoint(round(share * view.width()), view.height() // 2))
    hands.until(lambda: step.view().done and "scale" in hands.sentence)
    assert step.known.ruler.length_m == pytest.approx(0.24)


# -- the steps without a window ----------------------------------------------------------------------------------------

@pytest.fixture(scope="module")
def shown(compiled):
    """The step of the captures, the board shown to it in every place; Space each time."""
    scene = BoardScene(synthetic_rig(), STANDARD_BOARD)
    show = ShowStep(BoardStep(BoardFields(square_mm=25.0), CAMERAS), CAMERAS)
    show.enter()
    for place in PLACES:
        scene.place(*place)
        show.accept_observation(show.observe(scene.pictures()))
        show.capture()
    assert show.view().done, show.view()
    return show


def solved(shown, rig, known, board=STANDARD_BOARD):
    """The result of the shots; `board` is what the person says of the squares."""
    lenses = [None if node.intrinsics.nominal else lens_of(node) for node in rig.nodes]
    views = StereoViews(replace(shown.views, board=board), known.known, tuple(lenses))
    return solve(views, InForce(rig), progress=lambda text, fraction: None)


def test_a_corrected_square_keeps_the_shots(compiled):
    scene, board = BoardScene(synthetic_rig(), STANDARD_BOARD), BoardStep(BoardFields(square_mm=25.0), CAMERAS)
    show = ShowStep(board, CAMERAS)
    show.enter()
    scene.place(*PLACES[0])
    show.accept_observation(show.observe(scene.pictures()))
    assert show.capture()
    board.change(replace_fields(board.fields, square_mm=24.6))
    show.enter()
    assert len(show.views.shots) == 1 and show.views.board == Chessboard(9, 6, 0.0246)
    board.change(replace_fields(board.fields, cols=8))
    show.enter()
    assert show.views.shots == (), "shots of another board are useless"


@pytest.mark.parametrize(("cols", "rows", "said"), [(10, 7, "seems to have 9x6"), (8, 5, "seems to have 9x6"),
                                                 (9, 6, "larger than 9x6")])
def test_a_wrong_board_is_named_where_it_is_shown_and_gives_no_shots(compiled, cols, rows, said):
    scene = BoardScene(synthetic_rig(), STANDARD_BOARD)
    show = ShowStep(BoardStep(BoardFields(cols=cols, rows=rows, square_mm=25.0), CAMERAS), CAMERAS)
    show.enter()
    for place in PLACES[:3]:
        scene.place(*place)
        seen = show.observe(scene.pictures())
        show.accept_observation(replace(seen, beyond=(Beyond(column=True, row=False),) * 2) if cols == 9 else seen)
    assert said in show.view().hint and not show.capture() and not show.view().may_go_on


def test_a_length_check_is_skipped_knowingly_and_the_rig_says_so(shown, wrong_rig):
    known = LengthsStep(CAMERAS)
    assert not known.view().may_go_on and "Skip" in known.view().hint
    known.skip(True)
    assert known.view().passable and not known.view().done and "unproven" in known.view().sentence
    result = solved(shown, wrong_rig, known)
    assert "lengths_unproven" in result.verdict.codes
    proposal = propose(result, InForce(wrong_rig))
    assert any("never checked" in row.after for row in proposal.rows)
    assert (proposal.rig.calibration.method, proposal.rig.calibration.lengths) == ("board", "skipped")
    assert "lengths_unproven" in check_rig(proposal.rig).verdict.codes


def test_a_wrong_square_size_is_found_by_the_baseline_and_writes_nothing(shown, wrong_rig, tmp_path):
    known = LengthsStep(CAMERAS)
    known.set_lengths(75.0, 0.0)
    result = solved(shown, wrong_rig, known, Chessboard(9, 6, 0.025 / 1.1))  # printed too large, and not measured
    assert not result.verdict.acceptable and "baseline" in result.verdict.codes
    assert propose(result, InForce(wrong_rig)).save(tmp_path / "desk.json") == "" and not list(tmp_path.iterdir())


def test_undo_forgets_the_last_shot_and_another_board_all(scene):
    board = BoardStep(BoardFields(square_mm=25.0), CAMERAS)
    show = ShowStep(board, CAMERAS)
    show.enter()
    for count, place in enumerate(PLACES[:2], 1):
        scene.place(*place)
        show.accept_observation(show.observe(scene.pictures()))
        show.capture()
        assert len(show.views.shots) == count
    first = show.views.shots[0]
    assert show.undo() and show.views.shots == (first,)
    board.change(BoardFields(cols=8, square_mm=25.0))
    show.enter()
    assert not show.views.shots and show.views.board.cols == 8


def test_pictures_of_a_ruler_can_be_held_before_the_first_ones_came():
    pictures = {name: Picture(name, np.zeros((480, 640, 3), np.uint8), 1, 0, 0) for name in CAMERAS}
    step = LengthsStep(CAMERAS)
    step.set_lengths(0.0, 200.0)
    assert not step.capture()
    step.accept_observation(pictures)
    assert step.frozen == pictures
    assert step.undo() and not step.frozen
    step.accept_observation(pictures)
    assert not step.frozen, "let go for good"


def test_a_ruler_needs_both_ends_in_two_pictures():
    blank = np.zeros((480, 640, 3), np.uint8)
    step = LengthsStep(CAMERAS)
    assert not step.view().may_go_on and step.known.ruler is None
    step.set_lengths(0.0, 200.0)
    step.accept_observation({name: Picture(name, blank, 1, 0, 0) for name in CAMERAS})
    assert step.capture() and not step.view().passable
    for camera, x in (("left", 100.0), ("left", 300.0), ("right", 60.0)):
        step.pick(camera, x, 240.0)
    assert step.known.ruler is None and "both ends" in step.view().sentence
    step.pick("right", 260.0, 240.0)
    assert step.view().done and step.known.ruler.length_m == pytest.approx(0.2)
    assert np.allclose(step.known.ruler.ends[1], [[60.0, 240.0], [260.0, 240.0]])
    step.undo()
    assert step.known.ruler is None
