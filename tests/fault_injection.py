"""Misfortunes of a recorded log: cameras that see nothing, hidden markers, names that are mixed up, a late start.

Each is a change of records, so that one take serves for many trials. Only what nodes said is changed, never the truth.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rhot_app.recording.raw_log import Record, RecordKind
from rhot_app.simulator.film.node_log import T0_MASTER_NS, lost
from rhot_node.wire.codec import decode, encode
from rhot_node.wire.messages import ClockReply, ClockRequest, MarkerObservation, Observations

Array = NDArray[np.float64]
Change = Callable[[float, int, Sequence[MarkerObservation]], Sequence[MarkerObservation]]
"""Given the scene time of arrival, s, the node's id and what it saw, what it shall have seen instead."""

EPISODE_S = (0.1, 0.8)
"""How long a marker stays hidden at a time, unless told otherwise: evenly between these."""


def changed(records: Sequence[Record], change: Change) -> list[Record]:
    """The records with other markers in their datagrams."""
    return [_changed(record, change) if record.kind is RecordKind.DATAGRAM else record for record in records]


def arrival_s(record: Record) -> float:
    """Scene time at which a record was received or sent."""
    return 1e-9 * (record.t_master_ns - T0_MASTER_NS)


def blind(node_id: int, start_s: float, end_s: float) -> Change:
    """A camera that is covered: its node finds no marker."""
    def change(t_s: float, node: int, seen: Sequence[MarkerObservation]) -> Sequence[MarkerObservation]:
        return [lost(marker.index) for marker in seen] if node == node_id and start_s <= t_s < end_s else seen
    return change


def silent(records: Sequence[Record], node_id: int, start_s: float, end_s: float) -> list[Record]:
    """The records without one node's datagrams of that time."""
    return [record for record in records if record.kind is not RecordKind.DATAGRAM or record.node_id != node_id
            or not start_s <= arrival_s(record) < end_s]


def begun_at(records: Sequence[Record], start_s: float) -> list[Record]:
    """The records without any datagrams before that time: clocks are known, the hand is not."""
    return [record for record in records if record.kind is not RecordKind.DATAGRAM or arrival_s(record) >= start_s]


def hidden(share: float, seconds: float, nodes: Sequence[int], markers: int, seed: int, *, together: bool,
           lasting_s: tuple[float, float] = EPISODE_S) -> Change:
    """Every marker is hidden for this share of the time, at random, for as long at a time as `episodes` says;
    `together`: from all cameras at once, otherwise from each at its own times."""
    rng = np.random.default_rng([seed, 0x41D])
    shared = [episodes(share, seconds, rng, lasting_s) for _ in range(markers)]
    spells = {node: shared if together else [episodes(share, seconds, rng, lasting_s) for _ in range(markers)]
              for node in nodes}

    def change(t_s: float, node: int, seen: Sequence[MarkerObservation]) -> Sequence[MarkerObservation]:
        return [lost(marker.index) if _within(spells[node][marker.index], t_s) else marker for marker in seen]
    return change


def mixed_up(pair: tuple[int, int], share: float, seconds: float, nodes: Sequence[int], seed: int) -> Change:
    """Two markers of one colour: for a share of the time a node takes each for the other, at its own times."""
    rng = np.random.default_rng([seed, 0x3E0])
    spells = {node: episodes(share, seconds, rng) for node in nodes}

    def change(t_s: float, node: int, seen: Sequence[MarkerObservation]) -> Sequence[MarkerObservation]:
        if not _within(spells[node], t_s):
            return seen
        other = {pair[0]: pair[1], pair[1]: pair[0]}
        return sorted((_named(marker, other.get(marker.index, marker.index)) for marker in seen),
                      key=lambda marker: marker.index)
    return change


def episodes(share: float, seconds: float, rng: np.random.Generator,
             lasting_s: tuple[float, float] = EPISODE_S) -> Array:
    """(E, 2) begin and end, s: episodes that fill about this share of the time, each `lasting_s`, evenly between the
    two."""
    mean = 0.5 * sum(lasting_s)
    spells: list[tuple[float, float]] = []
    t = rng.exponential(mean / share) * (1.0 - share)
    while t < seconds:
        length = rng.uniform(*lasting_s)
        spells.append((t, t + length))
        t += length + rng.exponential(mean * (1.0 - share) / share)
    return np.array(spells).reshape(-1, 2)


def prolonged(records: Sequence[Record], times: int) -> Iterator[Record]:
    """The log again and again, as if it went on: for what only shows after many minutes. The hand leaps at each seam.

    The nodes' clocks keep their rates, to the few microseconds that the log's own exchanges tell them.
    """
    span_ns = records[-1].t_master_ns - records[0].t_master_ns + 1
    rates = _clock_rates(records)
    frames = {node: 1 + max(_observations(record).sequence for record in records
                            if record.kind is RecordKind.DATAGRAM and record.node_id == node) for node in rates}
    asked = sum(record.kind is RecordKind.CLOCK_REQUEST for record in records)
    for lap in range(times):
        for record in records:
            if lap == 0 or record.kind is not RecordKind.START:
                yield _later(record, lap * span_ns, round(lap * span_ns * rates.get(record.node_id, 1.0)),
                             lap * frames.get(record.node_id, 0), lap * asked)


def _changed(record: Record, change: Change) -> Record:
    message = _observations(record)
    markers = change(arrival_s(record), record.node_id, message.markers)
    return record if markers is message.markers else replace(
        record, data=encode(replace(message, markers=tuple(markers))))


def _observations(record: Record) -> Observations:
    message = decode(record.data)
    assert isinstance(message, Observations)
    return message


def _named(marker: MarkerObservation, index: int) -> MarkerObservation:
    return MarkerObservation(index, marker.x, marker.y, marker.diameter, marker.cov_xx, marker.cov_xy, marker.cov_yy,
                             marker.quality, marker.flags)


def _within(spells: Array, t_s: float) -> bool:
    """Whether a time is inside one of the episodes (E, 2)."""
    if not len(spells):
        return False
    last = int(np.searchsorted(spells[:, 0], t_s, side="right")) - 1
    return last >= 0 and t_s < float(spells[last, 1])


def _clock_rates(records: Sequence[Record]) -> dict[int, float]:
    """Nanoseconds of each node's clock per master's, from its first and its last answer."""
    replies: dict[int, list[ClockReply]] = {}
    for record in records:
        if record.kind is RecordKind.CLOCK_REPLY:
            message = decode(record.data)
            assert isinstance(message, ClockReply)
            replies.setdefault(record.node_id, []).append(message)
    return {node: (echoes[-1].t2_node_ns - echoes[0].t2_node_ns) / (echoes[-1].t1_master_ns - echoes[0].t1_master_ns)
            for node, echoes in replies.items()}


def _later(record: Record, master_ns: int, node_ns: int, frames: int, requests: int) -> Record:
    """The record as if everything in it had happened so much later."""
    message = decode(record.data)
    match message:
        case Observations():
            message = replace(message, sequence=message.sequence + frames, frame_number=message.frame_number + frames,
                              t_frame_node_ns=message.t_frame_node_ns + node_ns,
                              t_send_node_ns=message.t_send_node_ns + node_ns)
        case ClockRequest():
            message = replace(message, sequence=message.sequence + requests,
                              t1_master_ns=message.t1_master_ns + master_ns)
        case ClockReply():
            message = replace(message, sequence=message.sequence + requests,
                              t1_master_ns=message.t1_master_ns + master_ns,
                              t2_node_ns=message.t2_node_ns + node_ns, t3_node_ns=message.t3_node_ns + node_ns)
    return replace(record, t_master_ns=record.t_master_ns + master_ns, data=encode(message))
