"""The lens wizard, clicked through on a drawn board; its steps on their own."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest
from board_scene import BoardScene, compile_search
from fake_engine import synthetic_rig
from wizard_rig import FakeRigClient

from rhot_app.calibration.board.boards import STANDARD_BOARD
from rhot_app.calibration.kinds.lens import what_follows
from rhot_app.project import Intrinsics, Rig, RigNode, load_rig
from rhot_app.ui.wizards.framework.board import BoardFields
from rhot_app.ui.wizards.framework.drawing import Cells, Line
from rhot_app.ui.wizards.lens import LAST, LensBoardStep, LensShowStep, straightened

TRUE_F = 530.0
PLACES = [((0.0, 0.0, 0.0), (0.0, 0.0, 0.417)), ((0.0, 0.0, 0.0), (-0.142, -0.083, 0.417)),
          ((0.0, 0.0, 0.0), (0.142, -0.083, 0.417)), ((0.0, 0.0, 0.0), (-0.142, 0.083, 0.417)),
          ((0.0, 0.0, 0.0), (0.142, 0.083, 0.417)), ((0.3, 0.2, 0.0), (0.0, 0.0, 0.283)),
          ((0.6, 0.0, 0.0), (0.0, 0.042, 0.417)), ((-0.6, 0.0, 0.1), (0.0, -0.042, 0.417)),
          ((0.0, 0.6, 0.0), (0.067, 0.0, 0.417)), ((0.0, -0.6, 0.0), (-0.067, 0.0, 0.417)),
          ((0.5, 0.5, 0.3), (-0.083, 0.067, 0.417)), ((-0.5, 0.5, 0.0), (0.083, 0.067, 0.417))]


@pytest.fixture(scope="module", autouse=True)
def compiled():
    compile_search()


@pytest.fixture
def scene():
    return BoardScene(synthetic_rig(), STANDARD_BOARD)


@pytest.fixture
def hands(open_wizard, scene):
    """The wizard on a rig whose lenses are 8 % too long, before a drawn board."""
    truth = synthetic_rig()
    lens = msgspec.structs.replace(truth.nodes[0].intrinsics, fx=572.0, fy=572.0)
    rig = msgspec.structs.replace(truth, nodes=tuple(msgspec.structs.replace(node, intrinsics=lens)
                                                     for node in truth.nodes))
    return open_wizard("lens", FakeRigClient(rig, scene.draw))


def test_from_the_board_to_a_saved_lens(hands, scene):
    scene.place(*PLACES[0])
    hands.type(hands.window.page.square, "25")
    wall = hands.frame.grid.views
    for camera in ("right", "left"):
        hands.window.page.which.setCurrentText(camera)
        hands.until(lambda camera=camera: hands.window.step.view().done and camera in hands.sentence)
        assert [name for name, view in wall.items() if view.isVisible()] == [camera], "as large as can be"
    hands.next()
    for count, place in enumerate(PLACES):
        scene.place(*place)
        hands.until(lambda count=count: len(hands.window.step.views) > count)
    assert hands.window.step.view().done, hands.frame.bars.bars
    assert isinstance(wall["left"].overlay[0], Cells)
    hands.next()
    hands.solved()
    assert hands.verdict.acceptable, hands.verdict
    assert any(isinstance(mark, Line) for mark in wall["left"].overlay), "residuals are drawn"
    assert hands.window.page.table.records_model.rowCount() >= 10
    hands.next()
    assert hands.window.page.table.text(0, 1) == "572.0, 572.0 px"
    hands.use()
    assert "then stereo" in hands.hint
    left, right = load_rig(hands.path).nodes
    assert left.intrinsics.fx == pytest.approx(TRUE_F, rel=0.005) and right.intrinsics.fx == 572.0
    assert left.intrinsics.cx == pytest.approx(319.5, abs=3.0)
    assert hands.memory[LAST] == "left", "the next time begins with the other camera"


# -- the steps without a window ----------------------------------------------------------------------------------------

@pytest.fixture
def steps():
    """The first two steps, the board's squares measured."""
    board = LensBoardStep(BoardFields(square_mm=25.0), ("left", "right"), "left")
    show = LensShowStep(board)
    show.enter()
    return board, show


def test_space_takes_a_view_and_undo_gives_it_back(steps, scene):
    _, step = steps
    scene.place(*PLACES[0])
    step.accept_observation(step.observe(scene.pictures()))
    assert step.capture() and len(step.views) == 1
    assert not step.capture() and len(step.views) == 1, "the same view again adds nothing"
    scene.world_from_board = None
    step.accept_observation(step.observe(scene.pictures()))
    assert step.seen is None and not step.capture()
    assert step.undo() and step.views == () and not step.view().may_go_on


def test_a_corrected_square_keeps_the_views_and_a_wrong_board_is_named(steps, scene):
    board, step = steps
    scene.place(*PLACES[0])
    step.accept_observation(step.observe(scene.pictures()))
    assert step.capture()
    board.change(msgspec.structs.replace(board.fields, square_mm=24.6))
    step.enter()
    assert len(step.views) == 1 and step.board.square_m == pytest.approx(0.0246)
    board.change(msgspec.structs.replace(board.fields, cols=10, rows=7))
    step.enter()
    step.accept_observation(step.observe(scene.pictures()))
    assert step.views == () and "seems to have 9x6" in step.view().hint


def test_another_camera_begins_anew(steps, scene):
    board, step = steps
    scene.place(*PLACES[0])
    step.accept_observation(step.observe(scene.pictures()))
    assert step.capture()
    of_left = step.observe(scene.pictures())
    board.choose("right")
    step.enter()
    step.accept_observation(of_left)
    assert step.camera == "right" and step.views == () and step.seen is None
    step.accept_observation(step.observe(scene.pictures()))
    assert step.capture() and len(step.views) == 1


def test_what_follows_a_lens_is_what_the_rig_lacks():
    def rig(nominal, placed):
        found = Intrinsics(640, 480, 500.0, 500.0, 321.0, 240.0)
        nodes = tuple(RigNode(k, name, Intrinsics.assumed(640, 480) if name in nominal else found,
                              pose_known=k == 1 or placed) for k, name in enumerate(("left", "right"), 1))
        return Rig("two", nodes)
    new, placed = rig(("left", "right"), False), rig(("left",), True)
    assert "of right" in what_follows(new, rig(("right",), False))
    assert "not known yet" in what_follows(new, rig((), False))
    assert "old intrinsics" in what_follows(placed, rig((), True))
    alone = msgspec.structs.replace(new, nodes=new.nodes[:1])
    assert what_follows(alone, alone) == ""


def test_straightening_takes_the_lens_distortion_away():
    lens = Intrinsics(640, 480, 500.0, 500.0, 319.5, 239.5, (-0.3, 0.0, 0.0, 0.0, 0.0))
    column = np.zeros((480, 640, 3), np.uint8)
    v = np.arange(480)
    x, y = (600.0 - lens.cx) / lens.fx, (v - lens.cy) / lens.fy
    bent = x * (1.0 - 0.3 * (x * x + y * y)) * lens.fx + lens.cx
    rows = (y * (1.0 - 0.3 * (x * x + y * y))) * lens.fy + lens.cy
    column[np.clip(np.round(rows).astype(int), 0, 479), np.round(bent).astype(int)] = 255
    straight = straightened(column, lens)[60:420, :, 0].argmax(axis=1)
    seen = straight[straight > 0]
    assert len(seen) > 200 and np.ptp(np.round(bent)[60:420]) > 10 and np.percentile(np.abs(seen - 600), 90) <= 2.0
