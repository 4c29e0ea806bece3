"""Recorded videos of several cameras as frame sets: a picture of each camera near one instant, with its own time.

In ordinary videos the time of a frame follows from its number; the twin's recordings of raw frames state it. The nodes'
own recordings state it too, and the log beside them takes it to the master's clock. Pictures of a folder are a video,
and one picture is a video in which nothing moves.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Final

import msgspec
import numpy as np
from msgspec import Meta
from numpy.typing import NDArray

from rhot_app.errors import RecordingError, note_loss
from rhot_app.project import Intrinsics, Rig, RigNode
from rhot_app.recording.raw_log import FILMS, LogReader
from rhot_app.recording.video import video_path
from rhot_app.sources.clock import ClockEstimate
from rhot_app.sources.recorded_pictures import FilmReader, RecordedPictures, recorded_pictures
from rhot_app.sources.replay import LogValidator
from rhot_node.config import CameraSettings

Image = NDArray[np.uint8]
Times = NDArray[np.int64]

FPS = 1.0, 1000.0
"""frames/s that a video can have; what a file says beyond them is not a rate but missing."""

STILL_FPS: Final = CameraSettings().fps
STILL_FRAMES: Final = round(2.0 * STILL_FPS)
"""What one picture is shown for: two seconds, in which a hand is found, measured and settles."""

_CLOCK_EVERY_NS = 1_000_000_000


@dataclass(frozen=True, slots=True, eq=False)
class CameraVideo:
    """One camera's video. `times_ns` (N,): mid-exposure of the middle row of every frame."""

    camera: str
    source: RecordedPictures
    lens: Intrinsics
    times_ns: Times

    @property
    def path(self) -> Path:
        """The file or folder."""
        return self.source.path

    @property
    def stamped(self) -> bool:
        """Whether the node wrote the times, by its own clock until `on_master_clock`; else they are of a clock that all
        videos have."""
        return bool(self.source.stamps)

    @property
    def still(self) -> bool:
        """Whether all frames are one picture."""
        return len(self.source.files) == 1

    @property
    def period_ns(self) -> int:
        """Median time from frame to frame."""
        return int(np.median(np.diff(self.times_ns))) if len(self.times_ns) > 1 else round(1e9 / FPS[0])

    def frames(self, wanted: NDArray[np.bool_] | None = None) -> Iterator[tuple[int, Image]]:
        """(time ns, picture (H, W, 3) RGB) of every frame, or of those that are `wanted` (N,). Raises RecordingError
        where a frame has another size; a video that ends too early is noted as a loss."""
        chosen = np.arange(len(self.times_ns)) if wanted is None else np.flatnonzero(wanted)
        with contextlib.closing(FilmReader(self.source, in_order=True)) as reader:
            for k in chosen.tolist():
                picture = reader.picture(k)
                if picture is not None:
                    _check_size(self.path, self.camera, (picture.shape[1], picture.shape[0]), self.lens)
                    yield int(self.times_ns[k]), picture
                elif reader.ended:
                    break
            missing = len(self.times_ns) - reader.passed if reader.ended else 0
        if missing * self.period_ns > 1_000_000_000:  # containers may miscount by a frame or a few
            note_loss(str(self.path), f"{self.path}: {missing} of its {len(self.times_ns)} frames cannot be read; is "
                                      "the file complete?")

    def some(self, wanted: NDArray[np.bool_], most: int) -> list[Image]:
        """At most `most` of the pictures `wanted` (N,), evenly spread."""
        places = np.flatnonzero(wanted)
        kept = np.zeros(len(wanted), np.bool_)
        if len(places):
            kept[places[np.linspace(0, len(places) - 1, most).round().astype(int)]] = True
        return [picture for _, picture in self.frames(kept)]


def open_video(node: RigNode, path: Path, fps: float | None = None) -> CameraVideo:
    """The video of a camera of the rig. `fps`: of an ordinary video, instead of the rate that its file says, and of the
    pictures of a folder.

    Raises RecordingError: no video, a picture of another size than the lens's, or no frame rate.
    """
    source = recorded_pictures(path)
    _check_size(path, node.name, source.size, node.intrinsics)
    return CameraVideo(node.name, source, node.intrinsics, _times_ns(source, node, fps))


def _times_ns(source: RecordedPictures, node: RigNode, fps: float | None) -> Times:
    """(N,) as in `CameraVideo`, with the rig's calibrated correction of the camera. Raises RecordingError."""
    path, count, rate = source.path, source.count, fps or source.fps
    if fps is not None and (source.stamps or source.header is not None):
        raise RecordingError(f"{path}: it was recorded with the time of every frame; leave --fps out.")
    correction, half = round(1e9 * node.time_offset_s), 0.5 * (node.intrinsics.height - 1)
    if source.stamps:
        return np.array([one.t_node_ns + round(half * one.row_time_ns) + correction for one in source.stamps], np.int64)
    if source.header is not None:
        return np.array(source.header.times_ns, np.int64) + round(half * source.header.row_time_ns) + correction
    if source.files and not path.is_dir():
        count, rate = STILL_FRAMES, fps or STILL_FPS
    elif source.files and fps is None:
        raise RecordingError(f"{path}: pictures do not say how many of them were taken a second; give it with --fps.")
    if not FPS[0] <= rate <= FPS[1]:
        raise RecordingError(f"{path}: it says no frame rate; give it with --fps.")
    if count < 1:
        raise RecordingError(f"{path}: it does not say how many frames it has. Write it anew with a video program.")
    return np.round(1e9 / rate * np.arange(count)).astype(np.int64)


def open_videos(rig: Rig, paths: dict[str, str], fps: float | None) -> list[CameraVideo]:
    """The videos of cameras, in the rig's order. Raises RecordingError."""
    files = [Path(path).resolve() for path in paths.values()]
    doubled = next((path for path in files if files.count(path) > 1), None)
    if doubled is not None:
        raise RecordingError(f"{doubled}: it is given for two cameras; each has its own video.")
    return [open_video(node, Path(paths[node.name]), fps) for node in rig.nodes if node.name in paths]


def _check_size(path: Path, camera: str, size: tuple[int, int], lens: Intrinsics) -> None:
    if size != (lens.width, lens.height):
        raise RecordingError(f"{path}: its pictures are {size[0]} x {size[1]} px, but the lens of camera {camera} "
                             f"was calibrated at {lens.width} x {lens.height} px. Record at that size, or calibrate at "
                             "this one.")


# -- One clock for all ------------------------------------------------------------------------------------------------

def on_one_clock(videos: Sequence[CameraVideo], offsets_s: Mapping[str, float]) -> list[CameraVideo]:
    """The videos with all times on one clock: the nodes' recordings by the log beside them, all others as their files
    begin; then `offsets_s` by camera is added.

    Raises RecordingError: nodes' recordings without log, or videos that do not overlap.
    """
    several = len(videos) > 1
    timed = [on_master_clock(video, needed=several and video.camera not in offsets_s) if video.stamped else video
             for video in videos]
    timed = [replace(video, times_ns=video.times_ns + round(1e9 * offsets_s.get(video.camera, 0.0)))
             for video in timed]
    first, last = overlap(timed)
    if first > last:
        zero = min(int(video.times_ns[0]) for video in timed)
        covers = "; ".join(f"{video.camera} has {1e-9 * (int(video.times_ns[0]) - zero):.2f} to "
                           f"{1e-9 * (int(video.times_ns[-1]) - zero):.2f} s" for video in timed)
        raise RecordingError(f"the videos show no common time: {covers}. Are they of one recording? --offset-s moves a "
                             "video in time.")
    return timed


def overlap(videos: Sequence[CameraVideo]) -> tuple[int, int]:
    """The first and the last instant, ns, at which all videos have frames, to half a frame."""
    half = min(video.period_ns for video in videos) // 2
    return (max(int(video.times_ns[0]) for video in videos) - half,
            min(int(video.times_ns[-1]) for video in videos) + half)


def log_of(video: CameraVideo) -> Path:
    """The log that a node's recording was made beside."""
    return video.path.with_name(f"{video.path.stem.rpartition('.')[0] or video.path.stem}.rhotlog")


def on_master_clock(video: CameraVideo, *, needed: bool) -> CameraVideo:
    """A node's recording with the master's times, by the log beside it; unchanged without log, unless it is `needed`.
    Raises RecordingError."""
    log = log_of(video)
    if not log.exists():
        if not needed:
            return video
        raise RecordingError(f"{video.path}: its times are of the node's own clock, and the log {log.name} that "
                             f"compares the clocks is not beside it. Put it there, or give "
                             f"--offset-s {video.camera}=S.")
    with contextlib.closing(LogReader(log)) as reader:
        node = next((node for node in reader.rig.nodes if video_path(log, node.name).name == video.path.name), None)
        clocks = [] if node is None else _clock_estimates(reader, reader.rig, node.node_id)
    if not clocks:
        raise RecordingError(f"{log}: it has no clock records of the node that recorded {video.path.name}. Is it the "
                             f"log of this video? Else move it away and give --offset-s {video.camera}=S.")
    begins = np.array([begin for begin, _ in clocks])
    places = np.clip(np.searchsorted(begins, video.times_ns, side="right") - 1, 0, None)
    times = [clocks[k][1].to_master_ns(int(t)) for k, t in zip(places, video.times_ns, strict=True)]
    return replace(video, times_ns=np.array(times, np.int64))


def _clock_estimates(reader: LogReader, rig: Rig, node_id: int) -> list[tuple[int, ClockEstimate]]:
    """(node time from which it holds, estimate) of a node's clock, about once a second of the log."""
    validator, found, next_ns = LogValidator(rig), [], 0
    link = next(link for link in validator.links if link.node.node_id == node_id)
    for record in reader:
        validator.feed(record)
        estimate = link.clock.estimate_at(record.t_master_ns) if record.t_master_ns >= next_ns else None
        if estimate is not None:
            found.append((record.t_master_ns + round(estimate.offset_ns), estimate))
            next_ns = record.t_master_ns + _CLOCK_EVERY_NS
    return found


# -- Frame sets -------------------------------------------------------------------------------------------------------

@dataclass(frozen=True, slots=True)
class FrameSet:
    """A picture (H, W, 3) RGB of each camera, None where it has none, and their times (C,) ns."""

    images: tuple[Image | None, ...]
    t_ns: tuple[int, ...]

    @property
    def first_ns(self) -> int:
        """Of its earliest picture."""
        return min(t for t, image in zip(self.t_ns, self.images, strict=True) if image is not None)


def frame_sets(videos: Sequence[CameraVideo]) -> Iterator[FrameSet]:
    """The frames of all videos while all have some, in the order of time. Pictures within half a frame of the quickest
    camera make a set; every picture is in one set."""
    half = min(video.period_ns for video in videos) // 2
    first, last = overlap(videos)
    streams = [video.frames((video.times_ns >= first) & (video.times_ns <= last)) for video in videos]
    heads = [next(stream, None) for stream in streams]
    while waiting := [head[0] for head in heads if head is not None]:
        begin = min(waiting)
        images: list[Image | None] = [None] * len(videos)
        times = [begin] * len(videos)
        for c, head in enumerate(heads):
            if head is not None and head[0] <= begin + half:
                times[c], images[c] = head
                heads[c] = next(streams[c], None)
        yield FrameSet(tuple(images), tuple(times))


def frames_left_out(videos: Sequence[CameraVideo]) -> int:
    """How many frames lie outside the time that all videos show."""
    first, last = overlap(videos)
    return sum(int(np.sum((video.times_ns < first) | (video.times_ns > last))) for video in videos)


def checked_seconds(text: str, option: str) -> float:
    """A number of seconds of the command line. Raises RecordingError."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise RecordingError(f"{option} {text}: {text!r} is no number of seconds.")
    return value


# -- the videos of a log in the time of its states ---------------------------------------------------------------------
# Which picture a camera took at a moment of the recording: of the nodes' own videos, which were collected beside the
# log, or of those that a log of films names in its header.

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
