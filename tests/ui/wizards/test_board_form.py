"""The form of the board: what it says, what it remembers, and that the live picture confirms it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from board_scene import BoardScene, compile_search
from fake_engine import synthetic_rig
from msgspec.structs import replace as replace_fields
from PySide6.QtCore import Qt
from PySide6.QtGui import QDesktopServices
from PySide6.QtWidgets import QLabel
from wizard_rig import FakeSettingsStore

from rhot_app.__main__ import main
from rhot_app.calibration.board.boards import STANDARD_BOARD, AprilGrid, CharucoBoard, Chessboard, CircleGrid
from rhot_app.calibration.board.size_check import Beyond
from rhot_app.ui.wizards.framework.board import (
    MEMORY,
    BoardFields,
    BoardPage,
    BoardStep,
    fields_from,
    remembered_fields,
)
from rhot_app.ui.wizards.framework.drawing import Dots

MEASURED = BoardFields(square_mm=25.0)


@pytest.fixture(scope="module", autouse=True)
def compiled():
    compile_search()


@pytest.fixture
def scene():
    scene = BoardScene(synthetic_rig(), STANDARD_BOARD)
    scene.place((0.1, -0.2, 0.05), (0.04, 0.0, 0.6))
    return scene


def test_fields_make_boards():
    assert BoardFields().board() == STANDARD_BOARD == Chessboard(9, 6, 0.025)
    assert BoardFields(square_mm=24.6).board() == Chessboard(9, 6, 0.0246)
    assert BoardFields(square_mm=24.6).to_print() == STANDARD_BOARD
    charuco = BoardFields("charuco", 8, 6, 25.0, 20.0, "DICT_5X5_100", True).board()
    assert charuco == CharucoBoard(8, 6, 0.025, 0.02, "DICT_5X5_100", legacy=True)
    assert BoardFields("aprilgrid", 6, 6, 88.0, tag_spacing=0.25).board() == AprilGrid(6, 6, 0.088, 0.25)
    assert BoardFields("circles", 4, 11).board() == CircleGrid(4, 11, 0.02)


def test_fields_are_remembered_and_nonsense_is_forgotten():
    fields = BoardFields("charuco", 8, 6, 25.0, 18.0)
    assert remembered_fields(fields.to_text()) == fields
    assert fields_from(fields.to_text()) == replace_fields(fields, square_mm=None, marker_mm=None)
    assert fields_from("") == BoardFields() == fields_from("{\"kind\": 3}")


def test_an_impossible_board_is_a_sentence():
    step = BoardStep(BoardFields("charuco", 8, 6, 25.0, 25.0))
    assert step.board is None and not step.view().done and "do not go into" in step.view().hint


def test_the_board_is_confirmed_by_what_is_seen(scene):
    step = BoardStep(MEASURED)
    assert not step.view().done and step.view().may_go_on, "no tick before anything was seen"
    assert "Show the board" in step.view().sentence
    step.accept_observation(step.observe(scene.pictures()))
    view = step.view()
    assert "left, right" in view.sentence and view.done
    dots = next(mark for mark in view.annotated["left"].overlay if isinstance(mark, Dots))
    corners = scene.board.object_points() @ scene.world_from_board[:3, :3].T + scene.world_from_board[:3, 3]
    expected = 530.0 * corners[:, :2] / corners[:, 2:] + [319.5, 239.5]
    assert np.abs(np.sort(dots.points, axis=0) - np.sort(expected, axis=0)).max() < 0.3


def test_a_smaller_count_is_found_out(scene):
    step = BoardStep(BoardFields(cols=8, square_mm=25.0))
    for _ in range(3):
        step.accept_observation(step.observe(scene.pictures()))
    assert "9x6" in step.view().hint
    seen_before = step.observe(scene.pictures())
    step.change(BoardFields(cols=9, square_mm=25.0))
    step.accept_observation(seen_before)
    assert step.view().hint == "", "what was seen of another board is past"


def test_squares_that_go_on_forbid_the_count(scene):
    step = BoardStep(MEASURED)
    sight = step.observe(scene.pictures())
    for _ in range(3):
        step.accept_observation(replace(sight, beyond=(Beyond(column=True, row=False),) * 2))
    view = step.view()
    assert not view.done and "Count" in view.sentence and "10x6" in view.hint


def test_a_larger_count_is_explained(scene):
    step = BoardStep(BoardFields(cols=10, rows=7, square_mm=25.0))
    step.accept_observation(step.observe(scene.pictures()))
    assert "seems to have 9x6" in step.view().hint
    scene.world_from_board = None
    step.accept_observation(step.observe(scene.pictures()))
    assert "seems to have 9x6" in step.view().hint, "the reason is looked for now and then only"


def test_a_board_without_a_right_way_up_is_told():
    assert "180°" in BoardStep(BoardFields(cols=8, rows=6)).view().hint


def test_a_board_that_nobody_measured_is_shown_but_not_done(scene):
    step = BoardStep(BoardFields())
    step.accept_observation(step.observe(scene.pictures()))
    view = step.view()
    assert not view.may_go_on and "Measure the squares" in view.sentence
    assert all(view.annotated[name].overlay for name in ("left", "right")), "the person sees that it is the right one"


@pytest.fixture
def memory():
    return FakeSettingsStore()


@pytest.fixture
def page(qtbot, themed, memory):
    page = BoardPage(BoardStep(fields_from("")), memory)
    qtbot.addWidget(page)
    page.show()
    return page


def test_the_page_hides_what_a_chessboard_has_not_and_undoes(qtbot, page, memory):
    step = page.step
    assert not page.marker.isVisible() and not page.legacy.isVisible()
    page.kind.setCurrentIndex(1)
    assert (page.cols.value(), page.rows.value()) == (10, 7), "the usual board of that kind is as large"
    qtbot.keyClicks(page.square, "20")
    assert page.marker.isVisible() and page.marker.placeholderText() == "15", "the marker goes along with its square"
    assert step.board == CharucoBoard(10, 7, 0.02, 0.015)
    assert remembered_fields(memory[MEMORY]) == step.fields
    while step.undo():
        pass
    page.show_view(step.view())
    assert page.square.text() == "" and page.kind.currentData() == "chessboard"


@pytest.mark.parametrize(("kind", "board", "measured", "has_gap"), [
    ("aprilgrid", AprilGrid(7, 5, 0.024, 0.3), "Tag", True), ("circles", CircleGrid(4, 11, 0.024), "Spacing", False)])
def test_other_boards_are_chosen_measured_and_remembered(qtbot, page, memory, monkeypatch, kind, board, measured,
                                                         has_gap):
    monkeypatch.setattr(QDesktopServices, "openUrl", lambda url: True)
    page.kind.setCurrentIndex(page.kind.findData(kind))
    qtbot.keyClicks(page.square, "24")
    assert page.step.board == board and remembered_fields(memory[MEMORY]).kind == kind
    labels = [label.text() for label in page.findChildren(QLabel) if label.isVisible()]
    assert any(text.startswith(measured) for text in labels)
    assert page.spacing.isVisible() is has_gap and not page.marker.isVisible()
    qtbot.mouseClick(page.print_button, Qt.MouseButton.LeftButton)
    assert f"{kind}_{board.size_text}" in page.note.text()


def test_what_was_measured_last_is_offered_and_not_filled_in(qtbot, page, memory):
    qtbot.keyClicks(page.square, "x24,6")
    assert page.square.value == page.step.fields.square_mm == 24.6, "what is no number cannot be typed"
    again = BoardPage(BoardStep(fields_from(memory[MEMORY])), memory)
    qtbot.addWidget(again)
    assert again.square.text() == "" and "24.6" in again.square.placeholderText()
    again.cols.setValue(8)
    assert remembered_fields(memory[MEMORY]).square_mm == 24.6, "until something else is measured"


def test_the_board_is_printed_as_rhot_target_draws_it(qtbot, page, tmp_path, monkeypatch):
    opened = []
    monkeypatch.setattr(QDesktopServices, "openUrl", lambda url: opened.append(Path(url.toLocalFile())) or True)
    qtbot.keyClicks(page.square, "24.6")  # what was measured is not what is drawn
    qtbot.mouseClick(page.print_button, Qt.MouseButton.LeftButton)
    (path,) = opened
    assert path.is_relative_to(tmp_path) and str(path) in page.note.text()
    by_command = tmp_path / "board.pdf"
    assert main(["target", "chessboard", "--out", str(by_command)]) == 0
    assert path.read_bytes() == by_command.read_bytes()
    monkeypatch.setattr(QDesktopServices, "openUrl", lambda url: False)
    qtbot.mouseClick(page.print_button, Qt.MouseButton.LeftButton)
    assert "opens no PDF" in page.note.text() and str(path) in page.note.text()


def test_a_board_too_large_for_the_paper_is_a_sentence(qtbot, page):
    page.cols.setValue(20)
    qtbot.mouseClick(page.print_button, Qt.MouseButton.LeftButton)
    assert "A4" in page.note.text()
