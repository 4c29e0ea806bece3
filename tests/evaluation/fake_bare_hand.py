"""A tracker without markers that is told the truth: the harness's own figures are then known."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from rhot_app.errors import TrackingError
from rhot_app.hand.skeleton import HandPose
from rhot_app.simulator.bare_hand.sequence import BareHandTruth
from rhot_app.state import UNESTIMATED, Condition, HandState, Knowledge

Array = NDArray[np.float64]


class FakeBareHand:
    """The true hand with Gaussian noise of `joint_sd` m on every coordinate and `angle_sd` rad; finds a hand by itself
    `finds_after` pictures on, or never. Its states are `age_s` old."""

    def __init__(self, truth_at: Callable[[int], BareHandTruth], joint_sd: float = 2e-3, angle_sd: float = 0.05,
                 finds_after: int | None = None, age_s: float = 0.0) -> None:
        self.truth_at, self.sd, self.angle_sd, self.finds_after = truth_at, joint_sd, angle_sd, finds_after
        self.age_ns = round(1e9 * age_s)
        self.rng, self.steps, self.newest = np.random.default_rng(1), 0, 0
        self.given: tuple[HandPose, int] | None = None
        self.seen: list[Sequence[NDArray[np.uint8] | None]] = []

    def start(self, pose: HandPose, t_ns: int) -> None:
        """What it is told."""
        self.given = (pose, t_ns)

    def step(self, images: Sequence[NDArray[np.uint8] | None], t_ns: Sequence[int]) -> HandState:
        """The truth at the newest picture's time, or what it said before when there is none."""
        self.steps += 1
        self.seen.append(images)
        if self.given is None and (self.finds_after is None or self.steps <= self.finds_after):
            raise TrackingError("there is no hand yet")
        if any(image is not None for image in images):
            self.newest = max(t_ns) - self.age_ns
        truth = self.truth_at(self.newest)
        joints = truth.joints + self.rng.normal(0.0, self.sd, (21, 3))
        return hand_state(self.newest, joints, truth.angles + self.rng.normal(0.0, self.angle_sd, 21),
                          truth.world_from_palm, np.tile(self.sd ** 2 * np.eye(3), (21, 1, 1)))


def hand_state(t_ns: int, joints: Array, angles: Array, world_from_palm: Array, covariances: Array) -> HandState:
    """A state of a rig without markers."""
    none = np.empty((0, 3))
    return HandState(0, t_ns, t_ns, Condition.TRACKING, (), none, none, np.empty((0, 3, 3)), np.empty(0, np.uint8), (),
                     np.empty((0, 0, 2)), np.empty((0, 0), np.uint16), joints, np.zeros(21, np.uint8), joints[4::4],
                     angles, np.zeros(21, np.uint8), world_from_palm, Knowledge.MEASURED, np.empty(0),
                     **(UNESTIMATED | {"joint_covariances": covariances}), latency_s={})
