"""The arguments that describe a board, the same for every calibration that uses one."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from rhot_app.calibration.board.standard_board import BOARD, CHARUCO, SQUARE_MM

if TYPE_CHECKING:
    from rhot_app.calibration.board.boards import Board


def add_board_arguments(parser: argparse.ArgumentParser) -> None:
    """Size, squares and markers."""
    board = parser.add_argument_group("board")
    board.add_argument("--board", metavar="COLSxROWS",
                       help=f"inner corners of the chessboard (default {BOARD}); with --marker-mm squares of a ChArUco "
                       f"board (default {CHARUCO})")
    board.add_argument("--square-mm", type=float, default=SQUARE_MM, metavar="S",
                       help=f"side of a square, as measured (default {SQUARE_MM:g}, as rhot target draws it; printers "
                       "scale)")
    board.add_argument("--marker-mm", type=float, metavar="M", help="side of a marker: the board is a ChArUco board")
    board.add_argument("--dictionary", default="", metavar="NAME", help="its markers (default DICT_4X4_50)")
    board.add_argument("--legacy-pattern", action="store_true", help="it was drawn by OpenCV before 4.6")


def board_of(args: argparse.Namespace) -> Board:
    """The board; raises CalibrationError for an impossible one."""
    from rhot_app.calibration.board.boards import DEFAULT_DICTIONARY, CharucoBoard, Chessboard, parse_size

    cols, rows = parse_size(args.board or (BOARD if args.marker_mm is None else CHARUCO))
    if args.marker_mm is None:
        return Chessboard(cols, rows, args.square_mm * 1e-3)
    return CharucoBoard(cols, rows, args.square_mm * 1e-3, args.marker_mm * 1e-3,
                        args.dictionary or DEFAULT_DICTIONARY, args.legacy_pattern)
