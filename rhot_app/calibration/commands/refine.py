"""``rhot refine``: whether a rig's cameras still stand as calibrated, and how they stand now, from a recorded hand."""

from __future__ import annotations

import argparse
import contextlib
import math
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rhot_app.calibration.commands.arguments import require_folder, show
from rhot_app.calibration.registry import calibration
from rhot_app.calibration.report import Report
from rhot_app.errors import CalibrationError, RecordingError, RhotError, input_file
from rhot_app.options import add_json_argument, add_out_argument, add_rig_argument
from rhot_node.compiled import announce_compilation
from rhot_node.terminal import add_examples

if TYPE_CHECKING:
    from rhot_app.project import Rig
    from rhot_app.tracking.refinement.refined_rig import Refinement, Scale
    from rhot_app.tracking.tracker import CameraObservations

SCALE_S = 120.0
"""Of the recording's end, from which the hand's size is estimated."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot refine``."""
    parser.add_argument("log", type=input_file, metavar="LOG", help="a raw log of a hand that moves through the volume")
    add_rig_argument(parser, "rig to check (default: the log's own)")
    add_out_argument(parser, "write the refined rig here", metavar="RIG")
    parser.add_argument("--use", action="store_true",
                        help="write it to --rig; what is there is kept (rhot history)")
    parser.add_argument("--no-scale", action="store_true", help="do not estimate the hand's size, which takes longest")
    add_json_argument(parser)
    add_examples(parser, "rhot refine wave.rhotlog", "rhot refine wave.rhotlog --rig desk.json --use")


def run(args: argparse.Namespace) -> int:
    """Refine and report; a rig is written only with ``--out`` or ``--use``, when it is stale and may be refined."""
    from rhot_app.project import load_rig
    from rhot_app.recording.raw_log import LogReader
    from rhot_app.rig_history import accept
    from rhot_app.tracking.refinement.refined_rig import Scale, figure_rows, refined_rig, verdict_of

    if args.use and (args.rig is None or args.out is not None):
        raise CalibrationError("--use writes to the file that --rig names; give it, and leave --out away.")
    target = args.rig if args.use else args.out
    require_folder(target)
    with contextlib.closing(LogReader(args.log)) as reader:
        rig = load_rig(args.rig) if args.rig is not None else reader.rig
    announce_compilation()
    frames = _frames(args.log, rig)
    found = _refine(args.log, rig, frames)
    refined = refined_rig(rig, found)
    scale = Scale() if args.no_scale else _scale(refined, frames)
    verdict = verdict_of(found, rig.nodes[0].name, scale)
    written = ""
    if target is not None and verdict.acceptable and not found.holds:
        accept(target, refined, calibration("refined").reason)
        written = str(target)
    rows = figure_rows(found, scale)
    wide = max(len(what) for what, _, _ in rows)
    lines = ["", f"{'':{wide}}  before      after", *(f"{what:{wide}}  {before:<10}  {after}"
                                                      for what, before, after in rows)]
    if target is not None and found.holds:
        lines.append("Nothing was written: no other calibration is better.")
    return show(Report(verdict, notes=tuple(lines), fields=_fields(found, scale)), as_json=args.json, written=written)


def _frames(log: Path, rig: Rig) -> list[CameraObservations]:
    """Every admitted frame. Raises RecordingError when there is none."""
    from rhot_app.calibration.recorded_observations import why_none
    from rhot_app.recording.raw_log import LogReader
    from rhot_app.sources.replay import LogValidator
    from rhot_app.tracking.tracker import CameraObservations

    validator = LogValidator(rig)
    with contextlib.closing(LogReader(log)) as reader:
        frames = [frame for record in reader if isinstance(frame := validator.feed(record), CameraObservations)]
    if not frames:
        raise RecordingError(f"{log}: no frame in it can be used with the rig {rig.name!r} ({why_none(validator)}). "
                             "Give the rig that the log was recorded with, or record again.")
    return frames


def _refine(log: Path, rig: Rig, frames: Iterable[CameraObservations]) -> Refinement:
    from rhot_app.tracking.refinement.rig_refinement import RigRefiner

    refiner = RigRefiner(rig)
    if not refiner.active:
        raise CalibrationError(f"the rig {rig.name!r} cannot be refined: that needs two or more cameras in different "
                               "places, depth.mode \"stereo\", and nodes that send times.")
    for frame in frames:
        refiner.take(frame)
    found = refiner.step()
    if found is None:
        raise CalibrationError(f"{log}: too few markers were seen by two cameras at once. Record a hand that moves "
                               "through both pictures for two minutes.")
    return found


def _scale(rig: Rig, frames: list[CameraObservations]) -> Scale:
    """The hand's size by the estimator on the refined rig; unknown where the rig does not allow it."""
    import msgspec

    from rhot_app.project import TrackerSettings
    from rhot_app.tracking.refinement.refined_rig import Scale
    from rhot_app.tracking.scene import make_tracker

    try:
        floating = msgspec.structs.replace(rig, tracker=TrackerSettings(kind="estimator", float_scale=True))
        tracker = make_tracker(floating)
    except (RhotError, ValueError):  # a rig cannot be tracked so if one of its hands has no markers
        return Scale()
    since_ns, scale = frames[-1].t_row0_master_ns - round(1e9 * SCALE_S), Scale()
    for frame in frames:
        if frame.t_row0_master_ns >= since_ns:
            tracker.ingest(frame)
            state = tracker.solve()
            if state is not None and math.isfinite(state.hand_scale_sd):
                scale = Scale(state.hand_scale, state.hand_scale_sd)
    return scale


def _fields(found: Refinement, scale: Scale) -> dict[str, Any]:
    return {
        "holds": found.holds, "probability": found.probability, "chi_squared": found.chi_squared,
        "degrees_of_freedom": found.freedom, "held_out": found.held_out, "before_px": found.before_px,
        "after_px": found.after_px,
        "places_move_mm": 1e3 * found.moved_m, "places_sd_mm": 1e3 * found.places_sd_m,
        "knocked_s_before_end": found.knocked_s if found.knocked_s is not None and math.isfinite(found.knocked_s)
        else None, "dispersion": found.dispersion, "observations": found.observations, "voxels": found.voxels,
        "scale": scale.factor if scale.known else None, "scale_sd": scale.sd if scale.known else None,
        "cameras": [{"name": camera.name, "turn_deg": [math.degrees(v) for v in camera.turn],
                     "turn_sd_deg": [math.degrees(v) for v in camera.turn_sd],
                     "shift_across_mm": 1e3 * camera.offset[0], "shift_across_sd_mm": 1e3 * camera.offset[1],
                     "undetermined": list(camera.undetermined)} for camera in found.cameras]}
