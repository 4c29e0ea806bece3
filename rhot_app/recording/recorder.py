"""Writes the raw log in a thread of its own, so that a slow disk never delays a sample."""

from __future__ import annotations

import contextlib
import errno
import fcntl
import math
import os
import struct
import time
from collections import deque
from collections.abc import Callable
from io import FileIO
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any

from rhot_app.errors import RecordingError
from rhot_app.project import Rig
from rhot_app.recording.raw_log import END, PAYLOAD_MAX, Record, RecordKind, encode_header, encode_record
from rhot_node.files import free_bytes, sync_folder
from rhot_node.threads import Worker

# -- remaining disk time -----------------------------------------------------------------------------------------------

WINDOW_S = 10.0
"""The rate is that of the last seconds: nodes may be started and stopped while a log is written."""

_LEAST_S = 2.0  # of growth before it is a rate


class DiskWatch:
    """`look` is called by the thread that writes, because a slow disk may keep it waiting; anybody may read."""

    def __init__(self, folder: Path, free: Callable[[Path], int] = free_bytes) -> None:
        self.seconds_left = math.inf
        self._folder, self._free = folder, free
        self._sizes: deque[tuple[float, int]] = deque()

    def look(self, size: int, now_s: float) -> None:
        """The log has `size` bytes now."""
        self._sizes.append((now_s, size))
        while now_s - self._sizes[0][0] > WINDOW_S:
            self._sizes.popleft()
        begun_s, before = self._sizes[0]
        if now_s - begun_s < _LEAST_S:
            return
        try:
            left = self._free(self._folder)
        except OSError:
            self.seconds_left = math.inf
            return
        self.seconds_left = left * (now_s - begun_s) / (size - before) if size > before else math.inf


# -- the writing thread ------------------------------------------------------------------------------------------------

QUEUE_LIMIT = 65_536
"""Records that may wait for the disk: six seconds of a 10,000 datagrams/s flood."""

SYNC_S = 1.0
"""The log is flushed to the disk this often: what a power cut may cost."""

_FLUSH_S = 0.2
_BATCH_S = 0.02  # one write for many records, and the lock of the interpreter left alone


class Recorder:
    """One log being written. `put` never blocks and never raises; `failure` says why recording ended early, `notice`
    what the operator should know while it goes on."""

    def __init__(self, path: Path, rig: Rig, about: dict[str, Any] | None = None) -> None:
        """Create the file. Raises RecordingError when it exists already or cannot be written; no file is left then."""
        self.path = path
        self.bytes_written = 0
        self.failure = self.notice = ""
        self.disk = DiskWatch(path.parent)
        self._began_s = time.monotonic()
        self._queue: SimpleQueue[Record] = SimpleQueue()
        self._missed = 0
        self._synced_bytes = 0
        self._synced_s = time.monotonic()
        header = encode_header(rig, about or {}, marks_end=True)
        try:
            self._file = FileIO(path, "xb")
        except FileExistsError as exc:
            raise RecordingError(f"{path}: exists already; a log is never written over. Choose another name.") from exc
        except OSError as exc:
            raise RecordingError(f"{path}: cannot be written ({exc.strerror}); name a file in a folder that exists and "
                                 "that you may write to.") from exc
        try:
            with contextlib.suppress(OSError):  # some network file systems have no locks
                fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)  # nobody appends to it meanwhile
            self._write(header)
        except OSError as exc:
            with contextlib.suppress(OSError):
                self._file.close()
            with contextlib.suppress(OSError):
                path.unlink()
            raise RecordingError(f"{path}: cannot be written ({exc.strerror}); make room, or choose another "
                                 "place.") from exc
        self._worker = Worker("writes the log", self._turn, begin=lambda: sync_folder(path), end=self._finish)
        self._worker.start()

    @property
    def recording(self) -> bool:
        """Whether records are still taken."""
        return not self.failure and not self._worker.ending.is_set()

    @property
    def seconds(self) -> float:
        """How long it has been written, s."""
        return time.monotonic() - self._began_s

    def put(self, kind: RecordKind, node_id: int, t_master_ns: int, data: bytes) -> None:
        """Take one record; when the disk is too slow it is left out and the gap is recorded."""
        if not self.recording:
            return
        if self._queue.qsize() >= QUEUE_LIMIT or len(data) > PAYLOAD_MAX:
            self._missed += 1
            return
        self._queue.put(Record(kind, node_id, t_master_ns, data))

    def step(self, timeout_s: float) -> None:
        """Write what waits; wait up to `timeout_s` for the first record."""
        parts: list[bytes] = []
        with contextlib.suppress(Empty):
            parts.append(encode_record(self._queue.get(timeout=timeout_s)))
            while len(parts) < 4096:
                parts.append(encode_record(self._queue.get_nowait()))
        if self._missed:
            missed, self._missed = self._missed, 0
            parts.append(encode_record(Record(RecordKind.GAP, 0, time.monotonic_ns(), struct.pack("<I", missed))))
        if not parts:
            return
        try:
            self._write(b"".join(parts))
        except OSError as exc:
            self._fail(exc)

    def close(self) -> None:
        """Write what waits and the end mark, flush it to the disk and close the file. May be called twice."""
        self._worker.close()
        try:
            self._file.close()
        except OSError as exc:  # some network file systems write only now
            self._fail(exc)

    def discard(self) -> None:
        """Close the file and remove it: the recording was refused."""
        self.close()
        with contextlib.suppress(OSError):
            self.path.unlink()

    def _fail(self, exc: Exception) -> None:
        if not self.failure:
            why = (exc.strerror if isinstance(exc, OSError) else "") or repr(exc)
            self.failure = (f"Recording to {self.path} has stopped: {why}. Tracking goes on. "
                            "Make room or choose another disk, then start a new recording.")

    def _look_after(self) -> None:
        """Notice when somebody removes or moves the file, which a program that writes it does not feel."""
        try:
            now = os.fstat(self._file.fileno())
            self.notice = "" if self._is_at_path(now) else (
                f"The recording is no longer at {self.path}: its folder or the file was moved. It goes on, in the file "
                "where it is now.")
            if not now.st_nlink:
                raise FileNotFoundError(errno.ENOENT, "the file or its folder was removed, and the recording with it")
        except OSError as exc:
            self._fail(exc)

    def _is_at_path(self, status: os.stat_result) -> bool:
        try:
            return os.path.samestat(self.path.stat(), status)
        except OSError:
            return False

    def _sync(self) -> None:
        """Have the disk take what was written; only this thread waits for it."""
        if self._synced_bytes == self.bytes_written:
            return
        self._synced_bytes = self.bytes_written
        try:
            os.fsync(self._file.fileno())
        except OSError as exc:
            self._fail(exc)

    def _write(self, data: bytes) -> None:
        """Write all bytes; a raw file may take only a part of them at a time."""
        view = memoryview(data)
        while view:
            written = self._file.write(view)
            self.bytes_written += written
            view = view[written:]

    def _turn(self) -> None:
        if self.failure:
            self._worker.ending.wait()
            return
        try:
            self.step(_FLUSH_S)
        except Exception as exc:  # what waited is lost: nobody must believe that it is written
            self._fail(exc)
            raise
        self._look_after()
        if time.monotonic() >= self._synced_s + SYNC_S:
            self._sync()
            self.disk.look(self.bytes_written, time.monotonic())
            self._synced_s = time.monotonic()
        self._worker.ending.wait(_BATCH_S)

    def _finish(self) -> None:
        while not self.failure and self._queue.qsize():
            self.step(0.0)
        if not self.failure:
            try:
                self._write(END)
            except OSError as exc:
                self._fail(exc)
        self._sync()
