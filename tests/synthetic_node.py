"""A node without images: speaks the wire like a real one and streams exact marker positions of a moving hand.

For measuring and testing what lies behind the wire at any rate, where rendering and detection would be in the way.
"""

from __future__ import annotations

import math
import socket
import time
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rhot_app.geometry.camera import CameraModel
from rhot_app.hand.anatomy import load_hand
from rhot_app.hand.kinematics import forward
from rhot_app.hand.model import build_model
from rhot_app.hand.skeleton import ANGLES, FINGERS, HandPose
from rhot_app.project import Broadcast, CameraCalibration, CameraPose, Intrinsics, Rig, RigNode
from rhot_node.clock import ANCILLARY_SIZE, KernelTime, NodeClock, ask_for_times
from rhot_node.errors import WireError
from rhot_node.files import resource_path
from rhot_node.markers import load_markers
from rhot_node.threads import Worker
from rhot_node.wire.codec import decode, encode
from rhot_node.wire.messages import (
    ClockReply,
    ClockRequest,
    MarkerFlag,
    MarkerObservation,
    NodeState,
    Observations,
    Start,
    Stop,
)

FRAME_AGE_NS = 6_000_000
"""From mid-exposure of row 0 to the datagram: read-out and detection, as on a real node."""

ROW_TIME_NS = 10_000
PERIOD_S = 2.0
"""The hand repeats its movement after this long."""

_STEPS = 240  # positions in one period; frames take the nearest
_DISTANCE_M = 0.6


def synthetic_rig(node_count: int = 2, baseline_m: float = 0.075) -> Rig:
    """A rig on this machine: cameras side by side, six markers, an adult right hand, UDP ports that were free."""
    lens = Intrinsics(width=640, height=480, fx=530.0, fy=530.0, cx=319.5, cy=239.5)
    names = ("left", "right") if node_count == 2 else tuple(f"camera {k + 1}" for k in range(node_count))
    nodes = tuple(
        RigNode(node_id=k + 1, name=name, intrinsics=lens, udp_port=_free_port(),
                control_port=47801 + 10 * k, preview_port=47802 + 10 * k, pairing_port=47803 + 10 * k,
                pose=CameraPose(translation_m=(k * baseline_m, 0.0, 0.0)))
        for k, name in enumerate(names))
    return Rig(name="synthetic", nodes=nodes, markers=load_markers(resource_path("markers", "rhot6.json")),
               hand=load_hand(resource_path("hands", "right.json")),
               calibration=CameraCalibration("exact", error_m=0.0),
               broadcast=Broadcast("127.255.255.255", _free_port()))  # heard on this machine only


def hand_markers(rig: Rig) -> NDArray[np.float64]:
    """(S, M, 3) m: one period of an opening, closing and swaying hand's markers in the rig frame."""
    model = build_model(rig.hand)
    flexion = np.array(["flexion" in name for name in ANGLES])
    positions = np.full((_STEPS, len(rig.markers.markers), 3), np.nan)
    for step in range(_STEPS):
        phase = 2.0 * math.pi * step / _STEPS
        pose = HandPose(_palm(phase), np.where(flexion, 0.35 - 0.25 * math.cos(phase), 0.0))
        points = forward(model, pose)
        for row, marker in enumerate(rig.markers.markers):
            if marker.role == "wrist":
                positions[step, row] = points.joints[0]
            elif marker.role is not None:
                positions[step, row] = points.marker_centres[FINGERS.index(marker.role.removesuffix("_tip"))]
    return positions


def _palm(phase: float) -> NDArray[np.float64]:
    """world_from_palm: fingers up, back of the hand away from the cameras, swaying by 3 cm."""
    palm = np.eye(4)
    palm[:3, 0] = (0.0, -1.0, 0.0)
    palm[:3, 2] = (0.0, 0.0, 1.0)
    palm[:3, 1] = np.cross(palm[:3, 2], palm[:3, 0])
    palm[:3, 3] = (0.0375 + 0.03 * math.sin(phase), 0.06, _DISTANCE_M + 0.02 * math.cos(phase))
    return palm


class SyntheticNode:
    """One node of a rig on this machine. `step` answers and sends what is due; `start` runs it in a thread."""

    def __init__(self, rig: Rig, camera: int, *, rate_hz: float = 120.0, clock: NodeClock | None = None,
                 boot_id: int = 1, state: NodeState = NodeState.READY) -> None:
        """`camera`: the node's index in the rig. Opens the node's UDP port."""
        self.state = state
        self.session = 0
        self.sent = 0
        self._node: RigNode = rig.nodes[camera]
        self._clock = clock or NodeClock()
        self._boot_id = boot_id
        self._period_ns = round(1e9 / rate_hz)
        self._phase_ns = round(0.37 * camera * self._period_ns) % self._period_ns  # cameras run freely
        self._frames = _observe(rig, camera, hand_markers(rig))
        self._target: tuple[str, int] | None = None
        self._sequence = 0
        self._due_ns = 0
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", self._node.udp_port))
        ask_for_times(self._socket)
        self._kernel_time = KernelTime()
        self._worker = Worker(f"plays the node {self._node.name}", self.step)

    def step(self, timeout_s: float = 0.1) -> None:
        """Wait for a message until the next frame is due (at most `timeout_s`), answer it, send the frame."""
        if self._target is not None:
            timeout_s = min(timeout_s, 1e-9 * (self._due_ns - time.monotonic_ns()))
        self._socket.settimeout(max(timeout_s, 1e-5))
        try:
            data, ancillary, _, sender = self._socket.recvmsg(8192, ANCILLARY_SIZE)
        except (TimeoutError, BlockingIOError):
            pass
        else:
            self._take(data, sender, self._kernel_time.receive_time_ns(ancillary)[0])
        if self._target is not None and time.monotonic_ns() >= self._due_ns:
            self.send_frame(time.monotonic_ns())
            self._due_ns += self._period_ns

    def send_frame(self, now_ns: int) -> None:
        """Send the frame that was taken `FRAME_AGE_NS` before `now_ns`, host time."""
        if self._target is None:
            return
        t_frame_ns = now_ns - FRAME_AGE_NS
        template = self._frames[round(t_frame_ns * 1e-9 / PERIOD_S * _STEPS) % _STEPS]
        message = replace(template, session=self.session, sequence=self._sequence, frame_number=self._sequence,
                          t_frame_node_ns=self._clock.from_host_ns(t_frame_ns),
                          t_send_node_ns=self._clock.from_host_ns(now_ns))
        self._socket.sendto(encode(message), self._target)
        self._sequence += 1
        self.sent += 1

    def start(self) -> None:
        """Run in a thread of its own."""
        self._worker.start()

    def close(self) -> None:
        """Fall silent and close the port. May be called twice."""
        self._worker.close()
        self._socket.close()

    def _take(self, data: bytes, sender: tuple[str, int], t_receive_ns: int) -> None:
        try:
            message = decode(data)
        except WireError:
            return
        match message:
            case ClockRequest(node_id=node_id) if node_id == self._node.node_id:
                t2 = self._clock.from_host_ns(t_receive_ns)
                reply = ClockReply(node_id, self.session, message.sequence, message.t1_master_ns, t2,
                                   max(t2, self._clock.now_ns()), self._boot_id, self.state)
                self._socket.sendto(encode(reply), sender)
            case Start():
                entry = next((entry for entry in message.entries if entry.node_id == self._node.node_id), None)
                if entry is not None and message.session != self.session and self.state is not NodeState.FAULT:
                    self.session, self.state, self._sequence = message.session, NodeState.STREAMING, 0
                    # Due at whole periods of the machine's clock plus the camera's phase, whoever hears first.
                    self._due_ns = time.monotonic_ns() // self._period_ns * self._period_ns + self._phase_ns
                    self._target = (sender[0], entry.data_port)
            case Stop() if message.session in (0, self.session):
                self.session, self.state, self._target = 0, NodeState.READY, None


def _observe(rig: Rig, camera: int, positions: NDArray[np.float64]) -> list[Observations]:
    """One message per position, complete but for session, sequence and times."""
    node = rig.nodes[camera]
    lens = node.intrinsics
    model = CameraModel.from_rig(lens, node.pose)
    messages = []
    for points in positions:
        pixels = model.project(points)
        markers = tuple(
            MarkerObservation(index, float(x), float(y), 16.0, 4e-4, 0.0, 4e-4, 1.0) if np.isfinite(x)
            else MarkerObservation(index, math.nan, math.nan, 0.0, 0.0, 0.0, 0.0, 0.0, MarkerFlag.LOST)
            for index, (x, y) in enumerate(pixels))
        messages.append(Observations(
            node_id=node.node_id, session=0, sequence=0, t_frame_node_ns=0, t_send_node_ns=0,
            processing_ns=2_000_000, exposure_ns=4_000_000, row_time_ns=ROW_TIME_NS, width=lens.width,
            height=lens.height, frame_number=0, marker_checksum=rig.markers.checksum, markers=markers))
    return messages


def _free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        sock.bind(("127.0.0.1", 0))
        return int(sock.getsockname()[1])
