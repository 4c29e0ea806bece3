"""Data association: which of the candidates that a node reports is which marker.

A node reports several objects of a marker's colour. While a marker is tracked, its own motion predicts its pixel. After
that the position of the rest of the hand predicts it. Without a known hand nothing is predicted. Candidates of two
cameras are then chosen whose rays meet (the epipolar constraint) at points within the hand's reach of each other.

`assign` solves the assignment for any predicted pixels with covariances, `MarkerAssociation` that of a frame.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from rhot_app.estimation import track
from rhot_app.estimation.quantiles import chi_squared
from rhot_app.geometry.camera import project_with_slope, scales_of
from rhot_app.geometry.triangulate import cast, empty_rays, triangulate
from rhot_app.tracking.locate import GATE_FLOOR_PX
from rhot_app.tracking.rig_arrays import RigArrays
from rhot_app.tracking.tracker import CameraObservations, Candidates
from rhot_node.wire.messages import MarkerFlag

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

GATE = float(chi_squared(track.GATE, 2))
"""Squared Mahalanobis distance of a pixel that one observation in a thousand exceeds."""

AMBIGUITY_MARGIN = 4.0
"""Difference of squared Mahalanobis distances: a likelihood ratio of e^2. Candidates closer than that are ambiguous."""

HAND_SPEED = 2.0
"""m/s: a hand's motion between the frames of two cameras, by which their rays may miss each other."""

_LOST, _AMBIGUOUS, _ACQUIRED = int(MarkerFlag.LOST), int(MarkerFlag.AMBIGUOUS), int(MarkerFlag.ACQUIRED)
_FORBIDDEN = 1e9
_COLUMNS = "pixels", "covariances", "diameters", "qualities", "flags"


def squared_distances(offsets: Array, covariances: Array) -> tuple[Array, Array]:
    """Squared Mahalanobis distances (...,) of offsets (..., 2), and the determinants of their covariances
    (..., 2, 2)."""
    a, b, c = covariances[..., 0, 0], covariances[..., 0, 1], covariances[..., 1, 1]
    x, y = offsets[..., 0], offsets[..., 1]
    determinants = a * c - b * b
    return (c * x * x - 2.0 * b * x * y + a * y * y) / determinants, determinants


def assign(predicted: Array, predicted_covariances: Array, pixels: Array, covariances: Array,
           label_costs: Array) -> tuple[Indices, Array]:
    """The joint assignment of N candidates to M markers with the greatest likelihood.

    A pair costs its squared Mahalanobis distance and the logarithm of its covariance's determinant. A pair beyond the
    gate is excluded.

    `predicted` (M, 2) px, NaN for none, with `predicted_covariances` (M, 2, 2) px^2. `pixels` (N, 2) px with
    `covariances` (N, 2, 2) px^2. `label_costs` (M, N) are added: -2 log of the probability that the marker is reported
    under the candidate's label, infinite where that is excluded. A marker may stay without a candidate at the cost
    GATE.
    Returns the candidate of each marker (M,), -1 for none, and all costs (M, N).
    """
    distances, volumes = squared_distances(pixels - predicted[:, None], predicted_covariances[:, None] + covariances)
    volumes = np.log(volumes)  # of two candidates as near, the more certain one is likelier
    costs = distances + volumes - volumes.min(axis=1, keepdims=True, initial=np.inf) + label_costs
    costs = np.where(np.isfinite(costs) & (distances < GATE), costs, _FORBIDDEN)
    markers = len(predicted)
    without = np.where(np.eye(markers, dtype=np.bool_), GATE, _FORBIDDEN)
    rows, columns = linear_sum_assignment(np.hstack([costs, without]))
    chosen = np.full(markers, -1, dtype=np.intp)
    chosen[rows] = np.where(columns < len(pixels), columns, -1)
    return chosen, costs


class MarkerAssociation:
    """Chooses one candidate for each marker in every frame."""

    def __init__(self, rig: RigArrays) -> None:
        self._rig = rig
        finite = np.isfinite(rig.reach)
        self._on_hand = finite.any(axis=1)
        # Standard deviation, m, of a marker's position about the mean of the others.
        self._hand_sd_m = 0.5 * np.max(np.where(finite, rig.reach, 0.0), axis=1, initial=0.0)
        _intersect(np.empty((0, 2, 2)), np.empty((0, 2, 2, 2)), rig.intrinsics, rig.cameras, np.empty((0, 3)),
                   np.empty(0))  # compiled before a frame needs it
        self.reset()

    def reset(self) -> None:
        """Forget all frames."""
        cameras, markers = len(self._rig.cameras), len(self._rig.marker_ids)
        self._chosen = np.full((cameras, markers, 2), np.nan)  # px, where each camera saw it last
        self._frames: list[CameraObservations | None] = [None] * cameras  # newest of each camera, all candidates

    def select(self, frame: CameraObservations, points: Array | None = None, variances: Array | None = None
               ) -> CameraObservations:
        """The frame with the likeliest candidate of each marker. A marker without a candidate in its gate is lost.

        `points` (M, 3) m: where the markers are predicted at the frame's time, NaN or None where nothing is, with
        `variances` (M,) m^2 on every axis.

        AMBIGUOUS is set where another candidate is about as likely (AMBIGUITY_MARGIN). ACQUIRED is set where another
        candidate is nearer to the pixel chosen in the camera's last frame. A frame without further candidates is
        returned unchanged.
        """
        self._frames[frame.camera] = frame
        if frame.further is None:
            found = np.isfinite(frame.pixels[:, 0])
            self._chosen[frame.camera][found] = frame.pixels[found]
            return frame
        listed = list_candidates(frame)
        predicted, covariances = self._predict(frame.camera, points, variances)
        chosen, rivals = self._choose(listed, predicted, covariances)
        undetermined = np.isnan(predicted[:, 0]) | (rivals >= 0)  # the prediction does not tell
        if undetermined.any():
            by_rays, undecided = self._choose_by_rays(frame, listed)
            chosen, rivals = np.where(undetermined, by_rays, chosen), np.where(undetermined, undecided, rivals)
        alone = np.bincount(listed.markers, minlength=len(chosen)) == 1  # nothing to choose, as in other frames
        chosen[alone] = [int(np.flatnonzero(listed.markers == m)[0]) for m in np.flatnonzero(alone)]
        return self._selected(frame, listed, chosen, rivals)

    def _predict(self, camera: int, points: Array | None, variances: Array | None) -> tuple[Array, Array]:
        """Predicted pixels (M, 2), NaN where nothing is, and their covariances (M, 2, 2) px^2.

        A marker that is not predicted, or less certainly, is somewhere on the hand, about the others' mean.
        """
        rig, hand_variances = self._rig, self._hand_sd_m**2
        if points is None or variances is None:
            points, variances = np.full((len(rig.marker_ids), 3), np.nan), hand_variances
        certain = np.isfinite(points[:, 0]) & (variances < hand_variances)
        if (certain & self._on_hand).any():
            by_hand = self._on_hand & ~certain
            points = np.where(by_hand[:, None], points[certain & self._on_hand].mean(axis=0), points)
            variances = np.where(by_hand, hand_variances, variances)
        pixels, slope = project_with_slope(points, rig.cameras[camera], rig.intrinsics[camera])
        return pixels, variances[:, None, None] * slope @ slope.transpose(0, 2, 1)

    def _choose(self, listed: Candidates, predicted: Array, covariances: Array) -> tuple[Indices, Indices]:
        """The candidate of each marker (M,), and another one that is about as likely; -1 for none.

        `predicted` (M, 2) px, NaN for none, with `covariances` (M, 2, 2) px^2.
        """
        every = np.arange(len(predicted))
        own = every[:, None] == listed.markers
        chosen, costs = assign(predicted, covariances, listed.pixels, listed.covariances, np.where(own, 0.0, np.inf))
        paid = costs[every, chosen]
        others = costs.copy()
        others[every, chosen] = _FORBIDDEN
        rivals = np.argmin(others, axis=1)
        near = (others[every, rivals] < GATE) & (others[every, rivals] - paid < AMBIGUITY_MARGIN) & (chosen >= 0)
        return chosen, np.where(near, rivals, -1)

    def _choose_by_rays(self, frame: CameraObservations, listed: Candidates) -> tuple[Indices, Indices]:
        """The candidate of each marker (M,) by the rays of two cameras, and another one where the rays do not tell; -1
        for none.

        The largest set of candidates is chosen whose rays meet at points within reach of one of them. Any other
        marker gets its first reported candidate.
        """
        first = np.full(len(self._rig.marker_ids), -1, dtype=np.intp)
        second = first.copy()
        for row in range(len(listed.markers) - 1, -1, -1):
            second[listed.markers[row]], first[listed.markers[row]] = first[listed.markers[row]], row
        best, undecided, best_count = first, second, 1
        for other in self._frames:
            if other is None or other.camera == frame.camera or \
                    abs(other.t_row0_master_ns - frame.t_row0_master_ns) > track.PREDICTED_NS:
                continue
            rows, points = self._intersections(frame, listed, other)
            cluster = self._largest_cluster(listed.markers[rows], points)
            count = len(set(listed.markers[rows[cluster]].tolist()))
            if count > best_count:
                best, undecided, best_count = first.copy(), second.copy(), count
                nearest_first = list(dict.fromkeys(rows[cluster][::-1].tolist()))
                for row in nearest_first[::-1]:  # the nearest of a marker counts, another one is its rival
                    m = listed.markers[row]
                    undecided[m] = best[m] if best[m] in nearest_first and best[m] != row else -1
                    best[m] = row
        return best, undecided

    def _intersections(self, frame: CameraObservations, listed: Candidates, other: CameraObservations
                       ) -> tuple[Indices, Array]:
        """Points (H, 3) m, world frame, where the rays of candidates of the same marker meet in two cameras, and (H,)
        the rows of the candidates in `listed`."""
        rig, others, pair = self._rig, list_candidates(other), [frame.camera, other.camera]
        rows, columns = np.nonzero(listed.markers[:, None] == others.markers[None])
        points, errors_px = np.empty((len(rows), 3)), np.empty(len(rows))
        _intersect(np.stack([listed.pixels[rows], others.pixels[columns]], axis=1),
                   np.stack([listed.covariances[rows], others.covariances[columns]], axis=1),
                   rig.intrinsics[pair], rig.cameras[pair], points, errors_px)
        _, slopes = project_with_slope(points, rig.cameras[frame.camera], rig.intrinsics[frame.camera])
        moved_m = HAND_SPEED * 1e-9 * abs(other.t_row0_master_ns - frame.t_row0_master_ns)
        meet = errors_px < GATE_FLOOR_PX + moved_m * scales_of(slopes)  # NaN, so false, behind a camera
        return rows[meet], points[meet]

    def _largest_cluster(self, markers: Indices, points: Array) -> Indices:
        """Rows of the points (H, 3) m of `markers` (H,) of the hand that are within reach of one of them, which has
        most markers about it. The nearest to that one comes last of each marker's."""
        if not len(points):
            return np.empty(0, dtype=np.intp)
        apart = np.linalg.norm(points[:, None] - points[None], axis=2)
        itself = np.eye(len(points), dtype=np.bool_)
        reach = self._rig.reach[markers[:, None], markers[None]]
        near = ((apart <= reach) & np.isfinite(reach) & (markers[:, None] != markers[None])) | itself
        anchor = int(np.argmax([len(set(markers[row].tolist())) for row in near]))
        order = np.argsort(-apart[anchor])
        return np.asarray(order[near[anchor, order]])

    def _selected(self, frame: CameraObservations, listed: Candidates, chosen: Indices,
                  rivals: Indices) -> CameraObservations:
        """The frame with the chosen candidates (M,), -1 for lost, and their flags; they are kept for the next frame.

        A candidate that another one rivals has the second moment of both about it, each with a probability of 1/2.
        """
        found = chosen >= 0
        rows = np.where(found, chosen, 0)
        before = self._chosen[frame.camera]
        pixels = np.where(found[:, None], listed.pixels[rows], np.nan)
        ambiguous = rivals >= 0
        flags = np.where(found, listed.flags[rows] | np.where(ambiguous, _AMBIGUOUS, 0), _LOST).astype(np.uint16)
        apart = np.where(ambiguous[:, None], listed.pixels[rivals] - listed.pixels[rows], 0.0)
        covariances = listed.covariances[rows] + 0.5 * apart[:, :, None] * apart[:, None, :]
        for m in np.flatnonzero(found & np.isfinite(before[:, 0])):
            own = np.flatnonzero(listed.markers == m)
            nearest = own[np.argmin(np.linalg.norm(listed.pixels[own] - before[m], axis=1))]
            if nearest != chosen[m]:
                flags[m] |= _ACQUIRED
        self._chosen[frame.camera][found] = pixels[found]
        return replace(frame, further=None, pixels=pixels, flags=flags,
                       covariances=np.where(found[:, None, None], covariances, np.nan),
                       diameters=np.where(found, listed.diameters[rows], 0.0),
                       qualities=np.where(found, listed.qualities[rows], 0.0))


def list_candidates(frame: CameraObservations) -> Candidates:
    """Every candidate of a frame but the lost ones."""
    found = np.flatnonzero(np.isfinite(frame.pixels[:, 0]) & ((frame.flags & _LOST) == 0))
    columns = [getattr(frame, name)[found] for name in _COLUMNS]
    if frame.further is None:
        return Candidates(found, *columns)
    further = [getattr(frame.further, name) for name in _COLUMNS]
    return Candidates(np.concatenate([found, frame.further.markers]),
                   *(np.concatenate(both) for both in zip(columns, further, strict=True)))


@njit(cache=True)
def _intersect(pixels: Array, covariances: Array, intrinsics: Array, cameras: Array, points: Array, errors_px: Array
               ) -> None:
    """Triangulate H pairs of `pixels` (H, 2, 2) px with `covariances` (H, 2, 2, 2) px^2 in two cameras: `points` (H, 3)
    m and `errors_px` (H,), by which the rays miss each other, NaN where they do not meet."""
    rays, used, spread = empty_rays(2), np.empty(2, np.bool_), np.empty((3, 3))
    for h in range(pixels.shape[0]):
        used[:] = True
        cast(pixels[h], covariances[h], intrinsics, used, rays)
        errors_px[h], _ = triangulate(rays, cameras, used, points[h], spread)
