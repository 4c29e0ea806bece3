"""OpenCV's YAML files: one camera as the sample ``calibration`` writes it, a pair as ``stereo_calib`` does.

A pair's R and T take the first camera's coordinates to the second's, T in the board's unit of length.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.exchange.documents import Entry, listed
from rhot_app.calibration.exchange.records import ForeignCamera, Stated, focal_of, lens_of, refuse_model
from rhot_app.errors import CalibrationError
from rhot_app.geometry.transforms import inverse, rigid

Array = NDArray[np.float64]


def read(documents: Sequence[Entry], stated: Stated) -> list[ForeignCamera]:
    """One camera a file, without poses, or the pair of one file or of two, named by the numbers of M1 and M2: nothing
    in it says which one stands to the left. Raises CalibrationError."""
    if any(one.has("M1") or one.has("R") for one in documents):
        return _read_pair(documents, stated)
    return [_read_camera(one, stated) for one in documents]


def _read_camera(document: Entry, stated: Stated) -> ForeignCamera:
    if document.has("fisheye_model") and document["fisheye_model"].value:
        raise refuse_model(document, "fisheye")
    return ForeignCamera(document.file.stem, lens_of(
        document, stated.size_of(document), focal_of(document["camera_matrix"]),
        document["distortion_coefficients"].numbers()))


def _read_pair(documents: Sequence[Entry], stated: Stated) -> list[ForeignCamera]:
    files = " and ".join(str(one.file) for one in documents)
    keys = [key for one in documents for key in one.value]
    doubled = next((key for key in keys if keys.count(key) > 1), None)
    if doubled is not None:
        raise CalibrationError(f"{files}: both have {doubled}; give the files of one pair.")
    pair = Entry(Path(files), "", {key: value for one in documents for key, value in one.value.items()})
    size = stated.size_of(pair)
    lenses = [lens_of(pair, size, focal_of(pair[f"M{k}"]), pair[f"D{k}"].numbers()) for k in (1, 2)]
    shift = pair["T"]
    second = rigid(pair["R"].rotation(), stated.unit_of(shift) * shift.numbers(3))
    return [ForeignCamera("cam1", lenses[0], np.eye(4)), ForeignCamera("cam2", lenses[1], second)]


def write(cameras: Sequence[ForeignCamera], unit_m: float) -> dict[str, str]:
    """One file: of a camera, or of a pair with lengths in `unit_m` metres. Raises CalibrationError for more."""
    width, height = cameras[0].lens.width, cameras[0].lens.height
    lines = ["%YAML:1.0", "---", f"image_width: {width}", f"image_height: {height}"]
    if len(cameras) == 1:
        parts = {"camera_matrix": cameras[0].matrix, "distortion_coefficients": cameras[0].distortion[:, None]}
    else:
        parts = _pair_parts(cameras, unit_m)
    return {"": "\n".join([*lines, *(_matrix(name, value) for name, value in parts.items()), ""])}


def _pair_parts(cameras: Sequence[ForeignCamera], unit_m: float) -> dict[str, Array]:
    first, second = cameras
    if (first.lens.width, first.lens.height) != (second.lens.width, second.lens.height):
        raise CalibrationError(f"{first.name} and {second.name} have pictures of two sizes; OpenCV's files of a pair "
                               "have one. Export each camera by itself with --camera.")
    rotation, shift, (r1, r2, p1, p2, q) = rectified(cameras, unit_m)
    return {"M1": first.matrix, "D1": first.distortion[None], "M2": second.matrix, "D2": second.distortion[None],
            "R": rotation, "T": shift[:, None], "R1": r1, "R2": r2, "P1": p1, "P2": p2, "Q": q}


def rectified(cameras: Sequence[ForeignCamera], unit_m: float) -> tuple[Array, Array, list[Array]]:
    """R (3, 3) and T (3,) of a pair, and OpenCV's rectification of it: R1, R2, P1, P2, Q; lengths in `unit_m`."""
    first, second = cameras
    assert first.camera_from_world is not None and second.camera_from_world is not None
    second_from_first = second.camera_from_world @ inverse(first.camera_from_world)
    rotation, shift = second_from_first[:3, :3], second_from_first[:3, 3] / unit_m
    if not np.linalg.norm(shift) > 0.0:
        raise CalibrationError(f"{first.name} and {second.name} stand at the same place: that is no calibrated pair. "
                               "Export each camera by itself with --camera.")
    found = cv2.stereoRectify(first.matrix, first.distortion, second.matrix, second.distortion,
                              (first.lens.width, first.lens.height), rotation, shift, alpha=0.0)
    return rotation, shift, [np.asarray(part, np.float64) for part in found[:5]]


def _matrix(name: str, values: Array) -> str:
    rows, cols = values.shape
    return f"{name}: !!opencv-matrix\n   rows: {rows}\n   cols: {cols}\n   dt: d\n   data: {listed(values.ravel())}"
