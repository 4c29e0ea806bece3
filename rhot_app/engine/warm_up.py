"""Compiles and warms the tracker before the first frame comes, with synthetic frames of the rig's own cameras."""

from __future__ import annotations

import numpy as np

from rhot_app.engine.codec import encode
from rhot_app.geometry.camera import CameraModel
from rhot_app.project import Rig, RigNode
from rhot_app.tracking.tracker import CameraObservations, Tracker
from rhot_node.wire.codec import decode as decode_datagram
from rhot_node.wire.codec import encode as encode_datagram
from rhot_node.wire.marker_table import MarkerTable
from rhot_node.wire.messages import MarkerObservation, Observations

FRAMES = 24
_PERIOD_NS = 8_333_333
_DISTANCE_M = 0.6


def warm_up(tracker: Tracker, rig: Rig) -> None:
    """Let `tracker` solve a few frames of points 0.6 m along z of the rig frame, then forget them.

    Compiled code is read from numba's cache where it can be written, else it is compiled here: seconds, once.
    """
    count = len(rig.markers.markers)
    spread = np.linspace(-0.06, 0.06, count)
    points_m = np.column_stack([spread, 0.05 - np.abs(spread), np.full(count, _DISTANCE_M)])
    for frame in range(FRAMES):
        moved_m = points_m + np.array([0.002 * frame, 0.0, 0.0])
        for camera, node in enumerate(rig.nodes):
            tracker.ingest(_see(moved_m, camera, node, 10**9 + frame * _PERIOD_NS))
            state = tracker.solve()
            if state is not None:
                encode(state)
    tracker.reset()
    _read_one(rig)


def _read_one(rig: Rig) -> None:
    """A datagram's way through the wire's compiled code."""
    markers = [MarkerObservation(k, 1.0, 1.0, 1.0, 1.0, 0.0, 1.0, 1.0) for k in range(len(rig.markers.markers))]
    message = decode_datagram(encode_datagram(Observations(1, 1, 0, 0, 0, 0, 0, 0, 640, 480, 0, 0, markers)))
    assert isinstance(message, Observations)
    assert isinstance(message.markers, MarkerTable)
    message.markers.columns()


def _see(points_m: np.ndarray, camera: int, node: RigNode, t_ns: int) -> CameraObservations:
    """One exact frame of world points (M, 3) m."""
    pixels = CameraModel.from_rig(node.intrinsics, node.pose).project(points_m)
    count = len(points_m)
    return CameraObservations(
        camera=camera, t_row0_master_ns=t_ns, row_time_ns=10_000, clock_bound_s=1e-4, t_receive_ns=t_ns + 5_000_000,
        detect_s=1e-3, network_s=1e-3, pixels=pixels,
        covariances=np.tile(0.01 * np.eye(2), (count, 1, 1)), diameters=np.full(count, 16.0),
        qualities=np.ones(count), flags=np.zeros(count, np.uint16))
