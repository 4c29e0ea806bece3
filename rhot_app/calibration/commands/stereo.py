"""``rhot calibrate stereo``: two or more cameras from pictures of a board that they took at the same moments."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from rhot_app.calibration.commands.board_arguments import add_board_arguments, board_of
from rhot_app.calibration.commands.output import add_json_argument, require_folder, show
from rhot_app.calibration.commands.stereo_arguments import (
    files_of,
    known_lengths,
    named_paths,
)

if TYPE_CHECKING:
    from rhot_app.calibration.lens.start import LensStart
    from rhot_app.calibration.stereo.report import StereoReport
    from rhot_app.calibration.stereo.world_frame import WorldFrame
    from rhot_app.progress import Progress
    from rhot_app.project import Rig

EPILOG = """Patterns stand in quotes. Pictures of one moment have the same number in their names, such as left07.jpg and
right07.jpg. Two cameras are --left and --right; more, or others, are --camera NAME=PATTERN, named as in the rig.

The rig is written only when the verdict allows it; what was in --out before is kept (rhot history)."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot calibrate stereo``."""
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.epilog = EPILOG
    pictures = parser.add_argument_group("pictures")
    pictures.add_argument("--left", metavar="PATTERN", help="pictures of the camera called left")
    pictures.add_argument("--right", metavar="PATTERN", help="pictures of the camera called right")
    pictures.add_argument("--camera", action="append", default=[], metavar="NAME=PATTERN",
                          help="pictures of a camera of the rig; once per camera")
    add_board_arguments(parser)
    lenses = parser.add_argument_group("lenses; found from the same pictures where they are not given")
    lenses.add_argument("--left-intrinsics", type=Path, metavar="FILE", help="lens of left")
    lenses.add_argument("--right-intrinsics", type=Path, metavar="FILE", help="lens of right")
    lenses.add_argument("--intrinsics", action="append", default=[], metavar="NAME=FILE", help="lens of a camera")
    lenses.add_argument("--refine-intrinsics", action="store_true",
                        help="let given lenses change within their standard deviations")
    checks = parser.add_argument_group("a second known length, which alone can tell a wrong square size")
    checks.add_argument("--baseline-mm", type=float, metavar="B",
                        help="distance of the first two cameras, measured by hand from lens to lens (75 as built)")
    checks.add_argument("--ruler-mm", type=float, metavar="L", help="length of a ruler that the cameras saw")
    checks.add_argument("--ruler", action="append", default=[], metavar="NAME=x,y,x,y",
                        help="its two ends in a camera's picture, px from the upper left; for two cameras")
    rig = parser.add_argument_group("rig")
    rig.add_argument("--table-image", action="append", default=[], metavar="NAME=FILE",
                     help="the board lying on the table: the world's z points up from it")
    rig.add_argument("--rig-from", type=Path, metavar="RIG",
                     help="rig to begin with (default: --out, or the shipped one)")
    rig.add_argument("--out", type=Path, metavar="RIG", help="rig to write")
    add_json_argument(parser)


def run(args: argparse.Namespace) -> int:
    """Calibrate and report; a rig is written when it may be used and passes its own checks."""
    from rhot_app.calibration.commands.stereo_output import fields_of, lines_of
    from rhot_app.calibration.stereo.rig import calibrated_rig, require_nodes, rig_verdict
    from rhot_app.progress import ProgressLine
    from rhot_app.rig_history import accept

    require_folder(args.out)
    files = files_of(args)
    base = _base_rig(args)
    require_nodes(base, list(files))
    line = ProgressLine("stereo calibration")
    report, frame = _calibrate(args, files, base, line.report)
    line.finish()
    verdict, rig = report.verdict, None
    if report.figures is not None:
        rig = calibrated_rig(base, report.figures, frame)
        verdict = rig_verdict(report, rig, frame)
    written = ""
    if rig is not None and args.out is not None and verdict.acceptable:
        accept(args.out, rig, "stereo calibration")
        written = str(args.out)
    return show(fields_of(report, frame), lines_of(report, frame), verdict, as_json=args.json, written=written)


def _calibrate(args: argparse.Namespace, files: dict[str, list[Path]], base: Rig,
               progress: Progress) -> tuple[StereoReport, WorldFrame | None]:
    from rhot_app.calibration.lens.search import find_lens
    from rhot_app.calibration.stereo.calibrate import calibrate
    from rhot_app.calibration.stereo.reading import read_shared, read_view
    from rhot_app.calibration.stereo.rig import lens_of
    from rhot_app.calibration.stereo.world_frame import place_world

    board = board_of(args)
    names = list(files)
    known, given = known_lengths(args, names), _given_lenses(args, names)
    tables = named_paths(args.table_image, "--table-image", names)
    read = read_shared(files, board, progress=progress)
    lenses = [given[name] if name in given else find_lens(read.views.of_camera(camera), board, name)
              for camera, name in enumerate(names)]
    nodes = {node.name: node for node in base.nodes}
    report = calibrate(
        read.views, lenses, refine=args.refine_intrinsics, known=known,
        remembered=[None if nodes[name].intrinsics.nominal else lens_of(nodes[name]) for name in names],
        dropped=read.dropped, noticed=[] if read.size is None else [read.size], progress=progress)
    if not tables or report.figures is None:
        return report, None
    views = [read_view(tables[name], board) if name in tables else None for name in names]
    return report, place_world(views, board, report.figures.state, names)


def _given_lenses(args: argparse.Namespace, names: list[str]) -> dict[str, LensStart]:
    from rhot_app.calibration.lens.intrinsics_file import load_intrinsics

    given = named_paths(args.intrinsics, "--intrinsics", names)
    for name, path in (("left", args.left_intrinsics), ("right", args.right_intrinsics)):
        if path is not None:
            given[name] = path
    return {name: load_intrinsics(path).lens for name, path in given.items()}


def _base_rig(args: argparse.Namespace) -> Rig:
    """The rig to begin with: --rig-from, else what stands at --out, else the shipped one."""
    from rhot_app.project import load_rig
    from rhot_node.files import resource_path

    if args.rig_from is not None:
        return load_rig(args.rig_from)
    if args.out is not None and args.out.exists():
        return load_rig(args.out)
    return load_rig(resource_path("rigs", "two_pis.json"))
