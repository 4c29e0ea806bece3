"""``rhot target``: a calibration board as PDF or SVG in true scale."""

from __future__ import annotations

import argparse

from rhot_app.calibration.board.standard_board import KINDS, TAG_SPACING
from rhot_app.calibration.commands.output import SIZE_HELP, SQUARE_HELP, require_folder
from rhot_app.errors import positive_number
from rhot_app.options import add_out_argument
from rhot_node.terminal import add_examples


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot target``."""
    parser.add_argument("kind", choices=tuple(KINDS), help="a plain chessboard, one with markers (ChArUco), Kalibr's "
                        "AprilGrid, or OpenCV's asymmetric grid of circles")
    parser.add_argument("--board", metavar="COLSxROWS", help=f"its size: {SIZE_HELP}")
    parser.add_argument("--square-mm", type=positive_number, metavar="S", help=SQUARE_HELP)
    parser.add_argument("--tag-spacing", type=positive_number, metavar="R", help="gap between the tags of an "
                        f"AprilGrid, as a part of their side (default {TAG_SPACING:g})")
    parser.add_argument("--marker-mm", type=positive_number, metavar="M",
                        help="side of a ChArUco marker (default three quarters of the square)")
    parser.add_argument("--dictionary", metavar="NAME", help="the markers' dictionary (default DICT_4X4_50)")
    parser.add_argument("--legacy-pattern", action="store_true", help="the ChArUco layout of OpenCV before 4.6")
    parser.add_argument("--paper", default="A4", help="A5, A4 (default), A3, A2, A1, A0, letter, legal or tabloid")
    add_out_argument(parser, "file to write, .pdf or .svg", required=True)
    add_examples(parser, "rhot target chessboard --out board.pdf",
                 "rhot target aprilgrid --board 6x6 --paper A3 --square-mm 35 --out board.pdf")


def run(args: argparse.Namespace) -> int:
    """Draw and write the board."""
    from rhot_app.calibration.board.boards import make_board
    from rhot_app.calibration.board.target import write_target

    require_folder(args.out)
    board = make_board(args.kind, args.board, square_mm=args.square_mm, marker_mm=args.marker_mm,
                       dictionary=args.dictionary, legacy=args.legacy_pattern, tag_spacing=args.tag_spacing)
    write_target(args.out, board, args.paper)
    print(f"Written: {args.out} ({board.text}, {args.paper}). Print it at 100 % and measure the ruler on it.")
    return 0
