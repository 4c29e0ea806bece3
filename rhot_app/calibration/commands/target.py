"""``rhot target``: a calibration board as PDF or SVG in true scale."""

from __future__ import annotations

import argparse
from pathlib import Path

from rhot_app.calibration.commands.output import require_folder


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot target``."""
    parser.add_argument("kind", choices=("chessboard", "charuco"), help="a plain chessboard, or one with markers")
    parser.add_argument("--board", default=None, metavar="9x6",
                        help="inner corners of a chessboard (default 9x6), squares of a ChArUco board (default 10x7)")
    parser.add_argument("--square-mm", type=float, default=25.0, metavar="S", help="side of a square (default 25)")
    parser.add_argument("--marker-mm", type=float, metavar="M",
                        help="side of a ChArUco marker (default three quarters of the square)")
    parser.add_argument("--dictionary", default="DICT_4X4_50", help="the markers' dictionary (default DICT_4X4_50)")
    parser.add_argument("--legacy-pattern", action="store_true", help="the ChArUco layout of OpenCV before 4.6")
    parser.add_argument("--paper", default="A4", help="A5, A4 (default), A3, A2, A1, A0, letter, legal or tabloid")
    parser.add_argument("--out", type=Path, required=True, metavar="FILE", help="file to write, .pdf or .svg")


def run(args: argparse.Namespace) -> int:
    """Draw and write the board."""
    from rhot_app.calibration.board import Board, CharucoBoard, Chessboard, parse_size
    from rhot_app.calibration.target import draw_target
    from rhot_app.errors import CalibrationError
    from rhot_node.files import write_atomically

    require_folder(args.out)
    suffix = args.out.suffix.lower()
    if suffix not in (".pdf", ".svg"):
        raise CalibrationError(f"{args.out}: the file's name must end in .pdf or .svg.")
    square_m = 1e-3 * args.square_mm
    board: Board
    if args.kind == "chessboard":
        board = Chessboard(*parse_size(args.board or "9x6"), square_m)
    else:
        marker_m = 0.75 * square_m if args.marker_mm is None else 1e-3 * args.marker_mm
        board = CharucoBoard(*parse_size(args.board or "10x7"), square_m, marker_m, args.dictionary,
                             args.legacy_pattern)
    drawing = draw_target(board, args.paper)
    try:
        write_atomically(args.out, drawing.to_pdf() if suffix == ".pdf" else drawing.to_svg())
    except OSError as exc:
        raise CalibrationError(f"{args.out}: cannot be written ({exc.strerror}).") from exc
    print(f"Written: {args.out} ({board.text}, {args.paper}). Print it at 100 % and measure the ruler on it.")
    return 0
