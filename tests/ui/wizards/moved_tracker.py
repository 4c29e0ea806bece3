"""A finger with a tracker on it: what a rig sees of it and what the tracker says, by a clock that polling moves on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from fake_engine import FakeEngine
from scipy.spatial.transform import Rotation

from rhot_app.geometry.transforms import rigid
from rhot_app.objects.pose import Validity
from rhot_app.sources.poses.source import ForeignPose
from rhot_app.state import HandState

FOREIGN_FROM_RIG = rigid(Rotation.from_rotvec([0.4, -0.9, 0.3]).as_matrix(), [0.5, -0.2, 1.1])
TRACKER_FROM_FINGER = rigid(np.eye(3), [0.03, 0.05, -0.02])
DELAY_S = 0.037
POSE_NS, STATE_NS = 10_000_000, 20_000_000
POSES_PER_POLL = 8


def rig_from_tracker(t_s: float, turning: bool) -> np.ndarray:
    """At `t_s`; without `turning` it is moved in parallel."""
    waves = np.sin(np.outer([0.9, 1.7, 2.9], [1.0, 1.31, 0.77]) * 2.0 * t_s + np.arange(9).reshape(3, 3))
    place = np.array([0.0, 0.0, 0.6]) + (np.array([0.07, 0.06, 0.06]) * waves).sum(axis=0)
    turn = 0.25 * waves[:, ::-1].sum(axis=0) * turning
    return rigid(Rotation.from_rotvec(turn).as_matrix(), place)


class MovedTracker:
    """A `PoseSource`; each poll lets 80 ms pass. `listen` gives the listener that hears the finger meanwhile."""

    name, notice, ended = "a tracker", "", False

    def __init__(self, *, turning: bool = True) -> None:
        self.turning, self.seen = turning, True
        self._now_ns = self._state_ns = 100_000_000_000
        self._state = FakeEngine().state(0.0)
        self._random = np.random.default_rng(2), np.random.default_rng(11)

    def now_ns(self) -> int:
        """The master's clock."""
        return self._now_ns

    def poll(self) -> list[ForeignPose]:
        times = [self._now_ns + POSE_NS * k for k in range(1, POSES_PER_POLL + 1)]
        poses = [FOREIGN_FROM_RIG @ rig_from_tracker(1e-9 * t_ns - DELAY_S, self.turning) for t_ns in times]
        for pose in poses:
            pose[:3, 3] += 1e-4 * self._random[0].normal(size=3)
        self._now_ns = times[-1]
        return [ForeignPose(t_ns, pose, np.eye(6), Validity.TRACKED) for t_ns, pose in zip(times, poses, strict=True)]

    def states(self) -> list[HandState]:
        """Since the last call."""
        times = range(self._state_ns + STATE_NS, self._now_ns + 1, STATE_NS)
        self._state_ns += STATE_NS * len(times)
        return [self._seen(t_ns) for t_ns in times]

    def _seen(self, t_ns: int) -> HandState:
        places = np.full_like(self._state.marker_raw_positions, np.nan)
        if self.seen:
            place = (rig_from_tracker(1e-9 * t_ns, self.turning) @ TRACKER_FROM_FINGER)[:3, 3]
            places[self._state.marker_ids.index("index")] = place + 2e-4 * self._random[1].standard_normal(3)
        return replace(self._state, t_master_ns=t_ns, marker_raw_positions=places)

    def listen(self) -> Finger:
        return Finger(self)

    def close(self) -> None:
        """Nothing to close."""


class Finger:
    """A listener that hears what the rig sees of a `MovedTracker`."""

    def __init__(self, tracker: MovedTracker) -> None:
        self.poll = tracker.states

    def close(self) -> None:
        """Nothing to close."""
