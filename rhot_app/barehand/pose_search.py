"""The search for a hand's pose in the foreground: of a hand that takes its start pose, and of one that is tracked.

It samples poses from a Gaussian and adapts it to the better ones (CMA-ES, Hansen, "The CMA Evolution Strategy: A
Tutorial", arXiv:1604.00772). A search about the prediction corrects a finger that was mistaken for another one. It does
not leave a pose that is wrong by more than a finger's breadth: then the track is lost, and the hand is shown its start
pose again.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray

from rhot_app.barehand.silhouette import ForegroundMaps, LogOddsMaps, log_odds_maps, moved_by, score, score_steps
from rhot_app.barehand.surface import Surface
from rhot_app.geometry.camera import CameraModel
from rhot_app.hand.model import HandModel
from rhot_app.hand.motion.hand_process import FASTEST
from rhot_app.hand.motion.hand_state import POSE, STATE, TANGENT
from rhot_app.hand.motion.palm_on_plane import PalmOnPlane
from rhot_app.hand.skeleton import ANGLE_SLICES, FLEXIONS

Array = NDArray[np.float64]

CORRELATED = 8.0
"""Pixels that count as one observation: errors of the model's contour and of the foreground are correlated along a
finger's breadth."""

RELOCALISATION_LOG_ODDS = 7.0
"""Log odds by which another pose must be better than the predicted one: what the surface's own error changes them by.
By estimate, that is 0.5 mm along each side of a finger and 1 mm along the palm, at 0.5 m
before two cameras with a twelfth of the image foreground."""

LOCAL_SEARCH_S = 0.2
"""s: interval of the searches about the prediction, and so the longest time of a wrong pose that they correct. Chosen:
about a person's reaction time. A search in every image doubles the time of a step."""

ODDS_DROP = 0.25
"""Log odds per pixel below their average at which a search is due at once: a twentieth of the hand, half a finger, off
the foreground (`silhouette.MISLABELLED`: about 5 for each of its pixels, if a twelfth of the image is foreground)."""

ODDS_SMOOTHING = 0.1
"""Weight of a new image in that average. Chosen: ten images, a third of a second at 30 a second."""

ROUNDS = 15
"""Rounds of a search. Chosen: enough to rank postures."""

DRAWS = 14
"""Population size of CMA-ES: Hansen's default for 27 dimensions, 4 + 3 ln 27, rounded up."""

START_STEP = 0.5
"""Initial step size of CMA-ES in standard deviations of the prior. Chosen: with 1, fewer starts are good."""

_CURLS = np.radians(((5.0, 10.0, 5.0), (20.0, 30.0, 20.0), (65.0, 80.0, 45.0)))  # MCP, PIP, DIP: open, relaxed, closed
_THUMB_STEP = 0.5  # rad to either side of a relaxed thumb: a third of its range


class PoseSearch:
    """The searches for one hand. `average_odds`: moving average of its log odds per pixel (`log_odds_per_pixel`), 0
    before the first images. States are those of `hand_state`, with shape."""

    def __init__(self, model: HandModel, surface: Surface, cameras: Sequence[CameraModel],
                 plane: PalmOnPlane | None) -> None:
        """`plane`: on which the palm lies, if it is known."""
        self.model, self.surface, self.cameras, self.plane = model, surface, cameras, plane
        self._rng = np.random.default_rng(0)
        self.restart()

    def restart(self) -> None:
        """Another track begins."""
        self.average_odds, self._last_search_s = 0.0, -np.inf

    def worse(self, odds_per_pixel: float) -> bool:
        """Whether a prediction with these log odds per pixel covers the foreground worse than the hand did on
        average."""
        return odds_per_pixel < self.average_odds - ODDS_DROP

    def begins_search(self, odds_per_pixel: float, t_s: float) -> bool:
        """Begin a search about such a prediction at `t_s`, s, if it is time or the prediction is worse; whether it
        has begun."""
        due = self.worse(odds_per_pixel) or t_s - self._last_search_s > LOCAL_SEARCH_S
        if due:
            self._last_search_s = t_s
        return due

    def average(self, odds_per_pixel: float) -> None:
        """Take the log odds per pixel of one estimate into the average, which the first one begins."""
        self.average_odds += (ODDS_SMOOTHING if self.average_odds else 1.0) * (odds_per_pixel - self.average_odds)

    def odds_of(self, maps: ForegroundMaps, rate: float | None = None) -> LogOddsMaps:
        """Log odds of the foreground, of the cameras that have a map. `rate`: see `log_odds_maps`."""
        return log_odds_maps(maps, self.cameras, rate)

    def log_odds(self, odds: LogOddsMaps, state: Array) -> float:
        """Log odds of the hand in `state` by the foreground (`silhouette.score`) and the pose prior, up to a
        constant."""
        prior = self.model.pose_prior
        bent = state[STATE.angles] - prior.mean
        return score(self.surface, state, odds)[0] / CORRELATED - 0.5 * float(bent @ prior.information @ bent)

    def log_odds_per_pixel(self, odds: LogOddsMaps, state: Array) -> float:
        """Log odds by the foreground per pixel of the hand, without the forearm's."""
        _, parts = score(self.surface, state, odds)
        return float((parts[:, 0] + parts[:, 2]).sum() / max(parts[:, 1].sum(), 1.0))

    def relocalise(self, maps: ForegroundMaps, prediction: tuple[Array, Array], stationary: Array,
                   dt_s: float) -> Array | None:
        """A state whose pose is better than the predicted one by RELOCALISATION_LOG_ODDS; None without any.

        `prediction`: state and covariance (n, n). The search reaches as far as hands move in `dt_s`, s, by the motion's
        `stationary` covariance (n, n). It may run in a thread of its own.
        """
        (state, covariance), odds = prediction, self.odds_of(maps)
        pace, own = FASTEST / np.sqrt(3.0) * dt_s, TANGENT.pose
        moved = self.settle(odds, state, covariance[own, own] + pace**2 * stationary[own, own])
        better = self.log_odds(odds, moved) > self.log_odds(odds, state) + RELOCALISATION_LOG_ODDS
        return moved if better else None

    def settle(self, odds: LogOddsMaps, state: Array, covariance: Array) -> Array:
        """The state with the most probable pose by the foreground about that in `state`, with prior covariance
        (27, 27). Each finger is tried in each posture before the search and in between (`choose_postures`)."""
        if self.plane is not None:
            covariance = self.plane.narrowed(covariance)
        moved = self._search(odds, self.choose_postures(odds, state), covariance)
        return self._search(odds, self.choose_postures(odds, moved), 0.25 * covariance)

    def choose_postures(self, odds: LogOddsMaps, state: Array) -> Array:
        """The state with the posture of each digit that the foreground makes most probable: a finger unchanged, open,
        relaxed or closed; the thumb unchanged, relaxed or to either side. Then each pair of neighbouring fingers, with
        the prior's abduction, in all nine combinations: one may lie in the other's place. Coordinate descent, twice
        over all digits. Locked angles (`HandModel.locked`) stay."""
        mean, held = self.model.pose_prior.mean, set(self.model.locked)
        choices: list[tuple[NDArray[np.int64], list[Array]]] = []
        turns = [k for k in (0, 1) if k not in held]  # the thumb's angles at its root
        if turns:
            thumbs = [mean[ANGLE_SLICES[0]] + aside * np.eye(5)[which]
                      for which, aside in ((0, 0.0), *product(turns, (-_THUMB_STEP, _THUMB_STEP)))]
            choices.append((np.r_[ANGLE_SLICES[0]], thumbs))
        choices += [(np.array(own), list(_CURLS)) for own in FLEXIONS[1:] if not held & set(own)]
        for finger in (1, 2, 3):
            both = np.r_[ANGLE_SLICES[finger], ANGLE_SLICES[finger + 1]]
            if not held & set(both):
                first, second = mean[both[[0, 4]]]
                choices.append((both, [np.r_[first, one, second, other] for one, other in product(_CURLS, _CURLS)]))
        for where, options in [*choices, *choices]:
            steps = np.zeros((1 + len(options), POSE))
            steps[1:, 6 + where] = options - state[STATE.angles][where]
            best = steps[int(np.argmax(score_steps(self.surface, state, steps, self.model.limits, odds)))]
            state = state.copy()
            state[STATE.angles] += best[TANGENT.angles]
        return state

    def _search(self, odds: LogOddsMaps, state: Array, covariance: Array) -> Array:
        """The state with the most probable pose about that in `state`, with prior covariance (27, 27), after ROUNDS of
        DRAWS poses.

        The score is the log odds by the foreground over CORRELATED, less half of the squared Mahalanobis distance.
        """
        root = np.linalg.cholesky(covariance + 1e-12 * np.eye(len(covariance)))

        def scores(white: Array) -> Array:
            values = score_steps(self.surface, state, white @ root.T, self.model.limits, odds)
            return np.asarray(values / CORRELATED - 0.5 * np.sum(white * white, axis=1))

        return np.asarray(moved_by(state, root @ _cma_es(scores, len(root), self._rng), self.model.limits))


def _cma_es(value: Callable[[Array], Array], n: int, rng: np.random.Generator) -> Array:
    """Maximise a function of (DRAWS, n), from 0 with START_STEP; returns the best (n,). CMA-ES with the default
    parameters of Hansen's tutorial, positive weights only. The first sample is the start itself."""
    mu = DRAWS // 2
    weights = np.log(mu + 0.5) - np.log(np.arange(1, mu + 1))
    weights /= weights.sum()
    mu_eff = 1.0 / float(np.sum(weights * weights))
    c_c, c_s = (4.0 + mu_eff / n) / (n + 4.0 + 2.0 * mu_eff / n), (mu_eff + 2.0) / (n + mu_eff + 5.0)
    c_1 = 2.0 / ((n + 1.3) ** 2 + mu_eff)
    c_mu = min(1.0 - c_1, 2.0 * (mu_eff - 2.0 + 1.0 / mu_eff) / ((n + 2.0) ** 2 + mu_eff))
    damping = 1.0 + 2.0 * max(0.0, np.sqrt((mu_eff - 1.0) / (n + 1.0)) - 1.0) + c_s
    expected = np.sqrt(n) * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n))  # length of a standard normal
    mean, step, path, step_path = np.zeros(n), START_STEP, np.zeros(n), np.zeros(n)
    covariance, axes, lengths = np.eye(n), np.eye(n), np.ones(n)
    best, best_value = mean, -np.inf
    for number in range(ROUNDS):
        if number and number % 5 == 0:  # every fifth round: it takes as long as DRAWS scores
            squares, axes = np.linalg.eigh(covariance)
            lengths = np.sqrt(np.maximum(squares, 1e-12))
        drawn = rng.standard_normal((DRAWS, n)) * lengths @ axes.T
        if number == 0:
            drawn[0] = 0.0
        points = mean + step * drawn
        values = value(points)
        order = np.argsort(-values)[:mu]
        if values[order[0]] > best_value:
            best, best_value = points[order[0]], float(values[order[0]])
        moved = weights @ drawn[order]
        mean = mean + step * moved
        step_path = (1.0 - c_s) * step_path + np.sqrt(c_s * (2.0 - c_s) * mu_eff) * (axes @ (axes.T @ moved / lengths))
        length = float(np.linalg.norm(step_path)) / expected
        steady = length / np.sqrt(1.0 - (1.0 - c_s) ** (2 * (number + 1))) < 1.4 + 2.0 / (n + 1.0)
        path = (1.0 - c_c) * path + steady * np.sqrt(c_c * (2.0 - c_c) * mu_eff) * moved
        covariance = ((1.0 - c_1 - c_mu) * covariance + c_1 * np.outer(path, path)
                      + c_mu * (drawn[order].T * weights) @ drawn[order])
        step *= float(np.exp(c_s / damping * (length - 1.0)))
    return best
