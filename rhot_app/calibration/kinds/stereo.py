"""The stereo calibration: how cameras stand to each other, from pictures of a board that they took together."""

from __future__ import annotations

import argparse
import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from rhot_app.calibration.commands.arguments import add_board_arguments, board_of, dropped_fields, left_out
from rhot_app.calibration.registry import Calibration, Command, InForce, Observed
from rhot_app.calibration.report import Figure, Report, Table
from rhot_app.calibration.verdict import Finding, Grade
from rhot_app.errors import CalibrationError, finite, positive_number
from rhot_app.options import add_json_argument, add_offset_argument, add_out_argument
from rhot_node.terminal import add_examples

if TYPE_CHECKING:
    from rhot_app.calibration.board.corners import BoardView
    from rhot_app.calibration.board.shared_views import Dropped, SharedViews
    from rhot_app.calibration.check.health import HealthFigures
    from rhot_app.calibration.lens.fit import LensStart
    from rhot_app.calibration.proposal import Proposal
    from rhot_app.calibration.stereo.calibrate import KnownLengths
    from rhot_app.calibration.stereo.result import CameraFigures, PairFigures, StereoResult
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


def observe(args: argparse.Namespace, progress: Progress) -> Observed:
    """The board in all pictures, the lenses, and where the table is."""
    from rhot_app.calibration.lens.fit import find_lens
    from rhot_app.calibration.stereo.calibrate import lens_of, require_nodes
    from rhot_app.calibration.stereo.reading import read_shared, read_view

    files, base = files_of(args), _base_rig(args)
    names = list(files)
    require_nodes(base, names)
    board, known, given = board_of(args), known_lengths(args, names), _given_lenses(args, names)
    tables = named_paths(args.table_image, "--table-image", names)
    read = read_shared(files, board, offsets_s=_offsets(args, names), progress=progress)
    nodes = {node.name: node for node in base.nodes}
    shown = StereoViews(
        read.views, known, tuple(None if nodes[name].intrinsics.nominal else lens_of(nodes[name]) for name in names),
        tuple(given[name] if name in given else find_lens(read.views.of_camera(camera), board, name)
              for camera, name in enumerate(names)), args.refine_intrinsics, read.dropped, read.size,
        tuple(read_view(tables[name], board) if name in tables else None for name in names) if tables else ())
    return Observed((shown,), InForce(base, args.out))


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


# -- what is said of the result, and what it changes -------------------------------------------------------------------

@dataclass(frozen=True, slots=True)
class StereoViews:
    """What is known of cameras to be put together: `views` of the board, a second known length, and each camera's lens
    in the rig, None for a nominal one.

    `lenses`: those to begin with; without any, the rig's, or those that the views show. `refine`: these may change
    within their standard deviations. `table`: each camera's view of the board on the table, empty without one.
    """

    views: SharedViews
    known: KnownLengths
    remembered: tuple[LensStart | None, ...]
    lenses: tuple[LensStart, ...] = ()
    refine: bool = False
    dropped: tuple[Dropped, ...] = ()
    size: Finding | None = None
    table: tuple[BoardView | None, ...] = ()


def solve(shown: StereoViews, now: InForce, *, progress: Progress) -> StereoResult:
    """Cameras put together. Raises CalibrationError."""
    from rhot_app.calibration.lens.fit import find_lens
    from rhot_app.calibration.stereo.calibrate import calibrate
    from rhot_app.calibration.stereo.start import place_world

    views = shown.views
    lenses = shown.lenses or tuple(
        lens if lens is not None else find_lens(views.of_camera(camera), views.board, views.cameras[camera])
        for camera, lens in enumerate(shown.remembered))
    found = calibrate(views, lenses, refine=shown.refine, known=shown.known, remembered=shown.remembered,
                      dropped=shown.dropped, noticed=[] if shown.size is None else [shown.size], progress=progress)
    if not shown.table or found.figures is None:
        return found
    return replace(found, table=place_world(shown.table, views.board, found.figures.state, found.cameras))


def report(result: StereoResult, now: InForce | None) -> Report:
    """Distances, lenses and errors; where cameras stand above the table. The first pair's figures stand at
    the top of JSON, too."""
    from rhot_app.calibration.bundle.robust_error import what_is_reported
    from rhot_app.calibration.rig_figures import distance_figure, order_of_distortion
    from rhot_app.calibration.stereo.result import MARKER_NOISE_PX, WORKING_DISTANCE_M
    from rhot_app.geometry.camera import rig_intrinsics

    figures, frame, fields = result.figures, result.table, dropped_fields(result.dropped)
    if figures is None:
        names = ("rms_px", "baseline_mm", "rotation_rad", "translation_mm", "square_mm_triangulated", "epipolar_px")
        return Report(result.verdict, notes=tuple(left_out(result.dropped)), fields={
            **dict.fromkeys(names), "cameras": [{"name": name} for name in result.cameras], "pairs": [],
            "views_used": 0, **fields})
    squares, board, ruler, (by_rig, by_noise) = figures.squares, figures.board_errors, figures.ruler, figures.error_m
    said = [distance_figure(pair.first, pair.second, pair.baseline_m, pair.baseline_std_m) for pair in figures.pairs]
    said += [
        Figure("corners, rms", figures.rms_px, "px", decimals=3, key="rms_px"),
        Figure("shots", len(figures.shots), decimals=0, key="views_used"),
        Figure(f"{figures.board.parts} of {1e3 * figures.board.square_m:.2f} mm, as seen", 1e3 * squares.mean_m, "mm",
               1e3 * squares.std_m, key="square_mm_triangulated", sd_key="square_std_mm"),
        Figure("board, flat to", 1e3 * squares.flatness_m, "mm", key="flatness_mm")]
    if board is not None:
        said += [Figure("board, in its plane", 1e3 * board.in_plane_m, "mm", key="board_error_mm.in_plane"),
                 Figure("board, across it", 1e3 * board.across_m, "mm", key="board_error_mm.across")]
    if ruler is not None:
        said.append(Figure(f"ruler of {1e3 * ruler.said_m:.1f} mm, as seen", 1e3 * ruler.measured_m, "mm",
                           1e3 * ruler.std_m, key="ruler_mm.measured", sd_key="ruler_mm.std"))
    said += [Figure(f"error expected at {WORKING_DISTANCE_M:g} m", 1e3 * by_rig, "mm",
                    key="expected_error_mm.by_calibration"),
             Figure(f"the same by {MARKER_NOISE_PX:g} px of noise", 1e3 * by_noise, "mm",
                    key="expected_error_mm.by_marker_noise")]
    cameras = []
    for camera in figures.cameras:
        lens, row = _lens(camera)
        said += lens
        cameras.append(row)
    tables = [Table("cameras", tuple(cameras)), Table("pairs", tuple(_pair(pair) for pair in figures.pairs))]
    if frame is not None:
        fields["table.rms_px"] = frame.rms_px
        tables.append(Table("table.cameras", tuple((
            Figure("camera", each.name, key="name"),
            Figure("above the table", 1e3 * each.height_m, "mm", decimals=0, key="height_mm"),
            Figure("looks down by", math.degrees(each.down_rad), "degrees", decimals=1, key="down_deg"),
            Figure("roll", math.degrees(each.roll_rad), "degrees", decimals=1, key="roll_deg"))
            for each in frame.stances)))
    return Report(
        result.verdict, tuple(said), tuple(tables),
        (f"{what_is_reported(figures.error_inflation)}.",
         order_of_distortion(rig_intrinsics(figures.cameras[0].size, figures.cameras[0].lens)),
         *left_out(result.dropped)), {
            **tables[1].to_json()[0], "noise_px": figures.noise_px, "board_error_mm": None, "table": None,
            "expected_error_mm.distance_m": WORKING_DISTANCE_M, "expected_error_mm.marker_noise_px": MARKER_NOISE_PX,
            "std_method": "inverse of the bundle adjustment's normal equations at the corners' own spread, times the "
            "disagreement of the shots",
            "disagreement": figures.error_inflation, "lengths": figures.lengths,
            "ruler_mm": None if ruler is None else {"said": 1e3 * ruler.said_m},
            "shots": [{"name": shot.name, "rms_px": shot.rms_px} for shot in figures.shots], **fields})


def propose(result: StereoResult, now: InForce) -> Proposal | None:
    """The rig with these cameras, in the table's frame where there is one; judged by the rig's own checks as well. None
    where the cameras could not be put together."""
    from rhot_app.calibration.proposal import proposed
    from rhot_app.calibration.stereo.calibrate import calibrated_rig, rig_verdict

    if result.figures is None:
        return None
    after = calibrated_rig(now.rig, result.figures, result.table)
    judged = replace(report(result, now), verdict=rig_verdict(result, after, result.table))
    return proposed(CALIBRATION.reason, judged, now.rig, after)


def _lens(camera: CameraFigures) -> tuple[list[Figure], tuple[Figure, ...]]:
    """A camera's lens for people, and its row of figures."""
    from rhot_app.calibration.rig_figures import lens_figures
    from rhot_app.geometry.camera import PARAMETERS, own_parameters, rig_intrinsics

    own = own_parameters(camera.lens)
    std = {name: float(std) for name, std, has in zip(PARAMETERS, camera.lens_std, own, strict=True) if has}
    lens = list(lens_figures(camera.name, rig_intrinsics(camera.size, camera.lens), std))
    return [replace(one, key="") for one in lens], (
        Figure("camera", camera.name, key="name"),
        Figure("corners, rms", camera.rms_px, "px", decimals=3, key="rms_px"),
        *(replace(one, name="") for one in lens), Figure("", camera.size, key="size"), Figure("", std, key="std"))


def _pair(pair: PairFigures) -> tuple[Figure, ...]:

    return (Figure("from", pair.first, key="first"), Figure("to", pair.second, key="second"),
            Figure("", 1e3 * pair.baseline_m, key="baseline_mm"),
            Figure("T", 1e3 * pair.translation_m, "mm", 1e3 * pair.translation_std_m, key="translation_mm",
                   sd_key="translation_std_mm"),
            Figure("R", pair.rotation_rad, "rad", pair.rotation_std_rad, key="rotation_rad",
                   sd_key="rotation_std_rad"),
            Figure("epipolar", pair.epipolar_px, "px", key="epipolar_px"),
            Figure("shots", pair.shared, decimals=0, key="shared"))


POOR_ERROR_PX = 1.5
"""Median reprojection error from which the rig must not be used."""


def check(figures: HealthFigures) -> list[Finding]:
    """Whether the cameras' rays miss each other."""
    error = figures.errors_px[0]
    if not figures.apart:
        return []
    return [Finding("stale_geometry", Grade.POOR if error > POOR_ERROR_PX else Grade.FAIR,
                    f"The cameras' rays miss each other by {error:.1f} px.", figures.misfit,
                    "Do the stereo calibration with a board (Calibrate menu).")]


CALIBRATION = Calibration(
    "stereo", "Stereo calibration", "Where the cameras stand to each other and to the table, from a board that they "
    "see at the same time.", "stereo calibration",
    Command("stereo", "how two or more cameras stand to each other, from pictures of a board that they took together",
            add_arguments, observe, ("together",)),
    solve=solve, report=report, propose=propose, check=check, solver="rhot_app.calibration.stereo.calibrate")
