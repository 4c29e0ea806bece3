"""``rhot calibrate export``: a rig's lenses and poses as a file of another program."""

from __future__ import annotations

import argparse
import contextlib
import re
from pathlib import Path

from rhot_app.calibration.commands.arguments import FORMAT_NAMES, add_length_arguments, require_folder, unit_of
from rhot_app.errors import CalibrationError, refuse_existing
from rhot_app.options import add_force_argument, add_out_argument, add_rig_argument
from rhot_node.terminal import add_examples


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot calibrate export``."""
    add_rig_argument(parser, "the rig file", required=True)
    parser.add_argument("--format", choices=FORMAT_NAMES, required=True, help="whose file it is to be")
    parser.add_argument("--camera", action="append", default=[], metavar="NAME",
                        help="a camera of the rig, once per camera, in the order of the file (default: all)")
    add_length_arguments(parser)
    add_out_argument(parser, "file to write; of ROS, which has a file for each camera, a new folder for a pair",
                     required=True)
    add_force_argument(parser)
    add_examples(parser, "rhot calibrate export --rig desk.json --format kalibr --out camchain.yaml",
                 "rhot calibrate export --rig desk.json --format opencv --unit mm --out stereo.yml")


def run(args: argparse.Namespace) -> int:
    """Write the cameras and say what was written."""
    from rhot_app.calibration.check.camera_calibration import calibration_text
    from rhot_app.calibration.exchange.formats import FORMATS
    from rhot_app.calibration.exchange.rig_cameras import cameras_of
    from rhot_app.project import load_rig
    from rhot_node.files import write_atomically

    require_folder(args.out)
    form, unit_m, rig = FORMATS[args.format], unit_of(args), load_rig(args.rig)
    cameras = {camera.name: camera for camera in cameras_of(rig)}
    unknown = next((name for name in args.camera if name not in cameras), None)
    if unknown is not None:
        raise CalibrationError(f"--camera {unknown}: the rig's cameras are {', '.join(cameras)}.")
    chosen = [cameras[name] for name in dict.fromkeys(args.camera or cameras)]
    if rig.depth.mode == "disparity":
        raise CalibrationError(f"{args.rig}: its cameras are not calibrated; it takes distance from disparity "
                               "(depth.mode).")
    if len(chosen) > form.most:
        raise CalibrationError(f"{form.title} has a place for {form.most} cameras, the rig has {len(chosen)}; choose "
                               "with --camera, or another format.")
    if form.states_unit and unit_m not in (None, 1.0):
        raise CalibrationError(f"{form.title} has metres; leave --unit and --square-mm out.")
    if not form.states_unit and unit_m is None and len(chosen) > 1:
        raise CalibrationError(f"{form.title} does not say the unit of its lengths; choose one with --unit.")
    texts = form.write(chosen, 1.0 if unit_m is None else unit_m)
    if len(texts) == 1:
        refuse_existing(args.out, CalibrationError, force=args.force)
        write_atomically(args.out, texts[""].encode())
    else:
        if args.out.exists():
            raise CalibrationError(f"{args.out} exists already; name a new folder for the files of the pair.")
        _write_folder(args.out, {f"{_plain(name)}{form.suffix}": text for name, text in texts.items()})
    print(f"Written: {args.out}. Calibrated: {calibration_text(rig)}.")
    return 0


def _write_folder(folder: Path, texts: dict[str, str]) -> None:
    """All files in a new folder, or nothing."""
    from rhot_node.files import write_atomically

    folder.mkdir()
    try:
        for name, text in texts.items():
            write_atomically(folder / name, text.encode())
    except BaseException:
        for path in folder.iterdir():
            path.unlink()
        with contextlib.suppress(OSError):
            folder.rmdir()
        raise


def _plain(name: str) -> str:
    """A camera's name as that of a file."""
    return re.sub(r"[^\w.-]", "_", name)
