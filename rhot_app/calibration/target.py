"""A calibration board laid out on a sheet of paper, with a ruler that tells whether the printer kept the scale."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from rhot_app.calibration.board import Board, CharucoBoard, Chessboard
from rhot_app.calibration.target_drawing import Box, Drawing, Text
from rhot_app.errors import CalibrationError
from rhot_node.files import write_atomically

PAPERS_MM: dict[str, tuple[float, float]] = {
    "A5": (148.0, 210.0), "A4": (210.0, 297.0), "letter": (215.9, 279.4), "legal": (215.9, 355.6),
    "A3": (297.0, 420.0), "tabloid": (279.4, 431.8), "A2": (420.0, 594.0), "A1": (594.0, 841.0), "A0": (841.0, 1189.0),
}
"""Short and long side."""

MARGIN_MM = 6.0  # most printers leave about 5 mm white
RULER_MM = 100.0

_FOOT_MM = 15.0  # ruler and text below the board
_TICKS_MM = {1: 2.0, 5: 3.0, 10: 4.5}
_LINE_MM = 0.2
_TEXT_MM = 3.2


def draw_target(board: Board, paper: str = "A4") -> Drawing:
    """The board in the middle of the sheet, the ruler and a line that names it below.

    Raises CalibrationError when there is no such paper, or when the board does not fit on it: the sentence says which
    squares or which paper would.
    """
    if paper not in PAPERS_MM:
        raise CalibrationError(f"There is no paper {paper!r}; there are {', '.join(PAPERS_MM)}.")
    width, height = _board_size_mm(board)
    across = width >= height
    page_width, page_height = _page(paper, across=across)
    quiet = _quiet_mm(board)
    if not _fits(board, paper):
        raise CalibrationError(_refusal(board, paper))
    left = 0.5 * (page_width - width)
    room = page_height - MARGIN_MM - _FOOT_MM - quiet
    top = MARGIN_MM + max(0.0, 0.5 * (room - MARGIN_MM - height))
    foot = page_height - MARGIN_MM - _FOOT_MM
    boxes = tuple(Box(left + box.x, top + box.y, box.width, box.height) for box in _board_boxes(board))
    text_x = MARGIN_MM + RULER_MM + 6.0
    texts = [Text(text_x, foot + 5.0, _TEXT_MM, board.text[0].upper() + board.text[1:]),
             Text(text_x, foot + 10.0, _TEXT_MM,
                  f"Print at 100 % on {paper}, glue it flat, measure the ruler: {RULER_MM:g} mm"),
             *_ruler_numbers(foot)]
    return Drawing(page_width, page_height, boxes + tuple(_ruler_boxes(foot)), tuple(texts), board.text)


def write_target(out: Path, board: Board, paper: str = "A4") -> None:
    """Draw the board and write it, whole or not at all, as PDF or SVG by the file's name.

    Raises CalibrationError as `draw_target` does, for another ending, and when the file cannot be written.
    """
    suffix = out.suffix.lower()
    if suffix not in (".pdf", ".svg"):
        raise CalibrationError(f"{out}: the file's name must end in .pdf or .svg.")
    drawing = draw_target(board, paper)
    try:
        write_atomically(out, drawing.to_pdf() if suffix == ".pdf" else drawing.to_svg())
    except OSError as exc:
        raise CalibrationError(f"{out}: cannot be written ({exc.strerror}).") from exc


def _board_size_mm(board: Board) -> tuple[float, float]:
    square = 1e3 * board.square_m
    return square * (board.cols + 1), square * (board.rows + 1)


def _quiet_mm(board: Board) -> float:
    """White around the board: detectors need some to tell it from the foot."""
    return min(max(4.0, 0.3 * 1e3 * board.square_m), 12.0)


def _page(paper: str, *, across: bool) -> tuple[float, float]:
    short, long = PAPERS_MM[paper]
    return (long, short) if across else (short, long)


def _fits(board: Board, paper: str) -> bool:
    width, height = _board_size_mm(board)
    page_width, page_height = _page(paper, across=width >= height)
    return (width + 2.0 * MARGIN_MM <= page_width
            and height + 2.0 * MARGIN_MM + _FOOT_MM + _quiet_mm(board) <= page_height)


def _refusal(board: Board, paper: str) -> str:
    width, height = _board_size_mm(board)
    fitting = [name for name in PAPERS_MM if _fits(board, name)]
    page = _page(paper, across=width >= height)
    squares_mm = np.arange(1.0, 1e3 * board.square_m, 0.5)
    square = max((side for side in squares_mm if _fits(_scaled(board, 1e-3 * side), paper)), default=0.0)
    larger = f", or print it on {fitting[0]}" if fitting else ""
    return (f"The {board.text} is {width:g} x {height:g} mm large and does not fit on {paper} ({page[0]:g} x "
            f"{page[1]:g} mm) with its margins and the ruler. Squares of {square:g} mm "
            f"would{larger}.")


def _scaled(board: Board, square_m: float) -> Board:
    """The same board with other squares."""
    if isinstance(board, Chessboard):
        return replace(board, square_m=square_m)
    return replace(board, square_m=square_m, marker_m=board.marker_m * square_m / board.square_m)


def _board_boxes(board: Board) -> Iterator[Box]:
    square = 1e3 * board.square_m
    white = {(x, y) for x, y, _ in _marker_squares(board)} if isinstance(board, CharucoBoard) else _white_squares(board)
    for y in range(board.rows + 1):
        for x in range(board.cols + 1):
            if (x, y) not in white:
                yield Box(x * square, y * square, square, square)
    if isinstance(board, CharucoBoard):
        for x, y, bits in _marker_squares(board):
            yield from _marker_boxes(board, x, y, bits)


def _white_squares(board: Chessboard) -> set[tuple[int, int]]:
    """The upper left square is black: it lies outside the first inner corner."""
    return {(x, y) for y in range(board.rows + 1) for x in range(board.cols + 1) if (x + y) % 2}


def _marker_squares(board: CharucoBoard) -> Iterator[tuple[int, int, np.ndarray]]:
    """Column and row of every square with a marker, and the marker's cells, True where black, its border included."""
    drawn, family = board.opencv(), board.marker_family()
    cells = family.markerSize + 2
    for number, corners in zip(np.ravel(drawn.getIds()), drawn.getObjPoints(), strict=True):
        x, y = (np.asarray(corners)[:, :2].mean(axis=0) // board.square_m).astype(int)
        yield int(x), int(y), family.generateImageMarker(int(number), cells) == 0


def _marker_boxes(board: CharucoBoard, x: int, y: int, bits: np.ndarray) -> Iterator[Box]:
    """Black runs of each row of cells."""
    square, marker = 1e3 * board.square_m, 1e3 * board.marker_m
    left, top, cell = (x + 0.5) * square - 0.5 * marker, (y + 0.5) * square - 0.5 * marker, marker / len(bits)
    for row, cells in enumerate(bits):
        edges = np.flatnonzero(np.diff(np.concatenate([[False], cells, [False]]).astype(int)))
        for begin, end in edges.reshape(-1, 2):
            yield Box(left + begin * cell, top + row * cell, (end - begin) * cell, cell)


def _ruler_boxes(foot: float) -> Iterator[Box]:
    """The line and its ticks; the middles of the outermost ticks are RULER_MM apart."""
    yield Box(MARGIN_MM - 0.5 * _LINE_MM, foot + 4.5 - 0.5 * _LINE_MM, RULER_MM + _LINE_MM, _LINE_MM)
    for millimetre in range(int(RULER_MM) + 1):
        length = next(_TICKS_MM[step] for step in (10, 5, 1) if millimetre % step == 0)
        yield Box(MARGIN_MM + millimetre - 0.5 * _LINE_MM, foot + 4.5 - length, _LINE_MM, length)


def _ruler_numbers(foot: float) -> Iterator[Text]:
    for centimetre in range(int(RULER_MM) // 10 + 1):
        yield Text(MARGIN_MM + 10.0 * centimetre - 1.0, foot + 8.5, 0.9 * _TEXT_MM, str(centimetre))
