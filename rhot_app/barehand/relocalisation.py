"""Relocalisation of a tracked hand: when the foreground is searched for a better pose, and the search.

A search about the prediction corrects a finger that was mistaken for another one. It does not leave a pose that is
wrong by more than a finger's breadth, as a start may be. So the whole image is searched too, at growing intervals,
until that search finds the hand that is tracked.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rhot_app.barehand.silhouette import LogOddsMaps, log_odds_maps, score
from rhot_app.barehand.start import STEP, find_hand, log_odds, settle
from rhot_app.barehand.surface import SHAPE, Surface
from rhot_app.geometry.camera import CameraModel
from rhot_app.hand.kinematics import forward
from rhot_app.hand.model import HandModel
from rhot_app.hand.motion.hand_process import ANGLES, BIAS, FASTEST, POSE, VELOCITY
from rhot_app.hand.motion.palm_on_plane import PalmOnPlane
from rhot_app.hand.skeleton import HandPose

Array = NDArray[np.float64]
ForegroundMaps = Sequence[NDArray[np.float32] | None]
"""Foreground probabilities (h, w) of every STEP-th pixel of each camera, None of a camera without an image."""

RELOCALISATION_LOG_ODDS = 7.0
"""Log odds by which another pose must be better than the predicted one: what the surface's own error changes them by.
By estimate, that is 0.5 mm along each side of a finger and 1 mm along the palm (`contour_residual.COMMON`), at 0.5 m
before two cameras with a twelfth of the image foreground."""

LOCAL_SEARCH_S = 0.2
"""s: interval of the searches about the prediction, and so the longest time of a wrong pose that they correct. Chosen:
about a person's reaction time. A search in every image doubles the time of a step."""

GLOBAL_SEARCH_S = 0.25, 4.0
"""s: from a start to the first search of the whole image, and the longest interval between two; each interval is twice
the last one. Chosen: a wrong start lasts no longer than a person needs to see it. A search takes two seconds of a
core."""

SAME_POSE_M = 0.02
"""m: joints of one pose are nearer to each other, in the mean or at most; beyond, a finger is taken for another one.
Neighbouring knuckles are so far apart in the hand files."""

SAME_HAND_M = 0.1
"""m: palms of one hand are nearer to each other: a hand's breadth."""

ODDS_DROP = 0.25
"""Log odds per pixel below their average at which a search is due at once: a twentieth of the hand, half a finger, off
the foreground (`silhouette.MISLABELLED`: about 5 for each of its pixels, if a twelfth of the image is foreground)."""

ODDS_SMOOTHING = 0.1
"""Weight of a new image in that average. Chosen: ten images, a third of a second at 30 a second."""


class Relocalisation(NamedTuple):
    """Result of a search: a better `state` (n,) than the predicted one, None without any; whether it begins a track
    `anew`, at rest and with the file's shape; whether the whole image has the `same` hand as the prediction."""

    state: Array | None
    anew: bool
    same: bool


class Relocaliser:
    """The searches for one tracked hand. `average_odds`: moving average of its log odds per pixel
    (`log_odds_per_pixel`), 0 before the first images. `rng`: of all searches in images of files."""

    def __init__(self, model: HandModel, surface: Surface, cameras: Sequence[CameraModel],
                 plane: PalmOnPlane | None) -> None:
        """`plane`: on which the palm lies, if it is known."""
        self.model, self.surface, self.cameras, self.plane = model, surface, cameras, plane
        self.rng = np.random.default_rng(0)
        self.average_odds = 0.0
        self.restart()

    # -- when ----------------------------------------------------------------------------------------------------------

    def restart(self) -> None:
        """Schedule the searches of a track that begins at time 0: the first one about the prediction at once."""
        self.last_search_s = -np.inf
        self._global_s = self._interval_s = GLOBAL_SEARCH_S[0]

    def search_due(self, odds: LogOddsMaps, state: Array, t_s: float) -> bool:
        """Whether a search about the predicted `state` is due at `t_s`, s: because of the time, or because the
        prediction covers the foreground worse than the hand did on average."""
        late = t_s - self.last_search_s > LOCAL_SEARCH_S
        return bool(late or self.log_odds_per_pixel(odds, state) < self.average_odds - ODDS_DROP)

    def global_search_due(self, maps: ForegroundMaps, t_s: float) -> bool:
        """Whether the whole image should be searched at `t_s`, s; if so, the next interval is twice as long.

        Never in the maps of one camera, unless a plane is known: there a start is hardly more accurate than a track.
        """
        if t_s < self._global_s or (sum(one is not None for one in maps) < 2 and self.plane is None):
            return False
        self._interval_s = min(2.0 * self._interval_s, GLOBAL_SEARCH_S[1])
        self._global_s = t_s + self._interval_s
        return True

    def schedule_global_search(self, t_s: float, *, relocalised: bool, same: bool) -> None:
        """Schedule the next search of the whole image by the result of one at `t_s`, s: soon after a relocalisation,
        never once the `same` hand was found."""
        if same:
            self._global_s = np.inf
        elif relocalised:
            self._global_s = min(self._global_s, t_s + GLOBAL_SEARCH_S[0])
            self._interval_s = GLOBAL_SEARCH_S[0]

    def average(self, odds_per_pixel: float, *, first: bool) -> None:
        """Take the log odds per pixel of one estimate into the average, or begin it with them."""
        self.average_odds += (1.0 if first else ODDS_SMOOTHING) * (odds_per_pixel - self.average_odds)

    # -- how good a pose is --------------------------------------------------------------------------------------------

    def odds_of(self, maps: ForegroundMaps) -> LogOddsMaps:
        """Log odds of the foreground, of the cameras that have a map."""
        used = [c for c, one in enumerate(maps) if one is not None]
        return log_odds_maps([one for one in maps if one is not None], STEP,
                             [self.cameras[c].camera_from_world[:3] for c in used],
                             [self.cameras[c].intrinsics for c in used])

    def log_odds(self, odds: LogOddsMaps, state: Array) -> float:
        """Log odds of the hand in `state` by the foreground (`silhouette.score`) and the pose prior, up to a
        constant."""
        pose = pose_of(state)
        return log_odds(self.surface, pose.world_from_palm, pose.angles, self.model, state[BIAS:BIAS + SHAPE], odds)

    def log_odds_per_pixel(self, odds: LogOddsMaps, state: Array) -> float:
        """Log odds by the foreground per pixel of the hand, without the forearm's."""
        pose = pose_of(state)
        _, parts = score(self.surface, pose.world_from_palm, pose.angles, state[BIAS:BIAS + SHAPE], odds)
        return float((parts[:, 0] + parts[:, 2]).sum() / max(parts[:, 1].sum(), 1.0))

    # -- where ---------------------------------------------------------------------------------------------------------

    def search_globally(self, maps: ForegroundMaps, rng: np.random.Generator) -> HandPose | None:
        """The most probable hand of the file's shape anywhere in foreground maps; None without any."""
        return find_hand(maps, self.cameras, self.model, self.surface, rng, self.plane)

    def relocalise(self, maps: ForegroundMaps, prediction: tuple[Array, Array], stationary: Array, dt_s: float,
                   everywhere: bool = False) -> Relocalisation:
        """Search for a pose that is better than the predicted one by RELOCALISATION_LOG_ODDS.

        `prediction`: state and covariance (n, n). The search reaches as far as hands move in `dt_s`, s, by the motion's
        `stationary` covariance (n, n). `everywhere`: the whole image too. A pose found there may be another hand, or
        the tracked one, whose shape was learnt in a wrong pose. So it begins a track anew, if it is also better than
        the best pose near the prediction. Only `rng` changes, so it may run in a thread.
        """
        (state, covariance), odds, old = prediction, self.odds_of(maps), pose_of(prediction[0])
        size, pace = state[BIAS:BIAS + SHAPE].copy(), FASTEST / np.sqrt(3.0) * dt_s
        spread = covariance[:POSE, :POSE] + pace**2 * stationary[:POSE, :POSE]
        world, angles = settle(self.surface, old.world_from_palm, old.angles, spread, self.model, size, odds, self.rng,
                               self.plane)
        best, least = None, self.log_odds(odds, state) + RELOCALISATION_LOG_ODDS
        moved = _with_pose(state, HandPose(world, angles))
        if (value := self.log_odds(odds, moved)) > least:
            best, least = moved, value
        pose = self.search_globally(maps, self.rng) if everywhere else None
        if pose is None:
            return Relocalisation(best, False, False)
        joints = [forward(self.model, one).joints for one in (pose, old, HandPose(world, angles))]
        if any(np.linalg.norm(joints[0] - one, axis=1).max() < SAME_POSE_M for one in joints[1:]):
            return Relocalisation(best, False, True)
        other = _with_pose(state, pose)
        other[VELOCITY:] = 0.0
        if self.log_odds(odds, other) > least:
            return Relocalisation(other, True, False)
        return Relocalisation(best, False, False)


def pose_of(state: Array) -> HandPose:
    """The pose in a state."""
    world = np.eye(4)
    world[:3] = state[:ANGLES].reshape(3, 4)
    return HandPose(world, state[ANGLES:VELOCITY].copy())


def _with_pose(state: Array, pose: HandPose) -> Array:
    """The state with another pose."""
    out = state.copy()
    out[:ANGLES], out[ANGLES:VELOCITY] = pose.world_from_palm[:3].ravel(), pose.angles
    return out
