"""``rhot calibrate import``: lenses and poses from the files of other programs into a rig or an intrinsics file."""

from __future__ import annotations

import argparse
import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rhot_app.calibration.commands.arguments import (
    FORMAT_NAMES,
    UNITS_M,
    add_length_arguments,
    require_folder,
    show,
    unit_of,
)
from rhot_app.calibration.report import Report
from rhot_app.errors import CalibrationError, input_file
from rhot_app.options import add_json_argument, add_out_argument
from rhot_node.terminal import add_examples

if TYPE_CHECKING:
    from rhot_app.calibration.check.checks import PairGeometry
    from rhot_app.calibration.exchange.formats import Format
    from rhot_app.calibration.exchange.records import ForeignCamera
    from rhot_app.project import Rig


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot calibrate import``."""
    parser.add_argument("files", nargs="+", type=input_file, metavar="FILE",
                        help="a calibration of OpenCV, ROS, Kalibr, anipose or caliscope; of a pair in two files both")
    parser.add_argument("--format", choices=FORMAT_NAMES, help="what the files are (default: by what is in them)")
    add_length_arguments(parser)
    parser.add_argument("--size", type=_size, metavar="WIDTHxHEIGHT",
                        help="of the pictures, px, where the file does not say it, as OpenCV's of a pair")
    parser.add_argument("--camera", action="append", default=[], metavar="NAME=THEIRS",
                        help="a camera of the rig and its name in the file; once per camera (default: cameras of one "
                             "name, else all in their order)")
    parser.add_argument("--rig-from", type=input_file, metavar="RIG",
                        help="rig to begin with (default: --out, or a new one of these cameras for a bare hand)")
    parser.add_argument("--keep-world", action="store_true",
                        help="the file's world is the rig frame, and its z axis points up (default: the first camera "
                             "is the rig frame)")
    add_out_argument(parser, "rig to write", metavar="RIG")
    parser.add_argument("--intrinsics", type=Path, metavar="FILE",
                        help="intrinsics file to write, of one camera, for calibrate stereo")
    add_json_argument(parser)
    add_examples(parser, "rhot calibrate import calibration.toml --unit mm --out films.json",
                 "rhot calibrate import intrinsics.yml extrinsics.yml --square-mm 25 --size 640x480 --out desk.json")


def _size(text: str) -> tuple[int, int]:
    """Type of an argument: "640x480" as (640, 480), for argparse."""
    match = re.fullmatch(r"(\d{2,5})[xX×](\d{2,5})", text.strip())
    if not match:
        raise argparse.ArgumentTypeError(f"{text} is not a picture's size, such as 640x480")
    return int(match[1]), int(match[2])


def run(args: argparse.Namespace) -> int:
    """Read, check and report; files are written when the cameras can be those of a rig."""
    from rhot_app.calibration.check.checks import all_pairs
    from rhot_app.calibration.exchange.formats import FORMATS, read_files
    from rhot_app.calibration.exchange.records import Stated
    from rhot_app.calibration.exchange.rig_cameras import camera_findings, new_rig, with_cameras
    from rhot_app.calibration.verdict import judge
    from rhot_app.project import load_rig
    from rhot_app.rig_history import accept

    for path in (args.out, args.intrinsics):
        require_folder(path)
    name, cameras = read_files(args.files, Stated(args.size, unit_of(args)), args.format)
    base_file = args.rig_from or (args.out if args.out is not None and args.out.exists() else None)
    base = None if base_file is None else load_rig(base_file)
    chosen = _chosen(args.camera, cameras, base)
    hint = _unit_hint(chosen, 1.0 if FORMATS[name].states_unit else unit_of(args), FORMATS[name])
    rig = with_cameras(base or new_rig(args.files[0].stem[:64], chosen), chosen, keep_world=args.keep_world,
                       unit_hint=hint)
    posed = all(camera.camera_from_world is not None for camera in chosen.values())
    verdict = judge(f"{len(chosen)} {'camera' if len(chosen) == 1 else 'cameras'} of {FORMATS[name].title}, "
                    f"{'lenses and poses' if posed else 'lenses alone'}.", camera_findings(rig, chosen, hint))
    written = []
    if args.intrinsics is not None and verdict.acceptable:
        written.append(_write_intrinsics(args.intrinsics, chosen))
    if args.out is not None and verdict.acceptable:
        accept(args.out, rig, f"import from {name}")
        written.append(str(args.out))
    pairs = [pair for pair in all_pairs(rig) if {pair.first, pair.second} <= chosen.keys()] if posed else []
    heights = _heights_m(rig, chosen) if posed else {}
    said = Report(verdict, notes=(*_lens_lines(rig, chosen), *_place_lines(pairs, heights, args.keep_world)), fields={
        "format": name,
        "cameras": [_fields(node, chosen[node.name], posed, heights) for node in rig.nodes if node.name in chosen],
        "baselines_mm": [{"first": pair.first, "second": pair.second, "baseline_mm": 1e3 * pair.baseline_m}
                         for pair in pairs]})
    return show(said, as_json=args.json, written=", ".join(written))


def _chosen(texts: Sequence[str], cameras: list[ForeignCamera], rig: Rig | None) -> dict[str, ForeignCamera]:
    """The file's cameras by the rig's names. Raises CalibrationError where it is not clear which is which."""
    theirs = {camera.name: camera for camera in cameras}
    names = list(theirs) if rig is None else [node.name for node in rig.nodes]
    if texts:
        pairs = [text.partition("=")[::2] for text in texts]
        for text, (name, their) in zip(texts, pairs, strict=True):
            if their not in theirs or (rig is not None and name not in names):
                raise CalibrationError(f"--camera {text}: write NAME=THEIRS; the rig's cameras are "
                                       f"{', '.join(names) if rig is not None else 'new'}, the file's "
                                       f"{', '.join(theirs)}.")
        return {name: theirs[their] for name, their in pairs}
    if set(theirs) <= set(names):
        return theirs
    if len(theirs) == len(names):
        return dict(zip(names, cameras, strict=True))
    raise CalibrationError(f"the rig has the cameras {', '.join(names)}, the file {', '.join(theirs)}; say which is "
                           "which, with --camera NAME=THEIRS for each.")


def _write_intrinsics(path: Path, cameras: dict[str, ForeignCamera]) -> str:
    from rhot_app.calibration.lens.intrinsics import IntrinsicsFile
    from rhot_node.files import write_document

    if len(cameras) != 1:
        raise CalibrationError(f"--intrinsics writes one lens, and there are {', '.join(cameras)}; choose one with "
                               "--camera NAME=THEIRS.")
    (camera,) = cameras.values()
    lens = camera.lens
    write_document(path, IntrinsicsFile((lens.width, lens.height), lens.fx, lens.fy, lens.cx, lens.cy,
                                        lens.distortion))
    return str(path)


def _unit_hint(cameras: dict[str, ForeignCamera], unit_m: float | None, form: Format) -> str:
    """Which unit would make plausible distances between the cameras; empty where they are, or none would."""
    from rhot_app.calibration.check.checks import APART_M, NARROW_M
    from rhot_app.calibration.exchange.rig_cameras import baselines_m

    found = baselines_m(cameras)
    if unit_m is None or not found or NARROW_M <= min(found) <= max(found) <= APART_M:
        return ""
    for name, metres in UNITS_M.items():
        low, high = (metres / unit_m * bound(found) for bound in (min, max))
        if NARROW_M <= low <= high <= APART_M:
            far = f"{1e3 * low:.4g} mm" if low == high else f"{1e3 * low:.4g} to {1e3 * high:.4g} mm"
            if form.states_unit:
                return (f"{form.title} writes metres; if these numbers are {name}, they are {far} apart: convert the "
                        "file.")
            return f"With --unit {name} they are {far} apart."
    return ""


def _heights_m(rig: Rig, cameras: dict[str, ForeignCamera]) -> dict[str, float]:
    """How high each camera stands above the rig frame's origin, by what the rig calls up."""
    axis, sign = "xyz".index(rig.up[-1]), -1.0 if rig.up.startswith("-") else 1.0
    return {node.name: sign * node.pose.translation_m[axis] for node in rig.nodes if node.name in cameras}


def _fields(node: Any, camera: ForeignCamera, posed: bool, heights_m: dict[str, float]) -> dict[str, Any]:
    lens = node.intrinsics
    return {"name": node.name, "theirs": camera.name, "fx": lens.fx, "fy": lens.fy, "cx": lens.cx, "cy": lens.cy,
            "distortion": list(lens.distortion), "size": [lens.width, lens.height],
            "translation_mm": [1e3 * value for value in node.pose.translation_m] if posed else None,
            "rotation_wxyz": list(node.pose.rotation_wxyz) if posed else None,
            "height_mm": 1e3 * heights_m[node.name] if posed else None}


def _lens_lines(rig: Rig, cameras: dict[str, ForeignCamera]) -> list[str]:
    lines = []
    for node in (node for node in rig.nodes if node.name in cameras):
        lens = node.intrinsics
        lines.append(f"{node.name}, in the file {cameras[node.name].name}: f {lens.fx:.2f}, {lens.fy:.2f} px, centre "
                     f"({lens.cx:.2f}, {lens.cy:.2f}) px, {lens.width}x{lens.height} px")
    return lines


def _place_lines(pairs: list[PairGeometry], heights_m: dict[str, float], keep_world: bool) -> list[str]:
    """What the poses imply, for a person to hold against the room: nothing else tells a wrong unit."""
    lines = [f"{pair.first} to {pair.second}: {1e3 * pair.baseline_m:.1f} mm" for pair in pairs]
    if keep_world:
        return lines + [f"{name}: {1e3 * height:.0f} mm above z = 0" for name, height in heights_m.items()]
    (first, origin), *others = list(heights_m.items()) or [("", 0.0)]
    for name, height in others:
        side = "higher" if height >= origin else "lower"
        lines.append(f"{name} stands {1e3 * abs(height - origin):.0f} mm {side} than {first}, as {first} is held")
    return lines
