"""A raw log as an engine would have written it of simulated nodes: session, clock exchanges, datagrams, their delays.

It goes through the same door as a real one. The nodes' clocks disagree as the scene says; nothing in the log tells
the truth about them.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from rhot_app.project import Rig
from rhot_app.recording.raw_log import Record, RecordKind, begun_now, encode_log
from rhot_app.simulator.film.film import Report
from rhot_app.simulator.film.shot import Shot, make_renderer
from rhot_app.simulator.film.truth import FrameTruth
from rhot_app.simulator.render.painter import PoseSource
from rhot_app.simulator.scene.scene import Scene, node_settings
from rhot_node.capture.camera import available_delay_ns
from rhot_node.clock import NodeClock
from rhot_node.detect.image import from_i420
from rhot_node.detectors import make_detector
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

SESSION: Final = 1
T0_MASTER_NS: Final = 1_000_000_000_000
"""Master time of scene time 0."""

_ECHO_S, _ECHO_LEAD_S = 0.1, 3.0  # clock exchanges: how often, and how long before the first frame they begin
_ANSWER_NS = 30_000  # a node answers after this long
_PROCESSING_NS = 4_000_000


@dataclass(frozen=True, slots=True)
class Network:
    """One way takes `least_s` and, beyond it, an exponential time of mean `mean_s`; `loss`: probability that a datagram
    of observations never arrives."""

    least_s: float = 120e-6
    mean_s: float = 60e-6
    loss: float = 0.0


CABLE: Final = Network()


def lost(index: int) -> MarkerObservation:
    """A marker that a node does not find."""
    return MarkerObservation(index, math.nan, math.nan, 0.0, 0.0, 0.0, 0.0, 0.0, MarkerFlag.LOST)


class NodeSender:
    """What one node says: its part of the log, deterministic by `rng`."""

    def __init__(self, scene: Scene, rig: Rig, index: int, rng: np.random.Generator, network: Network) -> None:
        clock = scene.clocks[index]
        self._scene, self._rig, self._node = scene, rig, rig.nodes[index]
        self._rng, self._network = rng, network
        self._clock = NodeClock(round(1e9 * clock.offset_s), clock.drift_ppm, T0_MASTER_NS)

    def exchanges(self, end_s: float) -> Iterator[Record]:
        """Clock exchanges from before scene time 0 until after `end_s`."""
        for sequence, t_s in enumerate(np.arange(-_ECHO_LEAD_S, end_s + _ECHO_S, _ECHO_S)):
            yield from self._exchange(sequence, T0_MASTER_NS + round(1e9 * t_s))

    def datagram(self, number: int, t_ns: int, markers: Sequence[MarkerObservation]) -> Record | None:
        """Frame `number`, whose row 0 was exposed at scene time `t_ns`; None when it is lost on its way."""
        scene, lens = self._scene, self._node.intrinsics
        t_master_ns = T0_MASTER_NS + t_ns
        ready_ns = t_master_ns + available_delay_ns(scene.exposure_ns, scene.row_time_ns, lens.height)
        sent_ns = ready_ns + _PROCESSING_NS
        message = Observations(
            node_id=self._node.node_id, session=SESSION, sequence=number,
            t_frame_node_ns=self._clock.from_host_ns(t_master_ns), t_send_node_ns=self._clock.from_host_ns(sent_ns),
            processing_ns=_PROCESSING_NS, exposure_ns=scene.exposure_ns, row_time_ns=scene.row_time_ns,
            width=lens.width, height=lens.height, frame_number=number, marker_checksum=self._rig.markers.checksum,
            markers=tuple(markers))
        arrival_ns = sent_ns + self._way_ns()
        if self._network.loss > 0.0 and self._rng.random() < self._network.loss:
            return None
        return Record(RecordKind.DATAGRAM, self._node.node_id, arrival_ns, encode(message))

    def _exchange(self, sequence: int, t1_ns: int) -> tuple[Record, Record]:
        t2_ns = t1_ns + self._way_ns()
        t3_ns = t2_ns + _ANSWER_NS
        node_id = self._node.node_id
        request = ClockRequest(node_id, SESSION, sequence, t1_ns)
        reply = ClockReply(node_id, SESSION, sequence, t1_ns, self._clock.from_host_ns(t2_ns),
                           self._clock.from_host_ns(t3_ns), 1, NodeState.STREAMING)
        return (Record(RecordKind.CLOCK_REQUEST, node_id, t1_ns, encode(request)),
                Record(RecordKind.CLOCK_REPLY, node_id, t3_ns + self._way_ns(), encode(reply)))

    def _way_ns(self) -> int:
        return round(1e9 * (self._network.least_s + self._rng.exponential(self._network.mean_s)))


def write_node_log(path: Path, rig: Rig, about: dict[str, Any], said: Iterable[Record]) -> None:
    """Write what all nodes said, in the order of arrival, as a raw log that begins with the start of a session."""
    entries = tuple(StartEntry(node.node_id, 1, 0) for node in rig.nodes)
    start = Record(RecordKind.START, 0, T0_MASTER_NS - round(1e9 * _ECHO_LEAD_S) - 1,
                   encode(Start(SESSION, 0, entries)))
    records = sorted([*said, start], key=lambda record: record.t_master_ns)
    with path.open("wb") as file:
        file.writelines(encode_log(rig, begun_now(T0_MASTER_NS) | about, records))


Stream = tuple[list[Record], FrameTruth]
"""What one node says of a shot, and what was true of its frames."""


@dataclass(frozen=True, slots=True)
class Sending:
    """How a node sends: to a rig, over a network; `seed` of the delays, beside the scene's."""

    rig: Rig
    network: Network = CABLE
    seed: int = 0x7A4E

    def said(self, shot: Shot, index: int, seen: Sequence[Sequence[MarkerObservation]]) -> list[Record]:
        """One node's clock exchanges, and a datagram for every frame that is not lost on its way."""
        rng = np.random.default_rng([shot.scene.seed, index, self.seed])
        sender = NodeSender(shot.scene, self.rig, index, rng, self.network)
        times_ns = shot.scene.frame_times_ns(index, shot.seconds)
        sent = [sender.datagram(number, t_ns, markers) for number, (t_ns, markers) in
                enumerate(zip(times_ns, seen, strict=True))]
        return [*sender.exchanges(1e-9 * times_ns[-1]), *(record for record in sent if record is not None)]


def detected(sending: Sending, source: PoseSource | None, shot: Shot, index: int, report: Report) -> Stream:
    """One camera's pictures of the shot, or of another `source` in its place, through the node's detector."""
    scene, preset = shot.scene, shot.scene.preset
    detector, renderer = make_detector(node_settings(scene, index)), make_renderer(shot, index)
    times_ns = scene.frame_times_ns(index, shot.seconds)
    seen, visible = [], []
    for number, t_ns in enumerate(times_ns):
        frame, fractions = renderer.render(source or shot.scene_object.source, 1e-9 * t_ns, number)
        seen.append(detector.detect(from_i420(frame, preset.width, preset.height)))
        visible.append(fractions.copy())
        report(number)
    return sending.said(shot, index, seen), FrameTruth(1e-9 * np.array(times_ns), np.array(visible))
