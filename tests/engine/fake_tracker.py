"""A tracker that needs no mathematics, and an engine over synthetic nodes."""

from __future__ import annotations

import numpy as np

from rhot_app.project import Rig
from rhot_app.state import LATENCY_STAGES, UNESTIMATED, Condition, HandState, Knowledge
from rhot_app.tracking.tracker import CameraObservations, Tracker


class FakeTracker(Tracker):
    """A state for every frame of the last camera; notes what it was asked."""

    def __init__(self, rig: Rig) -> None:
        self.rig = rig
        self.ingested: list[CameraObservations] = []
        self.solves = 0
        self.resets = 0
        self.broken = False
        self.broken_camera = -1

    def ingest(self, observations: CameraObservations) -> None:
        if observations.camera == self.broken_camera:
            raise ValueError("that picture")
        self.ingested.append(observations)

    def newest_frames(self) -> tuple[CameraObservations | None, ...]:
        found: dict[int, CameraObservations] = {frame.camera: frame for frame in self.ingested}
        return tuple(found.get(camera) for camera in range(len(self.rig.nodes)))

    def reset(self) -> None:
        self.resets += 1
        self.ingested.clear()

    def solve(self) -> HandState | None:
        self.solves += 1
        if self.broken:
            raise FloatingPointError("numbers went wrong")
        if not self.ingested or self.ingested[-1].camera != len(self.rig.nodes) - 1:
            return None
        last = self.ingested[-1]
        count, cameras = len(self.rig.markers.markers), len(self.rig.nodes)
        return HandState(
            sequence=self.solves, t_master_ns=last.t_row0_master_ns, t_receive_ns=last.t_receive_ns,
            condition=Condition.TRACKING, marker_ids=self.rig.markers.ids, marker_positions=np.zeros((count, 3)),
            marker_raw_positions=np.zeros((count, 3)), marker_covariances=np.zeros((count, 3, 3)),
            marker_knowledge=np.zeros(count, np.uint8), camera_names=tuple(n.name for n in self.rig.nodes),
            camera_pixels=np.zeros((cameras, count, 2)), camera_flags=np.zeros((cameras, count), np.uint16),
            joint_positions=np.zeros((21, 3)), joint_knowledge=np.zeros(21, np.uint8),
            fingertip_positions=np.zeros((5, 3)), angles=np.zeros(21), angle_knowledge=np.zeros(21, np.uint8),
            world_from_palm=np.eye(4), palm_knowledge=Knowledge.GUESSED, epipolar_error_px=np.zeros(count),
            **UNESTIMATED,
            latency_s=dict.fromkeys(LATENCY_STAGES[:-2], 1e-4))
