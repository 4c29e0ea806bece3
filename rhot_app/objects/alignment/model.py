"""The measurement model of an alignment: the residuals of two streams and their analytic Jacobian.

`rhot_app.objects.alignment.fit` has the equations.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rhot_app.estimation.se3 import exp_so3, inverse_left_jacobian, skew
from rhot_app.objects.alignment.motion_stream import MotionStream

Array = NDArray[np.float64]

POINTS, POSES = 10, 13
"""Unknowns of an alignment by a rig's positions, and by its poses."""

TRANSLATION, ROTATION, POINT, OFFSET, BODY = (
    slice(first, end) for first, end in pairwise((*range(0, POINTS, 3), POINTS, POSES)))
"""Order of the covariance: rig_from_foreign's translation (m) and rotation (rad, along the rig's axes),
tracker_from_body's translation (m, the device's axes), the time offset (s), and, if the rig reports poses,
tracker_from_body's rotation (rad, the body's axes)."""

GAP_S = 0.04
"""s: no interpolation across longer intervals. A cubic spline errs by 5/384 h^4 |x''''| (de Boor 1978), here 0.3 mm for
10 mm at 5 Hz."""


@dataclass(frozen=True, slots=True)
class AlignmentEstimate:
    """The unknowns: `rotation` (3, 3) rig_from_foreign; `centre` (3,) m, where the rig sees the foreign point
    `AlignmentModel.centre`; `point` (3,) m and `body` (3, 3), tracker_from_body; `offset_s`, rig less foreign clock."""

    rotation: Array
    centre: Array
    point: Array
    offset_s: float
    body: Array

    def moved(self, step: Array) -> AlignmentEstimate:
        """After a step (POINTS,) or (POSES,) in the order of the covariance."""
        body = self.body @ exp_so3(step[BODY]) if len(step) == POSES else self.body
        return AlignmentEstimate(exp_so3(step[ROTATION]) @ self.rotation, self.centre + step[TRANSLATION],
                                 self.point + step[POINT], self.offset_s + float(step[OFFSET][0]), body)


class AlignmentModel:
    """The residuals of two streams at the samples of the sparser one, whose noise is then hardly correlated."""

    def __init__(self, foreign: MotionStream, rig: MotionStream) -> None:
        self.foreign, self.rig = foreign, rig
        self.poses = rig.has_rotations
        self.size = POSES if self.poses else POINTS
        self.at_rig = len(rig.times_s) / rig.duration_s <= len(foreign.times_s) / foreign.duration_s
        self.centre = foreign.positions.mean(axis=0)
        self._times = rig.times_s if self.at_rig else foreign.times_s

    def select(self, offset_s: float) -> None:
        """Use the instants at which the other stream can be interpolated, if `offset_s` is about true."""
        if self.at_rig:
            self._times = self.rig.times_s[self.foreign.covers(self.rig.times_s - offset_s, GAP_S)]
        else:
            self._times = self.foreign.times_s[self.rig.covers(self.foreign.times_s + offset_s, GAP_S)]

    @property
    def count(self) -> int:
        """Instants used."""
        return len(self._times)

    @property
    def duration_s(self) -> float:
        """From the first used instant to the last."""
        return float(self._times[-1] - self._times[0])

    def thin(self, count: int) -> None:
        """Use at most so many instants."""
        self._times = self._times[::max(1, math.ceil(len(self._times) / count))]

    def sampled(self, offset_s: float) -> tuple[tuple[Array, Array, Array, Array], tuple[Array, Array, Array, Array]]:
        """Position, velocity, rotation and angular velocity of the device and of the body at the used instants."""
        foreign_s, rig_s = ((self._times - offset_s, self._times) if self.at_rig else
                            (self._times, self._times + offset_s))
        return self.foreign.at(foreign_s), self.rig.at(rig_s)

    def linearise(self, estimate: AlignmentEstimate) -> tuple[Array, Array, Array, Array]:
        """Errors (N, 3) m with their Jacobian (N, 3, n), then rotation errors (N, 3) rad with theirs; N = 0 without
        poses. A Jacobian is that of the predicted value: minus that of the error."""
        (place, speed, device, turning), (seen, seen_speed, seen_rotation, seen_turning) = self.sampled(
            estimate.offset_s)
        arm = device @ estimate.point
        predicted = (place - self.centre + arm) @ estimate.rotation.T
        error = seen - predicted - estimate.centre
        jacobian = np.zeros((len(error), 3, self.size))
        jacobian[:, :, TRANSLATION] = np.eye(3)
        jacobian[:, :, ROTATION] = -skew(predicted)
        jacobian[:, :, POINT] = estimate.rotation @ device
        body_speed = (speed + np.cross(turning, arm)) @ estimate.rotation.T if self.at_rig else seen_speed
        jacobian[:, :, OFFSET.start] = -body_speed
        if not self.poses:
            return error, jacobian, np.empty((0, 3)), np.empty((0, 3, self.size))
        predicted_rotation = estimate.rotation @ device @ estimate.body
        turned = Rotation.from_matrix(seen_rotation @ predicted_rotation.transpose(0, 2, 1)).as_rotvec()
        # a left turn d of the prediction changes the error by the inverse right Jacobian of SO(3)
        turn = inverse_left_jacobian(-turned)
        by = np.zeros((len(turned), 3, self.size))
        by[:, :, ROTATION] = turn
        by[:, :, BODY] = turn @ predicted_rotation
        rate, slope = ((turning @ estimate.rotation.T, turn) if self.at_rig else
                       (seen_turning, inverse_left_jacobian(turned)))
        by[:, :, OFFSET.start] = -np.einsum("nij,nj->ni", slope, rate)
        return error, jacobian, turned, by
