"""The lens wizard, clicked through on a drawn board; its parts on their own."""

from __future__ import annotations

import contextlib

import msgspec
import numpy as np
import pytest
from board_scene import BoardScene, compile_search
from fake_engine import synthetic_rig
from PySide6.QtCore import Qt
from wizard_hands import Hands
from wizard_rig import FakeMemory, FakeRigAsker

from rhot_app.calibration.board.boards import STANDARD_BOARD
from rhot_app.project import Intrinsics, load_rig, save_rig
from rhot_app.ui.models.palette import DARK
from rhot_app.ui.wizards.framework.plan import Kit
from rhot_app.ui.wizards.framework.window import WizardWindow
from rhot_app.ui.wizards.lens import LAST, make_plan
from rhot_app.ui.wizards.models.drawing import Cells, Line
from rhot_app.ui.wizards.steps.lens_steps import straightened

TRUE_F = 530.0
PLACES = [((0.0, 0.0, 0.0), (0.0, 0.0, 0.417)), ((0.0, 0.0, 0.0), (-0.142, -0.083, 0.417)),
          ((0.0, 0.0, 0.0), (0.142, -0.083, 0.417)), ((0.0, 0.0, 0.0), (-0.142, 0.083, 0.417)),
          ((0.0, 0.0, 0.0), (0.142, 0.083, 0.417)), ((0.3, 0.2, 0.0), (0.0, 0.0, 0.283)),
          ((0.6, 0.0, 0.0), (0.0, 0.042, 0.417)), ((-0.6, 0.0, 0.1), (0.0, -0.042, 0.417)),
          ((0.0, 0.6, 0.0), (0.067, 0.0, 0.417)), ((0.0, -0.6, 0.0), (-0.067, 0.0, 0.417)),
          ((0.5, 0.5, 0.3), (-0.083, 0.067, 0.417)), ((-0.5, 0.5, 0.0), (0.083, 0.067, 0.417)),
          ((0.5, -0.5, 0.0), (-0.083, -0.067, 0.417)), ((-0.5, -0.5, 0.3), (0.083, -0.067, 0.417)),
          ((0.4, 0.0, 0.6), (-0.083, 0.0, 0.417)), ((0.0, 0.4, -0.4), (0.083, 0.0, 0.417))]


@pytest.fixture(scope="module", autouse=True)
def compiled():
    compile_search()


@pytest.fixture
def scene():
    return BoardScene(synthetic_rig(), STANDARD_BOARD)


@pytest.fixture
def hands(themed, scene, tmp_path):
    """The wizard on a rig whose lenses are 8 % too long, before a drawn board."""
    truth = synthetic_rig()
    lens = msgspec.structs.replace(truth.nodes[0].intrinsics, fx=572.0, fy=572.0)
    rig = msgspec.structs.replace(truth, nodes=tuple(msgspec.structs.replace(node, intrinsics=lens)
                                                     for node in truth.nodes))
    path = tmp_path / "desk.json"
    save_rig(path, rig)
    asker = FakeRigAsker(rig, scene.draw)
    kit = Kit(rig, path, asker.connect, DARK, FakeMemory())
    hands = Hands(WizardWindow(make_plan(kit), kit))
    hands.path, hands.memory = path, kit.memory
    yield hands
    hands.window.end().wait(5.0)
    hands.window.deleteLater()


def show(hands, scene, place):
    """Hold the board there until it was taken or adds nothing, but not for ever: parts of it may be out of sight."""
    count = len(hands.window.step.views)
    scene.place(*place)
    with contextlib.suppress(AssertionError):
        hands.wait(lambda: len(hands.window.step.views) > count
                   or (scene.near(1, hands.window.step._seen[0]) and hands.sentence != "Hold still."), 2.0)


def test_from_the_board_to_a_saved_lens(hands, scene):
    scene.place(*PLACES[0])
    hands.type(hands.window.page.square, "25")
    hands.until(lambda: hands.sentence == "Seen by left: this is the board.")
    assert not hands.window.frame.wall.views["right"].isVisible(), "one camera at a time, as large as can be"
    hands.next()
    for place in PLACES * 2:
        if hands.sentence == "Enough: press Next.":
            break
        show(hands, scene, place)
    assert hands.sentence == "Enough: press Next.", hands.window.frame.bars.bars
    assert isinstance(hands.window.frame.wall.views["left"].overlay[0], Cells)
    hands.next()
    hands.until(lambda: hands.window.frame.verdict.verdict is not None, timeout_s=40.0)
    assert hands.window.frame.verdict.verdict.acceptable, hands.window.frame.verdict.verdict
    assert any(isinstance(mark, Line) for mark in hands.window.frame.wall.views["left"].overlay), "residuals are drawn"
    assert hands.window.page.table.rowCount() >= 10
    hands.next()
    assert hands.window.page.table.item(1, 1).text() == "572.0, 572.0 px"
    hands.next()
    hands.until(lambda: hands.window.frame.next_button.text() == "Close")
    assert "put the cameras together" in hands.window.frame.hint.text()
    left, right = load_rig(hands.path).nodes
    assert left.intrinsics.fx == pytest.approx(TRUE_F, rel=0.005) and right.intrinsics.fx == 572.0
    assert left.intrinsics.cx == pytest.approx(319.5, abs=3.0)
    assert hands.memory[LAST] == "left", "the next time begins with the other camera"


def test_space_takes_a_view_and_undo_gives_it_back(hands, scene):
    hands.type(hands.window.page.square, "25")
    hands.next()
    scene.place(*PLACES[0])
    hands.until(lambda: len(hands.window.step.views) == 1)
    hands.key(Qt.Key.Key_Space)
    assert len(hands.window.step.views) == 1, "the same view again adds nothing"
    scene.world_from_board = None
    hands.until(lambda: hands.window.step._seen[0] is None)
    hands.key(Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    assert hands.window.step.views == () and not hands.window.frame.next_button.isEnabled()


def test_another_camera_begins_anew(hands, scene):
    hands.type(hands.window.page.square, "25")
    hands.next()
    scene.place(*PLACES[0])
    hands.until(lambda: len(hands.window.step.views) == 1)
    hands.click(hands.window.frame.back_button)
    hands.window.page.which.setCurrentText("right")
    hands.until(lambda: hands.sentence == "Seen by right: this is the board.")
    hands.next()
    assert hands.window.frame.wall.views["right"].isVisible() and not hands.window.frame.wall.views["left"].isVisible()
    hands.until(lambda: len(hands.window.step.views) == 1)
    assert hands.window.step.camera == "right"


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
