"""``rhot calibrate stereo``: two or more cameras from pictures or films of a board that they took together."""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rhot_app.calibration.commands.output import add_board_arguments, board_of, require_folder, show
from rhot_app.calibration.registry import STEREO
from rhot_app.errors import CalibrationError, finite, positive_number
from rhot_app.options import add_json_argument, add_offset_argument, add_out_argument
from rhot_node.terminal import add_examples

if TYPE_CHECKING:
    from rhot_app.calibration.lens.fit import LensStart
    from rhot_app.calibration.stereo.calibrate import KnownLengths
    from rhot_app.calibration.stereo.report import PairFigures, StereoReport
    from rhot_app.calibration.stereo.start import WorldFrame
    from rhot_app.progress import Progress
    from rhot_app.project import Rig


# -- meaning of the arguments ------------------------------------------------------------------------------------------

def files_of(args: argparse.Namespace) -> dict[str, list[Path]]:
    """The pictures of each camera, left and right first."""
    patterns = {name: pattern for name, pattern in (("left", args.left), ("right", args.right)) if pattern}
    for text in args.camera:
        name, pattern = _split(text, "--camera", "NAME=PATTERN")
        if name in patterns:
            raise CalibrationError(f"--camera {text}: the pictures of {name} are given twice.")
        patterns[name] = pattern
    if len(patterns) < 2:
        raise CalibrationError("Pictures of at least two cameras are needed: --left PATTERN --right PATTERN, or "
                               "--camera NAME=PATTERN for each.")
    from rhot_app.calibration.lens.views import matching_files

    found = {name: matching_files(pattern) for name, pattern in patterns.items()}
    for name, paths in found.items():
        if not paths:
            raise CalibrationError(f"{name}: no file matches {patterns[name]!r}. Put the pattern in quotes and see "
                                   "that the folder is right.")
    return found


def named_paths(texts: list[str], option: str, names: list[str]) -> dict[str, Path]:
    """NAME=FILE arguments as a table; raises CalibrationError for a name that is no camera."""
    table = {}
    for text in texts:
        name, path = _split(text, option, "NAME=FILE")
        if name not in names:
            raise CalibrationError(f"{option} {text}: there are no pictures of {name!r}; the cameras are "
                                   f"{', '.join(names)}.")
        table[name] = Path(path)
    return table


def known_lengths(args: argparse.Namespace, names: list[str]) -> KnownLengths:
    """The baseline by hand and the ruler."""
    import numpy as np

    from rhot_app.calibration.stereo.calibrate import KnownLengths
    from rhot_app.calibration.stereo.ruler import RulerReading

    for option, value in (("--baseline-mm", args.baseline_mm), ("--ruler-mm", args.ruler_mm)):
        if value is not None and not 0.0 < value < 1e5:
            raise CalibrationError(f"{option} {value:g}: a length in millimetres is needed.")
    baseline = None if args.baseline_mm is None else args.baseline_mm * 1e-3
    if args.ruler_mm is None and not args.ruler:
        return KnownLengths(baseline)
    if args.ruler_mm is None or len(args.ruler) < 2:
        raise CalibrationError("A ruler needs its length, --ruler-mm, and its ends in the pictures of two cameras: "
                               "--ruler left=x,y,x,y --ruler right=x,y,x,y.")
    ends = np.full((len(names), 2, 2), np.nan)
    for text in args.ruler:
        name, numbers = _split(text, "--ruler", "NAME=x,y,x,y")
        try:
            values = [float(number) for number in numbers.split(",")]
        except ValueError:
            values = []
        if name not in names or len(values) != 4 or not np.all(np.isfinite(values)):
            raise CalibrationError(f"--ruler {text}: a camera and the ends' positions in its picture are needed, such "
                                   f"as {names[0]}=120.5,80,410,95.")
        ends[names.index(name)] = np.reshape(values, (2, 2))
    return KnownLengths(baseline, RulerReading(args.ruler_mm * 1e-3, ends))


def _split(text: str, option: str, form: str) -> tuple[str, str]:
    name, _, rest = text.partition("=")
    if not name or not rest:
        raise CalibrationError(f"{option} {text}: write it as {form}.")
    return name, rest


# -- the command -------------------------------------------------------------------------------------------------------

EPILOG = """Patterns stand in quotes. Pictures of one moment have the same number in their names, such as left07.jpg and
right07.jpg. Or give one film of each camera, of a board that moves and rests: frames are chosen by themselves. Two
cameras are --left and --right; more, or others, are --camera NAME=PATTERN, named as in the rig.

The rig is written only when the verdict allows it; what was in --out before is kept (rhot history)."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot calibrate stereo``."""
    parser.epilog = EPILOG
    pictures = parser.add_argument_group("pictures")
    pictures.add_argument("--left", metavar="PATTERN", help="pictures of the camera called left")
    pictures.add_argument("--right", metavar="PATTERN", help="pictures of the camera called right")
    pictures.add_argument("--camera", action="append", default=[], metavar="NAME=PATTERN",
                          help="pictures of a camera of the rig; once per camera")
    add_offset_argument(pictures, "the times of a camera's film, where films did not begin together (rhot offset finds "
                                  "them)")
    add_board_arguments(parser)
    lenses = parser.add_argument_group("lenses; found from the same pictures where they are not given")
    lenses.add_argument("--intrinsics", action="append", default=[], metavar="NAME=FILE", help="lens of a camera")
    lenses.add_argument("--refine-intrinsics", action="store_true",
                        help="let given lenses change within their standard deviations")
    checks = parser.add_argument_group("a second known length, which alone can tell a wrong square size")
    checks.add_argument("--baseline-mm", type=positive_number, metavar="B",
                        help="distance of the first two cameras, measured by hand from lens to lens (75 as built)")
    checks.add_argument("--ruler-mm", type=positive_number, metavar="L", help="length of a ruler that the cameras saw")
    checks.add_argument("--ruler", action="append", default=[], metavar="NAME=x,y,x,y",
                        help="its two ends in a camera's picture, px from the upper left; for two cameras")
    rig = parser.add_argument_group("rig")
    rig.add_argument("--table-image", action="append", default=[], metavar="NAME=FILE",
                     help="the board lying on the table: the world's z points up from it")
    rig.add_argument("--rig-from", type=Path, metavar="RIG",
                     help="rig to begin with (default: --out, or the shipped one)")
    add_out_argument(rig, "rig to write", metavar="RIG")
    add_json_argument(parser)
    add_examples(
        parser, "rhot calibrate stereo --left 'left*.jpg' --right 'right*.jpg' --square-mm 24.8 --out desk.json",
        "rhot calibrate stereo --left 'left*.jpg' --right 'right*.jpg' --baseline-mm 75 --out desk.json")


def run(args: argparse.Namespace) -> int:
    """Calibrate and report; a rig is written when it may be used and passes its own checks."""
    from rhot_app.calibration.stereo.calibrate import calibrated_rig, require_nodes, rig_verdict
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
        accept(args.out, rig, STEREO.reason)
        written = str(args.out)
    return show(fields_of(report, frame), lines_of(report, frame), verdict, as_json=args.json, written=written)


def _calibrate(args: argparse.Namespace, files: dict[str, list[Path]], base: Rig,
               progress: Progress) -> tuple[StereoReport, WorldFrame | None]:
    from rhot_app.calibration.lens.fit import find_lens
    from rhot_app.calibration.stereo.calibrate import calibrate, lens_of
    from rhot_app.calibration.stereo.reading import read_shared, read_view
    from rhot_app.calibration.stereo.start import place_world

    board = board_of(args)
    names = list(files)
    known, given = known_lengths(args, names), _given_lenses(args, names)
    tables = named_paths(args.table_image, "--table-image", names)
    read = read_shared(files, board, offsets_s=_offsets(args, names), progress=progress)
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
    from rhot_app.calibration.lens.intrinsics import load_intrinsics

    given = named_paths(args.intrinsics, "--intrinsics", names)
    return {name: load_intrinsics(path).lens for name, path in given.items()}


def _offsets(args: argparse.Namespace, names: list[str]) -> dict[str, float]:
    offsets = {}
    for text in args.offset_s:
        name, seconds = _split(text, "--offset-s", "NAME=S")
        try:
            offsets[name] = finite(seconds)
        except argparse.ArgumentTypeError as exc:
            raise CalibrationError(f"--offset-s {text}: {exc}.") from exc
        if name not in names:
            raise CalibrationError(f"--offset-s {text}: the cameras are {', '.join(names)}.")
    return offsets


def _base_rig(args: argparse.Namespace) -> Rig:
    """The rig to begin with: --rig-from, else what stands at --out, else the shipped one."""
    from rhot_app.project import load_rig
    from rhot_node.files import resource_path

    if args.rig_from is not None:
        return load_rig(args.rig_from)
    if args.out is not None and args.out.exists():
        return load_rig(args.out)
    return load_rig(resource_path("rigs", "two_pis.json"))


# -- printed report ----------------------------------------------------------------------------------------------------

def fields_of(report: StereoReport, frame: WorldFrame | None) -> dict[str, Any]:
    """The JSON's fields; those of the first pair stand at the top. None where nothing was solved."""
    from rhot_app.calibration.stereo.report import MARKER_NOISE_PX, WORKING_DISTANCE_M

    rejected = [{"name": each.name, "reason": each.reason, "code": each.code} for each in report.dropped]
    figures = report.figures
    if figures is None:
        names = ("rms_px", "baseline_mm", "rotation_rad", "translation_mm", "square_mm_triangulated", "epipolar_px")
        return {**dict.fromkeys(names), "cameras": [{"name": name} for name in report.cameras], "pairs": [],
                "views_used": 0, "views_rejected": rejected}
    pairs = [_pair(pair) for pair in figures.pairs]
    squares, (by_rig, by_noise) = figures.squares, figures.error_m
    return {
        "rms_px": figures.rms_px, "noise_px": figures.noise_px, **pairs[0],
        "square_mm_triangulated": squares.mean_m * 1e3, "square_std_mm": squares.std_m * 1e3,
        "flatness_mm": squares.flatness_m * 1e3,
        "board_error_mm": None if figures.board_errors is None else {
            "in_plane": figures.board_errors.in_plane_m * 1e3, "across": figures.board_errors.across_m * 1e3},
        "expected_error_mm": {"distance_m": WORKING_DISTANCE_M, "by_calibration": _number(by_rig * 1e3),
                              "marker_noise_px": MARKER_NOISE_PX, "by_marker_noise": _number(by_noise * 1e3)},
        "std_method": "inverse of the bundle adjustment's normal equations at the corners' own spread, times the "
        "disagreement of the shots",
        "disagreement": figures.error_inflation,
        "cameras": [_camera(report, i) for i in range(len(figures.cameras))], "pairs": pairs,
        "views_used": len(figures.shots), "views_rejected": rejected,
        "shots": [{"name": shot.name, "rms_px": [_number(rms) for rms in shot.rms_px]} for shot in figures.shots],
        "ruler_mm": None if figures.ruler is None else {
            "said": figures.ruler.said_m * 1e3, "measured": figures.ruler.measured_m * 1e3,
            "std": figures.ruler.std_m * 1e3},
        "lengths": figures.lengths,
        "table": None if frame is None else _table(frame),
    }


def lines_of(report: StereoReport, frame: WorldFrame | None) -> list[str]:
    """The figures for people."""
    from rhot_app.calibration.bundle.robust_error import what_is_reported
    from rhot_app.calibration.stereo.report import MARKER_NOISE_PX, WORKING_DISTANCE_M

    figures = report.figures
    lines = [f"left out: {each.name}: {each.reason}" for each in report.dropped]
    if figures is None:
        return lines
    for camera in figures.cameras:
        fx, fy, cx, cy = camera.lens[:4]
        sfx, _, scx, scy = camera.lens_std[:4]
        lines.append(f"{camera.name}: f {fx:.2f}, {fy:.2f} ± {sfx:.2f} px, centre ({cx:.2f} ± {scx:.2f}, "
                     f"{cy:.2f} ± {scy:.2f}) px, rms {camera.rms_px:.3f} px")
    for pair in figures.pairs:
        shift, shift_std = _listed(pair.translation_m * 1e3), _listed(pair.translation_std_m * 1e3)
        lines.append(f"{pair.first} to {pair.second}: {pair.baseline_m * 1e3:.2f} mm; T ({shift}) ± ({shift_std}) mm, "
                     f"R ({_listed(pair.rotation_rad, 4)}) rad, epipolar {pair.epipolar_px:.2f} px")
    lines.append(what_is_reported(figures.error_inflation))
    squares = figures.squares
    lines.append(f"{figures.board.parts} as the cameras see them: {squares.mean_m * 1e3:.3f} ± "
                 f"{squares.std_m * 1e3:.3f} mm, board flat to {squares.flatness_m * 1e3:.2f} mm")
    if figures.board_errors is not None:
        lines.append(f"the board's corners are {figures.board_errors.in_plane_m * 1e3:.2f} mm off in its plane and "
                     f"{figures.board_errors.across_m * 1e3:.2f} mm across; allowed for")
    lines.append(f"a marker {WORKING_DISTANCE_M:g} m away: {figures.error_m[0] * 1e3:.1f} mm uncertain by this "
                 f"calibration, {figures.error_m[1] * 1e3:.1f} mm by {MARKER_NOISE_PX:g} px of noise")
    if frame is not None:
        lines += [f"{each.name}: {each.height_m * 1e3:.0f} mm above the table, looks down by "
                  f"{math.degrees(each.down_rad):.1f} degrees" for each in frame.stances]
    return lines


def _camera(report: StereoReport, index: int) -> dict[str, Any]:
    from rhot_app.geometry.camera import PARAMETERS, own_parameters, rig_intrinsics

    assert report.figures is not None
    camera = report.figures.cameras[index]
    lens, own = rig_intrinsics(camera.size, camera.lens), own_parameters(camera.lens)
    std = {name: float(std) for name, std, has in zip(PARAMETERS, camera.lens_std, own, strict=True) if has}
    return {"name": camera.name, "fx": lens.fx, "fy": lens.fy, "cx": lens.cx, "cy": lens.cy,
            "distortion": list(lens.distortion), "size": list(camera.size), "rms_px": camera.rms_px, "std": std}


def _pair(pair: PairFigures) -> dict[str, Any]:
    return {"first": pair.first, "second": pair.second, "baseline_mm": pair.baseline_m * 1e3,
            "rotation_rad": _list(pair.rotation_rad), "rotation_std_rad": _list(pair.rotation_std_rad),
            "translation_mm": _list(pair.translation_m * 1e3),
            "translation_std_mm": _list(pair.translation_std_m * 1e3),
            "epipolar_px": _number(pair.epipolar_px), "shared": pair.shared}


def _table(frame: WorldFrame) -> dict[str, Any]:
    return {"rms_px": frame.rms_px,
            "cameras": [{"name": each.name, "height_mm": each.height_m * 1e3, "down_deg": math.degrees(each.down_rad),
                         "roll_deg": math.degrees(each.roll_rad)} for each in frame.stances]}


def _list(values: Iterable[float]) -> list[float]:
    return [float(value) for value in values]


def _listed(values: Iterable[float], digits: int = 2) -> str:
    return ", ".join(f"{value:.{digits}f}" for value in values)


def _number(value: float) -> float | None:
    """JSON knows no NaN."""
    return float(value) if math.isfinite(value) else None
