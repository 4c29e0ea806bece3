"""``rhot target``: a calibration board as PDF or SVG in true scale."""

from __future__ import annotations

import argparse

from rhot_app.calibration.commands.arguments import BOARD_HELP, add_square_argument, described_board, require_folder
from rhot_app.options import add_out_argument
from rhot_node.terminal import add_examples


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot target``."""
    parser.add_argument("board", metavar="PART,PART,...", help=BOARD_HELP)
    add_square_argument(parser)
    parser.add_argument("--paper", default="A4", help="A5, A4 (default), A3, A2, A1, A0, letter, legal or tabloid")
    add_out_argument(parser, "file to write, .pdf or .svg", required=True)
    add_examples(parser, "rhot target chessboard --out board.pdf",
                 "rhot target aprilgrid,6x6 --paper A3 --square-mm 35 --out board.pdf")


def run(args: argparse.Namespace) -> int:
    """Draw and write the board."""
    from rhot_app.calibration.board.target import write_target

    require_folder(args.out)
    board = described_board(args.board, args.square_mm)
    write_target(args.out, board, args.paper)
    print(f"Written: {args.out} ({board.text}, {args.paper}). Print it at 100 % and measure the ruler on it.")
    return 0
