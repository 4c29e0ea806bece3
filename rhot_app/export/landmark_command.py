"""``rhot landmarks``: landmark tables of a bare hand as a raw log, tracked once, with a summary; or the installation of
the networks that find landmarks."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from rhot_app.errors import RecordingError, input_file, positive_number
from rhot_app.options import add_json_argument, add_out_argument, add_rig_argument
from rhot_app.progress import ProgressLine
from rhot_node.landmarks.install import LICENCE, PACKAGE, add_wheel, install
from rhot_node.terminal import add_examples

INSTALL = "install"

def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot landmarks``."""
    parser.usage = ("%(prog)s [-h] CSV [CSV ...] --rig FILE --out LOG [--fps N] [--bones {measured,rig}] [--json]\n"
                    "       %(prog)s install [--wheel FILE]")
    parser.add_argument("tables", type=_table_or_install, nargs="+", metavar="CSV",
                        help="a landmark table for each camera, in the rig's order (docs/landmarks.md); or the word "
                             f"install: place the hand networks on this machine (of {PACKAGE}, {LICENCE})")
    add_rig_argument(parser, "the calibrated rig, with the marker set landmarks21")
    add_out_argument(parser, "the raw log to write; a new file", metavar="LOG")
    parser.add_argument("--fps", type=positive_number, default=None, metavar="N",
                        help="frames per second of tables without times")
    parser.add_argument("--bones", choices=("measured", "rig"), default="measured",
                        help="the hand's bones: measured from the landmarks (default), or as the rig has them")
    add_json_argument(parser, "print the summary as one JSON object")
    add_examples(parser, "rhot landmarks left.csv right.csv --rig desk.json --fps 30 --out hand.rhotlog",
                 "rhot landmarks install")
    add_wheel(parser)
    parser.set_defaults(refuse=parser.error)


def _table_or_install(text: str) -> Path | None:
    """A table; None for the word install. A table of that name is ./install."""
    return None if text == INSTALL else input_file(text)


def run(args: argparse.Namespace) -> int:
    """Write the log, track it, print the summary. Raises RecordingError and RigError; KeypointError when networks
    cannot be installed."""
    if None in args.tables:
        if len(args.tables) > 1 or args.rig is not None or args.out is not None:
            args.refuse("install stands alone, or with --wheel FILE")
        progress = ProgressLine("Installing the hand networks")
        return install(args.wheel, False, progress.report)
    missing = [option for option, value in (("--rig", args.rig), ("--out", args.out)) if value is None]
    if missing or args.wheel is not None:
        args.refuse(f"a log of landmarks needs {' and '.join(missing)}" if missing else "--wheel belongs to install")
    return _write_log(args)


def _write_log(args: argparse.Namespace) -> int:
    from rhot_app.export.landmark_track import states_of_log, summarise, with_measured_bones
    from rhot_app.hand.landmarks import MEDIAN_M
    from rhot_app.project import load_rig, with_tracker
    from rhot_app.recording.landmark_log import landmark_order, read_landmark_table, write_landmark_log
    from rhot_node.compiled import announce_compilation

    if args.out.exists():
        raise RecordingError(f"{args.out}: exists already; a log is never written over. Choose another name.")
    if args.fps is not None and not 1.0 <= args.fps <= 1000.0:
        raise RecordingError(f"--fps {args.fps:g}: give the frames per second, from 1 to 1000.")
    rig = with_tracker(load_rig(args.rig), "estimator")
    landmark_order(rig)
    tables = [read_landmark_table(path, args.fps) for path in args.tables]
    frames = write_landmark_log(args.out, rig, tables)
    announce_compilation()
    bones = "The bones are the rig's."
    if args.bones == "measured":
        rig, bones = with_measured_bones(rig, args.out)
        write_landmark_log(args.out, rig, tables)
    summary: dict[str, Any] = {"log": str(args.out), "frames": frames, "bones": bones} | summarise(
        rig, list(states_of_log(rig, args.out)))
    if args.json:
        print(json.dumps(summary))
        return 0
    print(f"{args.out}: {frames} frames of {len(tables)} camera{'' if len(tables) == 1 else 's'}.")
    print(bones)
    if not summary["tracked"]:
        print("No hand was found in them. Are the tables in the rig's order, and is the rig's hand of the right side?")
        return 0
    print(f"Tracked in {100 * summary['tracked']:.0f} % of the states, from {summary['start_s']:.2f} s on.\n"
          f"Reprojection error of the joints: median {summary['reprojection_px']:.1f} px, at the hand "
          f"{summary['reprojection_mm']:.1f} mm.\n"
          f"Stated standard deviation of the joints: {summary['joint_sd_mm']:.1f} mm per axis.")
    if summary["reprojection_large"]:
        print(f"The reprojection error is large: landmarks err by {1e3 * MEDIAN_M:.0f} mm. Do not rely on the hand.\n"
              "Check the unit of length of the rig's camera poses, the order of the tables, and the side and size of "
              "the rig's hand (rhot calibrate bones measures its bones).")
    else:
        print("rhot export writes the hand for other programs; rhot calibrate bones measures its bones.")
    return 0
