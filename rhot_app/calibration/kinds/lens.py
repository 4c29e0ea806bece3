"""The calibration of a camera's intrinsics, from pictures, films or live views of a board."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from rhot_app.calibration.commands.arguments import add_board_arguments, board_of, dropped_fields, left_out
from rhot_app.calibration.registry import Calibration, Command, InForce, Observed
from rhot_app.calibration.report import Figure, Report, Table
from rhot_app.options import add_json_argument, add_out_argument, add_rig_argument
from rhot_node.terminal import add_examples

if TYPE_CHECKING:
    from rhot_app.calibration.board.boards import Board
    from rhot_app.calibration.board.corners import BoardView
    from rhot_app.calibration.lens.intrinsics import IntrinsicsResult
    from rhot_app.calibration.lens.views import ViewSet
    from rhot_app.calibration.proposal import Proposal
    from rhot_app.progress import Progress
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


def observe(args: argparse.Namespace, progress: Progress) -> Observed:
    """The board in all pictures."""
    from rhot_app.calibration.lens.views import matching_files, read_views
    from rhot_app.errors import CalibrationError

    board, rig = board_of(args), _rig(args)
    files = list(dict.fromkeys(path for pattern in args.images for path in matching_files(pattern)))
    if not files:
        raise CalibrationError(f"No file matches {' '.join(args.images)}. Put the pattern in quotes and see that the "
                               "folder is right.")
    return Observed((read_views(files, board, progress=progress), board, args.node or "", args.square_pixels),
                    None if rig is None else InForce(rig, args.rig))


def solve(views: ViewSet | Sequence[BoardView], board: Board, camera: str, square_pixels: bool, now: InForce | None, *,
          progress: Progress) -> IntrinsicsResult:
    """The lens of `camera`, "" for one without a name, from pictures of a board; or from views of a live camera, which
    are numbered. Raises CalibrationError."""
    from rhot_app.calibration.lens import intrinsics
    from rhot_app.calibration.lens.views import ViewSet

    if not isinstance(views, ViewSet):
        views = ViewSet(tuple(replace(view, source=f"view {k}") for k, view in enumerate(views, 1)), (), None)
    found = intrinsics.solve(views.views, board, square_pixels=square_pixels, dropped=views.dropped,
                             noticed=[] if views.size is None else [views.size], progress=progress)
    return replace(found, camera=camera)


def write(args: argparse.Namespace, result: IntrinsicsResult, now: InForce | None) -> str:
    """The intrinsics file, and the rig."""
    from rhot_app.calibration.lens.intrinsics import save_intrinsics

    written = []
    if args.out is not None:
        save_intrinsics(args.out, result)
        written.append(str(args.out))
    if now is not None:
        written.append(propose(result, now).save(now.path))
    return ", ".join(written)


def report(result: IntrinsicsResult, now: InForce | None) -> Report:
    """What the lens is, how well it is known, and of which views."""
    from rhot_app.calibration.bundle.robust_error import what_is_reported
    from rhot_app.calibration.lens.intrinsics_checks import WORKING_DISTANCE_M
    from rhot_app.calibration.rig_figures import lens_figures, order_of_distortion

    std = {name: std for name, (_, std) in result.parameters.items()}
    errors, board, cover = result.errors, result.board_errors, result.coverage
    figures = [
        *lens_figures(result.camera, result.intrinsics, std),
        Figure("corners, rms", result.rms_px, "px", key="rms_px"),
        Figure("views", len(result.views), decimals=0, key="views_used"),
        Figure(f"error expected at {WORKING_DISTANCE_M:g} m", 1e3 * errors.typical_m, "mm",
               key="expected_error_mm.typical"),
        Figure("the same in the corners", 1e3 * errors.worst_m, "mm", key="expected_error_mm.corner")]
    if board is not None:
        figures += [Figure("board, in its plane", 1e3 * board.in_plane_m, "mm", key="board_errors_mm.in_plane"),
                    Figure("board, across it", 1e3 * board.across_m, "mm", key="board_errors_mm.across")]
    views = tuple((Figure("view", view.source, key="name"), Figure("rms", view.rms_px, "px", key="rms_px"),
                   Figure("corners", view.corners, decimals=0, key="corners"),
                   Figure("blur", view.blur_px, "px", key="blur_px"),
                   Figure("square", view.square_px, "px", decimals=0, key="square_px")) for view in result.views)
    coverage = (f"Covered, of what is needed: across {100 * cover.x:.0f} %, up and down {100 * cover.y:.0f} %, "
                f"nearness {100 * cover.size:.0f} %, tilt {100 * cover.skew:.0f} %; corners in "
                f"{100 * cover.share:.0f} % of the picture (55 % and more are good).")
    return Report(
        result.verdict, tuple(figures), (Table("views", views),),
        (f"{what_is_reported(result.error_inflation)}.", order_of_distortion(result.intrinsics), coverage,
         *left_out(result.dropped)),
        {"size": result.size, "std": std, "disagreement": result.error_inflation, "undetermined": result.undetermined,
         "coverage": {**cover.bars, "share": cover.share, "cells": cover.cells},
         "expected_error_mm.distance_m": WORKING_DISTANCE_M, "board_errors_mm": None, **dropped_fields(result.dropped)})


def propose(result: IntrinsicsResult, now: InForce) -> Proposal:
    """The rig with this lens of its camera; poses that were found with the old one are outdated then."""
    from rhot_app.calibration.check.camera_calibration import with_lens
    from rhot_app.calibration.proposal import proposed

    after = with_lens(now.rig, result.camera, result.intrinsics)
    return proposed(f"{CALIBRATION.reason} {result.camera}", report(result, now), now.rig, after,
                    afterwards=what_follows(now.rig, after))


def what_follows(before: Rig, after: Rig) -> str:
    """What a new lens leaves to be done, a sentence; "" for nothing."""
    missing = [node.name for node in after.nodes if node.intrinsics.nominal]
    if len(after.nodes) == 1:
        return ""
    if missing:
        return f"Next the intrinsics of {' and '.join(missing)}, then stereo."
    return ("Next stereo: the poses of the cameras were found with the old intrinsics." if all(before.tracked_with) else
            "Next stereo: how the cameras stand to each other is not known yet.")


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


CALIBRATION = Calibration(
    "lens", "Intrinsics of a camera", "Focal length, centre and distortion of one camera's lens, from a board that is "
    "held all over its picture.", "intrinsics of",
    Command("intrinsics", "focal length, centre and distortion of one camera's lens, from pictures of a board",
            add_arguments, observe, ("lens",), write),
    solve=solve, report=report, propose=propose, solver="rhot_app.calibration.lens.intrinsics")
