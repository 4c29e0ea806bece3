"""``rhot landmarks``: landmark tables of a bare hand as a raw log, tracked once, with a summary; or the installation of
the networks that find landmarks."""

from __future__ import annotations

import argparse
import contextlib
import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rhot_app.errors import CalibrationError, RecordingError, input_file, positive_number
from rhot_app.hand.landmarks import ANATOMY_SD_M, NOISE_M
from rhot_app.progress import ProgressLine
from rhot_node.landmarks import install_command
from rhot_node.landmarks.install import LICENCE, PACKAGE
from rhot_node.landmarks.install_command import add_wheel
from rhot_node.terminal import add_examples

if TYPE_CHECKING:
    from rhot_app.project import Rig
    from rhot_app.state import HandState


INSTALL = "install"

MEDIAN_M = math.sqrt(2.0 * math.log(2.0) * (ANATOMY_SD_M**2 + NOISE_M**2))
"""m: median distance of a landmark from its joint (`hand.landmarks`): a Rayleigh distribution's."""

LARGE = 1.7
"""Times MEDIAN_M from which the rig or its hand is wrong. Chosen: between 1.4 of the
recorded hand in docs/landmarks.md with the shipped bones, and 1.8 with a wrong side or unit."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot landmarks``."""
    parser.usage = ("%(prog)s [-h] CSV [CSV ...] --rig FILE --out LOG [--fps N] [--bones {measured,rig}] [--json]\n"
                    "       %(prog)s install [--wheel FILE]")
    parser.add_argument("tables", type=_table_or_install, nargs="+", metavar="CSV",
                        help="a landmark table for each camera, in the rig's order (docs/landmarks.md); or the word "
                             f"install: place the hand networks on this machine (of {PACKAGE}, {LICENCE})")
    parser.add_argument("--rig", type=input_file, metavar="FILE",
                        help="the calibrated rig, with the marker set landmarks21")
    parser.add_argument("--out", type=Path, metavar="LOG", help="the raw log to write; a new file")
    parser.add_argument("--fps", type=positive_number, default=None, metavar="N",
                        help="frames per second of tables without times")
    parser.add_argument("--bones", choices=("measured", "rig"), default="measured",
                        help="the hand's bones: measured from the landmarks (default), or as the rig has them")
    parser.add_argument("--json", action="store_true", help="print the summary as one JSON object")
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
        return install_command.install(args.wheel, False, progress.report)
    missing = [option for option, value in (("--rig", args.rig), ("--out", args.out)) if value is None]
    if missing or args.wheel is not None:
        args.refuse(f"a log of landmarks needs {' and '.join(missing)}" if missing else "--wheel belongs to install")
    return _write_log(args)


def _write_log(args: argparse.Namespace) -> int:
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
    summary: dict[str, Any] = {"log": str(args.out), "frames": frames, "bones": bones} | summarise(rig, args.out)
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


def with_measured_bones(rig: Rig, path: Path) -> tuple[Rig, str]:
    """The rig with the bones that the landmarks of a log show, if they are usable, and a sentence on them."""
    import msgspec

    from rhot_app.calibration.hand.bones import solve_bones
    from rhot_app.calibration.hand.marker_places import tracks_of
    from rhot_app.calibration.recorded_observations import read_instants

    roles = {marker.id: marker.role for marker in rig.markers.markers if marker.role is not None}
    try:
        _, instants = read_instants(path, rig)
        report = solve_bones(tracks_of(instants.times_s, instants.positions, rig.markers.ids, roles), rig.hand)
    except (CalibrationError, RecordingError) as exc:
        return rig, f"The bones are the rig's: {exc}"
    if report.method != "landmarks":
        return rig, "The bones are the rig's, as not all joints have a landmark."
    if not report.verdict.acceptable:
        return rig, f"The bones are the rig's. Those that the landmarks show: {report.verdict.sentence}"
    hand = msgspec.structs.replace(report.hand, name=f"measured from {path.name}")
    return msgspec.structs.replace(rig, hand=hand), f"Bones measured from the landmarks. {report.verdict.sentence}"


def summarise(rig: Rig, path: Path) -> dict[str, Any]:
    """What the estimator makes of a landmark log. `tracked`: part of the states with a hand; `start_s`: of the first of
    them, after the first frame; `reprojection_px`, `reprojection_mm`: median distance of the landmarks from their
    joints' images, and as long at the hand; `reprojection_large`: whether that is more than LARGE of MEDIAN_M."""
    from rhot_app.geometry.camera import CameraModel
    from rhot_app.recording.landmark_log import landmark_order

    joints, order = [], np.array(landmark_order(rig))
    cameras = [CameraModel.from_rig(node.intrinsics, node.pose) for node in rig.nodes]
    errors, errors_m, first_ns = [], [], None
    states = track(rig, path)
    for state in states:
        first_ns = state.t_master_ns if first_ns is None else first_ns
        if state.tracked:
            joints.append(state)
            for camera, pixels in zip(cameras, state.camera_pixels, strict=True):
                expected = camera.project(state.joint_positions)
                errors.append(np.linalg.norm(expected[order[order >= 0]] - pixels[order >= 0], axis=1))
                errors_m.append(errors[-1] / camera.pixels_per_metre(state.joint_positions[order[order >= 0]]))
    if not joints:
        return {"tracked": 0.0, "start_s": None, "reprojection_px": None, "reprojection_mm": None,
                "reprojection_large": None, "joint_sd_mm": None}
    variances = np.array([np.einsum("jii->ji", state.joint_covariances) for state in joints])
    error_m = float(np.nanmedian(errors_m))
    return {"tracked": len(joints) / len(states), "start_s": 1e-9 * (joints[0].t_master_ns - (first_ns or 0)),
            "reprojection_px": float(np.nanmedian(errors)), "reprojection_mm": 1e3 * error_m,
            "reprojection_large": error_m > LARGE * MEDIAN_M, "joint_sd_mm": 1e3 * float(np.sqrt(variances.mean()))}


def track(rig: Rig, path: Path) -> list[HandState]:
    """The states of a log by the rig's tracker, one after every frame."""
    from rhot_app.recording.raw_log import LogReader
    from rhot_app.sources.replay import LogValidator
    from rhot_app.tracking.tracker import CameraObservations
    from rhot_app.tracking.trackers import make_tracker

    states, validator, tracker = [], LogValidator(rig), make_tracker(rig)
    with contextlib.closing(LogReader(path)) as reader:
        for record in reader:
            frame = validator.feed(record)
            if isinstance(frame, CameraObservations):
                tracker.ingest(frame)
                state = tracker.solve()
                if state is not None:
                    states.append(state)
    return states
