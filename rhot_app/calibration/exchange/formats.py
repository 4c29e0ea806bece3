"""The formats of calibrations that are read and written, and which one a file has."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from rhot_app.calibration.exchange import anipose, kalibr, opencv, ros
from rhot_app.calibration.exchange.documents import Entry, read_table
from rhot_app.calibration.exchange.records import ForeignCamera, Stated
from rhot_app.errors import CalibrationError


@dataclass(frozen=True, slots=True)
class Format:
    """One format. `read` takes the files' tables; `write` gives the text of each file, by the name of its camera where
    there are several. `most` cameras that it has a place for; `states_unit`: lengths are metres."""

    title: str
    suffix: str
    read: Callable[[Sequence[Entry], Stated], list[ForeignCamera]]
    write: Callable[[Sequence[ForeignCamera], float], dict[str, str]]
    most: int
    states_unit: bool


FORMATS: dict[str, Format] = {
    "opencv": Format("OpenCV", ".yml", opencv.read, opencv.write, 2, False),
    "ros": Format("ROS camera_info", ".yaml", ros.read, ros.write, 2, True),
    "kalibr": Format("Kalibr", ".yaml", kalibr.read, kalibr.write, 16, True),
    "anipose": Format("anipose", ".toml", anipose.read_anipose, anipose.write_anipose, 16, False),
    "caliscope": Format("caliscope", ".toml", anipose.read_caliscope, anipose.write_caliscope, 16, True),
}


def read_files(paths: Sequence[Path], stated: Stated,
               format_name: str | None = None) -> tuple[str, list[ForeignCamera]]:
    """The format of the files and their cameras. Raises CalibrationError naming file and place."""
    documents = [read_table(path) for path in paths]
    names = [format_name or format_of(one) for one in documents]
    other = next((k for k, name in enumerate(names) if name != names[0]), None)
    if other is not None:
        raise CalibrationError(f"{paths[other]}: it is a file of {FORMATS[names[other]].title}, {paths[0]} one of "
                               f"{FORMATS[names[0]].title}; give files of one calibration.")
    cameras = FORMATS[names[0]].read(documents, stated)
    called = [camera.name for camera in cameras]
    doubled = next((name for name in called if called.count(name) > 1), None)
    if doubled is not None:
        raise CalibrationError(f"{paths[-1]}: two cameras are called {doubled!r}; rename one of them.")
    return names[0], cameras


def format_of(document: Entry) -> str:
    """The name of the format that a table has. Raises CalibrationError where it is none."""
    if document.file.suffix.lower() == ".toml":
        return "caliscope" if anipose.is_caliscope(document) else "anipose"
    if any(document.has(key) for key in ("M1", "R")):
        return "opencv"
    if document.has("camera_matrix"):
        of_ros = ("camera_name", "distortion_model", "projection_matrix")
        return "ros" if any(document.has(key) for key in of_ros) else "opencv"
    if document.has("cam0"):
        return "kalibr"
    raise CalibrationError(f"{document.file}: no calibration that is known ({', '.join(FORMATS)}).")
