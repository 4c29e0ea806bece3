"""The form of the board: what it says, what it remembers, and that the live picture confirms it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from board_scene import BoardScene, compile_search
from fake_engine import synthetic_rig
from wizard_rig import FakeMemory

from rhot_app.calibration.board import CharucoBoard, Chessboard
from rhot_app.calibration.board_size_check import Beyond
from rhot_app.ui.wizards.board_page import MEMORY, BoardPage
from rhot_app.ui.wizards.feed import Picture
from rhot_app.ui.wizards.models.board_form import BoardFields, BoardStep, fields_from
from rhot_app.ui.wizards.models.drawing import Dots


@pytest.fixture(scope="module", autouse=True)
def compiled():
    compile_search()


@pytest.fixture
def scene():
    scene = BoardScene(synthetic_rig(), Chessboard(9, 6, 0.03))
    scene.place((0.1, -0.2, 0.05), (0.04, 0.0, 0.6))
    return scene


def pictures_of(scene):
    return {node.name: Picture(node.name, scene.draw(node.node_id, 0.0), 1, 0, 0) for node in scene.rig.nodes}


def test_fields_make_boards():
    assert BoardFields().board() == Chessboard(9, 6, 0.03)
    charuco = BoardFields("charuco", 8, 6, 25.0, 20.0, "DICT_5X5_100", True).board()
    assert charuco == CharucoBoard(8, 6, 0.025, 0.02, "DICT_5X5_100", legacy=True)


def test_fields_are_remembered_and_nonsense_is_forgotten():
    fields = BoardFields("charuco", 8, 6, 25.0, 18.0)
    assert fields_from(fields.to_text()) == fields
    assert fields_from("") == BoardFields() == fields_from("{\"kind\": 3}")


def test_an_impossible_board_is_a_sentence():
    step = BoardStep(BoardFields("charuco", 8, 6, 25.0, 25.0))
    assert step.board is None and not step.view().done and "do not go into" in step.view().hint


def test_the_board_is_confirmed_by_what_is_seen(scene):
    step = BoardStep(BoardFields())
    assert step.view().done and step.view().sentence.endswith("show it to check.")
    step.take(step.see(pictures_of(scene)))
    view = step.view()
    assert view.sentence == "Seen by left and right: this is the board."
    dots = next(mark for mark in view.overlays["left"] if isinstance(mark, Dots))
    corners = scene.board.object_points() @ scene.world_from_board[:3, :3].T + scene.world_from_board[:3, 3]
    expected = 530.0 * corners[:, :2] / corners[:, 2:] + [319.5, 239.5]
    assert np.abs(np.sort(dots.points, axis=0) - np.sort(expected, axis=0)).max() < 0.3


def test_a_smaller_count_is_found_out(scene):
    step = BoardStep(BoardFields(cols=8))
    for _ in range(3):
        step.take(step.see(pictures_of(scene)))
    assert "9x6" in step.view().hint
    seen_before = step.see(pictures_of(scene))
    step.change(BoardFields(cols=9))
    step.take(seen_before)
    assert step.view().hint == "", "what was seen of another board is past"


def test_squares_that_go_on_forbid_the_count(scene):
    step = BoardStep(BoardFields())
    sight = step.see(pictures_of(scene))
    for _ in range(3):
        step.take(replace(sight, beyond=(Beyond(column=True, row=False),) * 2))
    view = step.view()
    assert not view.done and view.sentence == "Count the corners again." and "10x6" in view.hint


def test_a_larger_count_is_explained(scene):
    step = BoardStep(BoardFields(cols=10, rows=7))
    step.take(step.see(pictures_of(scene)))
    assert "seems to have 9x6" in step.view().hint
    scene.world_from_board = None
    step.take(step.see(pictures_of(scene)))
    assert "seems to have 9x6" in step.view().hint, "the reason is looked for now and then only"


def test_a_board_without_a_right_way_up_is_told():
    assert "180°" in BoardStep(BoardFields(cols=8, rows=6)).view().hint


def test_the_page_hides_what_a_chessboard_has_not_and_undoes(qtbot, themed):
    memory = FakeMemory()
    step = BoardStep(BoardFields())
    page = BoardPage(step, memory)
    qtbot.addWidget(page)
    page.show()
    assert not page.marker.isVisible() and not page.legacy.isVisible()
    page.kind.setCurrentIndex(1)
    page.square.setValue(20.0)
    assert page.marker.isVisible() and page.marker.value() == 15.0, "the marker went along with its square"
    assert step.fields.kind == "charuco" and fields_from(memory[MEMORY]) == step.fields
    assert step.undo()
    page.show_view(step.view())
    assert page.square.value() == 30.0 and fields_from(memory[MEMORY]).square_mm == 30.0
