"""States of a known hand, outputs that get them at a steady rate, and free ports."""

from __future__ import annotations

import socket
import threading
import time
from dataclasses import replace

import msgspec
import numpy as np

from rhot_app.hand.kinematics import forward
from rhot_app.hand.model import build_model, neutral_pose
from rhot_app.hand.skeleton import HandPose
from rhot_app.outputs.outputs import Outputs
from rhot_app.outputs.spec import parse_output
from rhot_app.project import OutputSettings, Rig
from rhot_app.state import LATENCY_STAGES, UNESTIMATED, Condition, HandState, Knowledge

RATE_HZ = 80.0


def state_of(rig: Rig, pose: HandPose, sequence: int = 0) -> HandState:
    """A tracked hand in this pose, all of it measured, now."""
    points = forward(build_model(rig.hand), pose)
    count, cameras = len(rig.markers.markers), len(rig.nodes)
    return HandState(
        sequence=sequence, t_master_ns=time.monotonic_ns(), t_receive_ns=time.monotonic_ns(),
        condition=Condition.TRACKING, marker_ids=rig.markers.ids, marker_positions=np.zeros((count, 3)),
        marker_raw_positions=np.zeros((count, 3)), marker_covariances=np.zeros((count, 3, 3)),
        marker_knowledge=np.zeros(count, np.uint8), camera_names=tuple(node.name for node in rig.nodes),
        camera_pixels=np.zeros((cameras, count, 2)), camera_flags=np.zeros((cameras, count), np.uint16),
        joint_positions=points.joints, joint_knowledge=np.zeros(21, np.uint8),
        fingertip_positions=points.marker_centres, angles=pose.angles, angle_knowledge=np.zeros(21, np.uint8),
        world_from_palm=pose.world_from_palm, palm_knowledge=Knowledge.GUESSED, epipolar_error_px=np.zeros(count),
        **UNESTIMATED, latency_s=dict.fromkeys(LATENCY_STAGES, 1e-4))


def unknown(state: HandState) -> HandState:
    """The same instant without a hand."""
    nothing = np.full(21, int(Knowledge.UNKNOWN), np.uint8)
    return replace(state, condition=Condition.LOST, joint_positions=np.full((21, 3), np.nan), joint_knowledge=nothing,
                   angles=np.full(21, np.nan), angle_knowledge=nothing, world_from_palm=np.full((4, 4), np.nan),
                   palm_knowledge=Knowledge.UNKNOWN)


def palm_before_cameras() -> np.ndarray:
    """world_from_palm: fingers up, back of the hand away from the cameras, 0.6 m before them."""
    palm = np.eye(4)
    palm[:3, 0], palm[:3, 2] = (0.0, -1.0, 0.0), (0.0, 0.0, 1.0)
    palm[:3, 1] = np.cross(palm[:3, 2], palm[:3, 0])
    palm[:3, 3] = (0.04, 0.06, 0.6)
    return palm


def free_port() -> int:
    """A port that is free for TCP at this moment."""
    with socket.socket() as sock:
        sock.bind(("127.0.0.1", 0))
        return int(sock.getsockname()[1])


class Stream:
    """Outputs that get a state `RATE_HZ` times a second, from a thread as an engine's."""

    def __init__(self, rig: Rig, *specs: str | OutputSettings) -> None:
        self.outputs = Outputs()
        asked = tuple(parse_output(spec) if isinstance(spec, str) else spec for spec in specs)
        self.outputs.configure(msgspec.structs.replace(rig, outputs=asked))
        self.sent = 0
        self.state = state_of(rig, neutral_pose(palm_before_cameras()))
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End it all."""
        self._ending.set()
        self._thread.join()
        self.outputs.close()

    def _run(self) -> None:
        due_s = time.monotonic()
        while not self._ending.is_set():
            self.outputs.send(replace(self.state, sequence=self.sent, t_master_ns=time.monotonic_ns()))
            self.sent += 1
            due_s += 1.0 / RATE_HZ
            self._ending.wait(max(0.0, due_s - time.monotonic()))
