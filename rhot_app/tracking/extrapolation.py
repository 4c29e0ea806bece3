"""The hand at an instant after a state, from the state alone: what a display needs, without asking the tracker.

The estimator's process moves the pose by the state's velocity and acceleration. Whoever receives states predicts them
by itself.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rhot_app.estimation.layout import pose_matrix
from rhot_app.estimation.track import LOST_NS
from rhot_app.hand.kinematics import empty_frames, forward_arrays
from rhot_app.hand.motion.hand_state import STATE
from rhot_app.hand.skeleton import JOINT_SLICES
from rhot_app.objects.motion import SIZE, TWIST, ObjectProcess
from rhot_app.objects.state import ObjectState
from rhot_app.project import Rig
from rhot_app.state import HandState
from rhot_app.tracking.markers.marker_model import compile_markers, scaled_table
from rhot_app.tracking.rig_arrays import rigs_of_hands

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

FARTHEST_AHEAD_S = 0.1
"""s: a third of the longest correlation time of a hand's motion (`hand_process.SLOWEST`)."""

_FINGERTIPS = np.array([joints.stop - 1 for joints in JOINT_SLICES])


class Extrapolator:
    """Predicts the states of one rig's estimator. Those of the classic tracker have no velocity and stay as they are.

    Covariances grow as if the errors of place, velocity and acceleration were fully correlated, which they are at most,
    and by the process noise.
    """

    def __init__(self, rig: Rig) -> None:
        """Raises RigError when a marker has no place on the hand."""
        self._hands = [_Hand(alone, columns) for alone, columns in rigs_of_hands(rig)]

    def at(self, state: HandState, t_ns: int) -> HandState | None:
        """The state predicted to master time `t_ns`, at most FARTHEST_AHEAD_S ahead; before the state's own time, the
        state. None while there is no hand, and LOST_NS after the state.

        Condition, and how each value is known, are the state's.
        """
        ahead_s = 1e-9 * (t_ns - state.t_master_ns)
        if ahead_s > 1e-9 * LOST_NS or not (state.tracked or (state.other is not None and state.other.tracked)):
            return None
        dt_s = min(max(ahead_s, 0.0), FARTHEST_AHEAD_S)
        moved = replace(self._hands[0].moved(state, dt_s), objects=tuple(_later(one, dt_s) for one in state.objects))
        if state.other is None:
            return moved
        second, columns = self._hands[1].moved(state.other, dt_s), self._hands[1].columns
        positions, covariances = moved.marker_positions.copy(), moved.marker_covariances.copy()
        positions[columns], covariances[columns] = second.marker_positions, second.marker_covariances
        return replace(moved, marker_positions=positions, marker_covariances=covariances, other=second)


class _Hand:
    """One hand of a rig; `columns`: its markers among those of the rig."""

    def __init__(self, rig: Rig, columns: Indices) -> None:
        self.columns, model = columns, compile_markers(rig)
        self._limits, self._process = model.limits, model.process()
        joints, markers = model.model.dh, model.dh
        self._table = joints._replace(point_row=np.concatenate([joints.point_row, markers.point_row]),
                                      point_offset=np.concatenate([joints.point_offset, markers.point_offset]))
        self._joints = np.where(model.finger >= 0, _FINGERTIPS[model.finger], 0)  # that move about like the markers

    def moved(self, state: HandState, dt_s: float) -> HandState:
        """A state, `dt_s` later; of its markers, those of this hand."""
        later = replace(state, t_master_ns=state.t_master_ns + round(1e9 * dt_s))
        if not state.tracked or np.isnan(state.velocity[0]):
            return later
        numbers = np.concatenate([state.world_from_palm[:3].ravel(), state.angles, state.velocity, state.acceleration])
        noise_sd, numbers = self._process.process_noise_sd(numbers, dt_s), self._process.advance(numbers, dt_s)
        world, angles = pose_matrix(numbers), np.clip(numbers[STATE.angles], *self._limits.T)
        table, points = scaled_table(self._table, state.hand_scale), np.empty((len(self._table.point_row), 3))
        before = np.empty_like(points)
        forward_arrays(table, state.world_from_palm, state.angles, empty_frames(table), before)
        forward_arrays(table, world, angles, empty_frames(table), points)
        points -= before  # the state's own points may be of another shape than the file's
        columns = self.columns if len(state.marker_ids) > len(self.columns) else np.arange(len(self.columns))
        positions, covariances = state.marker_positions.copy(), state.marker_covariances.copy()
        way_m = (dt_s * state.joint_velocity_sd + 0.5 * dt_s**2 * state.joint_acceleration_sd
                 + math.sqrt(3.0) * noise_sd[0])  # the palm's; fast fingers may add some millimetres
        positions[columns] += points[26:]
        covariances[columns] = _grown(covariances[columns], way_m[self._joints])
        pose_sd = np.sqrt(np.concatenate([np.diag(state.palm_covariance), state.angle_sd**2]))
        way = dt_s * state.velocity_sd + 0.5 * dt_s**2 * state.acceleration_sd + noise_sd
        growth = 1.0 + way / np.maximum(pose_sd, 1e-12)
        return replace(
            later, world_from_palm=world, angles=angles, velocity=numbers[STATE.velocity],
            acceleration=numbers[STATE.acceleration], joint_positions=state.joint_positions + points[:21],
            fingertip_positions=state.fingertip_positions + points[21:26],
            marker_positions=positions, marker_covariances=covariances,
            joint_covariances=_grown(state.joint_covariances, way_m),
            fingertip_covariances=_grown(state.fingertip_covariances, way_m[_FINGERTIPS]),
            palm_covariance=state.palm_covariance * np.outer(growth[:6], growth[:6]),
            angle_sd=state.angle_sd * growth[6:])


def _later(one: ObjectState, dt_s: float) -> ObjectState:
    """An object's state, `dt_s` later; its covariance grows by the process noise, not by that of its velocity."""
    if not one.tracked or dt_s == 0.0:
        return one
    covariance = np.zeros((SIZE, SIZE))
    covariance[:TWIST, :TWIST] = one.covariance
    state, grown = ObjectProcess().predict(np.concatenate([one.world_from_object[:3].ravel(), one.velocity]),
                                           covariance, dt_s)
    return replace(one, t_master_ns=one.t_master_ns + round(1e9 * dt_s), world_from_object=pose_matrix(state),
                   covariance=grown[:TWIST, :TWIST])


def _grown(covariances: Array, way_m: Array) -> Array:
    """Covariances (N, 3, 3) m^2 whose standard deviations (root of the trace) grow by `way_m` (N,)."""
    sd = np.sqrt(np.maximum(np.trace(covariances, axis1=1, axis2=2), 1e-18))
    return np.asarray(covariances * ((1.0 + way_m / sd) ** 2)[:, None, None])
