"""``rhot calibrate intrinsics``: one camera's lens from pictures or films of a board."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from rhot_app.calibration.commands.output import add_board_arguments, board_of, require_folder, show
from rhot_app.calibration.registry import LENS
from rhot_app.options import add_json_argument, add_out_argument, add_rig_argument
from rhot_node.terminal import add_examples

if TYPE_CHECKING:
    from rhot_app.calibration.lens.intrinsics import IntrinsicsReport
    from rhot_app.project import Rig


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot calibrate intrinsics``."""
    parser.add_argument("--images", required=True, nargs="+", metavar="PATTERN",
                        help="pictures of one camera, such as 'left*.jpg', or films of a moving board")
    add_board_arguments(parser)
    parser.add_argument("--square-pixels", action="store_true", help="the same focal length along x and y")
    add_out_argument(parser, "intrinsics file to write, for calibrate stereo")
    add_rig_argument(parser, "rig to put them into", exists=False)
    parser.add_argument("--node", metavar="NAME", help="the rig's camera that took the pictures")
    add_json_argument(parser)
    add_examples(parser, "rhot calibrate intrinsics --images 'left*.jpg' --square-mm 24.8 --out left.json",
                 "rhot calibrate intrinsics --images left.mp4 --rig desk.json --node left")


def run(args: argparse.Namespace) -> int:
    """Calibrate and report; files are written only when the verdict allows it."""
    from rhot_app.calibration.check.camera_calibration import with_lens
    from rhot_app.calibration.lens.intrinsics import save_intrinsics, solve
    from rhot_app.calibration.lens.views import matching_files, read_views
    from rhot_app.errors import CalibrationError
    from rhot_app.progress import ProgressLine, within
    from rhot_app.rig_history import accept

    require_folder(args.out)
    board = board_of(args)
    rig = _rig(args)
    files = list(dict.fromkeys(path for pattern in args.images for path in matching_files(pattern)))
    if not files:
        raise CalibrationError(f"No file matches {' '.join(args.images)}. Put the pattern in quotes and see that the "
                               "folder is right.")
    line = ProgressLine("intrinsics")
    read = read_views(files, board, progress=within(line.report, 0.0, 0.5))
    report = solve(read.views, board, square_pixels=args.square_pixels, dropped=read.dropped,
                   noticed=[] if read.size is None else [read.size], progress=within(line.report, 0.5, 1.0))
    line.finish()
    written = []
    if report.verdict.acceptable and args.out is not None:
        save_intrinsics(args.out, report)
        written.append(str(args.out))
    if report.verdict.acceptable and rig is not None:
        accept(args.rig, with_lens(rig, args.node, report.intrinsics), f"{LENS.reason} {args.node}")
        written.append(str(args.rig))
    return show(fields_of(report), lines_of(report), report.verdict, as_json=args.json, written=", ".join(written))


def fields_of(report: IntrinsicsReport) -> dict[str, Any]:
    """The JSON's fields."""
    from rhot_app.calibration.lens.intrinsics_checks import WORKING_DISTANCE_M

    lens, errors = report.intrinsics, report.board_errors
    return {
        "rms_px": report.rms_px, "fx": lens.fx, "fy": lens.fy, "cx": lens.cx, "cy": lens.cy,
        "distortion": list(lens.distortion), "size": list(report.size),
        "std": {name: std for name, (_, std) in report.parameters.items()},
        "disagreement": report.error_inflation,
        "undetermined": list(report.undetermined),
        "views_used": len(report.views),
        "views_rejected": [{"name": each.name, "reason": each.reason, "code": each.code} for each in report.dropped],
        "views": [{"name": view.source, "rms_px": view.rms_px, "corners": view.corners,
                   "blur_px": _finite(view.blur_px), "square_px": view.square_px} for view in report.views],
        "coverage": {**report.coverage.bars, "share": report.coverage.share, "cells": report.coverage.cells.tolist()},
        "expected_error_mm": {"distance_m": WORKING_DISTANCE_M, "typical": _finite(1e3 * report.errors.typical_m),
                              "corner": _finite(1e3 * report.errors.worst_m)},
        "board_errors_mm": None if errors is None else {"in_plane": 1e3 * errors.in_plane_m,
                                                        "across": 1e3 * errors.across_m},
    }


def lines_of(report: IntrinsicsReport) -> list[str]:
    """The figures for people."""
    from rhot_app.calibration.bundle.robust_error import what_is_reported
    from rhot_app.calibration.lens.intrinsics_checks import WORKING_DISTANCE_M

    lines = [f"left out: {each.name}: {each.reason}" for each in report.dropped]
    lines += [f"{name:<4}{value:12.4f} ± {std:.4f}" + (" px" if name[0] in "fc" else "")
              for name, (value, std) in report.parameters.items()]
    lines.append(what_is_reported(report.error_inflation))
    cover = report.coverage
    lines.append(f"coverage, of what is needed: across {100 * cover.x:.0f} %, up and down {100 * cover.y:.0f} %, "
                 f"nearness {100 * cover.size:.0f} %, tilt {100 * cover.skew:.0f} %; corners in "
                 f"{100 * cover.share:.0f} % of the picture (55 % and more are good)")
    lines.append(f"error of a point {WORKING_DISTANCE_M:g} m away by the lens alone (SD): {report.errors}")
    worst = sorted(report.views, key=lambda view: -view.rms_px)[:3]
    lines.append("worst views: " + ", ".join(f"{view.source} {view.rms_px:.2f} px" for view in worst))
    return lines


def _rig(args: argparse.Namespace) -> Rig | None:
    """The rig that will take the lens, read before the work begins."""
    from rhot_app.errors import CalibrationError
    from rhot_app.project import load_rig

    if args.rig is None and args.node is None:
        return None
    if args.rig is None or args.node is None:
        raise CalibrationError("--rig and --node belong together: which camera of which rig?")
    rig = load_rig(args.rig)
    names = [node.name for node in rig.nodes]
    if args.node not in names:
        raise CalibrationError(f"{args.rig} has no camera {args.node!r}; its cameras are {', '.join(names)}.")
    return rig


def _finite(value: float) -> float | None:
    """The number as JSON may hold it."""
    return value if value == value and abs(value) != float("inf") else None
