"""Searches of foreground maps about a pose, in a thread: one takes a tenth of a second, and frames keep arriving."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rhot_app.barehand.observations import ForegroundFrame
from rhot_app.barehand.pose_search import RELOCALISATION_LOG_ODDS
from rhot_app.barehand.tracker import BareHandTracker
from rhot_app.hand.motion.hand_process import FASTEST
from rhot_app.hand.motion.hand_state import POSE, TANGENT
from rhot_app.hand.skeleton import HandPose
from rhot_app.tracking.contours.evidence import SAME_POSE_M, joints_of
from rhot_app.tracking.contours.requests import CameraFrames
from rhot_node.threads import OneShotThread

Array = NDArray[np.float64]

SAME_MAPS_NS = 100_000_000
"""ns: observations nearer in time count as of one position of a hand that is held still."""


@dataclass(frozen=True, slots=True)
class Maps:
    """Foreground probabilities of every STEP-th pixel of each camera about `t_ns`, None of one without an image."""

    t_ns: int
    probabilities: list[NDArray[np.float32] | None]


class NewestMaps:
    """The newest foreground map of each camera."""

    def __init__(self, cameras: Sequence[CameraFrames]) -> None:
        self._cameras = cameras
        self._maps: list[ForegroundFrame | None] = [None] * len(cameras)

    @property
    def simultaneous_ns(self) -> float:
        """Longest time between simultaneous maps, ns: half a period, and jitter."""
        return 0.75 * max(camera.period_ns for camera in self._cameras)

    def take(self, frame: ForegroundFrame) -> Maps | None:
        """Take one map. Returns the simultaneous maps of all cameras that deliver frames; None while one is missing."""
        self._maps[frame.camera], t_ns = frame, frame.t_row0_master_ns
        maps: list[ForegroundFrame | None] = []
        for camera, one in zip(self._cameras, self._maps, strict=True):
            fresh = one is not None and abs(t_ns - one.t_row0_master_ns) <= self.simultaneous_ns
            if camera.delivers(t_ns) and not fresh:
                return None
            maps.append(one if fresh else None)
        return Maps(t_ns, [None if one is None else one.probability for one in maps])


class Finder:
    """Searches in a thread of its own. `look` and `relocalise` begin one, `found` and `change` return its result once.

    One search runs at a time. All methods belong to the tracker's thread."""

    def __init__(self, hand: BareHandTracker) -> None:
        self._hand = hand
        self._task: OneShotThread | None = None
        self._found: tuple[int, HandPose, int] | None = None  # of which run
        self._change: tuple[int, Array | None] | None = None
        self._run = 0

    def reset(self) -> None:
        """Discard the result of the running search."""
        self._run += 1
        self._found = self._change = None

    def look(self, maps: Maps) -> None:
        """Look in these maps whether a hand has taken its start pose."""
        self._begin(self._look, maps, self._run)

    def relocalise(self, maps: Maps, state: Array, covariance: Array, dt_s: float) -> None:
        """Search for a better pose than that in `state`, as far as hands move in `dt_s`, s
        (`PoseSearch.relocalise`)."""
        self._begin(self._relocalise, maps, state.copy(), covariance.copy(), dt_s, self._run)

    def verify(self, maps: Maps, t_s: float, dt_s: float) -> bool:
        """Verify the predicted pose by maps of `t_s`, s, and relocalise the hand where the last search found a better
        one. Returns whether it was relocalised.

        A search starts when one is due (`PoseSearch.begins_search`). Its result is compared in the newest maps, into
        which the hand has moved since. Edges locate a hand more accurately, so small changes are left to them, unless a
        finger was mistaken for another one.
        """
        hand, search = self._hand, self._hand.search
        state, covariance = hand.filter.predict(t_s)
        odds, change = search.odds_of(maps.probabilities), self.change()
        per_pixel = search.log_odds_per_pixel(odds, state)
        worse = search.worse(per_pixel)
        if change is not None:
            moved = hand.process.retract(state, change)
            way = joints_of(hand, moved) - joints_of(hand, state)
            confused = np.linalg.norm(way - way.mean(axis=0), axis=1).max() > SAME_POSE_M
            gain = search.log_odds(odds, moved) - search.log_odds(odds, state)
            if (worse or confused) and gain > RELOCALISATION_LOG_ODDS:
                hand.filter.start(t_s, moved, _inflated(covariance, change))
                return True
        if search.begins_search(per_pixel, t_s):
            self.relocalise(maps, state, covariance, dt_s)
        search.average(per_pixel)
        return False

    def found(self) -> tuple[HandPose, int] | None:
        """The pose about the start pose that a hand has taken and its time, master ns; None without a new one."""
        found, self._found = self._found, None
        return None if found is None or found[0] != self._run else found[1:]

    def change(self) -> Array | None:
        """The step in the tangent space from the state of the last relocalisation to a better one; None without."""
        found, self._change = self._change, None
        return None if found is None or found[0] != self._run else found[1]

    def wait(self) -> None:
        """Wait for the running search."""
        if self._task is not None:
            self._task.join()

    def _begin(self, search_for: Callable[..., None], *arguments: Any) -> None:
        if self._task is None or not self._task.running:
            self._task = OneShotThread("searches for a hand", functools.partial(search_for, *arguments))

    def _look(self, maps: Maps, run: int) -> None:
        pose = self._hand.taken(maps.probabilities)
        if pose is not None:
            self._found = run, pose, maps.t_ns

    def _relocalise(self, maps: Maps, state: Array, covariance: Array, dt_s: float, run: int) -> None:
        process = self._hand.process
        better = self._hand.search.relocalise(maps.probabilities, (state, covariance), process.stationary, dt_s)
        self._change = run, None if better is None else process.difference(better, state)


def _inflated(covariance: Array, change: Array) -> Array:
    """The covariance after a relocalisation by `change`, inflated: the pose by its square, velocity and acceleration by
    those of a hand whose pose varies as much (`HandProcess.stationary`)."""
    out = covariance.copy()
    for order, scale in enumerate((1.0, FASTEST**2 / 3.0, FASTEST**4 / 3.0)):
        place = range(POSE * order, POSE * (order + 1))
        out[place, place] += scale * np.square(change[TANGENT.pose])
    return out
