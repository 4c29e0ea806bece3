"""The videos of a log in the time of its states: which picture a camera took at a moment of the recording.

They are the nodes' own, which were collected beside the log, or those that a log of films names in its header.
"""

from __future__ import annotations

import contextlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Final

import msgspec
import numpy as np
from msgspec import Meta

from rhot_app.errors import RecordingError
from rhot_app.project import Rig
from rhot_app.recording.raw_log import FILMS, LogReader
from rhot_app.recording.video import video_path
from rhot_app.sources.frame_sets import CameraVideo, on_master_clock, open_video

_PERIODS: Final = 2.0
"""Farther from a picture than this many of its periods there is none: frames were lost."""


class NamedFilm(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A film that a log was made of: its file, its rate where it does not say one, and the master's time of its first
    frame."""

    path: Annotated[str, Meta(min_length=1, max_length=4096)]
    first_t_master_ns: Annotated[int, Meta(ge=0, lt=2**62)]
    fps: Annotated[float, Meta(gt=0.0, le=1000.0)] | None = None


@dataclass(frozen=True, slots=True, eq=False)
class RecordedFilm:
    """One camera's video. `camera`: index into the rig's nodes. The times of `video` are the master's clock."""

    camera: int
    video: CameraVideo

    def number_at(self, t_master_ns: int) -> int | None:
        """The picture nearest to a moment; None where the film has none."""
        times = self.video.times_ns
        number = int(np.searchsorted(times, t_master_ns))
        near = [one for one in (number - 1, number) if 0 <= one < len(times)]
        found = min(near, key=lambda one: abs(int(times[one]) - t_master_ns))
        return found if abs(int(times[found]) - t_master_ns) <= _PERIODS * self.video.period_ns else None


def recorded_films(log: Path, rig: Rig) -> tuple[RecordedFilm, ...]:
    """The videos of a log whose cameras are the rig's. Raises RecordingError when the log is none, or when a video that
    should be there cannot be read."""
    with contextlib.closing(LogReader(log)) as reader:
        named = _named(reader.about.get(FILMS), log)
    found = []
    for camera, node in enumerate(rig.nodes):
        beside, film = video_path(log, node.name), named.get(node.name)
        if beside.exists():
            found.append(RecordedFilm(camera, on_master_clock(open_video(node, beside), needed=True)))
        elif film is not None:
            path = next((one for one in (Path(film.path), log.parent / Path(film.path).name) if one.exists()), None)
            if path is None:
                raise RecordingError(f"{film.path}: the film of camera {node.name} is not there any more. Put it "
                                     f"beside {log} to see its pictures.")
            video = open_video(node, path, film.fps)
            times_ns = video.times_ns - video.times_ns[0] + film.first_t_master_ns
            found.append(RecordedFilm(camera, replace(video, times_ns=times_ns)))
    return tuple(found)


def film_period_ns(about: Mapping[str, Any], log: Path) -> int | None:
    """Time from picture to picture of the quickest film that a log was made of, by its header `about`: pictures within
    half of it are of one instant. None where it was made of none, or of nodes' recordings, which have times of their
    own. Raises RecordingError."""
    rates = [film.fps for film in _named(about.get(FILMS), log).values()]
    return round(1e9 / max(rate for rate in rates if rate is not None)) if rates and None not in rates else None


def _named(value: object, log: Path) -> Mapping[str, NamedFilm]:
    try:
        return msgspec.convert(value or {}, dict[str, NamedFilm])
    except msgspec.ValidationError as exc:
        raise RecordingError(f"{log}: its header names films in a form that cannot be read ({exc}).") from exc
