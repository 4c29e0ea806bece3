"""The raw log's bytes: every datagram and clock exchange as it came, with its time. docs/log.md, byte by byte.

Reading and writing of files; no sockets, no threads.
"""

from __future__ import annotations

import enum
import json
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import msgspec

from rhot_app.errors import RecordingError
from rhot_app.project import Rig, parse_rig

MAGIC = b"RHOTLOG\0"
VERSION = 1
HEADER_MAX = 16 << 20
PAYLOAD_MAX = 65535  # the longest UDP datagram

_PREFIX = struct.Struct("<8sHHI")
_RECORD = struct.Struct("<BIqI")
_CRC = struct.Struct("<I")


class RecordKind(enum.IntEnum):
    """What a record holds."""

    DATAGRAM = 1  # received on a node's data port
    CLOCK_REQUEST = 2  # sent to a node, as sent
    CLOCK_REPLY = 3  # received on the command port
    START = 4  # sent to all nodes, as sent
    STOP = 5  # sent to all nodes, as sent
    GAP = 6  # u32: records that could not be kept because the disk was too slow


_KINDS = frozenset(int(kind) for kind in RecordKind)


@dataclass(frozen=True, slots=True)
class Record:
    """One record. `t_master_ns`: kernel receive time, or the time of sending; `node_id` 0: all nodes."""

    kind: RecordKind
    node_id: int
    t_master_ns: int
    data: bytes


def encode_header(rig: Rig, about: dict[str, Any]) -> bytes:
    """The bytes that begin a log: magic, version and a JSON document with the rig and free facts `about` it."""
    document = json.dumps({**about, "rig": json.loads(msgspec.json.encode(rig))}).encode()
    return _PREFIX.pack(MAGIC, VERSION, 0, len(document)) + document + _CRC.pack(zlib.crc32(document))


def encode_record(record: Record) -> bytes:
    """The bytes of one record."""
    body = _RECORD.pack(record.kind, record.node_id, record.t_master_ns, len(record.data)) + record.data
    return body + _CRC.pack(zlib.crc32(body))


class LogReader:
    """A log opened for reading. Iterating gives its records; a torn last one ends the iteration and is reported."""

    def __init__(self, path: Path) -> None:
        """Open and check the header. Raises RecordingError (no such file, not a log, other version, broken header)."""
        self.path = path
        self.torn_bytes = 0  # at the end, of a record that was being written when the program died
        try:
            self._file: BinaryIO = path.open("rb")
        except OSError as exc:
            raise RecordingError(f"{path}: cannot be read ({exc.strerror}).") from exc
        try:
            self.about = self._read_header()
            self.rig = parse_rig(json.dumps(self.about.pop("rig", None)).encode(), f"{path}: the rig in its header")
        except BaseException:
            self._file.close()
            raise

    def _read_header(self) -> dict[str, Any]:
        try:
            magic, version, _, length = _PREFIX.unpack(self._file.read(_PREFIX.size))
        except struct.error:
            magic, version, length = b"", 0, 0
        if magic != MAGIC:
            raise RecordingError(f"{self.path}: this is not a raw log of this program.")
        if version != VERSION:
            raise RecordingError(f"{self.path}: version {version} of the raw log is not supported; "
                                 f"this program reads version {VERSION}.")
        document, crc = self._file.read(min(length, HEADER_MAX)), self._file.read(_CRC.size)
        if len(document) != length or crc != _CRC.pack(zlib.crc32(document)):
            raise RecordingError(f"{self.path}: the log's header is broken or incomplete; nothing can be replayed.")
        about = json.loads(document)
        if not isinstance(about, dict):
            raise RecordingError(f"{self.path}: the log's header is not an object.")
        return about

    def __iter__(self) -> Iterator[Record]:
        """All records in the order written. Raises RecordingError where one is broken in the middle of the file."""
        while True:
            offset = self._file.tell()
            head = self._file.read(_RECORD.size)
            if not head:
                return
            body_length = _RECORD.unpack(head)[3] + _CRC.size if len(head) == _RECORD.size else 0
            body = self._file.read(min(body_length, PAYLOAD_MAX + _CRC.size))
            if len(head) == _RECORD.size and body_length <= PAYLOAD_MAX + _CRC.size and len(body) == body_length:
                record = self._check(head, body, offset)
                if record is not None:
                    yield record
                    continue
            self.torn_bytes = self._end() - offset
            return

    def _check(self, head: bytes, body: bytes, offset: int) -> Record | None:
        """The record, or None when it is the torn end of the file."""
        kind, node_id, t_master_ns, length = _RECORD.unpack(head)
        data = body[:length]
        sound = _CRC.pack(zlib.crc32(data, zlib.crc32(head))) == body[length:]
        if sound and kind in _KINDS:
            return Record(RecordKind(kind), node_id, t_master_ns, data)
        if self._file.tell() == self._end():
            return None
        raise RecordingError(f"{self.path}: the record at byte {offset} is broken; what follows cannot be trusted.")

    def _end(self) -> int:
        return self.path.stat().st_size

    def close(self) -> None:
        """Close the file. May be called twice."""
        self._file.close()
