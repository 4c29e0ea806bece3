"""States of the model tracker, of a hand and of none."""

from __future__ import annotations

import math
import time

import numpy as np

from rhot_app.tracking.kalman.estimate import SCALE, Estimate
from rhot_app.tracking.kalman.share import Share
from rhot_app.tracking.model_output import FIRST_MARKER, FIRST_TIP, Subject, describe, empty_report, open_account
from rhot_app.tracking.rig_arrays import RigArrays
from rhot_app.tracking.sights import Sights
from rhot_app.tracking.state import UNESTIMATED, Condition, HandState, Knowledge
from rhot_app.tracking.tracker import CameraObservations


class Teller:
    """Tells of one `estimate`, as it is at the moment. `complete`: whether all markers of the hand that it last told of
    are measured."""

    def __init__(self, rig: RigArrays, sights: Sights, subject: Subject, estimate: Estimate) -> None:
        self._rig, self._sights, self._estimate = rig, sights, estimate
        self._account = Share(open_account(estimate, subject, sights.seen))
        self.complete = False

    def tell(self, t_ns: int, sequence: int, newest: CameraObservations, begun: float) -> HandState:
        """The state of `t_ns`, to which the estimate has been carried, with its number; work on it began at `begun`, s
        of `time.perf_counter`. It is TRACKING while all markers are in sight, well or badly."""
        rig, estimate = self._rig, self._estimate
        solved, report = time.perf_counter(), empty_report(len(rig.marker_ids))
        self.complete, in_sight = describe(self._account, t_ns, report)
        points, covariances = report.points, report.covariances
        seen_pixels, seen_flags = self._sights.last_seen()
        return HandState(
            sequence=sequence, t_master_ns=t_ns, t_receive_ns=newest.t_receive_ns,
            condition=Condition.TRACKING if in_sight else Condition.PARTIAL,
            marker_ids=rig.marker_ids,
            marker_positions=points[FIRST_MARKER:], marker_raw_positions=report.raw,
            marker_covariances=covariances[FIRST_MARKER:], marker_knowledge=report.marker_knowledge,
            camera_names=rig.camera_names, camera_pixels=seen_pixels, camera_flags=seen_flags,
            joint_positions=points[:FIRST_TIP], joint_knowledge=report.joint_knowledge,
            fingertip_positions=points[FIRST_TIP:FIRST_MARKER], angles=estimate.angles.copy(),
            angle_knowledge=report.angle_knowledge, world_from_palm=estimate.world.copy(),
            palm_knowledge=Knowledge(int(report.palm[0])), epipolar_error_px=report.errors, angle_sd=report.angle_sd,
            joint_covariances=covariances[:FIRST_TIP], fingertip_covariances=covariances[FIRST_TIP:FIRST_MARKER],
            palm_covariance=report.palm_covariance, hand_scale=math.exp(estimate.log_scale[0]),
            hand_scale_sd=math.sqrt(max(estimate.covariance[SCALE, SCALE], 0.0)),
            latency_s={"detect": newest.detect_s, "network": newest.network_s, "pair": 0.0, "triangulate": 0.0,
                       "filter": solved - begun, "solve": time.perf_counter() - solved})


def tell_of_none(rig: RigArrays, sights: Sights, sequence: int, condition: Condition,
                 size: tuple[float, float] | None, newest: CameraObservations, begun: float) -> HandState:
    """No hand: what the cameras see is all there is to tell, and how large it was, `size`, the logarithm of its scale
    and the variance of that, where it is estimated."""
    log_scale, variance = (0.0, math.nan) if size is None else size
    markers = len(rig.marker_ids)
    seen_pixels, seen_flags = sights.last_seen()
    unknown = int(Knowledge.UNKNOWN)
    return HandState(
        sequence=sequence, t_master_ns=newest.t_row0_master_ns, t_receive_ns=newest.t_receive_ns, condition=condition,
        marker_ids=rig.marker_ids, marker_positions=np.full((markers, 3), np.nan),
        marker_raw_positions=np.full((markers, 3), np.nan), marker_covariances=np.full((markers, 3, 3), np.nan),
        marker_knowledge=np.full(markers, unknown, np.uint8), camera_names=rig.camera_names,
        camera_pixels=seen_pixels, camera_flags=seen_flags, joint_positions=np.full((21, 3), np.nan),
        joint_knowledge=np.full(21, unknown, np.uint8), fingertip_positions=np.full((5, 3), np.nan),
        angles=np.full(21, np.nan), angle_knowledge=np.full(21, unknown, np.uint8),
        world_from_palm=np.full((4, 4), np.nan), palm_knowledge=Knowledge.UNKNOWN,
        epipolar_error_px=np.full(markers, np.nan),
        **UNESTIMATED | {"hand_scale": math.exp(log_scale), "hand_scale_sd": math.sqrt(variance)},
        latency_s={"detect": newest.detect_s, "network": newest.network_s, "pair": 0.0, "triangulate": 0.0,
                   "filter": time.perf_counter() - begun, "solve": 0.0})
