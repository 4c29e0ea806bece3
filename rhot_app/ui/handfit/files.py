"""Pictures of one instant from files: still pictures, and videos at a second of the time that all of them show."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rhot_app.errors import CalibrationError
from rhot_app.handfit.pictures import files_by_camera, read_picture
from rhot_app.project import Rig
from rhot_app.sources.frame_sets import on_one_clock, open_video, overlap
from rhot_app.ui.language import tr
from rhot_node.pictures import VIDEO_SUFFIXES

Image = NDArray[np.uint8]

def is_video(path: Path) -> bool:
    """Whether a file is a video, by its name."""
    return path.suffix.lower() in VIDEO_SUFFIXES


def read_instant(rig: Rig, given: Sequence[str], at_s: float = 0.0) -> dict[int, Image]:
    """(H, W, 3) RGB by the camera's number. `given`: files as `files_by_camera` takes them; `at_s`: of videos, from the
    first moment that all of them show. Raises CalibrationError and RecordingError."""
    files = files_by_camera(rig, given)
    found = {camera: read_picture(path, rig.nodes[camera]) for camera, path in files.items() if not is_video(path)}
    videos = {camera: open_video(rig.nodes[camera], path) for camera, path in files.items() if is_video(path)}
    if not videos:
        return found
    timed = on_one_clock(list(videos.values()), {})
    first, last = overlap(timed)
    wanted = first + round(1e9 * at_s)
    if not first <= wanted <= last:
        together_s = 1e-9 * (last - first)
        raise CalibrationError(
            tr("The videos show {length:.2f} s together, and second {at:g} is before that. Choose a later one.",
               length=together_s, at=at_s) if wanted < first else
            tr("The videos show {length:.2f} s together, and second {at:g} is beyond that. Choose an earlier one.",
               length=together_s, at=at_s))
    for camera, video in zip(videos, timed, strict=True):
        nearest = np.zeros(len(video.times_ns), np.bool_)
        nearest[int(np.argmin(np.abs(video.times_ns - wanted)))] = True
        picture = next(video.frames(nearest), None)
        if picture is None:
            raise CalibrationError(tr("{path}: its frame at second {at_s:g} cannot be read; is the file complete?",
                                      path=video.path, at_s=at_s))
        found[camera] = picture[1]
    return found


def in_order(rig: Rig, paths: Sequence[str]) -> list[str]:
    """The files that a person chose, each with the camera whose name is in its own; where that does not tell them
    apart, sorted by name."""
    names = [node.name for node in rig.nodes]
    # the longest: cam1 is in cam10, too
    longest = [max((name for name in names if name.lower() in Path(path).stem.lower()), key=len, default=None)
               for path in paths]
    named = [name for name in longest if name is not None]
    if len(named) == len(paths) == len(set(named)):
        return [f"{name}={path}" for name, path in zip(named, paths, strict=True)]
    return sorted(paths)
