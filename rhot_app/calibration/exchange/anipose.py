"""The TOML files of anipose (``calibration.toml``) and caliscope (``camera_array.toml``): a table for each camera.

Both state a rotation vector and a translation that take the world's coordinates to the camera's: anipose in the unit of
the board's squares, caliscope in metres.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from rhot_app.calibration.exchange.documents import Entry, listed
from rhot_app.calibration.exchange.records import ForeignCamera, Stated, focal_of, lens_of, refuse_model
from rhot_app.errors import CalibrationError
from rhot_app.estimation.se3 import exp_so3, log_so3
from rhot_app.geometry.transforms import rigid


def read_anipose(documents: Sequence[Entry], stated: Stated) -> list[ForeignCamera]:
    """The cameras of one file; their world is anipose's. Raises CalibrationError."""
    return [_read(camera, stated, camera["name"].text) for camera in _tables(documents)]


def read_caliscope(documents: Sequence[Entry], stated: Stated) -> list[ForeignCamera]:
    """The cameras of one file; their world is caliscope's. Raises CalibrationError."""
    stated.refuse_unit(documents[0], "caliscope")
    return [_read(camera, Stated(unit_m=1.0), "cam_" + re.split(r"[._]", camera.place)[-1])
            for camera in _tables(documents)]


def is_caliscope(document: Entry) -> bool:
    """Whether a file with cameras of this kind is caliscope's: anipose names its cameras."""
    return document.has("cameras") or any(camera.has("cam_id") or camera.has("port") for camera in _tables([document]))


def _tables(documents: Sequence[Entry]) -> list[Entry]:
    if len(documents) != 1:
        raise CalibrationError(f"{documents[1].file}: give one file; it holds all cameras.")
    (document,) = documents
    group = document["cameras"] if document.has("cameras") else document
    keys = [key for key, value in group.value.items() if isinstance(value, dict) and (
        group is not document or re.fullmatch(r"cam_\w+", key))] if isinstance(group.value, dict) else []
    if not keys:
        raise CalibrationError(f"{document.file}: it has no camera.")
    return [group[key] for key in keys]


def _read(camera: Entry, stated: Stated, name: str) -> ForeignCamera:
    if camera.has("fisheye") and camera["fisheye"].value:
        raise refuse_model(camera, "fisheye")
    width, height = (int(side) for side in camera["size"].numbers(2))
    lens = lens_of(camera, (width, height), focal_of(camera["matrix"]), camera["distortions"].numbers())
    if not camera.has("rotation"):
        return ForeignCamera(name, lens)
    shift = camera["translation"]
    return ForeignCamera(name, lens, rigid(exp_so3(camera["rotation"].numbers(3)),
                                           stated.unit_of(shift) * shift.numbers(3)))


def write_anipose(cameras: Sequence[ForeignCamera], unit_m: float) -> dict[str, str]:
    """One file of all cameras, with lengths in `unit_m` metres."""
    tables = [[f"[cam_{k}]", f"name = {_quoted(camera.name)}", *_fields(camera, unit_m)]
              for k, camera in enumerate(cameras)]
    return {"": "\n\n".join("\n".join(table) for table in [*tables, ["[metadata]", "adjusted = false"]]) + "\n"}


def write_caliscope(cameras: Sequence[ForeignCamera], unit_m: float) -> dict[str, str]:
    """One file of all cameras, by number: caliscope has no names."""
    return {"": "\n\n".join("\n".join([f"[cameras.{k}]", f"port = {k}", "rotation_count = 0", "ignore = false",
                                       "fisheye = false", *_fields(camera, 1.0)])
                            for k, camera in enumerate(cameras)) + "\n"}


def _fields(camera: ForeignCamera, unit_m: float) -> list[str]:
    pose = camera.camera_from_world
    assert pose is not None
    rows = ", ".join(listed(row) for row in camera.matrix)
    return [f"size = [{camera.lens.width}, {camera.lens.height}]", f"matrix = [{rows}]",
            f"distortions = {listed(camera.distortion)}", f"rotation = {listed(log_so3(pose[:3, :3]))}",
            f"translation = {listed(pose[:3, 3] / unit_m)}"]



def _quoted(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'
