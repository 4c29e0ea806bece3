"""Adapts a hand file to a hand that was tracked with it: one shape and the pose of every key frame, together.

The shape is what the key frames share. Each step eliminates the frames' own numbers (Schur complement), so that it
costs no more than a camera's bundle adjustment of as many frames. Levenberg-Marquardt as everywhere.

Whether the hand may be used is judged by key frames that were kept aside: a hand adapted to every second one must
explain the others better than the file does.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import msgspec
import numpy as np
from numpy.typing import NDArray

from rhot_app.barehand.contour_residual import ContourFrame
from rhot_app.barehand.contours import SILHOUETTE
from rhot_app.barehand.key_frames import (
    FRAME_COLUMNS,
    SHAPE_COLUMNS,
    SHAPE_SD,
    KeyFrame,
    normal_equations,
    phalanx_sd,
    with_edge_bias,
)
from rhot_app.barehand.surface import FINGER_SIZE, FOREARM_TURN, HAND_SIZE, LENGTH, RADIUS, THICKNESS
from rhot_app.barehand.tracker import LENGTH_SD, RADIUS_SD
from rhot_app.calibration.verdict import Finding, Grade, Verdict, judge
from rhot_app.estimation.least_squares import minimise
from rhot_app.estimation.se3 import retract
from rhot_app.hand.anatomy import HandAnatomy
from rhot_app.hand.model import HandModel
from rhot_app.hand.motion.hand_state import POSE, STATE, TANGENT
from rhot_app.hand.skeleton import FINGERS
from rhot_app.handfit.hand_shape import SHAPE_LIMIT, SIZE, Shapes

Array = NDArray[np.float64]

"""In the history of a hand file or a rig."""

EDGE_SD_PX = 4.0, 2.0, 1.0
"""px: how far from the contour an edge is expected at most, in each of three solutions. 5 % of a phalanx are 2 px. Each
solution has the surface of the hand file that the one before led to: two phalanges meet with one radius, to which the
first surface is an approximation."""

_DIGITS = 4  # of mm
_STEPS, _LEAST_GAIN = 20, 1e-2  # of a cost in which one standard deviation costs 1


@dataclass(frozen=True, slots=True, eq=False)
class Adapted:
    """`hand`: the hand file by the key frames, with standard deviations. `length_sd`, `radius_sd` (15,): those of its
    phalanges' lengths and radii, relative. `states` (F, n): the hand at each key frame. `shape` (SIZE,), relative to
    the file before, as in `hand_shape`; `covariance` (FOREARM_TURN, FOREARM_TURN) of it, without the finger roots.
    `kept_aside`: -2 log likelihood of every second key frame, in sum, with the file before and with a hand adapted to
    the others; NaN of less than two key frames."""

    hand: HandAnatomy
    length_sd: Array
    radius_sd: Array
    states: Array
    shape: Array
    covariance: Array
    kept_aside: tuple[float, float]

    @property
    def verdict(self) -> Verdict:
        """Whether the hand may be used."""
        change = self.document()
        before, after = self.kept_aside
        findings = [Finding("adapted", Grade.GOOD, f"Lengths change by {change['lengths_percent']:.1f} %, radii by "
                            f"{change['radii_percent']:.1f} %, rms.")]
        for what, most in (("lengths", LENGTH_SD), ("radii", RADIUS_SD)):
            if not change[f"{what}_sd_percent"] < 100.0 * most:
                findings.append(Finding(
                    "hand_undetermined", Grade.POOR, f"The {what} are uncertain by "
                    f"{change[f'{what}_sd_percent']:.1f} %; another adult's hand file is by {100.0 * most:.0f} %.",
                    "The hand was seen in too few poses.", "Spread and bend every finger, and turn the hand."))
        if not after < before:
            findings.append(Finding(
                "not_confirmed", Grade.POOR, "The hand in use fits pictures that were kept aside as well or better.",
                "The contours are not those of one hand.", "Learn the background, and show one bare hand alone."))
        if np.any(np.abs(self.shape[:FOREARM_TURN]) >= SHAPE_LIMIT[:FOREARM_TURN]):
            findings.append(Finding(
                "no_hand_has", Grade.POOR, "A length or radius differs from the hand in use by more than adults' do.",
                "The contours are not a hand's, or the cameras' poses are wrong.",
                "Check the stereo calibration, and show one bare hand alone."))
        return judge(f"by {len(self.states)} poses; lengths are known to {change['lengths_sd_percent']:.1f} %, radii "
                     f"to {change['radii_sd_percent']:.1f} %.", findings)

    def document(self) -> dict[str, float]:
        """By how much lengths and radii changed and how well they are known, rms over the phalanges."""
        sizes, own = self.shape[:THICKNESS + 1], self.shape
        lengths = own[LENGTH:RADIUS] + sizes[HAND_SIZE] + sizes[FINGER_SIZE]
        radii = own[RADIUS:RADIUS + 15] + sizes[HAND_SIZE] + sizes[THICKNESS]
        return {"key_frames": len(self.states)} | {
            f"{name}_percent": 100.0 * float(np.sqrt(np.mean(values**2)))
            for name, values in (("lengths", lengths), ("lengths_sd", self.length_sd), ("radii", radii),
                                 ("radii_sd", self.radius_sd))}


def adapt(base: HandAnatomy, key_frames: Sequence[KeyFrame],
          progress: Callable[[float], None] = lambda part: None) -> Adapted:
    """The most probable hand by key frames that were tracked with the hand `base`, and people's hands."""
    shapes = Shapes(base)
    found, shape = _fitted(shapes, key_frames, np.zeros(SIZE), progress=progress)
    covariance = with_edge_bias(found.reduced(0.0)[0], key_frames, shapes.model(shape))
    length_sd, radius_sd = phalanx_sd(covariance)
    hand = _with_sd(shapes.anatomy(shape), length_sd.reshape(5, 3), radius_sd.reshape(5, 3))
    return Adapted(hand, length_sd, radius_sd, np.array(found.states), shape, covariance,
                   _kept_aside(shapes, key_frames))


def _fitted(shapes: Shapes, key_frames: Sequence[KeyFrame], shape: Array, *, fixed: bool = False,
            progress: Callable[[float], None] = lambda part: None) -> tuple[_Iterate, Array]:
    """The last solution, and its shape. `fixed`: the shape stays."""
    states = [one.state for one in key_frames]
    found: _Iterate | None = None
    for number, sd_px in enumerate(EDGE_SD_PX):
        progress(number / len(EDGE_SD_PX))
        problem = _Problem(shapes, shape, [[_expected(frame, sd_px, shapes, shape) for frame in one.frames]
                                           for one in key_frames], fixed)
        found, _ = minimise(_Iterate(problem, np.zeros(FOREARM_TURN), states), _STEPS, _LEAST_GAIN)
        shape = shape.copy()
        shape[:FOREARM_TURN] = np.clip(shape[:FOREARM_TURN] + found.step, -SHAPE_LIMIT[:FOREARM_TURN],
                                       SHAPE_LIMIT[:FOREARM_TURN])
        states = found.states
    assert found is not None
    return found, shape


def _kept_aside(shapes: Shapes, key_frames: Sequence[KeyFrame]) -> tuple[float, float]:
    if len(key_frames) < 2:
        return np.nan, np.nan
    before, after = (_fitted(shapes, key_frames[1::2], shape, fixed=True)[0].frames_cost
                     for shape in (np.zeros(SIZE), _fitted(shapes, key_frames[::2], np.zeros(SIZE))[1]))
    return before, after


def _with_sd(hand: HandAnatomy, length_sd: Array, radius_sd: Array) -> HandAnatomy:
    """The hand with standard deviations (5, 3) of lengths and radii, relative."""
    fingers = {}
    for k, name in enumerate(FINGERS):
        one = hand.fingers[name]
        bones, radii = ([round(value * part, _DIGITS) for value, part in zip(values, parts, strict=True)]
                        for values, parts in ((one.bones_mm, length_sd[k].tolist()),
                                              (one.radii_mm, radius_sd[k].tolist())))
        fingers[name] = msgspec.structs.replace(one, bones_sd_mm=(bones[0], bones[1], bones[2]),
                                                radii_sd_mm=(radii[0], radii[1], radii[2]))
    return msgspec.structs.replace(hand, fingers=fingers)


def _expected(frame: ContourFrame, sd_px: float, shapes: Shapes, shape: Array) -> ContourFrame:
    """The same edges about the surface of another shape.

    An edge behind which the picture shows the hand is no silhouette here: in a gap between two fingers that is as
    narrow as the lens' blur, edges are displaced by half a pixel.
    """
    out = copy.copy(frame)
    assert frame.edges is not None, "a key frame has been searched"
    gap = (frame.points.behind == SILHOUETTE)[:, None] & (frame.edges.outside > 0.5)
    out.edges = frame.edges._replace(inside=np.where(gap, 0.0, frame.edges.inside))
    out.surface = shapes.surface(shape)
    out.expected_sd = np.minimum(frame.expected_sd, sd_px)
    return out


@dataclass(frozen=True, slots=True, eq=False)
class _Problem:
    """`frames`: of each key frame, about the surface of `shape`. `fixed`: the shape stays as it is."""

    shapes: Shapes
    shape: Array
    frames: Sequence[Sequence[ContourFrame]]
    fixed: bool = False

    @property
    def model(self) -> HandModel:
        return self.shapes.model(self.shape)


class _Iterate:
    """Implements `Iterate`: the shape, `step` (FOREARM_TURN,) from the problem's, and the states of the key frames."""

    def __init__(self, problem: _Problem, step: Array, states: Sequence[Array]) -> None:
        self._problem, self.step, self.states = problem, step, list(states)
        self._systems = []
        away = (problem.shape[:FOREARM_TURN] + step) / SHAPE_SD
        self.frames_cost = 0.0
        for frames, state in zip(problem.frames, self.states, strict=True):
            there = state.copy()
            there[STATE.shape][:FOREARM_TURN] = step
            information, pull, cost = normal_equations(frames, there, problem.model)
            self._systems.append((information, pull))
            self.frames_cost += cost
        self.cost = float(away @ away) + self.frames_cost

    def reduced(self, damping: float) -> tuple[Array, Array, list[Array]]:
        """Normal matrix and right side of the shape, and of each frame how its own numbers follow: a matrix
        (own, FOREARM_TURN + 1), the last column without a step of the shape."""
        away = self._problem.shape[:FOREARM_TURN] + self.step
        matrix, right = np.diag(1.0 / SHAPE_SD**2), -away / SHAPE_SD**2
        for information, pull in self._systems:
            matrix += information[np.ix_(SHAPE_COLUMNS, SHAPE_COLUMNS)]
            right = right + pull[SHAPE_COLUMNS]
        matrix[np.diag_indices_from(matrix)] *= 1.0 + damping
        followed = []
        for information, pull in self._systems:
            own = information[np.ix_(FRAME_COLUMNS, FRAME_COLUMNS)]
            coupled = information[np.ix_(FRAME_COLUMNS, SHAPE_COLUMNS)]
            own[np.diag_indices_from(own)] *= 1.0 + damping
            follows = np.linalg.solve(own, np.column_stack([coupled, pull[FRAME_COLUMNS]]))
            matrix -= coupled.T @ follows[:, :-1]
            right = right - coupled.T @ follows[:, -1]
            followed.append(follows)
        return matrix, right, followed

    def moved(self, damping: float) -> _Iterate:
        """The iterate after a damped step."""
        matrix, right, followed = self.reduced(damping)
        step = np.zeros(FOREARM_TURN) if self._problem.fixed else np.linalg.solve(matrix, right)
        states = [_moved(state, follows[:, -1] - follows[:, :-1] @ step)
                  for state, follows in zip(self.states, followed, strict=True)]
        return _Iterate(self._problem, self.step + step, states)


def _moved(state: Array, step: Array) -> Array:
    """A state after a step of its pose and of the forearm."""
    out = state.copy()
    out[STATE.pose] = retract(state[STATE.pose], step[TANGENT.pose])
    out[STATE.shape][FOREARM_TURN:] += step[POSE:]
    return out
