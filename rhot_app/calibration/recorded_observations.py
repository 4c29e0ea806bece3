"""Raw logs as the tables that calibrations work on: every frame through the same door as live ones.

    rig, table = read_observations(Path("wave.log"))          # each camera's own frames, at their own times
    rig, instants = read_instants(Path("wave.log"), my_rig)   # all cameras at common instants, markers located

A log holds the rig it was recorded with; give another one to calibrate that. What a frame must be to be admitted
(marker set, image size, clock) is the door's business, and the errors say what it refused.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from rhot_app.calibration.observations import InstantTable, ObservationCollector, ObservationTable
from rhot_app.errors import RecordingError
from rhot_app.project import Rig
from rhot_app.recording.raw_log import LogReader
from rhot_app.sources.replay import LogValidator
from rhot_app.state import HandState, Knowledge
from rhot_app.tracking.pairing import Paired, Pairing
from rhot_app.tracking.scene import make_tracker
from rhot_app.tracking.tracker import CameraObservations


def read_observations(path: Path, rig: Rig | None = None) -> tuple[Rig, ObservationTable]:
    """All frames of a log, and the rig: `rig`, or the one the log was recorded with.

    Raises RecordingError when the file is no log, is broken, or holds no frame of the rig's nodes.
    """
    with contextlib.closing(LogReader(path)) as reader:
        rig = rig or reader.rig
        collector = ObservationCollector(tuple(node.name for node in rig.nodes), rig.markers.ids)
        for frame in _frames(reader, rig):
            collector.add(frame)
    return rig, collector.table()


def read_instants(path: Path, rig: Rig | None = None) -> tuple[Rig, InstantTable]:
    """A log as the tracker sees it: one row per state. Errors as of `read_observations`; RecordingError too when no
    instant was seen by two cameras."""
    found: list[tuple[Paired, HandState]] = []
    with contextlib.closing(LogReader(path)) as reader:
        rig = rig or reader.rig
        tracker, pairing = make_tracker(rig), Pairing(len(rig.nodes), len(rig.markers.ids))
        for frame in _frames(reader, rig):
            tracker.ingest(frame)
            pairing.ingest(frame)
            paired, state = pairing.due(), tracker.solve()
            if paired is not None and state is not None:
                found.append((paired, state))
    if not found:
        raise RecordingError(f"{path}: the cameras' frames nowhere overlap in time, so nothing can be located. Record "
                             "again while all nodes stream.")
    return rig, _instants(rig, found)


def _frames(reader: LogReader, rig: Rig) -> Iterator[CameraObservations]:
    """Every admitted frame. Raises RecordingError at the end when there was none."""
    door = LogValidator(rig)
    count = 0
    for record in reader:
        frame = door.feed(record)
        if isinstance(frame, CameraObservations):
            count += 1
            yield frame
    if not count:
        raise RecordingError(f"{reader.path}: no frame in it can be used with the rig {rig.name!r} "
                             f"({why_none(door)}). Give the rig that the log was recorded with, or record again.")


def why_none(door: LogValidator) -> str:
    """What became of a log's datagrams, in words."""
    reasons = [f"{count} of {link.node.name} refused: {reason}" for link in door.links
               for reason, count in link.door.dropped.items()]
    if door.unknown_nodes:
        reasons.append(f"{door.unknown_nodes} of nodes that the rig does not have")
    return ", ".join(reasons) or "it holds no observations"


def _instants(rig: Rig, found: list[tuple[Paired, HandState]]) -> InstantTable:
    paired, states = [pair for pair, _ in found], [state for _, state in found]
    positions = np.array([state.marker_raw_positions for state in states])
    covariances = np.array([state.marker_covariances for state in states])
    covariances[np.isnan(positions[..., 0])] = np.nan  # the tracker also tells where hidden markers should be
    return InstantTable(
        marker_ids=rig.markers.ids, camera_names=tuple(node.name for node in rig.nodes),
        t_ns=np.array([pair.t_ns for pair in paired], dtype=np.int64),
        pixels=np.array([pair.pixels for pair in paired]),
        pixel_covariances=np.array([pair.covariances for pair in paired]),
        positions=positions, position_covariances=covariances,
        measured=np.array([state.marker_knowledge for state in states]) == Knowledge.MEASURED,
        errors_px=np.array([state.epipolar_error_px for state in states]))
