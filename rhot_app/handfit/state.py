"""What a fit has at one step of its history: a shape that all instants share, and each instant's pose and anchors; and
the steps, with undo and redo of any depth.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rhot_app.barehand.contour_residual import ContourFrame
from rhot_app.barehand.surface import FOREARM_TURN
from rhot_app.hand.kinematics import move
from rhot_app.hand.motion.hand_state import POSE, SHAPE, STATE, TANGENT, state_at
from rhot_app.hand.skeleton import HandPose
from rhot_app.handfit.hand_shape import SHAPE_LIMIT, SIZE

Array = NDArray[np.float64]
Image = NDArray[np.uint8]

OWN = POSE + 2
"""Numbers of an instant's tangent space: palm translation and rotation and 21 angles, as in `hand_process`, then the
forearm's flexion and deviation."""

BEND_LIMIT = np.array([1.5, 0.75])
"""rad: the forearm's flexion and deviation, three standard deviations (`barehand.tracker.FOREARM_SD`)."""


@dataclass(frozen=True, slots=True)
class Anchor:
    """A joint of `skeleton.JOINTS` that is to be seen at `pixel` (x, y) of a camera of the rig, both by number."""

    camera: int
    joint: int
    pixel: tuple[float, float]


@dataclass(frozen=True, slots=True, eq=False)
class Contour:
    """The edges that were searched about a hand of `shape` (SIZE,), one frame for each camera that has a picture."""

    shape: Array
    frames: tuple[ContourFrame, ...]

    @property
    def found(self) -> float:
        """Part of the expected contour that was found, 0..1."""
        counts = np.sum([frame.slice_counts.sum(axis=0) for frame in self.frames], axis=0)
        return float(counts[0] / max(counts[1], 1.0))


@dataclass(frozen=True, slots=True, eq=False)
class Instant:
    """One moment: `images` (H, W, 3) RGB by the camera's number, the hand's pose then, the forearm's `bend` (2,) rad,
    and what is known of it. `contour`: of the last fit to contours, None once anything was changed by hand."""

    name: str
    images: Mapping[int, Image]
    pose: HandPose
    bend: Array
    anchors: tuple[Anchor, ...] = ()
    contour: Contour | None = None

    def with_anchor(self, anchor: Anchor) -> Instant:
        """The instant with this anchor in place of the same joint's in the same camera."""
        return replace(self.without_anchor(anchor.camera, anchor.joint),
                       anchors=(*self.without_anchor(anchor.camera, anchor.joint).anchors, anchor))

    def without_anchor(self, camera: int, joint: int) -> Instant:
        """The instant without a joint's anchor in a camera."""
        return replace(self, anchors=tuple(one for one in self.anchors if (one.camera, one.joint) != (camera, joint)))


def bare_state(instant: Instant) -> Array:
    """The hand at rest in the state of `hand_state`, with its base shape."""
    state = state_at(instant.pose.world_from_palm, instant.pose.angles, SHAPE)
    state[STATE.shape][FOREARM_TURN:] = instant.bend
    return state


@dataclass(frozen=True, slots=True, eq=False)
class FitState:
    """One step of the history: `shape` (SIZE,) and the instants."""

    shape: Array
    instants: tuple[Instant, ...]

    @property
    def size(self) -> int:
        """Numbers of the tangent space: the shape's, then those of each instant."""
        return SIZE + OWN * len(self.instants)

    def own(self, instant: int) -> slice:
        """Where an instant's numbers stand in the tangent space."""
        return slice(SIZE + OWN * instant, SIZE + OWN * (instant + 1))

    def change(self, instant: int, changed: Instant) -> FitState:
        """The state with one instant replaced."""
        return replace(self, instants=(*self.instants[:instant], changed, *self.instants[instant + 1:]))

    def moved(self, step: Array, limits: Array) -> FitState:
        """The state moved by `step` (n,) of its tangent space; joint angles stay within `limits` (21, 2) rad, the shape
        and the forearm within theirs."""
        instants = []
        for k, one in enumerate(self.instants):
            own, world, angles = step[self.own(k)], np.empty((4, 4)), np.empty(21)
            if not own.any():
                instants.append(one)
                continue
            move(one.pose.world_from_palm, one.pose.angles, own[TANGENT.pose], world, angles)
            instants.append(replace(one, pose=HandPose(world, np.clip(angles, limits[:, 0], limits[:, 1])),
                                    bend=np.clip(one.bend + own[POSE:], -BEND_LIMIT, BEND_LIMIT)))
        return FitState(np.clip(self.shape + step[:SIZE], -SHAPE_LIMIT, SHAPE_LIMIT), tuple(instants))


@dataclass(frozen=True, slots=True)
class _Step:
    """A state and the words for what led to it."""

    state: FitState
    done: str


class History:
    """States, the newest of which is `state`; those that were undone wait for redo."""

    def __init__(self, state: FitState) -> None:
        self._steps = [_Step(state, "")]
        self._at = 0

    @property
    def state(self) -> FitState:
        """The state now."""
        return self._steps[self._at].state

    @property
    def past(self) -> Sequence[FitState]:
        """All states from the first one on to the one now."""
        return [step.state for step in self._steps[:self._at + 1]]

    @property
    def undoable(self) -> str:
        """What undo would take back, "" for nothing."""
        return self._steps[self._at].done

    @property
    def redoable(self) -> str:
        """What redo would bring back, "" for nothing."""
        return self._steps[self._at + 1].done if self._at + 1 < len(self._steps) else ""

    def undo(self) -> None:
        """One step back; nothing when there is none."""
        self._at = max(self._at - 1, 0)

    def redo(self) -> None:
        """One step forward again; nothing when there is none."""
        self._at = min(self._at + 1, len(self._steps) - 1)

    def take(self, state: FitState, done: str, *, goes_on: bool = False) -> None:
        """A new state, after something was `done`. `goes_on`: in place of the newest step, which was the same thing."""
        keep = self._at if goes_on and self._at and self.undoable == done else self._at + 1
        self._steps[keep:] = [_Step(state, done)]
        self._at = keep

    def rename(self, done: str) -> None:
        """Other words for the newest step; not for the first one."""
        if self._at:
            self._steps[self._at] = _Step(self.state, done)
