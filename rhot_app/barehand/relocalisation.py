"""Relocalisation of a tracked hand: when the foreground is searched for a better pose, and the search.

A search about the prediction corrects a finger that was mistaken for another one. It does not leave a pose that is
wrong by more than a finger's breadth: then the track is lost, and the hand is shown its start pose again.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rhot_app.barehand.silhouette import LogOddsMaps, log_odds_maps, score
from rhot_app.barehand.start import STEP, ForegroundMaps, log_odds, settle
from rhot_app.barehand.surface import Surface
from rhot_app.geometry.camera import CameraModel
from rhot_app.hand.model import HandModel
from rhot_app.hand.motion.hand_process import FASTEST
from rhot_app.hand.motion.hand_state import STATE, TANGENT, pose_of
from rhot_app.hand.motion.palm_on_plane import PalmOnPlane
from rhot_app.hand.skeleton import HandPose

Array = NDArray[np.float64]

RELOCALISATION_LOG_ODDS = 7.0
"""Log odds by which another pose must be better than the predicted one: what the surface's own error changes them by.
By estimate, that is 0.5 mm along each side of a finger and 1 mm along the palm (`contour_residual.COMMON`), at 0.5 m
before two cameras with a twelfth of the image foreground."""

LOCAL_SEARCH_S = 0.2
"""s: interval of the searches about the prediction, and so the longest time of a wrong pose that they correct. Chosen:
about a person's reaction time. A search in every image doubles the time of a step."""

SAME_POSE_M = 0.02
"""m: joints of one pose are nearer to each other, in the mean or at most; beyond, a finger is taken for another one.
Neighbouring knuckles are so far apart in the hand files."""

ODDS_DROP = 0.25
"""Log odds per pixel below their average at which a search is due at once: a twentieth of the hand, half a finger, off
the foreground (`silhouette.MISLABELLED`: about 5 for each of its pixels, if a twelfth of the image is foreground)."""

ODDS_SMOOTHING = 0.1
"""Weight of a new image in that average. Chosen: ten images, a third of a second at 30 a second."""


class Relocaliser:
    """The searches for one tracked hand. `average_odds`: moving average of its log odds per pixel
    (`log_odds_per_pixel`), 0 before the first images. `rng`: of all random searches."""

    def __init__(self, model: HandModel, surface: Surface, cameras: Sequence[CameraModel],
                 plane: PalmOnPlane | None) -> None:
        """`plane`: on which the palm lies, if it is known."""
        self.model, self.surface, self.cameras, self.plane = model, surface, cameras, plane
        self.rng = np.random.default_rng(0)
        self.average_odds = 0.0
        self.restart()

    # -- when ----------------------------------------------------------------------------------------------------------

    def restart(self) -> None:
        """Schedule the searches of a track that begins at time 0: the first one at once."""
        self.last_search_s = -np.inf

    def search_due(self, odds: LogOddsMaps, state: Array, t_s: float) -> bool:
        """Whether a search about the predicted `state` is due at `t_s`, s: because of the time, or because the
        prediction covers the foreground worse than the hand did on average."""
        late = t_s - self.last_search_s > LOCAL_SEARCH_S
        return bool(late or self.log_odds_per_pixel(odds, state) < self.average_odds - ODDS_DROP)

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
        return log_odds(self.surface, pose.world_from_palm, pose.angles, self.model, state[STATE.shape], odds)

    def log_odds_per_pixel(self, odds: LogOddsMaps, state: Array) -> float:
        """Log odds by the foreground per pixel of the hand, without the forearm's."""
        pose = pose_of(state)
        _, parts = score(self.surface, pose.world_from_palm, pose.angles, state[STATE.shape], odds)
        return float((parts[:, 0] + parts[:, 2]).sum() / max(parts[:, 1].sum(), 1.0))

    # -- where ---------------------------------------------------------------------------------------------------------

    def relocalise(self, maps: ForegroundMaps, prediction: tuple[Array, Array], stationary: Array,
                   dt_s: float) -> Array | None:
        """A state whose pose is better than the predicted one by RELOCALISATION_LOG_ODDS; None without any.

        `prediction`: state and covariance (n, n). The search reaches as far as hands move in `dt_s`, s, by the motion's
        `stationary` covariance (n, n). Only `rng` changes, so it may run in a thread.
        """
        (state, covariance), odds, old = prediction, self.odds_of(maps), pose_of(prediction[0])
        size, pace = state[STATE.shape].copy(), FASTEST / np.sqrt(3.0) * dt_s
        spread = covariance[TANGENT.pose, TANGENT.pose] + pace**2 * stationary[TANGENT.pose, TANGENT.pose]
        world, angles = settle(self.surface, old.world_from_palm, old.angles, spread, self.model, size, odds, self.rng,
                               self.plane)
        moved = _with_pose(state, HandPose(world, angles))
        better = self.log_odds(odds, moved) > self.log_odds(odds, state) + RELOCALISATION_LOG_ODDS
        return moved if better else None


def _with_pose(state: Array, pose: HandPose) -> Array:
    """The state with another pose."""
    out = state.copy()
    out[STATE.palm], out[STATE.angles] = pose.world_from_palm[:3].ravel(), pose.angles
    return out
