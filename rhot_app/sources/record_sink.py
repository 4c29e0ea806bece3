"""What a recorder must offer to the sources: they hand it every datagram, as it came or went."""

from __future__ import annotations

from typing import Protocol

from rhot_app.recording.raw_log import RecordKind


class RecordSink(Protocol):
    """Takes records. Must return at once and never raise: it is called between a sample and its state."""

    def put(self, kind: RecordKind, node_id: int, t_master_ns: int, data: bytes) -> None:
        """Take one datagram with its kernel receive time, or the time of sending."""
        ...
