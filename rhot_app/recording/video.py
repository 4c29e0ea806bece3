"""Fetches the videos that the nodes recorded beside a log: piece by piece, taken up again where it was cut off.

Functions that wait; call them in a worker or a command.
"""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import os
import re
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Final

import msgspec
import zmq
from msgspec import Meta

from rhot_app.errors import RecordingError, RhotError
from rhot_app.progress import Progress, silent, within
from rhot_app.project import Rig, RigNode
from rhot_app.recording.raw_log import LogReader
from rhot_node.errors import NodeError, printable
from rhot_node.files import MIB, free_bytes, replacing
from rhot_node.keys import KeyPair
from rhot_node.network.context import Client, Context, ask_all, read_answer
from rhot_node.threads import ANSWER_S
from rhot_node.video.avi import read_stamps
from rhot_node.video.recorder import READ_MAX, VideoInfo, VideoName

PATIENCE_S: Final = 30.0
"""How long a node may be silent before its video is given up until the next try."""

_ANSWER_MAX = 8 * MIB  # bytes; the longest honest answer is a list of some ten thousand videos
_LOOK_S = 0.5

COLUMNS = ("frame_number", "t_node_ns", "exposure_ns", "row_time_ns")


@dataclass(frozen=True, slots=True)
class Collected:
    """One node's video on this computer."""

    node: str
    path: Path
    info: VideoInfo


class _Videos(msgspec.Struct):
    videos: Annotated[list[VideoInfo], Meta(max_length=100_000)]


def video_name(log: Path) -> str:
    """What the nodes call the videos of a log. Raises RecordingError when it has none or cannot be read."""
    with contextlib.closing(LogReader(log)) as reader:
        name = reader.about.get("video")
    if name is None:
        raise RecordingError(f"{log}: it was recorded without video. `rhot engine --log FILE --video` records both.")
    try:
        return msgspec.convert(name, VideoName)
    except msgspec.ValidationError as exc:
        raise RecordingError(f"{log}: its header names a video that no node can have; is it damaged?") from exc


def video_path(log: Path, node: str, folder: Path | None = None) -> Path:
    """Where the video of a log's node lies: ``NAME.NODE.avi`` beside ``NAME.rhotlog``, or in `folder`."""
    safe = re.sub(r"[^\w-]", "_", node)
    return (log.parent if folder is None else folder) / f"{log.stem}.{safe}.avi"


def videos_of(log: Path) -> list[Path]:
    """What was collected beside a log: videos, their tables, and pieces of videos."""
    ours = re.compile(re.escape(log.stem) + r"\.[\w-]+\.(avi|avi\.part|csv)")
    return sorted(path for path in log.parent.iterdir() if ours.fullmatch(path.name))


def collect_videos(log: Path, rig: Rig, own: KeyPair, folder: Path | None = None, *, keep: bool = False,
                   patience_s: float = PATIENCE_S, progress: Progress = silent) -> list[Collected]:
    """Fetch the videos of `log` from the nodes of `rig` into `folder`, by default beside the log.

    A video is removed from its node when it is whole here, unless `keep`. What was fetched before is left as it is. A
    piece of a video stays as ``.part`` and is gone on with the next time. Raises RecordingError with a sentence for
    every node whose video could not be had, after all were tried; whatever `progress` raises.
    """
    name = video_name(log)
    nodes = [node for node in rig.nodes if not node.text_datagrams]
    if not nodes:
        raise RecordingError("the rig has no node that records video.")
    found, problems = [], []
    for number, node in enumerate(nodes):
        part = within(progress, number / len(nodes), (number + 1) / len(nodes))
        try:
            with contextlib.closing(_Channel(node, own, patience_s)) as channel:
                found.append(_collect(channel, name, video_path(log, node.name, folder), keep, part))
        except (RhotError, NodeError) as exc:
            problems.append(str(exc))
        except OSError as exc:
            problems.append(f"{exc.filename or log}: cannot be written ({exc.strerror}).")
    if problems:
        raise RecordingError("\n".join(problems))
    return found


def _collect(channel: _Channel, name: str, target: Path, keep: bool, progress: Progress) -> Collected:
    node = channel.node.name
    info = channel.finished(name, progress)
    if info is None:
        if target.exists():
            return Collected(node, target, _known(name, target))
        raise RecordingError(f"node {node} has no video of this recording. Was it connected while it was recorded?")
    if not info.size:
        raise RecordingError(f"node {node} recorded no frame. {printable(info.message)}")
    if target.exists():
        if _digest(target) != info.sha256:
            raise RecordingError(f"{target}: exists already and is another file; nothing is written over. Move it away "
                                 "or choose another folder.")
    else:
        _fetch(channel, info, target, progress)
    write_times(target)
    if not keep:
        channel.ask({"request": "video_delete", "name": name})
    progress(f"video of {node}", 1.0)
    return Collected(node, target, info)


def _fetch(channel: _Channel, info: VideoInfo, target: Path, progress: Progress) -> None:
    """Fetch one video; raises RecordingError when it did not come whole, OSError."""
    part = target.with_name(f"{target.name}.part")
    with part.open("ab") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as exc:
            raise RecordingError(f"{part}: the video is being fetched already. Wait for its end.") from exc
        except OSError:  # some network file systems have no locks
            pass
        have = file.tell()
        if have > info.size:
            have = file.truncate(0)
        if info.size - have > free_bytes(target.parent):
            raise RecordingError(f"{target.parent}: there is no room for the {info.size - have} bytes of the video of "
                                 f"node {channel.node.name}.")
        while have < info.size:
            progress(f"video of {channel.node.name}", have / info.size)
            data = channel.read(info.name, have, min(READ_MAX, info.size - have))
            file.write(data)
            have += len(data)
        file.flush()
        os.fsync(file.fileno())
        progress(f"checking the video of {channel.node.name}", 1.0)
        if _digest(part) != info.sha256:
            part.unlink()
            raise RecordingError(f"the video of node {channel.node.name} did not come as the node has it, so what came "
                                 "was removed. Collect it again.")
        part.rename(target)


def write_times(video: Path) -> None:
    """The numbers and times of a video's frames as a table beside it. Raises NodeError, OSError."""
    stamps = read_stamps(video)
    with replacing(video.with_suffix(".csv")) as file:
        lines = [COLUMNS, *((one.number, one.t_node_ns, one.exposure_ns, one.row_time_ns) for one in stamps)]
        file.writelines(f"{','.join(map(str, line))}\n".encode() for line in lines)


def _known(name: str, target: Path) -> VideoInfo:
    return VideoInfo(name, len(read_stamps(target)), 0, target.stat().st_size, "")


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


class _Channel:
    """Requests to one node, which are asked again when the connection was cut."""

    def __init__(self, node: RigNode, own: KeyPair, patience_s: float) -> None:
        """Raises RecordingError for an address that none can have."""
        self.node, self._patience_s, self._context = node, patience_s, Context()
        try:
            self._client = Client(self._context, f"tcp://{node.address}:{node.control_port}", own, node.public_key,
                                  longest=_ANSWER_MAX)
        except zmq.ZMQError as exc:
            self._context.destroy(linger=0)
            raise RecordingError(f"node {node.name}: {node.address} is no address to connect to ({exc}).") from exc

    def close(self) -> None:
        """End the connection."""
        self._context.destroy(linger=0)

    def finished(self, name: str, progress: Progress) -> VideoInfo | None:
        """The node's video when it is finished; waits while it is not. None: the node has none of this name."""
        end_s = time.monotonic() + self._patience_s
        while True:
            answer, _ = self.ask({"request": "video_list"})
            try:
                videos = msgspec.convert(answer, _Videos).videos
            except msgspec.ValidationError as exc:
                raise self._strange() from exc
            info = next((video for video in videos if video.name == name), None)
            if info is None or info.state == "done":
                return info
            if time.monotonic() > end_s:
                raise RecordingError(f"the video of node {self.node.name} is not finished yet. Stop the recording, "
                                     "then collect it.")
            progress(f"{self.node.name} finishes its video", 0.0)
            time.sleep(_LOOK_S)

    def read(self, name: str, offset: int, length: int) -> bytes:
        """A piece of a video, at least a byte and at most `length`."""
        _, data = self.ask({"request": "video_read", "name": name, "offset": offset, "length": length})
        if data is None or not 0 < len(data) <= length:
            raise self._strange()
        return data

    def ask(self, request: dict[str, Any]) -> tuple[dict[str, Any], bytes | None]:
        """The answer and what is attached to it. Raises RecordingError when the node refuses or stays silent."""
        end_s, data, parts = time.monotonic() + self._patience_s, msgspec.json.encode(request), None
        while parts is None:
            left_s = end_s - time.monotonic()
            if left_s <= 0.0:
                raise RecordingError(
                    f"node {self.node.name} does not answer at {self.node.address}:{self.node.control_port}. When it "
                    "runs again, collect the videos again: it goes on where it was cut off.")
            (parts,) = ask_all([(self._client, data)], min(ANSWER_S, left_s))
        try:
            return read_answer(parts[0]), parts[1] if len(parts) > 1 else None
        except NodeError as exc:
            raise RecordingError(f"node {self.node.name}: {exc}") from exc
        except msgspec.MsgspecError as exc:
            raise self._strange() from exc

    def _strange(self) -> RecordingError:
        return RecordingError(f"node {self.node.name} gave an answer that cannot be read; is it of another version?")
