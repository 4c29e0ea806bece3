"""Printed boards: true scale in both file formats, found again by the detectors, refused when they do not fit."""

from __future__ import annotations

import re
from pathlib import Path

import cv2
import numpy as np
import pytest
from pdf_pages import pages_of

from rhot_app.__main__ import main
from rhot_app.calibration.board.boards import STANDARD_BOARD, AprilGrid, CharucoBoard, Chessboard, CircleGrid
from rhot_app.calibration.board.corners import detect
from rhot_app.calibration.board.target import PAPERS_MM, RULER_MM, draw_target
from rhot_app.errors import CalibrationError
from rhot_app.vector_graphics import Drawing

PX_PER_MM = 4.0
SHARP_PX_PER_MM = 8.0

BOARDS = [Chessboard(9, 6, 0.025), Chessboard(6, 9, 0.02), CharucoBoard(10, 7, 0.025, 0.018),
          CharucoBoard(8, 6, 0.025, 0.018, "DICT_5X5_100", legacy=True), CharucoBoard(8, 6, 0.025, 0.018),
          AprilGrid(7, 5, 0.025, 0.3), CircleGrid(4, 11, 0.02)]


def boxes_of_svg(svg: bytes) -> np.ndarray:
    """(N, 4) mm: x, y, width, height of the black rectangles."""
    found = re.findall(rb'<rect x="([\d.-]+)" y="([\d.-]+)" width="([\d.-]+)" height="([\d.-]+)"/>', svg)
    return np.array(found, dtype=np.float64)


def discs_of_svg(svg: bytes) -> np.ndarray:
    """(N, 3) mm: middle and radius of the black circles."""
    found = re.findall(rb'<circle cx="([\d.-]+)" cy="([\d.-]+)" r="([\d.-]+)"/>', svg)
    return np.array(found, dtype=np.float64).reshape(-1, 3)


def mm_per_px(drawing: Drawing, picture: np.ndarray) -> np.ndarray:
    """(2,) x and y: pictures of pages are a whole number of pixels large."""
    return np.array([drawing.width, drawing.height]) / picture.shape[1::-1]


def picture_of(drawing: Drawing) -> np.ndarray:
    """The sheet as a camera straight above would see it."""
    picture = np.full((round(drawing.height * PX_PER_MM), round(drawing.width * PX_PER_MM)), 255, np.uint8)
    for x, y, width, height in PX_PER_MM * boxes_of_svg(drawing.to_svg()):
        picture[round(y):round(y + height), round(x):round(x + width)] = 0
    v, u = np.indices(picture.shape)
    for x, y, radius in PX_PER_MM * discs_of_svg(drawing.to_svg()):
        picture[np.hypot(u + 0.5 - x, v + 0.5 - y) < radius] = 0
    return cv2.GaussianBlur(picture, (0, 0), 1.0)


@pytest.mark.parametrize("board", BOARDS, ids=lambda board: board.text)
def test_the_printed_board_is_found_in_true_scale(board) -> None:
    view = detect(picture_of(draw_target(board)), board)
    assert view is not None and len(view.ids) == board.count
    span_mm = np.linalg.norm(view.pixels[-1] - view.pixels[0]) / PX_PER_MM
    points = board.object_points()[view.ids]
    assert span_mm == pytest.approx(1e3 * np.linalg.norm(points[-1] - points[0]), abs=0.2)


@pytest.mark.parametrize("board", BOARDS, ids=lambda board: board.text)
def test_a_pdf_is_printed_in_true_scale(board) -> None:
    drawing = draw_target(board)
    pdf = drawing.to_pdf()
    assert b"PrintScaling /None" in pdf
    (text, picture), = pages_of(pdf, SHARP_PX_PER_MM)
    assert "Print at 100 %" in text and str(round(RULER_MM)) in text
    assert np.array(picture.shape[1::-1]) == pytest.approx(SHARP_PX_PER_MM * np.array([drawing.width, drawing.height]),
                                                           abs=1.0)
    view = detect(cv2.GaussianBlur(picture[..., 0], (0, 0), 1.0), board)
    assert view is not None and len(view.ids) == board.count
    points, seen = 1e3 * board.object_points()[view.ids, :2], view.pixels * mm_per_px(drawing, picture)
    np.testing.assert_allclose(seen - seen.mean(axis=0), points - points.mean(axis=0), atol=0.1)


def test_the_ruler_is_as_long_as_it_says() -> None:
    boxes = boxes_of_svg(draw_target(BOARDS[0]).to_svg())
    ticks = boxes[(boxes[:, 2] < 0.3) & (boxes[:, 3] > 1.0)]
    middles = ticks[:, 0] + 0.5 * ticks[:, 2]
    assert middles.max() - middles.min() == pytest.approx(RULER_MM, abs=1e-3)
    assert len(ticks) == RULER_MM + 1


@pytest.mark.parametrize("board", BOARDS, ids=lambda board: board.text)
def test_nothing_leaves_the_page_or_lies_on_the_ruler(board) -> None:
    drawing = draw_target(board)
    boxes = boxes_of_svg(drawing.to_svg())
    assert (boxes[:, :2] >= 5.0).all()
    assert (boxes[:, 0] + boxes[:, 2] <= drawing.width - 5.0).all()
    ruler = boxes[:, 2] < 0.3
    discs = discs_of_svg(drawing.to_svg())
    lowest = max([*(boxes[~ruler, 1] + boxes[~ruler, 3])[boxes[~ruler, 3] > 0.3], *(discs[:, 1] + discs[:, 2])])
    assert lowest + 3.0 < boxes[ruler, 1].min()


def test_discs_are_round_in_pdf_as_well() -> None:
    drawing = draw_target(CircleGrid(4, 11, 0.02))
    (_, picture), = pages_of(drawing.to_pdf(), SHARP_PX_PER_MM)
    dark = picture[..., 0] < 128
    u, v = (np.indices(dark.shape)[::-1] + 0.5) * mm_per_px(drawing, picture)[:, None, None]
    discs = discs_of_svg(drawing.to_svg())
    assert len(discs) == 44
    for x, y, radius in discs:
        near = np.hypot(u - x, v - y)
        assert dark[near < radius - 0.1].all() and not dark[(near > radius + 0.1) & (near < radius + 1.0)].any()


def test_a_board_too_large_says_what_would_fit() -> None:
    with pytest.raises(CalibrationError, match=r"does not fit on A4.*Squares of (\d+\.?\d*) mm would, or print it on A3"
                       ) as caught:
        draw_target(Chessboard(9, 6, 0.03))
    square_mm = float(re.search(r"Squares of ([\d.]+) mm", str(caught.value))[1])
    assert draw_target(Chessboard(9, 6, 1e-3 * square_mm)).width == PAPERS_MM["A4"][1]
    with pytest.raises(CalibrationError):
        draw_target(Chessboard(9, 6, 1e-3 * (square_mm + 0.5)))
    with pytest.raises(CalibrationError, match=f"Squares of {square_mm:g} mm"):  # however large the wish was
        draw_target(Chessboard(9, 6, 0.2))


def test_the_command_writes_and_refuses(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "board.pdf"
    assert main(["target", "chessboard", "--board", "9x6", "--square-mm", "25", "--out", str(out)]) == 0
    assert out.read_bytes().startswith(b"%PDF-1.")
    for arguments, sentence in (
            (["chessboard", "--out", str(tmp_path / "board.png")], "must end in .pdf or .svg"),
            (["chessboard", "--square-mm", "30", "--out", str(tmp_path / "b.svg")], "does not fit on A4"),
            (["chessboard", "--paper", "B7", "--out", str(tmp_path / "b.svg")], "no paper 'B7'"),
            (["circles", "--marker-mm", "12", "--out", str(tmp_path / "b.svg")], "belong to a ChArUco board"),
            (["chessboard", "--tag-spacing", "0.3", "--out", str(tmp_path / "b.svg")], "belongs to an AprilGrid"),
            (["aprilgrid", "--tag-spacing", "3", "--out", str(tmp_path / "b.svg")], "spacing of 3 is not possible"),
            (["charuco", "--dictionary", "DICT_X", "--out", str(tmp_path / "b.svg")], "no marker dictionary"),
            (["chessboard", "--out", str(tmp_path / "no" / "b.doc")], "there is no folder")):
        assert main(["target", *arguments]) == 2
        assert sentence in capsys.readouterr().err
    assert sorted(path.name for path in tmp_path.iterdir()) == ["board.pdf"]


@pytest.mark.parametrize("paper", ["A4", "letter"])
def test_the_standard_board_goes_on_the_paper_that_people_have(paper: str) -> None:
    drawing = draw_target(STANDARD_BOARD, paper)
    assert Chessboard(9, 6, 0.025) == STANDARD_BOARD and drawing.width == PAPERS_MM[paper][1]
