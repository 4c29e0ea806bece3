"""Looks for a bare hand in foreground maps, in a thread: that takes a second, and frames go on meanwhile."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rhot_app.barehand.observations import ForegroundFrame
from rhot_app.barehand.relocalisation import LOCAL_SEARCH_S, ODDS_DROP, RELOCALISATION_LOG_ODDS, SAME_POSE_M
from rhot_app.barehand.silhouette import CORRELATED, search
from rhot_app.barehand.surface import SHAPE
from rhot_app.barehand.tracker import BareHandTracker
from rhot_app.hand.motion.hand_process import FASTEST, POSE
from rhot_app.hand.skeleton import HandPose
from rhot_app.tracking.contours.evidence import joints_of
from rhot_app.tracking.contours.requests import CameraFrames

Array = NDArray[np.float64]

log = logging.getLogger(__name__)

MOVED_M, TURNED = 0.05, 0.4
"""m and rad: how far a hand that is being looked for moves while it is, at most: it is held still, more or less."""

LEAST_GAIN = RELOCALISATION_LOG_ODDS * CORRELATED
"""Log odds of pixels by which another pose must cover the foreground better (`barehand.relocalisation`)."""

SAME_MAPS_NS = 100_000_000
"""ns: what was seen so far apart may still be of one place of a hand that is looked for."""

_ROUNDS = 60  # of the search about what was found, in the newest maps: half of `start.LAST_ROUNDS`, for it is near


@dataclass(frozen=True, slots=True)
class Maps:
    """Foreground probabilities of every STEP-th pixel of each camera about `t_ns`, None of one without a picture."""

    t_ns: int
    probabilities: list[NDArray[np.float32] | None]


class NewestMaps:
    """The newest foreground map of each camera."""

    def __init__(self, cameras: Sequence[CameraFrames]) -> None:
        self._cameras = cameras
        self._maps: list[ForegroundFrame | None] = [None] * len(cameras)

    @property
    def same_ns(self) -> float:
        """How far apart maps of one moment are at most, ns: half a period, but for jitter."""
        return 0.75 * max(camera.period_ns for camera in self._cameras)

    def take(self, frame: ForegroundFrame) -> Maps | None:
        """Take one in. The maps of all cameras that deliver frames, of about its moment; None while one is missing."""
        self._maps[frame.camera], t_ns = frame, frame.t_row0_master_ns
        maps: list[ForegroundFrame | None] = []
        for camera, one in zip(self._cameras, self._maps, strict=True):
            fresh = one is not None and abs(t_ns - one.t_row0_master_ns) <= self.same_ns
            if camera.delivers(t_ns) and not fresh:
                return None
            maps.append(one if fresh else None)
        return Maps(t_ns, [None if one is None else one.probability for one in maps])


class Finder:
    """Searches in a thread of its own. `look` and `relocalise` begin one, `found` and `change` return its result once.

    One search runs at a time. All methods belong to the tracker's thread."""

    def __init__(self, hand: BareHandTracker, *, alone: bool = True) -> None:
        """`alone`: no other hand is in the images, for which a search everywhere might take it."""
        self._hand, self._alone = hand, alone
        self._rng = np.random.default_rng(0)
        self._thread: threading.Thread | None = None
        self._newest: Maps | None = None
        self._found: tuple[int, HandPose, int] | None = None  # of which run
        self._change: tuple[int, Array | None, bool] | None = None
        self._run = 0
        self._searched_s = -np.inf

    def reset(self) -> None:
        """What is being looked for is not wanted any more."""
        self._run += 1
        self._found = self._newest = self._change = None
        self._searched_s = -np.inf

    def look(self, maps: Maps) -> None:
        """Look for a hand in these maps, or, while another search goes on, follow what it finds into them."""
        self._newest = maps
        self._begin(self._look, maps, self._run)

    def relocalise(self, maps: Maps, state: Array, covariance: Array, dt_s: float, everywhere: bool = False) -> None:
        """See whether a hand in `state` may have gone elsewhere in `dt_s` (`Relocaliser.relocalise`)."""
        self._begin(self._relocalise, maps, state.copy(), covariance.copy(), dt_s, everywhere, self._run)

    def follow(self, maps: Maps, t_s: float, dt_s: float) -> bool:
        """Search anew every SEARCHED_S, and when the hand covers the foreground of `t_s` worse than of late. The search
        asks whether another pose, as far away as hands go in `dt_s`, covers it better. A change that was found is
        compared in the newest maps, into which the hand has moved meanwhile. Whether it was moved: edges tell better
        how, unless they take one finger for another."""
        hand, relocaliser = self._hand, self._hand.relocaliser
        state, covariance = hand.filter.predict(t_s)
        odds, (change, same) = relocaliser.odds_of(maps.probabilities), self.change()
        relocaliser.schedule_global_search(t_s, relocalised=False, same=same)
        per_pixel = relocaliser.log_odds_per_pixel(odds, state)
        worse = per_pixel < relocaliser.average_odds - ODDS_DROP
        if change is not None:
            moved = hand.process.retract(state, change)
            way = joints_of(hand, moved) - joints_of(hand, state)
            confused = np.linalg.norm(way - way.mean(axis=0), axis=1).max() > SAME_POSE_M
            gain = relocaliser.log_odds(odds, moved) - relocaliser.log_odds(odds, state)
            gain += CORRELATED * (relocaliser.log_prior(moved) - relocaliser.log_prior(state))
            if (worse or confused) and gain > LEAST_GAIN:
                hand.filter.start(t_s, moved, _widened(covariance, change))
                relocaliser.schedule_global_search(t_s, relocalised=True, same=False)
                return True
        if worse or t_s - self._searched_s > LOCAL_SEARCH_S:
            everywhere = self._alone and not self._busy and relocaliser.global_search_due(maps.probabilities, t_s)
            self.relocalise(maps, state, covariance, dt_s, everywhere)
            self._searched_s = t_s
        relocaliser.average(per_pixel, first=not relocaliser.average_odds)
        return False

    def found(self) -> tuple[HandPose, int] | None:
        """A pose and its time, master ns, if one was found since it was asked for last."""
        found, self._found = self._found, None
        return None if found is None or found[0] != self._run else found[1:]

    def change(self) -> tuple[Array | None, bool]:
        """The step in the tangent space to where the hand may be, if it was found since it was asked for last, and
        whether the same hand was found everywhere."""
        found, self._change = self._change, None
        return (None, False) if found is None or found[0] != self._run else found[1:]

    def wait(self) -> None:
        """Until the search is over."""
        if self._thread is not None:
            self._thread.join()

    @property
    def _busy(self) -> bool:
        return self._thread is not None and self._thread.is_alive()

    def _begin(self, search_for: Callable[..., None], *arguments: Any) -> None:
        if not self._busy:
            self._thread = threading.Thread(target=_logged, args=(search_for, *arguments), name="find", daemon=True)
            self._thread.start()

    def _look(self, maps: Maps, run: int) -> None:
        pose = self._hand.relocaliser.search_globally(maps.probabilities, np.zeros(SHAPE), self._rng)
        newest = self._newest
        if pose is None or run != self._run:
            return
        if newest is not None and newest is not maps:
            pose, maps = self._followed(pose, newest), newest
        self._found = run, pose, maps.t_ns

    def _relocalise(self, maps: Maps, state: Array, covariance: Array, dt_s: float, everywhere: bool, run: int) -> None:
        process = self._hand.process
        moved, same = self._hand.relocaliser.relocalise(maps.probabilities, (state, covariance), process.stationary,
                                                        dt_s, everywhere)
        if moved is not None or same:
            self._change = run, None if moved is None else process.difference(moved, state), same

    def _followed(self, pose: HandPose, maps: Maps) -> HandPose:
        """The pose in later maps, near to where it was."""
        hand = self._hand
        odds = hand.relocaliser.odds_of(maps.probabilities)
        covariance = np.diag(np.repeat(np.square([MOVED_M, TURNED, TURNED]), (3, 3, 21)))
        covariance[6:, 6:] = np.linalg.inv(hand.model.pose_prior.information + np.eye(21) / TURNED**2)
        if hand.plane is not None:
            covariance = hand.plane.narrowed(covariance)
        world, angles, _ = search(hand.surface, pose.world_from_palm, pose.angles, covariance, hand.model.limits,
                                  np.zeros(SHAPE), odds, self._rng, _ROUNDS)
        return HandPose(world, angles)


def _widened(covariance: Array, change: Array) -> Array:
    """The covariance of a hand that was wrong by `change`: its pose errs by as much more, and its motion as a hand's
    does whose pose varies so (`HandProcess.stationary`)."""
    out = covariance.copy()
    for order, scale in enumerate((1.0, FASTEST**2 / 3.0, FASTEST**4 / 3.0)):
        place = range(POSE * order, POSE * (order + 1))
        out[place, place] += scale * np.square(change[:POSE])
    return out


def _logged(search_for: Callable[..., None], *arguments: Any) -> None:
    """A search that fails is logged; the next maps are searched anew."""
    try:
        search_for(*arguments)
    except Exception:
        log.exception("the search for a hand failed")
