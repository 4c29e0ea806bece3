"""Refines where the cameras stand to each other while a hand with markers moves before them (self-calibration).

Pairs of cameras that see a marker at one instant give one epipolar error each. The errors of ten seconds are summed up
as information on the cameras' poses; an information filter goes through these summaries with a slow random walk, and
compares "nothing happened" with "a camera was knocked at this moment". What comes of it must predict observations that
were held back from it. Epipolar errors determine how a camera is turned against another one and the direction of the
baseline, never the scale (Hartley and Zisserman 2004, 9.6): the length of the baselines is kept.

A correction of camera k is `world_from_camera @ [exp(omega), tau]`: a turn about its own axes x (right), y (down) and z
(ahead), rad, and a shift along them, m. The first camera is the reference.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.check.camera_calibration import calibration_error
from rhot_app.estimation.change_point import ChangePoint, find_change
from rhot_app.estimation.quantiles import chi_squared_tail
from rhot_app.estimation.se3 import exp_so3, log_so3
from rhot_app.geometry.camera import CameraModel, point_rays
from rhot_app.geometry.transforms import inverse, rigid
from rhot_app.geometry.triangulate import Outcome, cast, empty_rays, triangulate
from rhot_app.project import Rig
from rhot_app.tracking.markers.marker_model import DRIFT_SD_RAD
from rhot_app.tracking.pairing import DOUBTFUL, Paired, Pairing
from rhot_app.tracking.refinement.pair_observations import TWIST, Pairs, PairStore, linearise, midpoints
from rhot_app.tracking.refinement.refined_rig import CameraCorrection, Refinement
from rhot_app.tracking.rig_arrays import compile_rig
from rhot_app.tracking.tracker import CameraObservations

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

# -- process and noise -------------------------------------------------------------------------------------------------

KNOCK_SD = np.array([math.radians(1.0)] * 3 + [5e-3] * 3)
"""How far a knock turns (rad) and shifts (m) a camera on its mount. More takes the hand out of its picture."""

KNOCKS_PER_S = 1.0 / 36_000.0
"""A camera is knocked once in ten hours of use."""

KNOCKED_BEFORE = 0.1
"""Probability of a knock between the calibration and the start."""

WALK_SD = np.array([DRIFT_SD_RAD] * 3 + [0.05 * DRIFT_SD_RAD] * 3)
"""Drift within an hour, rad and m: a bracket turns, and its camera, 5 cm away, moves."""

STUDENT = 4.0
"""Degrees of freedom of the errors' distribution, Student's t (Lange, Little and Taylor 1989)."""

BIAS_PX = 0.05
"""Standard deviation of the difference of a marker's centroid bias between two cameras (the bound that
`benchmarks/centroid.py` checks)."""

CALIBRATED_PX = 0.1
"""Epipolar error that a good calibration leaves (`FAIR_ERROR_PX`: 0.1 to 0.3); for rigs that do not record theirs."""

# -- sampling ----------------------------------------------------------------------------------------------------------

EVERY_S = 0.5
"""Between two samples: centroid biases last about as long, so denser ones add little information."""

SEGMENT_S = 10.0
"""Length of a summary, and how finely the moment of a knock is resolved."""

_BURST = 8  # frames per camera that an interpolation to one instant needs
_ROUNDS = 5  # of reweighting
_RELINEARISED = 3
_SMALL_SQ = math.radians(0.1) ** 2  # a step (rad) after which errors are linear to a hundredth of a pixel
_RESTART_S = 1.0  # a frame older than the newest by this belongs to another recording


@dataclass(frozen=True, slots=True, eq=False)
class Gathered:
    """Observations, and s of the newest frame."""

    rows: Pairs
    now_s: float


# -- the filter --------------------------------------------------------------------------------------------------------

@dataclass(frozen=True, slots=True, eq=False)
class _Summaries:
    """S segments of n unknowns: `t_s` (S,) begins, `matrix` (S, n, n) and `vector` (S, n) information about poses and
    biases; `weights` (N,) robust weights of the observations; `segment` (N,) which one each is in."""

    t_s: Array
    matrix: Array
    vector: Array
    weights: Array
    segment: Indices


@dataclass(frozen=True, slots=True, eq=False)
class _Solution:
    """`state` and `covariance` of poses and biases; `knocked_s` as in `Refinement`; `since` (N,) bool: the observations
    after the knock."""

    state: Array
    covariance: Array
    dispersion: float
    knocked_s: float | None
    since: NDArray[np.bool_]


class RigRefiner:
    """Takes every frame (`take`) and estimates the refinement every few seconds (`step`). One thread.

    Landmarks are left out: their errors are lasting and the same in no two cameras, so they would turn the cameras. A
    rig of one camera, of cameras in one place, without calibrated depth, without times, or of landmarks alone is not
    refined: `active` is False.
    """

    def __init__(self, rig: Rig) -> None:
        self.rig = rig
        models = [CameraModel.from_rig(node.intrinsics, node.pose) for node in rig.nodes]
        self._stored = np.array([model.world_from_camera for model in models])
        self._compiled = compile_rig(rig)
        self._focal = self._compiled.intrinsics[:, :2]
        centres = self._stored[:, :3, 3]
        self._base_m = float(np.linalg.norm(centres - centres[0], axis=1).sum())
        self._own = np.array([marker.shape != "landmark" for marker in rig.markers.markers])
        places = {tuple(centre) for centre in centres.tolist()}
        self.active = (len(models) > 1 and len(places) == len(models) and rig.depth.mode == "stereo"
                       and self._own.any() and not any(node.text_datagrams for node in rig.nodes))
        self._pairs = list(combinations(range(len(models)), 2))
        self._pair_of = np.zeros((len(models), len(models)), np.intp)
        for number, (i, j) in enumerate(self._pairs):
            self._pair_of[i, j] = number
        self._poses = TWIST * (len(models) - 1)
        self._size = self._poses + len(self._pairs) * len(rig.markers.ids)
        self._calibrated, copies = self._calibrated_variances(), len(models) - 1
        biases = np.zeros(self._size - self._poses)
        self._prior = np.concatenate([self._calibrated, biases + BIAS_PX**2])
        self._knock = np.concatenate([np.tile(KNOCK_SD**2, copies), biases])
        self._walk = np.concatenate([np.tile(WALK_SD**2 / 3600.0, copies), biases])
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self.store = PairStore()
        self._frames: list[deque[CameraObservations]] = [deque(maxlen=_BURST) for _ in self._stored]
        self._epoch_ns: int | None = None
        self._now_s = self._sampled_s = -math.inf

    def take(self, frame: CameraObservations) -> None:
        """Keep one frame; twice a second the newest frames of all cameras are brought to one instant."""
        if not self.active or len(frame.pixels) != len(self.rig.markers.ids):
            return
        if self._epoch_ns is None:
            self._epoch_ns = frame.t_row0_master_ns
        t_s = 1e-9 * (frame.t_row0_master_ns - self._epoch_ns)
        if t_s < self._now_s - _RESTART_S:
            self.reset()
            self._epoch_ns, t_s = frame.t_row0_master_ns, 0.0
        self._now_s = max(self._now_s, t_s)
        self._frames[frame.camera].append(frame)
        if self._now_s >= self._sampled_s + EVERY_S and all(len(each) >= 3 for each in self._frames):
            self._sampled_s = self._now_s
            self._sample()

    # -- from frames to observations -----------------------------------------------------------------------------------

    def _sample(self) -> None:
        """Pair the newest frames and keep the markers that two cameras observed without a doubtful flag."""
        pairing = Pairing(len(self._stored), len(self.rig.markers.ids))
        frames = sorted((frame for each in self._frames for frame in each), key=lambda one: one.t_receive_ns)
        found: list[Paired] = []
        for frame in frames:
            pairing.ingest(frame)
            if (paired := pairing.due()) is not None:
                found.append(paired)
        if len(found) > 1 and found[-1].t_ns > found[-2].t_ns:
            bounds = np.array([each[-1].clock_bound_s for each in self._frames])
            self._keep(found[-1], found[-2], bounds)

    def _keep(self, paired: Paired, before: Paired, bounds_s: Array) -> None:
        """`bounds_s` (C,): half-widths of the clocks' errors, which move what moves."""
        assert self._epoch_ns is not None
        t_s = 1e-9 * (paired.t_ns - self._epoch_ns)
        speed = (paired.pixels - before.pixels) / (1e-9 * (paired.t_ns - before.t_ns))
        clear = (paired.flags >= 0) & ((paired.flags & DOUBTFUL) == 0) & np.isfinite(speed).all(axis=2) & self._own
        for marker in np.flatnonzero(np.count_nonzero(clear, axis=0) >= 2):
            self._keep_marker(t_s, int(marker), paired, clear[:, marker], speed[:, marker], bounds_s)

    def _keep_marker(self, t_s: float, marker: int, paired: Paired, used: NDArray[np.bool_], speed: Array,
                     bounds_s: Array) -> None:
        rig, rays, observed = self._compiled, empty_rays(len(self._stored)), used.copy()
        late = bounds_s[:, None] / math.sqrt(3.0) * speed  # evenly distributed within the bound
        spread = paired.covariances[:, marker] + late[:, :, None] * late[:, None, :]
        cast(paired.pixels[:, marker], spread, rig.intrinsics, observed, rays)
        place, covariance = np.empty(3), np.empty((3, 3))
        _, outcome = triangulate(rays, rig.cameras, observed, place, covariance)
        if outcome != Outcome.OK:
            return
        centred = np.empty_like(rays.at)
        point_rays(rays.at, rig.cameras, rig.shapes[marker], place, centred)
        for i, j in self._pairs:
            if observed[i] and observed[j]:
                self.store.add(t_s, (i, j), marker, centred[[i, j]], rays.covariances[[i, j]], place)

    # -- from observations to poses ------------------------------------------------------------------------------------

    def step(self) -> Refinement | None:
        """The refinement by all observations; None while there are too few."""
        return self.refine(self.gather())

    def gather(self) -> Gathered:
        """A copy of what is kept, for `refine`."""
        return Gathered(self.store.recent(self._now_s), self._now_s)

    def refine(self, gathered: Gathered) -> Refinement | None:
        """As `step`; may run in another thread than `take`. Some 60 ms."""
        rows = gathered.rows
        if not self.active or len(rows) <= 2 * self._size:
            return None
        state = np.zeros(self._poses)
        for _ in range(_RELINEARISED):
            found = self._solve(gathered, state)
            step, state = found.state[:self._poses] - state, found.state[:self._poses]
            if np.square(step).max() < _SMALL_SQ:
                break
        return self._refinement(gathered, found)

    def _calibrated_variances(self) -> Array:
        """(6 (C - 1),) of the stored calibration: the angle that makes its stated error of places, or CALIBRATED_PX."""
        error, variances = calibration_error(self.rig), []
        for camera in range(1, len(self._stored)):
            base_m = float(np.linalg.norm(self._stored[camera, :3, 3] - self._stored[0, :3, 3]))
            sd = (float(error.turn(np.array(base_m))) if error.known
                  else CALIBRATED_PX / float(self._focal[camera].mean()))
            variances += [max(sd, 1e-7) ** 2] * 3 + [(max(sd, 1e-7) * base_m) ** 2] * 3
        return np.array(variances)

    def _solve(self, gathered: Gathered, reference: Array) -> _Solution:
        """The most probable hypothesis, everything linearised at the correction `reference`."""
        rows = gathered.rows
        lin = linearise(rows, self._moved(reference), self._focal)
        jacobian = np.zeros((len(rows), self._size))
        jacobian[:, :self._poses] = lin.jacobian
        lasting = self._pair_of[rows["first"], rows["second"]] * len(self.rig.markers.ids) + rows["marker"]
        jacobian[np.arange(len(lasting)), self._poses + lasting] = 1.0
        jacobian /= lin.sd_px[:, None]
        target = (lin.jacobian @ reference - lin.error_px) / lin.sd_px  # of jacobian @ state
        sums = self._summarise(rows, jacobian, target)
        dispersion = 1.0
        for _ in range(2):
            change = self._search(sums, dispersion)
            earlier = np.concatenate([change.before[:self._poses], change.state[self._poses:]])
            of_row = np.where((sums.segment < change.part)[:, None], earlier, change.state)
            left = target - np.sum(jacobian * of_row, axis=1)
            dispersion = self._dispersion(sums, lasting, left, (1 + (change.part > 0)) * self._poses)
        change = self._search(sums, dispersion)
        knock = change.part
        ago_s = None if knock < 0 else math.inf if knock == 0 else gathered.now_s - float(sums.t_s[knock])
        return _Solution(change.state, change.covariance, dispersion, ago_s, sums.segment >= knock)

    def _summarise(self, rows: Pairs, jacobian: Array, target: Array) -> _Summaries:
        """The information of each segment, its outliers found about its own fit: no other segment decides."""
        numbers, segment = np.unique(np.floor(rows["t_s"] / SEGMENT_S).astype(np.int64), return_inverse=True)
        weights, matrices = np.ones(len(target)), np.empty((len(numbers), self._size, self._size))
        vectors = np.empty((len(numbers), self._size))
        prior = np.diag(1.0 / (self._prior + self._knock))
        for k in range(len(numbers)):
            here = np.flatnonzero(segment == k)
            j, wanted, weight = jacobian[here], target[here], np.ones(len(here))
            for _ in range(_ROUNDS):
                matrices[k], vectors[k] = j.T @ (weight[:, None] * j), j.T @ (weight * wanted)
                left = wanted - j @ np.linalg.solve(prior + matrices[k], vectors[k])
                weight = np.minimum(1.0, (STUDENT + 1.0) / (STUDENT + np.square(left)))
            matrices[k], vectors[k] = j.T @ (weight[:, None] * j), j.T @ (weight * wanted)
            weights[here] = weight
        return _Summaries(np.asarray(numbers * SEGMENT_S, dtype=np.float64), matrices, vectors, weights, segment)

    def _search(self, sums: _Summaries, dispersion: float) -> ChangePoint:
        odds = [math.log(1.0 - KNOCKED_BEFORE), math.log(KNOCKED_BEFORE),
                *np.log(KNOCKS_PER_S * np.diff(sums.t_s))]
        return find_change(self._prior, self._knock, self._walk, sums.t_s, sums.matrix / dispersion,
                           sums.vector / dispersion, np.array(odds))

    def _dispersion(self, sums: _Summaries, lasting: Indices, left: Array, fitted: int) -> float:
        """How much more the means of a marker's errors over a segment vary than independent errors would; 1 or more.

        Errors that last (of a lens, of a marker that is half in shade) are so accounted for (Liang and Zeger 1986).
        `lasting` (N,): pair and marker; `left` (N,) what the poses leave, whitened; `fitted` numbers of the poses.
        """
        _, cluster = np.unique(sums.segment * (self._size - self._poses) + lasting, return_inverse=True)
        totals = np.bincount(cluster, sums.weights)
        means_sq = np.square(np.bincount(cluster, sums.weights * left)) / np.maximum(totals, 1e-9)
        free = len(totals) - fitted
        return max(1.0, float(means_sq.sum()) / free) if free >= self._size else 1.0

    def _moved(self, state: Array) -> Array:
        """(C, 4, 4) world_from_camera with the correction `state`, baselines as long as they were."""
        poses = self._stored.copy()
        for camera in range(1, len(poses)):
            step = state[TWIST * (camera - 1):TWIST * camera]
            poses[camera] = poses[camera] @ rigid(exp_so3(step[:3]), step[3:])
        centres = poses[:, :3, 3]
        length = float(np.linalg.norm(centres - centres[0], axis=1).sum())
        poses[:, :3, 3] = centres[0] + (centres - centres[0]) * (self._base_m / length)
        return poses

    def _held_out(self, gathered: Gathered, found: _Solution) -> tuple[float, float, float]:
        """`held_out`, `before_px` and `after_px` of `Refinement`: every other segment is predicted from the rest, one
        and the other half in turn. The likelihood is Student's t, the dispersion says how many of them count."""
        rows = gathered.rows
        half = np.floor(rows["t_s"] / SEGMENT_S).astype(np.int64)
        total, before, after = 0.0, list[Array](), list[Array]()
        for parity in (0, 1):
            chosen = half % 2 == parity
            held = np.flatnonzero(chosen & found.since)
            if not len(held) or chosen.all():
                continue
            trained = self._solve(Gathered(rows[~chosen], gathered.now_s), found.state[:self._poses])
            stored, refined = (linearise(rows[held], poses, self._focal)
                               for poses in (self._stored, self._moved(trained.state)))
            total += 0.5 * (STUDENT + 1.0) / found.dispersion * float(
                np.sum(np.log1p(np.square(stored.error_px / stored.sd_px) / STUDENT)
                       - np.log1p(np.square(refined.error_px / refined.sd_px) / STUDENT)))
            before.append(stored.error_px)
            after.append(refined.error_px)
        if not before:
            return 0.0, math.nan, math.nan
        return total, _middle_px(np.concatenate(before)), _middle_px(np.concatenate(after))

    def _refinement(self, gathered: Gathered, found: _Solution) -> Refinement:
        rows, poses = gathered.rows, self._moved(found.state)
        covariance = found.covariance[:self._poses, :self._poses]
        cameras = []
        for camera in range(1, len(poses)):
            part = slice(TWIST * (camera - 1), TWIST * camera)
            change = inverse(self._stored[camera]) @ poses[camera]
            along = self._stored[camera, :3, :3].T @ (self._stored[camera, :3, 3] - self._stored[0, :3, 3])
            cameras.append(CameraCorrection(self.rig.nodes[camera].name, log_so3(change[:3, :3]), change[:3, 3],
                                            covariance[part, part], along / np.linalg.norm(along)))
        chi_squared, freedom = self._test(found)
        since = rows[found.since]
        held_out, before, after = self._held_out(gathered, found)
        if math.isnan(before):
            before, after = (_middle_px(linearise(since, where, self._focal).error_px)
                             for where in (self._stored, poses))
        return Refinement(
            tuple(cameras), poses, chi_squared, freedom, float(chi_squared_tail(chi_squared, max(freedom, 1))),
            found.knocked_s, held_out, before, after, _rms(midpoints(since, self._stored) - midpoints(since, poses)),
            self._places_sd_m(since, found), _rms(midpoints(since, poses) - poses[:, :3, 3].mean(axis=0)),
            found.dispersion, len(since), len(np.unique(since["voxel"])), float(np.ptp(since["t_s"])))

    def _places_sd_m(self, rows: Pairs, found: _Solution) -> float:
        """By differences: how places move with the poses."""
        middle, moves = midpoints(rows, self._moved(found.state)), []
        for k in range(self._poses):
            step = np.zeros(self._poses)
            step[k] = 1e-5
            moves.append((midpoints(rows, self._moved(found.state[:self._poses] + step)) - middle) / 1e-5)
        slopes = np.array(moves)
        covariance = found.covariance[:self._poses, :self._poses]
        return float(np.sqrt(np.einsum("knc,kl,lnc->n", slopes, covariance, slopes).mean()))

    def _test(self, found: _Solution) -> tuple[float, int]:
        """Chi-squared of the correction against none, in the directions that the observations determine.

        The calibration's variance is in the prior and is added once more, so false alarms are rarer than the level.
        """
        scale = np.tile(KNOCK_SD, self._poses // TWIST)
        covariance = (found.covariance[:self._poses, :self._poses] + np.diag(self._calibrated)) / np.outer(scale, scale)
        values, vectors = np.linalg.eigh(covariance)
        determined = values < 0.25  # at most half as uncertain as a knock makes them
        parts = vectors[:, determined].T @ (found.state[:self._poses] / scale)
        return float(np.sum(np.square(parts) / values[determined])), int(np.count_nonzero(determined))


def _middle_px(errors: Array) -> float:
    """The median epipolar error (N,), px, as rms over both cameras."""
    return float(np.median(np.abs(errors))) / math.sqrt(2.0)


def _rms(ways: Array) -> float:
    """Root mean square length of vectors (N, 3)."""
    return float(np.sqrt(np.square(ways).sum(axis=1).mean()))
