"""Pictures of one instant from files, and whether a rig's cameras may be fitted to; a sentence for each mistake."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.check.camera_calibration import calibration_finding
from rhot_app.errors import CalibrationError
from rhot_app.project import Rig, RigNode
from rhot_node import pictures
from rhot_node.errors import PictureError

Image = NDArray[np.uint8]


def require_calibrated(rig: Rig) -> str:
    """What is to be said of the cameras' calibration, "" for nothing. Raises CalibrationError where no lens is known,
    because every length would be wrong."""
    finding = calibration_finding(rig)
    nominal = all(node.intrinsics.nominal for node in rig.nodes)
    exact = rig.calibration is not None and rig.calibration.method == "exact"
    if rig.depth.mode == "disparity" or (nominal and not exact):
        raise CalibrationError("No camera of this rig is calibrated, so a hand fitted to its pictures would have wrong "
                               "lengths. Calibrate the intrinsics of each camera, then stereo (Calibrate menu).")
    return "" if finding is None else f"{finding.finding.figure} {finding.finding.cause}".strip()


def files_by_camera(rig: Rig, given: Sequence[str]) -> dict[int, Path]:
    """Files by the camera's number: in the order of the rig's cameras, or as NAME=FILE. Raises CalibrationError."""
    names = [node.name for node in rig.nodes]
    found: dict[int, Path] = {}
    for place, text in enumerate(given):
        named = max((name for name in names if text.startswith(f"{name}=")), key=len, default=None)
        other, equals, _ = text.partition("=")
        if named is None and equals and Path(other).name == other and not Path(text).exists():
            raise CalibrationError(f"{text}: there is no camera {other!r} in the rig; there are {', '.join(names)}.")
        if named is None and place >= len(names):
            raise CalibrationError(f"{text}: the rig has {len(names)} cameras ({', '.join(names)}), and this is one "
                                   "picture more.")
        camera = place if named is None else names.index(named)
        if camera in found:
            raise CalibrationError(f"{text}: camera {names[camera]} has two pictures; give one for each camera.")
        found[camera] = Path(text if named is None else text[len(named) + 1:])
    if not found:
        raise CalibrationError("No picture was given. Give one for each camera, in the order of the rig's cameras: "
                               f"{', '.join(names)}.")
    return found


def read_picture(path: Path, node: RigNode) -> Image:
    """(H, W, 3) RGB. Raises CalibrationError for what is no picture, or none of this camera's size."""
    try:
        bgr = pictures.read_picture(path)
    except PictureError as exc:
        raise CalibrationError(str(exc)) from exc
    picture = np.ascontiguousarray(bgr[:, :, ::-1])
    require_size(picture, node, str(path))
    return picture


def require_size(picture: Image, node: RigNode, name: str) -> None:
    """Raises CalibrationError for a picture (H, W, 3) that has not the size of the camera's lens."""
    height, width = picture.shape[:2]
    lens = node.intrinsics
    if (width, height) != (lens.width, lens.height):
        raise CalibrationError(f"{name}: the picture has {width} x {height} px, the lens of camera {node.name} was "
                               f"calibrated at {lens.width} x {lens.height} px. Take the picture at that size.")
