"""``rhot target``: a calibration board as PDF or SVG in true scale."""

from __future__ import annotations

import argparse
from pathlib import Path

from rhot_app.calibration.board.standard_board import BOARD, CHARUCO, MARKER_SHARE, SQUARE_MM
from rhot_app.calibration.commands.output import require_folder
from rhot_app.errors import positive_number
from rhot_node.terminal import add_examples


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot target``."""
    parser.add_argument("kind", choices=("chessboard", "charuco"), help="a plain chessboard, or one with markers")
    parser.add_argument("--board", default=None, metavar=BOARD,
                        help=f"inner corners of a chessboard (default {BOARD}), squares of a ChArUco board (default "
                        f"{CHARUCO})")
    parser.add_argument("--square-mm", type=positive_number, default=SQUARE_MM, metavar="S",
                        help=f"side of a square (default {SQUARE_MM:g})")
    parser.add_argument("--marker-mm", type=positive_number, metavar="M",
                        help="side of a ChArUco marker (default three quarters of the square)")
    parser.add_argument("--dictionary", default="DICT_4X4_50", help="the markers' dictionary (default DICT_4X4_50)")
    parser.add_argument("--legacy-pattern", action="store_true", help="the ChArUco layout of OpenCV before 4.6")
    parser.add_argument("--paper", default="A4", help="A5, A4 (default), A3, A2, A1, A0, letter, legal or tabloid")
    parser.add_argument("--out", type=Path, required=True, metavar="FILE", help="file to write, .pdf or .svg")
    add_examples(parser, "rhot target chessboard --out board.pdf",
                 "rhot target charuco --paper A3 --square-mm 35 --out board.pdf")


def run(args: argparse.Namespace) -> int:
    """Draw and write the board."""
    from rhot_app.calibration.board.boards import Board, CharucoBoard, Chessboard, parse_size
    from rhot_app.calibration.board.target import write_target

    require_folder(args.out)
    square_m = 1e-3 * args.square_mm
    board: Board
    if args.kind == "chessboard":
        board = Chessboard(*parse_size(args.board or BOARD), square_m)
    else:
        marker_m = MARKER_SHARE * square_m if args.marker_mm is None else 1e-3 * args.marker_mm
        board = CharucoBoard(*parse_size(args.board or CHARUCO), square_m, marker_m, args.dictionary,
                             args.legacy_pattern)
    write_target(args.out, board, args.paper)
    print(f"Written: {args.out} ({board.text}, {args.paper}). Print it at 100 % and measure the ruler on it.")
    return 0
