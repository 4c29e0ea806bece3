"""Compiles and warms the tracker before the first frame comes, with synthetic frames of the rig's own cameras."""

from __future__ import annotations

import msgspec
import numpy as np

from rhot_app.engine.codec import encode
from rhot_app.geometry.camera import CameraModel
from rhot_app.hand.kinematics import empty_frames, forward_arrays
from rhot_app.hand.model import build_model, neutral_pose
from rhot_app.hand.places import ROLES, place_of
from rhot_app.project import OTHER_HAND, Rig, RigNode
from rhot_app.tracking.extrapolation import Extrapolator
from rhot_app.tracking.marker_model import points_on
from rhot_app.tracking.tracker import CameraObservations, Tracker
from rhot_node.wire.codec import decode as decode_datagram
from rhot_node.wire.codec import encode as encode_datagram
from rhot_node.wire.marker_table import MarkerTable
from rhot_node.wire.messages import MarkerObservation, Observations

FRAMES = 24
_PERIOD_NS = 8_333_333
_CAMERA_FROM_PALM = np.array([[0.0, 1.0, 0.0, 0.04], [-1.0, 0.0, 0.0, 0.07], [0.0, 0.0, 1.0, 0.6],
                              [0.0, 0.0, 0.0, 1.0]])
"""Fingers up, 0.6 m away."""


def warm_up(tracker: Tracker, rig: Rig) -> None:
    """Let `tracker` solve a few frames of the rig's own hand, 0.6 m before the first camera, then forget them.

    Compiled code is read from numba's cache where it can be written, else it is compiled here: seconds, once.
    """
    points_m, extrapolator = _worn_points(rig), Extrapolator(rig) if rig.tracker.kind == "estimator" else None
    for frame in range(FRAMES):
        moved_m = points_m + np.array([0.002 * frame, 0.0, 0.0])
        for camera, node in enumerate(rig.nodes):
            tracker.ingest(_see(moved_m, camera, node, 10**9 + frame * _PERIOD_NS))
            state = tracker.solve()
            if state is not None:
                encode(state)
                if extrapolator is not None:
                    extrapolator.at(state, state.t_master_ns + _PERIOD_NS)  # windows find it compiled
    tracker.reset()
    _read_one(rig)


def _worn_points(rig: Rig) -> np.ndarray:
    """(M, 3) m, world: the markers on relaxed hands before the first camera; side by side those that no hand wears."""
    markers, first = rig.markers.markers, rig.nodes[0]
    points = np.tile(_CAMERA_FROM_PALM[:3, 3], (len(markers), 1))
    points[:, 0] = np.linspace(-0.06, 0.06, len(markers))
    for hand, prefix, aside_m in ((rig.hand, "", 0.0), (rig.other_hand, OTHER_HAND, -0.15)):
        worn = [k for k, marker in enumerate(markers)
                if (marker.role or "").startswith(prefix) and (marker.role or "").removeprefix(prefix) in ROLES]
        if hand is None or not worn:
            continue
        model, pose = build_model(hand), neutral_pose(_CAMERA_FROM_PALM)
        dh = points_on(model.dh, tuple(place_of(msgspec.structs.replace(
            markers[k], role=(markers[k].role or "").removeprefix(prefix)), model) for k in worn))
        found = np.empty((len(worn), 3))
        forward_arrays(dh, pose.world_from_palm, pose.angles, empty_frames(dh), found)
        found[:, 0] += aside_m
        points[worn] = found
    world_from_camera = np.linalg.inv(CameraModel.from_rig(first.intrinsics, first.pose).camera_from_world)
    return np.asarray(points @ world_from_camera[:3, :3].T + world_from_camera[:3, 3])


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
