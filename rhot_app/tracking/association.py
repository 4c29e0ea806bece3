"""Data association: which of the candidates that a node reports is which marker.

A node reports everything of a marker's colour. Where the marker should be in the image is predicted: by its own motion
while it is tracked, by where the rest of the hand is after that. Nothing is predicted before a hand is known; then the
candidates of two cameras are chosen whose rays meet (the epipolar constraint), and meet within a hand's reach.

`assign` takes predicted pixels with covariances from whoever has them. `MarkerAssociation` predicts for a tracker.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from rhot_app.geometry.camera import project_normalised, undistort_points
from rhot_app.tracking.locate import GATE_FLOOR_PX
from rhot_app.tracking.rig_arrays import RigArrays
from rhot_app.tracking.tracker import CameraObservations
from rhot_app.tracking.trust import ACCELERATION_LIMIT, FORGET_S
from rhot_node.wire.messages import MarkerFlag

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

GATE = 13.816
"""Squared Mahalanobis distance that a marker's own observation exceeds once in a thousand: chi-squared, 2 degrees of
freedom."""

AMBIGUOUS_RATIO = 4.0
"""Two candidates whose squared distances differ by less (a likelihood ratio of e^2) cannot be told apart."""

ACCELERATION_SD = ACCELERATION_LIMIT / np.sqrt(GATE)
"""m/s^2, so that no hand's acceleration leaves the gate."""

PLACE_SD_M = 2e-3
"""Of a tracked marker's last position, m: noise and latency of the tracker that noted it."""

TOGETHER_NS = 100_000_000
"""Frames of two cameras are compared while nothing is known if they are no further apart, ns."""

HAND_SPEED = 2.0
"""m/s: by how much rays of frames of different instants may miss each other."""

_LOST, _AMBIGUOUS, _ACQUIRED = int(MarkerFlag.LOST), int(MarkerFlag.AMBIGUOUS), int(MarkerFlag.ACQUIRED)
_FORBIDDEN = 1e9
_COLUMNS = "pixels", "covariances", "diameters", "qualities", "flags"


def assign(predicted: Array, predicted_covariances: Array, pixels: Array, covariances: Array,
           label_costs: Array) -> tuple[Indices, Array]:
    """The joint assignment of N candidates to M markers with the least sum of squared Mahalanobis distances.

    `predicted` (M, 2) px with `predicted_covariances` (M, 2, 2) px^2; `pixels` (N, 2) with `covariances` (N, 2, 2);
    `label_costs` (M, N) is added, -2 log of the probability that the marker is reported under the candidate's label:
    0 for its own, infinite where that is excluded. A marker may stay without a candidate at the cost of the gate.
    Returns the candidate of each marker (M,), -1 for none, and all costs (M, N).
    """
    offset = pixels[None] - predicted[:, None]
    total = predicted_covariances[:, None] + covariances[None]
    costs = np.einsum("mni,mni->mn", offset, np.linalg.solve(total, offset[..., None])[..., 0]) + label_costs
    costs = np.where(np.isfinite(costs), costs, _FORBIDDEN)
    markers = len(predicted)
    without = np.where(np.eye(markers, dtype=np.bool_), GATE, _FORBIDDEN)
    rows, columns = linear_sum_assignment(np.hstack([costs, without]))
    chosen = np.full(markers, -1, dtype=np.intp)
    chosen[rows] = np.where(columns < len(pixels), columns, -1)
    return chosen, costs


class _Listed(NamedTuple):
    """All candidates of one frame: N rows, the best of each marker that has any first."""

    markers: Indices
    pixels: Array
    covariances: Array
    diameters: Array
    qualities: Array
    flags: NDArray[np.uint16]


class MarkerAssociation:
    """Chooses one candidate a marker in every frame, for one tracker, which notes where the markers were."""

    def __init__(self, rig: RigArrays) -> None:
        self._rig = rig
        finite = np.isfinite(rig.reach)
        self._on_hand = finite.any(axis=1)
        self._spread_m = 0.5 * np.max(np.where(finite, rig.reach, 0.0), axis=1, initial=0.0)  # about the hand's middle
        self.reset()

    def reset(self) -> None:
        """Forget where the markers were."""
        cameras, markers = len(self._rig.cameras), len(self._rig.marker_ids)
        self._positions, self._velocities = np.full((markers, 3), np.nan), np.zeros((markers, 3))
        self._seen_ns = np.zeros(markers, dtype=np.int64)
        self._chosen = np.full((cameras, markers, 2), np.nan)  # px, in the newest frame of each camera
        self._frames: list[CameraObservations | None] = [None] * cameras  # as they came

    def note(self, t_ns: int, positions: Array) -> None:
        """Remember where the markers were at master time `t_ns`: (M, 3) m, NaN where not known."""
        known = np.isfinite(positions[:, 0])
        dt_s = 1e-9 * (t_ns - self._seen_ns)
        steady = known & np.isfinite(self._positions[:, 0]) & (dt_s > 0.0) & (dt_s < FORGET_S)
        self._velocities[known] = 0.0
        self._velocities[steady] = (positions[steady] - self._positions[steady]) / dt_s[steady, None]
        self._positions[known], self._seen_ns[known] = positions[known], t_ns

    def select(self, frame: CameraObservations) -> CameraObservations:
        """The frame with one candidate a marker, the likeliest; a marker that none can be is lost in it.

        A candidate as likely as the chosen one makes it ambiguous. One that is not where the chosen one was in the
        frame before is flagged as acquired. Frames without further candidates are returned as they are.
        """
        self._frames[frame.camera] = frame
        if frame.further is None:
            self._chosen[frame.camera] = frame.pixels
            return frame
        listed = _list_candidates(frame)
        predicted, variances = self._predict(frame)
        chosen, ambiguous = self._choose(listed, predicted, variances)
        unknown = np.isnan(predicted[:, 0])
        if unknown.any():
            chosen = np.where(unknown, self._choose_by_rays(frame, listed), chosen)
        return self._selected(frame, listed, chosen, ambiguous)

    def _predict(self, frame: CameraObservations) -> tuple[Array, Array]:
        """Predicted pixels (M, 2), NaN where nothing is, and their variances (M,) px^2."""
        rig, camera = self._rig, frame.camera
        middle_ns = frame.row_time_ns * rig.intrinsics[camera, 3]  # when the row of the principal point is exposed
        dt_s = 1e-9 * (frame.t_row0_master_ns + middle_ns - self._seen_ns)
        points = self._positions + self._velocities * dt_s[:, None]
        variances = PLACE_SD_M**2 + (0.5 * ACCELERATION_SD * dt_s**2) ** 2
        tracked = np.isfinite(points[:, 0]) & (np.abs(dt_s) < FORGET_S)
        newest = tracked & self._on_hand & (self._seen_ns == np.max(self._seen_ns, initial=0, where=tracked))
        # What is not tracked, or was not seen for long, is somewhere on the hand.
        by_hand = self._on_hand & newest.any() & ~(tracked & (variances < self._spread_m**2))
        points[~tracked] = np.nan
        points[by_hand] = points[newest].mean(axis=0) if newest.any() else np.nan
        variances = np.where(by_hand, self._spread_m**2, variances)
        local = points @ rig.cameras[camera, :, :3].T + rig.cameras[camera, :, 3]
        depth = np.where(local[:, 2] > 0.0, local[:, 2], np.nan)
        pixels = project_normalised(np.ascontiguousarray(local[:, :2] / depth[:, None]), rig.intrinsics[camera])
        return pixels, variances * (rig.focal[camera, 0] / depth) ** 2

    def _choose(self, listed: _Listed, predicted: Array, variances: Array) -> tuple[Indices, NDArray[np.bool_]]:
        """The candidates (M,) nearest to the predictions, -1 for none, and whether another is as near."""
        markers = len(predicted)
        known = np.isfinite(predicted[:, 0])
        own = np.arange(markers)[:, None] == listed.markers[None]
        covariances = np.where(known, variances, 1.0)[:, None, None] * np.eye(2)
        chosen, costs = assign(np.nan_to_num(predicted), covariances, listed.pixels, listed.covariances,
                               np.where(own & known[:, None], 0.0, np.inf))
        nearest = np.partition(np.hstack([costs, np.full((markers, 2), _FORBIDDEN)]), 1, axis=1)
        return chosen, (nearest[:, 1] < GATE) & (nearest[:, 1] - nearest[:, 0] < AMBIGUOUS_RATIO)

    def _choose_by_rays(self, frame: CameraObservations, listed: _Listed) -> Indices:
        """The candidates (M,) that meet those of another camera within a hand's reach of as many others as possible.

        The first reported one, where nothing tells; -1 where there is none.
        """
        first = np.full(len(self._rig.marker_ids), -1, dtype=np.intp)
        for row in range(len(listed.markers) - 1, -1, -1):
            first[listed.markers[row]] = row
        rays = undistort_points(listed.pixels, self._rig.intrinsics[frame.camera])
        best, best_count = first, 1
        for kept in self._frames:
            if kept is None or kept.camera == frame.camera or \
                    abs(kept.t_row0_master_ns - frame.t_row0_master_ns) > TOGETHER_NS:
                continue
            rows, points = self._meetings(frame, listed, rays, kept)
            chosen, count = self._most_together(listed.markers[rows], rows, points, first)
            if count > best_count:
                best, best_count = chosen, count
        return best

    def _meetings(self, frame: CameraObservations, listed: _Listed, rays: Array,
                  kept: CameraObservations) -> tuple[Indices, Array]:
        """Rows of the candidates whose rays meet one of the same marker in the frame of another camera, (H,), and the
        points where they do, (H, 3) m."""
        rig, other, theirs = self._rig, kept.camera, _list_candidates(kept)
        rows, columns = np.nonzero(listed.markers[:, None] == theirs.markers[None])
        their_rays = undistort_points(theirs.pixels, rig.intrinsics[other])[columns]
        cameras = rig.cameras[[frame.camera, other]]
        # (x p3 - p1) X = 0 and (y p3 - p2) X = 0 for both cameras
        seen = np.stack([rays[rows], their_rays], axis=1)[..., None]
        planes = (seen * cameras[None, :, 2:3] - cameras[None, :, :2]).reshape(-1, 4, 4)
        normal = np.einsum("hki,hkj->hij", planes[..., :3], planes[..., :3]) + 1e-12 * np.eye(3)
        side = -np.einsum("hki,hk->hi", planes[..., :3], planes[..., 3])
        points = np.linalg.solve(normal, side[..., None])[..., 0]
        local = np.einsum("cij,hj->hci", cameras[..., :3], points) + cameras[None, ..., 3]
        ahead = (local[..., 2] > 0.0).all(axis=1)
        depth = np.where(local[..., 2] > 0.0, local[..., 2], np.nan)
        missed_px = rig.focal[[frame.camera, other]] * (local[..., :2] / depth[..., None] - seen[..., 0])
        moved_m = HAND_SPEED * 1e-9 * abs(kept.t_row0_master_ns - frame.t_row0_master_ns)
        moved_px = moved_m * rig.focal[frame.camera, 0] / depth[:, 0]
        meet = ahead & (np.abs(missed_px).max(axis=(1, 2)) < GATE_FLOOR_PX + moved_px)
        return rows[meet], points[meet]

    def _most_together(self, markers: Indices, rows: Indices, points: Array, first: Indices) -> tuple[Indices, int]:
        """Of points (H, 3) of `markers` (H,) those within reach of one of them, for the one with most markers."""
        if not len(rows):
            return first, 0
        apart = np.linalg.norm(points[:, None] - points[None], axis=2)
        near = apart <= self._rig.reach[markers[:, None], markers[None]]
        near[np.arange(len(rows)), np.arange(len(rows))] = True
        near &= (markers[:, None] != markers[None]) | np.eye(len(rows), dtype=np.bool_)
        counts = np.array([len(set(markers[row].tolist())) for row in near])
        anchor = int(np.argmax(counts))
        chosen = first.copy()
        for h in np.argsort(-apart[anchor]):  # the nearest is written last
            if near[anchor, h]:
                chosen[markers[h]] = rows[h]
        return chosen, int(counts[anchor])

    def _selected(self, frame: CameraObservations, listed: _Listed, chosen: Indices,
                  ambiguous: NDArray[np.bool_]) -> CameraObservations:
        """The frame of the chosen candidates."""
        found = chosen >= 0
        rows = np.where(found, chosen, 0)
        before = self._chosen[frame.camera]
        pixels = np.where(found[:, None], listed.pixels[rows], np.nan)
        flags = np.where(found, listed.flags[rows] | np.where(ambiguous, _AMBIGUOUS, 0), _LOST).astype(np.uint16)
        for m in np.flatnonzero(found & np.isfinite(before[:, 0])):
            own = np.flatnonzero(listed.markers == m)
            nearest = own[np.argmin(np.linalg.norm(listed.pixels[own] - before[m], axis=1))]
            if nearest != chosen[m]:
                flags[m] |= _ACQUIRED
        self._chosen[frame.camera] = pixels
        return replace(frame, further=None, pixels=pixels, flags=flags,
                       covariances=np.where(found[:, None, None], listed.covariances[rows], np.nan),
                       diameters=np.where(found, listed.diameters[rows], 0.0),
                       qualities=np.where(found, listed.qualities[rows], 0.0))


def _list_candidates(frame: CameraObservations) -> _Listed:
    found = np.flatnonzero(np.isfinite(frame.pixels[:, 0]) & ((frame.flags & _LOST) == 0))
    columns = [getattr(frame, name)[found] for name in _COLUMNS]
    if frame.further is None:
        return _Listed(found, *columns)
    further = [getattr(frame.further, name) for name in _COLUMNS]
    return _Listed(np.concatenate([found, frame.further.markers]),
                   *(np.concatenate(both) for both in zip(columns, further, strict=True)))
