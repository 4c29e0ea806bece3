"""Key frames of a tracked hand: the few frames that together have most information on its shape.

A key frame keeps the edges that were found, not the images. Its pose is marginalised (Schur complement), which leaves
its information on the shape. So a pose with a bent joint adds information, and the same pose again hardly any.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.barehand.contour_residual import COLUMNS, ContourFrame, JointLimits, gathered, in_a_fit
from rhot_app.barehand.contours import STEP_M
from rhot_app.barehand.surface import FINGER_SIZE, FOREARM_TURN, HAND_SIZE, LENGTH, RADIUS, THICKNESS
from rhot_app.barehand.tracker import FOREARM_SD, LENGTH_SD, RADIUS_SD, SIZE_SD, BareHandTracker
from rhot_app.hand.model import HandModel
from rhot_app.hand.motion.hand_state import POSE, STATE, TANGENT

Array = NDArray[np.float64]

MAX_KEY_FRAMES = 48
"""Largest number of key frames. Chosen: the standard deviations of lengths fall by a sixth from 20 to 40 of them. A
solution takes a second."""

MIN_INTERVAL_S = 0.1
"""s: shortest interval between two key frames, which otherwise show the same pose (`hand_process.FASTEST`: 1/15 s)."""

CORRELATED_SLICES = 0.025 / STEP_M
"""Slices that count as one observation: the surface's error is correlated along a phalanx, 25 mm, in all key frames. As
independent observations they gave lengths two to three standard deviations off (`benchmarks/hand_adaptation.py`)."""

EDGE_BIAS_PX = 0.12
"""px: bias of the edges along a phalanx that all images have in common, before a learnt background: rms over the sides
of drawn hands in 30 frames (`python benchmarks/bare_hand.py --only edges --frames 30`, "along sides"). More key frames
do not reduce it."""

SHAPE_SD = np.concatenate([SIZE_SD, np.full(15, LENGTH_SD), np.full(15, RADIUS_SD), FOREARM_SD[:1]])
"""(FOREARM_TURN,) standard deviations of the shape in adults, relative to a hand file."""

FRAME_COLUMNS = np.r_[0:POSE, POSE + FOREARM_TURN:COLUMNS]
"""Columns of a contour's Jacobian that belong to one key frame: its pose and the forearm's rotation."""

SHAPE_COLUMNS = np.arange(POSE, POSE + FOREARM_TURN)
"""Columns that all key frames share: the shape."""

_BEND_SD = np.array(FOREARM_SD[1:])
_PALM_INFORMATION = 1e-3  # 1/m^2 and 1/rad^2: negligible, but keeps the matrix regular


@dataclass(frozen=True, slots=True, eq=False)
class KeyFrame:
    """The edges of all cameras at `t_s`, s, linearised at `state` (n,). `information` (FOREARM_TURN, FOREARM_TURN): on
    the shape."""

    t_s: float
    state: Array
    frames: tuple[ContourFrame, ...]
    information: Array


def normal_equations(frames: Sequence[ContourFrame], state: Array, model: HandModel) -> tuple[Array, Array, float]:
    """Information (COLUMNS, COLUMNS), gradient (COLUMNS,) and cost of a key frame's edges and of the priors of its pose
    and forearm, without the shape's prior."""
    information, gradient, cost = gathered(frames, state)
    cost /= CORRELATED_SLICES
    information = (information + np.tril(information, -1).T) / CORRELATED_SLICES
    gradient /= CORRELATED_SLICES
    angles, prior, bend = TANGENT.angles, model.pose_prior, state[STATE.shape][FOREARM_TURN:]
    away = prior.mean - state[STATE.angles]
    information[angles, angles] += prior.information
    gradient[angles] += prior.information @ away
    limits = JointLimits(model.limits).linearise(state)
    beyond = limits.jacobian[:, :POSE]
    information[TANGENT.pose, TANGENT.pose] += beyond.T @ beyond
    gradient[TANGENT.pose] += beyond.T @ limits.error
    information[range(6), range(6)] += _PALM_INFORMATION
    last = np.arange(COLUMNS - 2, COLUMNS)
    information[last, last] += 1.0 / _BEND_SD**2
    gradient[last] -= bend / _BEND_SD**2
    cost += float(away @ prior.information @ away + limits.error @ limits.error + np.sum((bend / _BEND_SD) ** 2))
    return information, gradient, cost


def marginal(information: Array) -> Array:
    """Information (FOREARM_TURN, FOREARM_TURN) on the shape, with FRAME_COLUMNS marginalised."""
    coupled = information[np.ix_(FRAME_COLUMNS, SHAPE_COLUMNS)]
    own, shared = (information[np.ix_(columns, columns)] for columns in (FRAME_COLUMNS, SHAPE_COLUMNS))
    found = shared - coupled.T @ np.linalg.solve(own, coupled)
    return np.asarray(0.5 * (found + found.T))


class KeyFrames:
    """The key frames of a hand that is tracked with one hand file. For one thread."""

    def __init__(self, model: HandModel) -> None:
        self._model = model
        self.kept: list[KeyFrame] = []
        self._last_s = -np.inf
        self._prior = np.diag(1.0 / SHAPE_SD**2)

    def clear(self) -> None:
        """Remove all, for another hand or other cameras."""
        self.kept, self._last_s = [], -np.inf

    def offer(self, tracker: BareHandTracker) -> None:
        """Keep the newest frames of `tracker` if they add more information on the shape than a kept one does."""
        knot = tracker.filter.newest
        frames = tuple(in_a_fit(frame) for frame in tracker.frames if frame is not None)
        if not frames or abs(knot.t_s - self._last_s) < MIN_INTERVAL_S:
            return
        self._last_s = knot.t_s
        try:
            information = marginal(normal_equations(frames, knot.state, self._model)[0])
        except np.linalg.LinAlgError:
            return
        self.kept.append(KeyFrame(knot.t_s, knot.state.copy(), frames, information))
        if len(self.kept) > MAX_KEY_FRAMES:
            total = self._information
            left = np.linalg.slogdet(total - np.array([one.information for one in self.kept]))[1]
            del self.kept[int(np.argmax(left))]

    @property
    def sufficient(self) -> bool:
        """Whether the standard deviations of the phalanges, rms, would be smaller than those of another person's hand
        file."""
        return all(float(np.sqrt(np.mean(sd**2))) < most
                   for sd, most in zip(phalanx_sd(self.covariance), (LENGTH_SD, RADIUS_SD), strict=True))

    @property
    def _information(self) -> Array:
        return np.asarray(self._prior + sum(one.information for one in list(self.kept)))

    @property
    def covariance(self) -> Array:
        """(FOREARM_TURN, FOREARM_TURN) of the shape that a solution with these key frames would have."""
        return with_edge_bias(self._information, list(self.kept), self._model)


def with_edge_bias(information: Array, key_frames: Sequence[KeyFrame], model: HandModel) -> Array:
    """Covariance (FOREARM_TURN, FOREARM_TURN) of the shape of a hand `model`: the inverse of the key frames'
    `information`, plus the common bias of all edges, which adds to the radii."""
    covariance = np.asarray(np.linalg.inv(information))
    scales = [frame.points.scale for one in key_frames for frame in one.frames]
    if scales:
        own = range(RADIUS, RADIUS + 15)
        covariance[own, own] += (EDGE_BIAS_PX / float(np.median(np.concatenate(scales))) / model.radii.ravel()) ** 2
    return covariance


def phalanx_sd(covariance: Array) -> tuple[Array, Array]:
    """(15,) and (15,) standard deviations of the logarithms of the phalanges' lengths and of their radii, sizes
    included, from the shape's covariance."""
    lengths, radii = np.zeros((15, FOREARM_TURN)), np.zeros((15, FOREARM_TURN))
    lengths[:, [HAND_SIZE, FINGER_SIZE]] = radii[:, [HAND_SIZE, THICKNESS]] = 1.0
    lengths[range(15), range(LENGTH, RADIUS)] = radii[range(15), range(RADIUS, RADIUS + 15)] = 1.0
    return (np.sqrt(np.sum((lengths @ covariance) * lengths, axis=1)),
            np.sqrt(np.sum((radii @ covariance) * radii, axis=1)))
