"""The raw log's bytes: every datagram and clock exchange as it came, with its time. docs/log.md, byte by byte.

Reading and writing of files; no sockets, no threads. A reader goes on behind damage, and behind blocks that the disk
does not give: with the next record whose checksum is right.
"""

from __future__ import annotations

import contextlib
import enum
import io
import json
import os
import re
import struct
import zlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, BinaryIO, Final, Protocol, cast

import msgspec
import numpy as np

from rhot_app.errors import RecordingError, note_loss
from rhot_app.project import Rig, parse_rig
from rhot_node.files import JSON_BYTES_MAX, KIB, MIB, decode_json, open_input
from rhot_node.wire.fields import TIME_MAX_NS, UDP_MAX

MAGIC: Final = b"RHOTLOG\0"
VERSION: Final = 2
HEADER_MAX: Final = JSON_BYTES_MAX
PAYLOAD_MAX: Final = UDP_MAX

_BLOCK = 4096  # of a disk: what one bad block destroys; each copy of the header fills whole ones
_BUFFER = 64 * KIB
_SCAN_MAX = MIB  # bytes searched at a time for the next sound record

_PREFIX = struct.Struct("<8sHHI")
_RECORD = struct.Struct("<BIqI")
_LENGTH = _CRC = struct.Struct("<I")


class RecordKind(enum.IntEnum):
    """What a record holds."""

    DATAGRAM = 1  # received on a node's data port
    CLOCK_REQUEST = 2  # sent to a node, as sent
    CLOCK_REPLY = 3  # received on the command port
    START = 4  # sent to all nodes, as sent
    STOP = 5  # sent to all nodes, as sent
    GAP = 6  # u32: records that could not be kept because the disk was too slow
    BOOKMARK = 7  # UTF-8 text about a moment (rhot_app.recording.bookmarks)
    OBJECT_POSE = 8  # of another tracker, in the rig frame (rhot_app.objects.observations)
    LANDMARKS = 9  # reserved
    SLICES = 10  # sent to a node, as sent
    REFUSED = 11  # JSON: datagrams of a node that were refused and are not recorded, by reason
    END = 12  # the recording was ended in order


_KINDS = frozenset(int(kind) for kind in RecordKind) - {RecordKind.LANDMARKS, RecordKind.END}
CONTINUES: Final = "continues"
"""In the header of a part: name of the log of the part before, which a crash of the engine had ended."""

_PART = re.compile(r"-part(\d{1,6})\Z")
_MARKS_END = "end_mark"  # in the header: whoever writes this log ends it with a record END


@dataclass(frozen=True, slots=True)
class Record:
    """One record. `t_master_ns`: kernel receive time, or the time of sending; `node_id` 0: all nodes."""

    kind: RecordKind
    node_id: int
    t_master_ns: int
    data: bytes


class RecordSink(Protocol):
    """Takes records. Must return at once and never raise: it is called between a sample and its state."""

    def put(self, kind: RecordKind, node_id: int, t_master_ns: int, data: bytes) -> None:
        """Take one record's parts."""
        ...


@dataclass(slots=True)
class Losses:
    """What of a log could not be read. Each place is at least one record."""

    places: int = 0
    skipped_bytes: int = 0
    header_bytes: int = 0  # of the copy of the header that is damaged
    unreadable_bytes: int = 0  # of blocks that the disk does not give
    torn_bytes: int = 0  # at the end, of the record that was being written when the program died
    end_missing: bool = False  # no end mark, although the log should have one
    unknown_records: int = 0  # sound, of a kind that a later version writes

    @property
    def damage(self) -> str:
        """What was skipped, as a clause; empty when nothing was."""
        said = []
        if self.unreadable_bytes:
            said.append(f"the disk does not give {self.unreadable_bytes} bytes of it")
        if self.header_bytes:
            said.append(f"one of the two copies of its header is damaged ({self.header_bytes} bytes)")
        if self.places:
            places = "1 damaged place was" if self.places == 1 else f"{self.places} damaged places were"
            records = "1 record" if self.places == 1 else f"{self.places} records"
            said.append(f"{places} skipped ({self.skipped_bytes} bytes, at least {records})")
        return "; ".join(said)

    @property
    def end(self) -> str:
        """What of its end is missing, as a clause; empty when nothing is."""
        if self.torn_bytes:
            return f"its last {self.torn_bytes} bytes are torn: it was cut off while it was written or copied"
        return "its end is missing: it is still being written, or was cut off" if self.end_missing else ""


def next_part(log: Path) -> Path:
    """A new name beside a log for the part after it: ``NAME-part2.rhotlog``, then ``NAME-part3.rhotlog``."""
    found = _PART.search(log.stem)
    number = int(found[1]) if found else 1
    while (part := log.with_stem(f"{_PART.sub('', log.stem)}-part{number + 1}")).exists():
        number += 1
    return part


def begun_now(t_master_ns: int) -> dict[str, Any]:
    """What a log's header says of its beginning: now, which is `t_master_ns` by the master's clock."""
    return {"created": datetime.now(UTC).isoformat(timespec="milliseconds"), "created_t_master_ns": t_master_ns}


FILMS: Final = "films"
"""In the header of a log that was made of films: what they were."""


def filmed_at(when: datetime, t_master_ns: int) -> dict[str, Any]:
    """What the header of a log that was made of a film says of the film's own time: `when` it was taken, which is
    `t_master_ns` by the log's clock."""
    return {"filmed": when.astimezone(UTC).isoformat(timespec="milliseconds"), "filmed_t_master_ns": t_master_ns}


def wall_clock_offset_ns(about: dict[str, Any], first_t_master_ns: int) -> int | None:
    """ns since 1970, UTC, less the master's clock, by a log's header; None when it does not say when it was begun.
    `first_t_master_ns`: of its first record, which stands for its beginning in older logs. Of a log that was made of
    films, `created` says when it was made, and only `filmed` when its hands were there."""
    key = "filmed" if FILMS in about else "created"
    at_ns = about.get(f"{key}_t_master_ns", first_t_master_ns)
    try:
        created = datetime.fromisoformat(about.get(key, ""))
    except (ValueError, TypeError):
        return None
    since = (created if created.tzinfo else created.replace(tzinfo=UTC)) - datetime.fromtimestamp(0, UTC)
    since_ns = since // timedelta(microseconds=1) * 1000
    return since_ns - at_ns if type(at_ns) is int and 0 <= at_ns <= since_ns < TIME_MAX_NS else None


def encode_header(rig: Rig, about: dict[str, Any], *, marks_end: bool = False) -> bytes:
    """The bytes that begin a log: twice the magic, the version and a JSON document with the rig and facts `about` it.
    `marks_end`: it will end with `END`, so a reader can tell when it was cut off.

    Raises RecordingError when the document is too large for a reader.
    """
    facts = {**about, **({_MARKS_END: True} if marks_end else {}), "rig": json.loads(msgspec.json.encode(rig))}
    document = json.dumps(facts).encode()
    document += b" " * (-(_PREFIX.size + len(document) + _CRC.size) % _BLOCK)
    if len(document) > HEADER_MAX:
        raise RecordingError(f"the rig {rig.name!r} is too large for a log: {len(document)} bytes of {HEADER_MAX}.")
    head = _PREFIX.pack(MAGIC, VERSION, 0, len(document)) + document
    return 2 * (head + _CRC.pack(zlib.crc32(head)))


def encode_record(record: Record) -> bytes:
    """The bytes of one record. Raises RecordingError when its data are longer than a reader takes."""
    if len(record.data) > PAYLOAD_MAX:
        raise RecordingError(f"a record of {len(record.data)} bytes does not fit a log; {PAYLOAD_MAX} do.")
    return _encode(record.kind, record.node_id, record.t_master_ns, record.data)


def _encode(kind: int, node_id: int, t_master_ns: int, data: bytes) -> bytes:
    body = _RECORD.pack(kind, node_id, t_master_ns, len(data)) + data
    return body + _CRC.pack(zlib.crc32(body))


END: Final = _encode(RecordKind.END, 0, 0, b"")
"""The bytes that end a log."""


def encode_log(rig: Rig, about: dict[str, Any], records: Iterable[Record]) -> Iterator[bytes]:
    """The bytes of a whole log, a part at a time. Raises RecordingError."""
    yield encode_header(rig, about, marks_end=True)
    for record in records:
        yield encode_record(record)
    yield END


class LogFile(io.RawIOBase):
    """A file of which every block can be read: one that the disk does not give is zeros, and counted."""

    def __init__(self, path: Path) -> None:
        """Open it. Raises OSError, also when it is no regular file."""
        self._file = cast(io.FileIO, open_input(path, buffering=0))
        self._lost: dict[int, int] = {}  # bytes that a block should have, by its number

    @property
    def unreadable_bytes(self) -> int:
        """How much the disk did not give until now."""
        return sum(self._lost.values())

    def readable(self) -> bool:
        """It is."""
        return True

    def seekable(self) -> bool:
        """It is."""
        return True

    def fileno(self) -> int:
        """The file's."""
        return self._file.fileno()

    def seek(self, offset: int, whence: int = os.SEEK_SET, /) -> int:
        """As of any file."""
        return self._file.seek(offset, whence)

    def readinto(self, buffer: Any, /) -> int | None:
        """As of any file. What cannot be read together is read block by block. Raises OSError where nothing tells the
        file's length."""
        at = self._file.tell()
        with contextlib.suppress(OSError):
            return self._file.readinto(buffer)
        size = os.fstat(self.fileno()).st_size
        block = memoryview(buffer)[:_BLOCK - at % _BLOCK]
        try:
            self._file.seek(at)
            return self._file.readinto(block)
        except OSError:
            if not size:
                raise
            lost = max(0, min(len(block), size - at))
            block[:lost] = bytes(lost)
            number = at // _BLOCK
            self._lost[number] = max(0, min(_BLOCK, size - number * _BLOCK))
            self._file.seek(at + lost)
            return lost

    def close(self) -> None:
        """Close the file. May be called twice."""
        self._file.close()
        super().close()


class LogReader:
    """A log opened for reading. Iterating gives its records from the first one on, and `losses` what was left out."""

    def __init__(self, path: Path, rig: Rig | None = None) -> None:
        """Open the file and read its header; `rig` takes the place of a header that cannot be read.

        Raises RecordingError: no such file, not a log, another version, or a header damaged in both copies.
        """
        self.path = path
        self.losses = Losses()
        try:
            with contextlib.ExitStack() as stack:
                self._raw = stack.enter_context(contextlib.closing(LogFile(path)))
                self._file = io.BufferedReader(self._raw, _BUFFER)
                header = _read_header(self._file)
                if header is None and rig is None:
                    raise RecordingError(_why_no_header(self._file, path, self._raw.unreadable_bytes))
                stack.pop_all()
        except OSError as exc:
            raise RecordingError(f"{path}: cannot be read ({exc.strerror}); name a raw log that you may read.") from exc
        try:
            self._records_at, self._header_losses = (0, 0) if header is None else (header.end, header.damaged_bytes)
            self.about = {} if header is None else header.about
            self._marks_end = self.about.pop(_MARKS_END, False) is True
            document = self.about.pop("rig", None)
            self.rig = rig if header is None and rig is not None else parse_rig(
                json.dumps(document).encode(), f"{path}: the rig in its header")
        except BaseException:
            self._file.close()
            raise

    @property
    def torn_bytes(self) -> int:
        """At the end, of the record that was being written when the program died."""
        return self.losses.torn_bytes

    def __iter__(self) -> Iterator[Record]:
        """All records in the order written, without damaged ones and those of unknown kinds.

        Raises RecordingError at the end when there is damage and not one record was sound.
        """
        for kind, node_id, t_master_ns, data in self._sound():
            if kind in _KINDS:
                yield Record(RecordKind(kind), node_id, t_master_ns, data)
            elif kind != RecordKind.END:
                self.losses.unknown_records += 1

    def sound_records(self) -> Iterator[bytes]:
        """The bytes of every sound record, of whatever kind but `END`. Raises RecordingError as iterating does."""
        for kind, node_id, t_master_ns, data in self._sound():
            if kind != RecordKind.END:
                yield _encode(kind, node_id, t_master_ns, data)

    def _sound(self) -> Iterator[tuple[int, int, int, bytes]]:
        """Kind, node, time and data of every sound record; `losses` counts what lies between them."""
        self.losses = losses = Losses(header_bytes=self._header_losses)
        sound, losses.end_missing = 0, self._marks_end
        try:
            for found in self._scan(losses):
                sound += 1
                losses.end_missing &= found[0] != RecordKind.END
                yield found
        except OSError as exc:
            raise RecordingError(f"{self.path}: cannot be read on ({exc.strerror}). Is its disk still there?") from exc
        losses.unreadable_bytes = self._raw.unreadable_bytes
        if losses.places and not sound:
            raise RecordingError(f"{self.path}: no record in it can be read; {losses.damage}.")
        if losses.damage:
            note_loss(str(self.path), f"{self.path}: {losses.damage}.")

    def _scan(self, losses: Losses) -> Iterator[tuple[int, int, int, bytes]]:
        """The sound records in their order; `losses` counts what lies between them. Raises OSError."""
        file, at = self._file, self._records_at
        file.seek(at)
        while head := file.read(_RECORD.size):
            found = _read_record(file, head)
            if found is not None:
                at += _RECORD.size + len(found[3]) + _CRC.size
                yield found
                continue
            size = file.seek(0, 2) - at
            following = _next_sound(file, at + 1)
            if following is None and _is_torn(head, size):
                losses.torn_bytes = size
                break
            losses.places += 1
            losses.skipped_bytes += size if following is None else following - at
            if following is None:
                break
            at = file.seek(following)

    def close(self) -> None:
        """Close the file. May be called twice."""
        self._file.close()


def _read_record(file: BinaryIO, head: bytes) -> tuple[int, int, int, bytes] | None:
    """Kind, node, time and data of the record that begins with `head`; None when it is damaged or torn."""
    if len(head) < _RECORD.size:
        return None
    kind, node_id, t_master_ns, length = _RECORD.unpack(head)
    if kind == 0 or length > PAYLOAD_MAX:
        return None
    body = file.read(length + _CRC.size)
    data = body[:length]
    if len(body) < length + _CRC.size or _CRC.pack(zlib.crc32(data, zlib.crc32(head))) != body[length:]:
        return None
    return kind, node_id, t_master_ns, data


def _is_torn(head: bytes, size: int) -> bool:
    """Whether the last `size` bytes of a file can be a record of which the end is missing."""
    if len(head) < _RECORD.size:
        return head[0] != 0
    kind, _, _, length = _RECORD.unpack(head)
    return kind != 0 and length <= PAYLOAD_MAX and size < _RECORD.size + length + _CRC.size


def _next_sound(file: BinaryIO, start: int) -> int | None:
    """Where the first sound record at or behind byte `start` begins; None when there is none."""
    step, longest = _BLOCK, _RECORD.size + PAYLOAD_MAX + _CRC.size
    while True:
        file.seek(start)
        block = file.read(step + longest)
        last = len(block) < step + longest
        found = _first_sound(block, len(block) if last else step)
        if found is not None:
            return start + found
        if last:
            return None
        start += step
        step = min(2 * step, _SCAN_MAX)


def _first_sound(block: bytes, limit: int) -> int | None:
    """Where the first sound record that begins in the first `limit` bytes of `block` does."""
    count = min(limit, len(block) - _RECORD.size - _CRC.size + 1)
    if count <= 0:
        return None
    values = np.frombuffer(block, np.uint8)
    length_at = _RECORD.size - _LENGTH.size  # little-endian: a length of at most 65535 ends with two zeros
    possible = (values[:count] != 0) & (values[length_at + 2:][:count] == 0) & (values[length_at + 3:][:count] == 0)
    view = memoryview(block)
    for begin in np.flatnonzero(possible).tolist():
        end = begin + _RECORD.size + _LENGTH.unpack_from(block, begin + length_at)[0]
        if end + _CRC.size <= len(block) and _CRC.unpack_from(block, end)[0] == zlib.crc32(view[begin:end]):
            return int(begin)
    return None


@dataclass(frozen=True, slots=True)
class _Header:
    about: dict[str, Any]
    end: int  # where the records begin
    damaged_bytes: int  # of the other copy, or of what stands before both


def _read_header(file: BinaryIO) -> _Header | None:
    """The header by its first copy that is sound; None when there is none."""
    first = _parse_header(file, 0)
    if first is not None:
        version, size, about = first
        if version == 1:
            return _Header(about, size, 0)
        return _Header(about, 2 * size, 0 if _parse_header(file, size) is not None else size)
    file.seek(0)
    start = file.read(2 * HEADER_MAX)
    at = start.find(MAGIC, 1)
    while at > 0:
        found = _parse_header(file, at)
        if found is not None and found[0] != 1:
            return _Header(found[2], at + found[1], at)
        at = start.find(MAGIC, at + 1)
    return None


def _parse_header(file: BinaryIO, at: int) -> tuple[int, int, dict[str, Any]] | None:
    """Version, length and document of the copy of the header at byte `at`; None when it is damaged."""
    file.seek(at)
    head = file.read(_PREFIX.size)
    if len(head) < _PREFIX.size:
        return None
    magic, version, _, length = _PREFIX.unpack(head)
    if magic != MAGIC or version not in (1, VERSION) or length > HEADER_MAX:
        return None
    document, crc = file.read(length), file.read(_CRC.size)
    covered = document if version == 1 else head + document
    if len(document) != length or crc != _CRC.pack(zlib.crc32(covered)):
        return None
    try:
        about = decode_json(document, "the header", RecordingError)
    except RecordingError:
        return None
    return (version, len(head) + length + _CRC.size, about) if isinstance(about, dict) else None


def _why_no_header(file: BinaryIO, path: Path, unreadable_bytes: int) -> str:
    if unreadable_bytes:
        return (f"{path}: the disk does not give {unreadable_bytes} bytes of its header. `rhot recover LOG --rig FILE "
                "--out CLEAN` reads the rest with the rig that it was recorded with.")
    file.seek(0)
    head = file.read(_PREFIX.size)
    if not head:
        return f"{path}: the file is empty, so there is nothing to read or to recover; choose another log."
    if not head.startswith(MAGIC):
        return (f"{path}: this is not a raw log of this program. If it was one, `rhot recover LOG --rig FILE --out "
                "CLEAN` may still read it.")
    version = _PREFIX.unpack(head)[1] if len(head) == _PREFIX.size else VERSION
    if version not in (1, VERSION):
        return (f"{path}: version {version} of the raw log is not supported; this program reads versions 1 and "
                f"{VERSION}.")
    return (f"{path}: the log's header is damaged or incomplete. `rhot recover LOG --rig FILE --out CLEAN` reads it "
            "with the rig that it was recorded with.")
