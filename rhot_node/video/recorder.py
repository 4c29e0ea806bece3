"""Writes a node's frames into videos in a thread of its own, and keeps them until a master has fetched them.

The frame loop only copies a frame into a short queue. When the disk or the encoder is too slow the oldest frame that
waits is dropped and counted: the frame loop never waits for a video.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import logging
import os
import stat
import threading
import time
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, BinaryIO, Final, Literal

import msgspec
from msgspec import Meta

from rhot_node.capture.camera import Frame
from rhot_node.detect.image import YuvImage
from rhot_node.errors import NodeError, VideoError
from rhot_node.files import KIB, MIB, free_bytes, open_input, read_document, write_document
from rhot_node.threads import OneShotThread
from rhot_node.video.avi import BYTES_MAX, Stamp, append_picture, begin_video, encode_picture, finish_video
from rhot_node.wire.messages import U32_MAX

log = logging.getLogger(__name__)

FORMAT: Final = "rhot-node-video"
VERSION: Final = 1

READ_MAX: Final = 256 * KIB
"""Bytes of one `read`: some milliseconds of a network, so that other requests are not kept waiting."""

LEASE_S: Final = 15.0
"""A master that records repeats its start every three seconds; after five that were not heard the video ends."""

FREE_MIN: Final = 512 * MIB
"""Bytes of the disk that are left to the system: a Pi whose disk is full no longer starts cleanly."""

QUEUE_FRAMES: Final = 16
"""Frames that may wait: 7 MB at 640 x 480, half a second at 30 Hz."""

_LOOK_S = 1.0
_NICENESS = 10  # of the thread that encodes; the detector's is 0

VideoName = Annotated[str, Meta(pattern=r"\A[A-Za-z0-9][A-Za-z0-9_-]{0,63}\Z")]
"""No dot and no slash: a name that a master gives never leads out of the folder."""


class VideoInfo(msgspec.Struct, frozen=True):
    """``NAME.json`` beside ``NAME.avi``, written when it is whole. `message`: why it ended early; empty otherwise."""

    name: VideoName
    frames: int
    dropped: int
    size: int
    sha256: str
    message: str = ""
    state: Literal["recording", "finishing", "done"] = "done"
    format: Literal["rhot-node-video"] = FORMAT
    version: Literal[1] = VERSION


def video_folder(settings: Path) -> Path:
    """Where the videos of the node with this settings file lie."""
    return settings.with_name(f"{settings.stem}.videos")


class VideoRecorder:
    """The videos of one node. `offer` belongs to the frame loop; everything else to the thread of the requests."""

    def __init__(self, folder: Path, *, free: Callable[[Path], int] = free_bytes, lease_s: float = LEASE_S,
                 queue_frames: int = QUEUE_FRAMES) -> None:
        """The folder is made when the first video begins. What a node left unfinished when it ended is finished now, in
        the background."""
        self.folder = folder
        self._free = free
        self._lease_s = lease_s
        self._queue_frames = queue_frames
        self._current: _Take | None = None
        self._takes: dict[str, _Take] = {}  # of this run of the node
        self._mending = {path.stem for path in folder.glob("*.avi") if not path.with_suffix(".json").exists()}
        self._mender = OneShotThread("mends videos", functools.partial(self._mend, sorted(self._mending)))

    def offer(self, frame: Frame) -> None:
        """Copy the frame for the video, if there is one; else cost nothing."""
        take = self._current
        if take is not None:
            take.put(frame)

    def start(self, name: str) -> VideoInfo:
        """Begin the video `name`, or go on with it: the answer to a repeated start says how it goes. Another one that
        was being recorded ends. Raises VideoError."""
        take = self._takes.get(name)
        if take is None:
            if any((self.folder / f"{name}{suffix}").exists() for suffix in (".avi", ".json")):
                raise VideoError(f"the node was started again since the video {name} began; what comes now is not in "
                                 "it. Begin a new recording.")
            self.stop()
            try:
                self.folder.mkdir(mode=stat.S_IRWXU, parents=True, exist_ok=True)
                self._require_room()
            except OSError as exc:
                raise VideoError(f"{self.folder}: no video can be written there ({exc.strerror}).") from exc
            take = self._takes[name] = self._current = _Take(self.folder / f"{name}.avi", self._free,
                                                             self._lease_s, self._queue_frames)
            log.info("the video %s begins", name)
        take.heard()
        return take.info

    def stop(self, name: str = "") -> str:
        """End the video `name`, or whichever is recorded; returns the name of the one that ended, or ""."""
        take = self._current
        if take is None or name not in ("", take.name):
            return ""
        self._current = None
        take.end()
        return take.name

    def videos(self) -> list[VideoInfo]:
        """All videos by name: finished, being finished and being recorded."""
        found = {name: take.info for name, take in self._takes.items()}
        for name in self._mending - found.keys():
            found[name] = VideoInfo(name, 0, 0, 0, "", state="finishing")
        for path in self.folder.glob("*.json"):
            with contextlib.suppress(NodeError):
                info = read_document(path, VideoInfo, format_name=FORMAT, version=VERSION, error=VideoError)
                if info.name == path.stem:
                    found[path.stem] = info
        return [found[name] for name in sorted(found)]

    def read(self, name: str, offset: int, length: int) -> bytes:
        """Bytes of a finished video from `offset` on, `length` of them or what there is. Raises VideoError."""
        self._require_done(name)
        try:
            with open_input(self.folder / f"{name}.avi") as file:
                file.seek(offset)
                return file.read(min(length, READ_MAX))
        except OSError as exc:
            raise VideoError(f"the video {name} cannot be read ({exc.strerror}).") from exc

    def delete(self, name: str) -> None:
        """Remove a finished video. Raises VideoError."""
        self._require_done(name)
        try:
            (self.folder / f"{name}.avi").unlink(missing_ok=True)  # first: without the other it would be found again
            (self.folder / f"{name}.json").unlink()
        except OSError as exc:
            raise VideoError(f"the video {name} cannot be removed ({exc.strerror}).") from exc
        self._takes.pop(name, None)
        log.info("the video %s is removed", name)

    def close(self) -> None:
        """End the video that is being recorded, and finish what is unfinished. May be called twice."""
        self.stop()
        for take in self._takes.values():
            take.join()
        self._mender.join()

    def _require_done(self, name: str) -> None:
        if not (self.folder / f"{name}.json").is_file():
            there = any(info.name == name for info in self.videos())
            raise VideoError(f"the video {name} is not finished yet." if there else f"there is no video {name}.")

    def _require_room(self) -> None:
        if self._free(self.folder) < FREE_MIN:
            raise VideoError(f"the node's disk has less than {FREE_MIN // MIB} MiB left, so no video is recorded. "
                             "Fetch the videos that it has, or make room.")

    def _mend(self, names: list[str]) -> None:
        _step_back()
        for name in names:
            with contextlib.suppress(OSError):
                _finish(self.folder / f"{name}.avi", 0, "The node ended while it was being recorded.")
            self._mending = self._mending - {name}  # another one: the other thread may be going through the old one


class _Take:
    """One video being written, in a thread of its own."""

    def __init__(self, path: Path, free: Callable[[Path], int], lease_s: float, queue_frames: int) -> None:
        self.name = path.stem
        self._path = path
        self._free = free
        self._lease_s = lease_s
        self._queue_frames = queue_frames
        self._queue: deque[tuple[YuvImage, Stamp]] = deque()
        self._changed = threading.Condition()
        self._ending = False
        self._finished: VideoInfo | None = None
        self._frames = self._dropped = self._size = 0
        self._image_size: tuple[int, int] | None = None
        self._message = ""
        self._heard_s = time.monotonic()
        self._look_s = 0.0
        self._task = OneShotThread("writes the video", self._run)

    @property
    def info(self) -> VideoInfo:
        """How it goes."""
        state: Literal["recording", "finishing"] = "finishing" if self._ending else "recording"
        return self._finished or VideoInfo(self.name, self._frames, self._dropped, self._size, "", self._message, state)

    def heard(self) -> None:
        """The master still wants it."""
        self._heard_s = time.monotonic()

    def put(self, frame: Frame) -> None:
        """Copy the frame into the queue; the oldest that waits makes room for it."""
        if self._ending:
            return
        copy = frame.image.copy()
        stamp = Stamp(frame.number & U32_MAX, frame.t_node_ns, frame.exposure_ns, frame.row_time_ns)
        with self._changed:
            if len(self._queue) >= self._queue_frames:
                self._queue.popleft()
                self._dropped += 1
            self._queue.append((copy, stamp))
            self._changed.notify()

    def end(self, message: str = "") -> None:
        """Take no more frames; what waits is still written."""
        with self._changed:
            self._message = self._message or message
            self._ending = True
            self._changed.notify()

    def join(self) -> None:
        """Wait until the video is whole."""
        self._task.join()

    def _run(self) -> None:
        _step_back()
        try:
            self._write_all()
        except (OSError, VideoError) as exc:
            self.end(f"The video could not be written ({getattr(exc, 'strerror', None) or exc}).")
        try:
            self._finished = _finish(self._path, self._dropped, self._message)
        except OSError as exc:
            self.end(f"The video could not be finished ({exc.strerror}).")
        log.log(logging.WARNING if self._message or self._dropped else logging.INFO,
                "the video %s ends: %d frames, %d dropped. %s", self.name, self._frames, self._dropped, self._message)

    def _write_all(self) -> None:
        with contextlib.ExitStack() as stack:
            file: BinaryIO | None = None
            while (item := self._next()) is not None:
                image, stamp = item
                if file is None:
                    handle = os.open(self._path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC,
                                     stat.S_IRUSR | stat.S_IWUSR)
                    file = stack.enter_context(os.fdopen(handle, "wb"))
                    self._image_size = image.size
                    begin_video(file, *image.size)
                if image.size != self._image_size:
                    self.end("The camera's image size was changed.")
                    return
                jpeg = encode_picture(image, stamp)
                append_picture(file, jpeg)
                self._frames += 1
                self._size = file.tell()
                if self._size > BYTES_MAX:
                    self.end("The video has reached 4 GiB, the most that its file can have.")

    def _next(self) -> tuple[YuvImage, Stamp] | None:
        """The next frame to write; None when there are no more."""
        while True:
            now_s = time.monotonic()
            if now_s >= self._look_s and not self._ending:
                self._look_s = now_s + _LOOK_S
                self._look(now_s)
            with self._changed:
                if self._queue:
                    return self._queue.popleft()
                if self._ending:
                    return None
                self._changed.wait(_LOOK_S)

    def _look(self, now_s: float) -> None:
        """End it when the disk is nearly full, or nobody wants it any more."""
        if self._free(self._path.parent) < FREE_MIN:
            self.end(f"The node's disk has less than {FREE_MIN // MIB} MiB left.")
        elif now_s - self._heard_s > self._lease_s:
            self.end("The master was not heard any more.")


def _step_back() -> None:
    """Have this thread run when no other wants to."""
    with contextlib.suppress(OSError):
        os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), _NICENESS)


def _finish(path: Path, dropped: int, message: str) -> VideoInfo:
    """Make a written video whole and write its `VideoInfo`. Raises OSError."""
    frames, size, digest = 0, 0, hashlib.sha256().hexdigest()
    if path.exists():
        try:
            with path.open("r+b") as file:
                frames = finish_video(file)
                size = file.seek(0, os.SEEK_END)
                file.seek(0)
                digest = hashlib.file_digest(file, "sha256").hexdigest()
        except VideoError:  # not even its header was written
            path.unlink()
    info = VideoInfo(path.stem, frames, dropped, size, digest, message or ("" if frames else "No frames came."))
    write_document(path.with_suffix(".json"), info)
    return info
