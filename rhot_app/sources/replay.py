"""A raw log as a source: its records go through the same links and doors that live nodes go through."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated

import msgspec

from rhot_app.barehand.observations import SliceRequest
from rhot_app.errors import RecordingError
from rhot_app.objects.observations import decode_pose
from rhot_app.project import Rig
from rhot_app.recording.raw_log import LogReader, Record, RecordKind, RecordSink
from rhot_app.sources.node_link import CLOCK_REPLY, RigLinks
from rhot_app.sources.receiver import Deliver, NodeReceiver, to_nobody
from rhot_app.tracking.tracker import CameraFrame
from rhot_node.errors import WireError
from rhot_node.files import decode_message
from rhot_node.threads import FOREIGN, OneShotThread
from rhot_node.wire.codec import decode_verified
from rhot_node.wire.messages import ClockReply, ClockRequest, Slices, Start


class LogValidator(RigLinks):
    """Takes records in the order written and gives the frames that live nodes would have given."""

    def __init__(self, rig: Rig) -> None:
        super().__init__(rig)
        self.unknown_nodes = 0  # records of nodes that the rig does not have
        self.gaps = 0  # records that the disk was too slow for
        self._by_id = {link.node.node_id: link for link in self.links}
        for link in self.links:
            link.door.open = decode_verified
            if link.node.text_datagrams:
                link.door.expect_session(1)

    def rewind(self) -> None:
        """The log begins anew; counters go on."""
        self.starts += 1
        for link in self.links:
            link.clock.reset()

    def feed(self, record: Record) -> CameraFrame | None:
        """Take one record in; a frame when it holds one that is admitted."""
        if record.kind is RecordKind.DATAGRAM:
            link = self._by_id.get(record.node_id)
            if link is not None:
                return link.door.admit(record.data, record.t_master_ns)
            self.unknown_nodes += 1
        elif record.kind is RecordKind.OBJECT_POSE:
            with contextlib.suppress(RecordingError):
                return decode_pose(record.data)
        elif record.kind is RecordKind.REFUSED:
            self._count_refused(record)
        elif record.kind is RecordKind.GAP:
            self.gaps += int.from_bytes(record.data[:4], "little")
        else:
            self._feed_command(record)
        return None

    def _count_refused(self, record: Record) -> None:
        link = self._by_id.get(record.node_id)
        with contextlib.suppress(msgspec.MsgspecError):
            refused = decode_message(record.data, dict[str, Annotated[int, msgspec.Meta(ge=0)]])
            if link is not None:
                link.refused_replies += refused.pop(CLOCK_REPLY, 0)
                link.door.received += sum(refused.values())
                for reason, count in refused.items():
                    link.door.drop(reason, count)

    def _feed_command(self, record: Record) -> None:
        try:
            message = decode_verified(record.data)
        except WireError:
            return
        if isinstance(message, Start):
            self.starts += 1
            for entry in message.entries:
                if (started := self._by_id.get(entry.node_id)) is not None:
                    started.door.expect_session(message.session)
        elif (link := self._by_id.get(message.node_id)) is None:
            return
        elif isinstance(message, Slices):
            link.door.searches.read(message)
        elif isinstance(message, ClockRequest):
            link.sent(message)
        elif isinstance(message, ClockReply):
            link.take_reply(message, record.t_master_ns)


class LogReplay(LogValidator):
    """`ObservationSource` of a log. `speed` 1 is real time; None is as fast as the tracker takes the frames."""

    live = False

    def __init__(self, path: Path, rig: Rig, speed: float | None = 1.0) -> None:
        """Open the log; raises RecordingError when it is none."""
        super().__init__(rig)
        self.over = False  # the log was played as far as it can be read
        self.failure = ""  # why that is not its end
        self.played_s = 0.0  # of the log's own time, from its first datagram
        self._deliver: Deliver = to_nobody
        self.receivers: tuple[NodeReceiver, ...] = ()
        self.log_path = str(path)
        LogReader(path).close()
        self._path = path
        self._speed = speed
        self._notice = ""
        self._ending = threading.Event()
        self._task: OneShotThread | None = None

    def deliver_to(self, deliver: Deliver) -> None:
        """Hand frames to `deliver` from now on, in the replay's own thread."""
        self._deliver = deliver

    def notices(self) -> list[str]:
        """That the log is over, damaged or torn."""
        return [self._notice] if self._notice else []

    def start(self, session: int) -> None:
        """Replay from the beginning; the log brings its own sessions, so `session` is not looked at."""
        self.stop()
        self._notice = self.failure = ""
        self.over = False
        self._ending.clear()
        self.rewind()
        self._task = OneShotThread("replays the log", self._run)

    def stop(self) -> None:
        """End the replay."""
        self._ending.set()
        if self._task is not None:
            self._task.join()

    def search(self, request: SliceRequest) -> None:
        """Nobody is asked."""

    def record_to(self, tap: RecordSink | None) -> None:
        """Raises RecordingError: a copy of the log's file is the recording."""
        if tap is not None:
            raise RecordingError(f"a replay is not recorded; copy {self._path} instead.")

    def close(self) -> None:
        """End the replay."""
        self.stop()

    def _run(self) -> None:
        try:
            with contextlib.closing(LogReader(self._path)) as reader:
                if not self._play(reader):
                    return
            end, damage = reader.losses.end, reader.losses.damage
            self._notice = f"The log is over; {end or 'Start replays it again'}."
            self._notice += f" It is damaged: {damage}." if damage else ""
        except RecordingError as exc:
            self._notice = self.failure = str(exc)
        except FOREIGN as exc:
            self._notice = self.failure = f"The replay failed ({type(exc).__name__}: {exc}). Report this with the log."
            raise
        finally:
            self.over = not self._ending.is_set()

    def _play(self, records: Iterable[Record]) -> bool:
        """Deliver all frames in their time; False when told to end before."""
        first_ns: int | None = None
        begun_ns = time.monotonic_ns()
        for record in records:
            if record.kind is RecordKind.BOOKMARK:  # it may stand anywhere, with any time
                continue
            if first_ns is None and record.kind is RecordKind.DATAGRAM:
                first_ns, begun_ns = record.t_master_ns, time.monotonic_ns()
            elapsed_ns = record.t_master_ns - first_ns if first_ns is not None else 0
            if self._wait(elapsed_ns, begun_ns):
                return False
            if record.kind is RecordKind.DATAGRAM:
                self.played_s = 1e-9 * elapsed_ns
            frame = self.feed(record)
            if frame is not None:
                self._deliver([frame])
        return True

    def _wait(self, elapsed_log_ns: int, begun_ns: int) -> bool:
        """Wait until the record is due; True when the replay shall end."""
        if self._speed is None:
            return self._ending.is_set()
        wait_s = 1e-9 * (begun_ns + elapsed_log_ns / self._speed - time.monotonic_ns())
        return self._ending.wait(wait_s) if wait_s > 0.0 else self._ending.is_set()
