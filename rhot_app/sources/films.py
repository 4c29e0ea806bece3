"""The videos of a log in the time of its states: which picture a camera took at a moment of the recording.

They are the nodes' own, which were collected beside the log, or those that a log of films names in its header.
"""

from __future__ import annotations

import contextlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Final

import cv2
import msgspec
import numpy as np
from msgspec import Meta
from numpy.typing import NDArray

from rhot_app.errors import RecordingError
from rhot_app.project import Rig
from rhot_app.recording.raw_log import FILMS, LogReader
from rhot_app.recording.video import video_path
from rhot_app.sources.frame_sets import CameraVideo, on_master_clock, open_video
from rhot_node.errors import PictureError
from rhot_node.files import open_input
from rhot_node.pictures import decode_picture, read_picture
from rhot_node.pictures import open_video as decoder
from rhot_node.video.avi import pictures_of

Image = NDArray[np.uint8]

_PERIODS: Final = 2.0
"""Farther from a picture than this many of its periods there is none: frames were lost."""

_READ_ON: Final = 30
"""Frames that are passed over one by one; a decoder that is sent farther begins at the key frame before."""


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


class FilmReader:
    """Pictures of one video in any order; quick where they follow each other."""

    def __init__(self, video: CameraVideo) -> None:
        """Raises RecordingError when the file cannot be opened."""
        self._video = video
        self._places: list[tuple[int, int]] = []
        self._capture: cv2.VideoCapture | None = None
        self._next = 0
        try:
            if video.stamped:
                with open_input(video.path) as file:
                    self._places = [(picture.offset, picture.size) for picture in pictures_of(file)]
            elif not video.pictures:
                self._capture = decoder(video.path)
        except (OSError, PictureError) as exc:
            raise self._lost(exc) from exc

    def picture(self, number: int) -> Image | None:
        """(H, W, 3) RGB; None where it is damaged. Raises RecordingError when the file is gone."""
        try:
            found = self._decoded(number)
        except PictureError:
            return None
        except OSError as exc:
            raise self._lost(exc) from exc
        return None if found is None else np.ascontiguousarray(found[..., ::-1])

    def _decoded(self, number: int) -> Image | None:
        if self._video.pictures:
            return read_picture(self._video.pictures[number])
        if self._capture is None:
            offset, size = self._places[number]
            with open_input(self._video.path) as file:
                file.seek(offset)
                return decode_picture(file.read(size))
        if not 0 <= number - self._next <= _READ_ON:
            self._capture.set(cv2.CAP_PROP_POS_FRAMES, number)
            self._next = number
        while self._next < number and self._capture.grab():
            self._next += 1
        read, picture = self._capture.read()
        self._next += 1
        return np.asarray(picture, np.uint8) if read else None

    def _lost(self, exc: Exception) -> RecordingError:
        return RecordingError(f"{self._video.path}: cannot be shown ({exc}). Is it still there?")

    def close(self) -> None:
        """Let go of the file. May be called twice."""
        if self._capture is not None:
            self._capture.release()
