"""Printed boards: true scale in both file formats, found again by the detectors, refused when they do not fit."""

from __future__ import annotations

import re
from pathlib import Path

import cv2
import numpy as np
import pytest

from rhot_app.__main__ import main
from rhot_app.calibration.board.boards import STANDARD_BOARD, AprilGrid, CharucoBoard, Chessboard, CircleGrid
from rhot_app.calibration.board.corners import detect
from rhot_app.calibration.board.target import PAPERS_MM, RULER_MM, draw_target
from rhot_app.errors import CalibrationError
from rhot_app.vector_graphics import Drawing

PX_PER_MM = 4.0

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


def boxes_of_pdf(pdf: bytes, page_height_mm: float) -> np.ndarray:
    """Likewise, from the points of the page's content."""
    found = np.array(re.findall(rb"([\d.-]+) ([\d.-]+) ([\d.-]+) ([\d.-]+) re", pdf), dtype=np.float64) * 25.4 / 72.0
    found[:, 1] = page_height_mm - found[:, 1] - found[:, 3]
    return found


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
def test_both_formats_say_the_same(board) -> None:
    drawing = draw_target(board)
    printed = boxes_of_pdf(drawing.to_pdf(), drawing.height)
    np.testing.assert_allclose(printed, boxes_of_svg(drawing.to_svg()), atol=2e-4)
    assert b"PrintScaling /None" in drawing.to_pdf()


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
    """Points on the curves of one disc, by de Casteljau, lie on its rim."""
    board = CircleGrid(4, 11, 0.02)
    drawing = draw_target(board)
    discs = discs_of_svg(drawing.to_svg())
    assert len(discs) == 44
    starts = re.findall(rb"([\d. -]+) m\n((?:[\d. -]+ c\n){4})f", drawing.to_pdf())
    assert len(starts) == 44
    for (start, curves), (x, y, radius) in zip(starts, discs, strict=True):
        here = np.array(start.split(), float) * 25.4 / 72.0
        for curve in curves.splitlines():
            knots = np.vstack([here, np.array(curve.split()[:6], float).reshape(3, 2) * 25.4 / 72.0])
            here = knots[3]
            for weights in ([1, 0, 0, 0], [0.125, 0.375, 0.375, 0.125]):
                px, py = np.array(weights) @ knots
                assert np.hypot(px - x, drawing.height - py - y) == pytest.approx(radius, rel=1e-3)


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


def test_the_pdf_is_one(tmp_path: Path) -> None:
    pdf = draw_target(BOARDS[2]).to_pdf()
    start = int(re.search(rb"startxref\n(\d+)", pdf)[1])
    assert pdf[start:start + 4] == b"xref"
    for number, offset in enumerate(re.findall(rb"(\d{10}) 00000 n", pdf), start=1):
        assert pdf[int(offset):].startswith(b"%d 0 obj" % number)


def test_the_command_writes_and_refuses(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "board.pdf"
    assert main(["target", "chessboard", "--board", "9x6", "--square-mm", "25", "--out", str(out)]) == 0
    assert out.read_bytes().startswith(b"%PDF-1.4")
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
