"""Raw logs made of frames, as a master would have recorded them from nodes whose clocks run as the master's."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from rhot_app.project import Rig
from rhot_app.recording.raw_log import Record, RecordKind, encode_header, encode_record
from rhot_app.tracking.tracker import CameraObservations
from rhot_node.wire.codec import encode
from rhot_node.wire.messages import (
    ClockReply,
    ClockRequest,
    MarkerFlag,
    MarkerObservation,
    NodeState,
    Observations,
    Start,
    StartEntry,
)

SESSION = 7
_EXCHANGE_NS = 100_000_000
_ROUND_TRIP_NS = 200_000


def write_log(path: Path, rig: Rig, frames: Sequence[CameraObservations]) -> Path:
    """Write `frames`, in the order of their arrival, with clock exchanges every tenth of a second."""
    first_ns = frames[0].t_receive_ns - 10 * _EXCHANGE_NS
    records = [_start(rig, first_ns)]
    due_ns, exchange = first_ns, 0
    for sequence, frame in enumerate(frames):
        while frame.t_receive_ns >= due_ns:
            exchange += 1
            records += [record for node in rig.nodes for record in _exchange(node.node_id, exchange, due_ns)]
            due_ns += _EXCHANGE_NS
        node_id = rig.nodes[frame.camera].node_id
        records.append(Record(RecordKind.DATAGRAM, node_id, frame.t_receive_ns,
                              encode(_message(rig, frame, sequence))))
    path.write_bytes(encode_header(rig, {}) + b"".join(encode_record(record) for record in records))
    return path


def _start(rig: Rig, t_ns: int) -> Record:
    entries = tuple(StartEntry(node.node_id, 5000 + k, 0) for k, node in enumerate(rig.nodes))
    return Record(RecordKind.START, 0, t_ns, encode(Start(SESSION, 1, entries)))


def _exchange(node_id: int, sequence: int, t1_ns: int) -> tuple[Record, Record]:
    middle_ns, t4_ns = t1_ns + _ROUND_TRIP_NS // 2, t1_ns + _ROUND_TRIP_NS
    request = ClockRequest(node_id, SESSION, sequence, t1_ns)
    reply = ClockReply(node_id, SESSION, sequence, t1_ns, middle_ns, middle_ns, 1, NodeState.STREAMING)
    return (Record(RecordKind.CLOCK_REQUEST, node_id, t1_ns, encode(request)),
            Record(RecordKind.CLOCK_REPLY, node_id, t4_ns, encode(reply)))


def _message(rig: Rig, frame: CameraObservations, sequence: int) -> Observations:
    node = rig.nodes[frame.camera]
    return Observations(
        node_id=node.node_id, session=SESSION, sequence=sequence, t_frame_node_ns=frame.t_row0_master_ns,
        t_send_node_ns=frame.t_receive_ns - 500_000, processing_ns=1_000_000, exposure_ns=4_000_000,
        row_time_ns=frame.row_time_ns, width=node.intrinsics.width, height=node.intrinsics.height,
        frame_number=sequence, marker_checksum=rig.markers.checksum,
        markers=tuple(_marker(frame, k) for k in range(len(frame.pixels))))


def _marker(frame: CameraObservations, index: int) -> MarkerObservation:
    if frame.flags[index] & MarkerFlag.LOST:
        return MarkerObservation(index, math.nan, math.nan, 0.0, 0.0, 0.0, 0.0, 0.0, MarkerFlag.LOST)
    (x, y), covariance = frame.pixels[index].tolist(), frame.covariances[index].tolist()
    return MarkerObservation(index, x, y, float(frame.diameters[index]), covariance[0][0], covariance[0][1],
                             covariance[1][1], float(frame.qualities[index]), MarkerFlag(int(frame.flags[index])))
