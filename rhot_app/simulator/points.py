"""The twin's ideal detector: what nodes would send if they found every marker, as a raw log, without any picture.

Each marker is where it was at its own row's time, projected through the lens, with Gaussian noise; now and then one is
lost. Nothing hides anything, and colours do not matter: the way to observe marker sets that no camera could tell apart.
The log holds what a real one does - session, clock exchanges of clocks that disagree, datagrams with their delays - so
that it goes through the same door.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from rhot_app.errors import SimulatorError
from rhot_app.project import Rig, load_rig
from rhot_app.recording.raw_log import Record, RecordKind, encode_header, encode_record
from rhot_app.simulator.film import TRUTH_NAME, Progress, new_folder
from rhot_app.simulator.sheet import Sheet
from rhot_app.simulator.shot import RIG_NAME, Shot, save_shot
from rhot_app.simulator.truth import FrameTruth, save_truth, true_act
from rhot_node.capture.pace import available_delay_ns
from rhot_node.clock import NodeClock
from rhot_node.wire.codec import encode
from rhot_node.wire.messages import (
    NO_FLAGS,
    ClockReply,
    ClockRequest,
    MarkerFlag,
    MarkerObservation,
    NodeState,
    Observations,
    Start,
    StartEntry,
)

Array = NDArray[np.float64]

LOG_NAME: Final = "points.log"
SESSION: Final = 1
T0_MASTER_NS: Final = 1_000_000_000_000
"""Master time of scene time 0."""

_GRID_HZ = 500.0  # of the splines through the markers' ways
_ECHO_S, _ECHO_LEAD_S = 0.1, 3.0  # clock exchanges: how often, and how long before the first frame they begin
_NETWORK_S = (120e-6, 60e-6)  # one way: at least, and mean of the exponential beyond it
_PROCESSING_NS = 4_000_000
_RADIUS_M = 8e-3  # where the marker set gives none
_MARGIN_PX = 4.0  # a marker nearer to the border is cut by it


@dataclass(frozen=True, slots=True)
class PointNoise:
    """`sigma_px`: standard deviation of a position per axis. `loss`: probability that a marker is not found."""

    sigma_px: float = 0.12
    loss: float = 0.01


def write_points(shot: Shot, folder: Path, noise: PointNoise, progress: Progress | None = None) -> None:
    """Write ``points.log``, the truth, the rig and the shot into the new `folder`, which appears when all is complete.

    Raises SimulatorError, also when what is shown wears no markers.
    """
    if isinstance(shot.act.thing, Sheet):
        raise SimulatorError(f"a {shot.act.name} wears no markers; show a hand or a marker.")
    with new_folder(folder) as work:
        save_shot(shot, work)
        rig = load_rig(work / RIG_NAME)
        streams = [_Stream(shot, rig, index, noise) for index in range(len(rig.nodes))]
        records = [record for done, stream in enumerate(streams)
                   for record in _noted(stream, done, len(streams), progress)]
        entries = tuple(StartEntry(node.node_id, 1, 0) for node in rig.nodes)
        records.append(Record(RecordKind.START, 0, T0_MASTER_NS - round(1e9 * _ECHO_LEAD_S) - 1,
                              encode(Start(SESSION, 0, entries))))
        records.sort(key=lambda record: record.t_master_ns)
        with (work / LOG_NAME).open("wb") as file:
            file.write(encode_header(rig, {"simulated": shot.act.name}))
            file.writelines(encode_record(record) for record in records)
        save_truth(work / TRUTH_NAME, true_act(shot.act, shot.seconds, tuple(stream.truth() for stream in streams)))


def _noted(stream: _Stream, done: int, count: int, progress: Progress | None) -> Iterator[Record]:
    yield from stream.records()
    if progress is not None:
        progress(done + 1, count)


class _Stream:
    """One node's part of the log."""

    def __init__(self, shot: Shot, rig: Rig, index: int, noise: PointNoise) -> None:
        self._scene, self._rig, self._node = shot.scene, rig, rig.nodes[index]
        self._camera = shot.scene.camera(index)
        self._noise = noise
        self._rng = np.random.default_rng([shot.scene.seed, index, 0x901])
        clock = shot.scene.clocks[index]
        self._clock = NodeClock(round(1e9 * clock.offset_s), clock.drift_ppm, T0_MASTER_NS)
        self._times_ns = np.array(shot.scene.frame_times_ns(index, shot.seconds))
        self._centres, self._pixels = self._observe(shot)

    def truth(self) -> FrameTruth:
        """The frames; every marker is whole, or it is not in the picture at all."""
        return FrameTruth(1e-9 * self._times_ns, np.isfinite(self._pixels[:, :, 0]).astype(np.float64))

    def records(self) -> Iterator[Record]:
        """Clock exchanges and datagrams."""
        end_s = 1e-9 * float(self._times_ns[-1])
        for sequence, t_s in enumerate(np.arange(-_ECHO_LEAD_S, end_s + _ECHO_S, _ECHO_S)):
            yield from self._exchange(sequence, T0_MASTER_NS + round(1e9 * t_s))
        for number in range(len(self._times_ns)):
            yield self._datagram(number)

    def _observe(self, shot: Shot) -> tuple[Array, Array]:
        """(F, M, 3) m and (F, M, 2) px at the time of each marker's own row; NaN where it is not in the picture."""
        assert not isinstance(shot.act.thing, Sheet)
        grid = np.arange(0.0, shot.seconds + 0.1, 1.0 / _GRID_HZ)
        ways = shot.act.thing.marker_positions(*shot.act.source.sample(grid))
        times, row_time_s = 1e-9 * self._times_ns, 1e-9 * self._scene.row_time_ns
        centres = np.full((len(times), ways.shape[1], 3), np.nan)
        pixels = np.full((len(times), ways.shape[1], 2), np.nan)
        size = np.array([self._camera.width, self._camera.height])
        for marker in range(ways.shape[1]):
            if not np.isfinite(ways[:, marker]).all():
                continue
            way, rows = CubicSpline(grid, ways[:, marker]), np.full(len(times), 0.5 * self._camera.height)
            for _ in range(4):
                centres[:, marker] = way(times + rows * row_time_s)
                pixels[:, marker] = self._camera.project(centres[:, marker])
                rows = np.clip(np.nan_to_num(pixels[:, marker, 1]), 0.0, size[1])
            seen = ((pixels[:, marker] > _MARGIN_PX) & (pixels[:, marker] < size - 1.0 - _MARGIN_PX)).all(axis=1)
            pixels[~seen, marker] = np.nan
        return centres, pixels

    def _datagram(self, number: int) -> Record:
        scene, lens = self._scene, self._node.intrinsics
        t_master_ns = T0_MASTER_NS + int(self._times_ns[number])
        ready_ns = t_master_ns + available_delay_ns(scene.exposure_ns, scene.row_time_ns, lens.height)
        sent_ns = ready_ns + _PROCESSING_NS
        message = Observations(
            node_id=self._node.node_id, session=SESSION, sequence=number,
            t_frame_node_ns=self._clock.from_host_ns(t_master_ns), t_send_node_ns=self._clock.from_host_ns(sent_ns),
            processing_ns=_PROCESSING_NS, exposure_ns=scene.exposure_ns, row_time_ns=scene.row_time_ns,
            width=lens.width, height=lens.height, frame_number=number, marker_checksum=self._rig.markers.checksum,
            markers=tuple(self._marker(number, index) for index in range(len(self._rig.markers.markers))))
        return Record(RecordKind.DATAGRAM, self._node.node_id, sent_ns + self._way_ns(), encode(message))

    def _marker(self, number: int, index: int) -> MarkerObservation:
        pixel, variance = self._pixels[number, index], self._noise.sigma_px**2
        x, y = pixel + self._rng.normal(0.0, self._noise.sigma_px, 2)
        if self._rng.random() < self._noise.loss or not np.isfinite(pixel).all():
            return MarkerObservation(index, math.nan, math.nan, 0.0, 0.0, 0.0, 0.0, 0.0, MarkerFlag.LOST)
        marker = self._rig.markers.markers[index]
        radius = 1e-3 * marker.radius_mm if marker.radius_mm else _RADIUS_M
        depth = (self._camera.camera_from_world @ np.append(self._centres[number, index], 1.0))[2]
        diameter = 2.0 * radius * self._camera.intrinsics[0] / depth
        return MarkerObservation(index, float(x), float(y), float(diameter), variance, 0.0, variance, 1.0, NO_FLAGS)

    def _exchange(self, sequence: int, t1_ns: int) -> tuple[Record, Record]:
        t2_ns = t1_ns + self._way_ns()
        t3_ns = t2_ns + 30_000
        node_id = self._node.node_id
        request = ClockRequest(node_id, SESSION, sequence, t1_ns)
        reply = ClockReply(node_id, SESSION, sequence, t1_ns, self._clock.from_host_ns(t2_ns),
                           self._clock.from_host_ns(t3_ns), 1, NodeState.STREAMING)
        return (Record(RecordKind.CLOCK_REQUEST, node_id, t1_ns, encode(request)),
                Record(RecordKind.CLOCK_REPLY, node_id, t3_ns + self._way_ns(), encode(reply)))

    def _way_ns(self) -> int:
        least, mean = _NETWORK_S
        return round(1e9 * (least + self._rng.exponential(mean)))
