"""ROS's ``camera_info`` files, one camera each, as ``camera_calibration`` writes them (sensor_msgs/CameraInfo).

A pair's poses stand in its rectification: R takes a camera's coordinates to rectified ones, and the fourth column of P
is the shift of the rectified second camera, (-fx' B, 0, 0) of cameras side by side, in metres.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.exchange.documents import Entry, listed
from rhot_app.calibration.exchange.opencv import rectified
from rhot_app.calibration.exchange.records import ForeignCamera, Stated, focal_of, lens_of, refuse_model
from rhot_app.errors import CalibrationError
from rhot_app.geometry.transforms import rigid
from rhot_app.project import Intrinsics

Array = NDArray[np.float64]

_MODELS = {"plumb_bob": (0, 4, 5), "rational_polynomial": (4, 5, 8, 12, 14)}  # and how many coefficients files have


def read(documents: Sequence[Entry], stated: Stated) -> list[ForeignCamera]:
    """A camera of every file; with poses where two files are a rectified pair. Raises CalibrationError."""
    lenses = [_read_lens(one, stated) for one in documents]
    names = [one["camera_name"].text if one.has("camera_name") else one.file.stem for one in documents]
    shifts = [_shift(one) for one in documents]
    moved = [bool(np.any(shift)) for shift in shifts]
    if not any(moved):
        return [ForeignCamera(name, lens) for name, lens in zip(names, lenses, strict=True)]
    if len(documents) != 2 or all(moved):
        raise CalibrationError(f"{documents[moved.index(True)].file}: it is the second camera of a stereo pair; give "
                               "the first one's file with it, and no other.")
    poses = [rigid(rotation.T, rotation.T @ shift) for rotation, shift in
             zip((one["rectification_matrix"].rotation() for one in documents), shifts, strict=True)]
    return [ForeignCamera(*each) for each in zip(names, lenses, poses, strict=True)]


def _read_lens(document: Entry, stated: Stated) -> Intrinsics:
    stated.refuse_unit(document, "ROS")
    model = document["distortion_model"].text if document.has("distortion_model") else "plumb_bob"
    if model not in _MODELS:
        raise refuse_model(document, model)
    distortion = document["distortion_coefficients"].numbers(*_MODELS[model])
    return lens_of(document, stated.size_of(document), focal_of(document["camera_matrix"]), distortion)


def _shift(document: Entry) -> Array:
    """(3,) m, where the rectified camera sees the rectified first one's origin."""
    if not document.has("projection_matrix"):
        return np.zeros(3)
    p = document["projection_matrix"].matrix(3, 4)
    if not (p[0, 0] > 0.0 and p[1, 1] > 0.0):
        raise document["projection_matrix"].wrong("has no focal length.")
    return np.array([p[0, 3] / p[0, 0], p[1, 3] / p[1, 1], 0.0])


def write(cameras: Sequence[ForeignCamera], unit_m: float) -> dict[str, str]:
    """A file for each camera, by name; of a pair with its rectification."""
    if len(cameras) == 1:
        camera = cameras[0]
        return {"": _text(camera, np.eye(3), np.column_stack([camera.matrix, np.zeros(3)]))}
    _, _, (r1, r2, p1, p2, _) = rectified(cameras, unit_m)
    return {camera.name: _text(camera, rotation, projection)
            for camera, rotation, projection in zip(cameras, (r1, r2), (p1, p2), strict=True)}


def _text(camera: ForeignCamera, rectification: Array, projection: Array) -> str:
    model = "plumb_bob" if len(camera.lens.distortion) == 5 else "rational_polynomial"
    name = camera.name.replace("\\", "\\\\").replace('"', '\\"')
    lines = [f"image_width: {camera.lens.width}", f"image_height: {camera.lens.height}", f'camera_name: "{name}"',
             *_matrix("camera_matrix", camera.matrix), f"distortion_model: {model}",
             *_matrix("distortion_coefficients", camera.distortion[None]),
             *_matrix("rectification_matrix", rectification), *_matrix("projection_matrix", projection), ""]
    return "\n".join(lines)


def _matrix(name: str, values: Array) -> list[str]:
    return [f"{name}:", f"  rows: {values.shape[0]}", f"  cols: {values.shape[1]}", f"  data: {listed(values.ravel())}"]
