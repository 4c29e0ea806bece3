"""A calibration board laid out on a sheet of paper, with a ruler that tells whether the printer kept the scale."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from rhot_app.calibration.board.aprilgrid import tag_cells
from rhot_app.calibration.board.boards import AprilGrid, Board, CharucoBoard, Chessboard, CircleGrid, scaled
from rhot_app.calibration.board.standard_board import CIRCLE_DIAMETER
from rhot_app.errors import CalibrationError
from rhot_app.vector_graphics import Box, Disc, Drawing, Text
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
    boxes, discs = _shapes(board)
    boxes = tuple(Box(left + box.x, top + box.y, box.width, box.height) for box in boxes)
    discs = tuple(Disc(left + disc.x, top + disc.y, disc.radius) for disc in discs)
    text_x = MARGIN_MM + RULER_MM + 6.0
    texts = [Text(text_x, foot + 5.0, _TEXT_MM, board.text[0].upper() + board.text[1:]),
             Text(text_x, foot + 10.0, _TEXT_MM,
                  f"Print at 100 % on {paper}, glue it flat, measure the ruler: {RULER_MM:g} mm"),
             *_ruler_numbers(foot)]
    return Drawing(page_width, page_height, (*boxes, *_ruler_boxes(foot), *discs, *texts), board.text)


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
    width, height = 1e3 * np.ptp(board.outline()[:, :2], axis=0)
    return float(width), float(height)


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
    sides_mm = np.arange(1.0, 1e3 * board.square_m, 0.5)
    side_mm = max((side for side in sides_mm if _fits(scaled(board, 1e-3 * side), paper)), default=0.0)
    larger = f", or print it on {fitting[0]}" if fitting else ""
    return (f"The {board.text} is {width:g} x {height:g} mm large and does not fit on {paper} ({page[0]:g} x "
            f"{page[1]:g} mm) with its margins and the ruler. {board.parts.capitalize()} of "
            f"{side_mm:g} mm would{larger}.")


def _shapes(board: Board) -> tuple[tuple[Box, ...], tuple[Disc, ...]]:
    """What is black, from the upper left corner of what is printed on."""
    match board:
        case AprilGrid():
            return tuple(_tag_boxes(board)), ()
        case CircleGrid():
            spacing = 1e3 * board.square_m
            return (), tuple(Disc(spacing + 1e3 * x, spacing + 1e3 * y, 0.5 * CIRCLE_DIAMETER * spacing)
                             for x, y, _ in board.object_points().tolist())
        case _:
            return tuple(_square_boxes(board)), ()


def _tag_boxes(board: AprilGrid) -> Iterator[Box]:
    """Tags, and the squares at the crossings between them and around."""
    tag, gap = 1e3 * board.tag_m, 1e3 * board.margin_m
    for row in range(board.tag_rows + 1):
        for col in range(board.tag_cols + 1):
            left, top = col * (tag + gap), row * (tag + gap)
            yield Box(left, top, gap, gap)
            if row < board.tag_rows and col < board.tag_cols:
                yield from _cell_boxes(left + gap, top + gap, tag, tag_cells(board.number_at(col, row)))


def _square_boxes(board: Chessboard | CharucoBoard) -> Iterator[Box]:
    square = 1e3 * board.square_m
    white = {(x, y) for x, y, _ in _marker_squares(board)} if isinstance(board, CharucoBoard) else _white_squares(board)
    for y in range(board.rows + 1):
        for x in range(board.cols + 1):
            if (x, y) not in white:
                yield Box(x * square, y * square, square, square)
    if isinstance(board, CharucoBoard):
        marker = 1e3 * board.marker_m
        for x, y, bits in _marker_squares(board):
            yield from _cell_boxes((x + 0.5) * square - 0.5 * marker, (y + 0.5) * square - 0.5 * marker, marker, bits)


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


def _cell_boxes(left: float, top: float, side: float, black: np.ndarray) -> Iterator[Box]:
    """Black runs of each row of a marker's cells (N, N)."""
    cell = side / len(black)
    for row, cells in enumerate(black):
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
