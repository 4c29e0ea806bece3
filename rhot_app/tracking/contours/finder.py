"""Searches for a bare hand in foreground maps, in a thread: a search takes seconds, and frames keep arriving."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rhot_app.barehand.observations import ForegroundFrame
from rhot_app.barehand.relocalisation import (
    LOCAL_SEARCH_S,
    ODDS_DROP,
    RELOCALISATION_LOG_ODDS,
    SAME_POSE_M,
    Relocalisation,
)
from rhot_app.barehand.silhouette import search
from rhot_app.barehand.surface import SHAPE
from rhot_app.barehand.tracker import BareHandTracker
from rhot_app.hand.motion.hand_process import FASTEST, POSE
from rhot_app.hand.skeleton import HandPose
from rhot_app.tracking.contours.evidence import joints_of
from rhot_app.tracking.contours.requests import CameraFrames
from rhot_node.threads import OneShotThread

Array = NDArray[np.float64]

MOVED_M, TURNED = 0.05, 0.4
"""m and rad: standard deviations of the motion of a hand during a search: it is held nearly still."""

SAME_MAPS_NS = 100_000_000
"""ns: observations nearer in time count as of one position of a hand that is searched for."""

_ROUNDS = 60  # of the refinement of a found pose in the newest maps: half of `start.LAST_ROUNDS`, as it is near


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
    """Searches in a thread of its own. `search_everywhere` and `relocalise` begin one, `found` and `change` return its
    result once.

    One search runs at a time. All methods belong to the tracker's thread."""

    def __init__(self, hand: BareHandTracker, *, alone: bool = True) -> None:
        """`alone`: there is no second hand, with which a search of the whole image might confuse this one."""
        self._hand, self._alone = hand, alone
        self._rng = np.random.default_rng(0)
        self._task: OneShotThread | None = None
        self._newest: Maps | None = None
        self._found: tuple[int, HandPose, int] | None = None  # of which run
        self._change: tuple[int, Relocalisation] | None = None
        self._run = 0
        self._searched_s = -np.inf

    def reset(self) -> None:
        """Discard the result of the running search."""
        self._run += 1
        self._found = self._newest = self._change = None
        self._searched_s = -np.inf

    def search_everywhere(self, maps: Maps) -> None:
        """Search these maps for a hand. While another search runs, its result will be refined in these maps instead."""
        self._newest = maps
        self._begin(self._search, maps, self._run)

    def relocalise(self, maps: Maps, state: Array, covariance: Array, dt_s: float, everywhere: bool = False) -> None:
        """Search for a better pose than that in `state`, as far as hands move in `dt_s`, s
        (`Relocaliser.relocalise`)."""
        self._begin(self._relocalise, maps, state.copy(), covariance.copy(), dt_s, everywhere, self._run)

    def verify(self, maps: Maps, t_s: float, dt_s: float) -> bool:
        """Verify the predicted pose by maps of `t_s`, s, and relocalise the hand where the last search found a better
        one. Returns whether it was relocalised.

        A search starts every LOCAL_SEARCH_S, and when the pose's log odds per pixel drop below their average. Its
        result is compared in the newest maps, into which the hand has moved since. Edges locate a hand more accurately,
        so small changes are left to them, unless a finger was mistaken for another one, or the hand was found
        elsewhere.
        """
        hand, relocaliser = self._hand, self._hand.relocaliser
        state, covariance = hand.filter.predict(t_s)
        odds, (change, anew, same) = relocaliser.odds_of(maps.probabilities), self.change()
        relocaliser.schedule_global_search(t_s, relocalised=False, same=same)
        per_pixel = relocaliser.log_odds_per_pixel(odds, state)
        worse = per_pixel < relocaliser.average_odds - ODDS_DROP
        if change is not None:
            moved = hand.process.retract(state, change)
            way = joints_of(hand, moved) - joints_of(hand, state)
            confused = np.linalg.norm(way - way.mean(axis=0), axis=1).max() > SAME_POSE_M
            gain = relocaliser.log_odds(odds, moved) - relocaliser.log_odds(odds, state)
            if (anew or worse or confused) and gain > RELOCALISATION_LOG_ODDS:
                if anew:
                    hand.restart(t_s, moved, anew=True)
                    relocaliser.average_odds = 0.0
                else:
                    hand.filter.start(t_s, moved, _inflated(covariance, change))
                relocaliser.schedule_global_search(t_s, relocalised=True, same=False)
                return True
        if worse or t_s - self._searched_s > LOCAL_SEARCH_S:
            everywhere = self._alone and not self._busy and relocaliser.global_search_due(maps.probabilities, t_s)
            self.relocalise(maps, state, covariance, dt_s, everywhere)
            self._searched_s = t_s
        relocaliser.average(per_pixel, first=not relocaliser.average_odds)
        return False

    def found(self) -> tuple[HandPose, int] | None:
        """The pose of the last search of the whole image and its time, master ns; None without a new one."""
        found, self._found = self._found, None
        return None if found is None or found[0] != self._run else found[1:]

    def change(self) -> Relocalisation:
        """The last relocalisation, with the step in the tangent space to the better state in place of that state."""
        found, self._change = self._change, None
        return Relocalisation(None, False, False) if found is None or found[0] != self._run else found[1]

    def wait(self) -> None:
        """Wait for the running search."""
        if self._task is not None:
            self._task.join()

    @property
    def _busy(self) -> bool:
        return self._task is not None and self._task.running

    def _begin(self, search_for: Callable[..., None], *arguments: Any) -> None:
        if not self._busy:
            self._task = OneShotThread("searches for a hand", functools.partial(search_for, *arguments))

    def _search(self, maps: Maps, run: int) -> None:
        pose = self._hand.relocaliser.search_globally(maps.probabilities, self._rng)
        newest = self._newest
        if pose is None or run != self._run:
            return
        if newest is not None and newest is not maps:
            pose, maps = self._refined(pose, newest), newest
        self._found = run, pose, maps.t_ns

    def _relocalise(self, maps: Maps, state: Array, covariance: Array, dt_s: float, everywhere: bool, run: int) -> None:
        process = self._hand.process
        found = self._hand.relocaliser.relocalise(maps.probabilities, (state, covariance), process.stationary, dt_s,
                                                  everywhere)
        step = None if found.state is None else process.difference(found.state, state)
        self._change = run, found._replace(state=step)

    def _refined(self, pose: HandPose, maps: Maps) -> HandPose:
        """The pose refined in later maps."""
        hand = self._hand
        odds = hand.relocaliser.odds_of(maps.probabilities)
        covariance = np.diag(np.repeat(np.square([MOVED_M, TURNED, TURNED]), (3, 3, 21)))
        covariance[6:, 6:] = np.linalg.inv(hand.model.pose_prior.information + np.eye(21) / TURNED**2)
        if hand.plane is not None:
            covariance = hand.plane.narrowed(covariance)
        world, angles = search(hand.surface, pose.world_from_palm, pose.angles, covariance, hand.model.limits,
                                  np.zeros(SHAPE), odds, self._rng, _ROUNDS)
        return HandPose(world, angles)


def _inflated(covariance: Array, change: Array) -> Array:
    """The covariance after a relocalisation by `change`, inflated: the pose by its square, velocity and acceleration by
    those of a hand whose pose varies as much (`HandProcess.stationary`)."""
    out = covariance.copy()
    for order, scale in enumerate((1.0, FASTEST**2 / 3.0, FASTEST**4 / 3.0)):
        place = range(POSE * order, POSE * (order + 1))
        out[place, place] += scale * np.square(change[:POSE])
    return out
