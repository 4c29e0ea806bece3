"""How far a track is from the truth, state by state, at the states' own times and without any alignment."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rhot_app.evaluation.score import VISIBLE_FRACTION
from rhot_app.evaluation.track import Track
from rhot_app.hand.skeleton import ANGLE_SLICES, FINGERS, TIP_ROLES
from rhot_app.project import Rig
from rhot_app.simulator.truth.truth import Truth
from rhot_app.tracking.state import Knowledge

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class WornMarkers:
    """Which fingers wear what. `tips` (T,): markers on fingertips, `tip_fingers` (T,): whose; `angles` (A,): indices of
    the joint angles of fingers that wear any marker."""

    tips: NDArray[np.int64]
    tip_fingers: NDArray[np.int64]
    angles: NDArray[np.int64]


def worn_by(rig: Rig) -> WornMarkers:
    """What the rig's marker set says."""
    roles = [marker.role or "" for marker in rig.markers.markers]
    pairs = [(roles.index(role), finger) for finger, role in enumerate(TIP_ROLES) if role in roles]
    dressed = [any(role.startswith(f"{finger}_") for role in roles) for finger in FINGERS]
    angles = [np.arange(part.start, part.stop) for part, has in zip(ANGLE_SLICES, dressed, strict=True) if has]
    tips = np.array(pairs, dtype=np.int64).reshape(-1, 2)
    return WornMarkers(tips[:, 0], tips[:, 1], np.concatenate([np.empty(0, np.int64), *angles]))


@dataclass(frozen=True, slots=True)
class Deviations:
    """Estimate minus truth at N states, rig frame, m and rad; M markers, T fingertips with markers.

    `palm` (N, 6): translation, then the rotation vector that turns the true palm into the estimate, world axes.
    `visible` and `measured` (N, M): whether both cameras truly see a marker, and whether the tracker calls it measured.
    """

    tips: Array  # (N, T, 3)
    markers: Array  # (N, M, 3)
    raw_markers: Array  # (N, M, 3), as triangulated
    joints: Array  # (N, 21, 3)
    angles: Array  # (N, 21)
    palm: Array  # (N, 6)
    visible: Mask
    measured: Mask


def deviations(track: Track, truth: Truth, worn: WornMarkers) -> Deviations:
    """Compare a track with what was true at its times."""
    times = track.times_s
    markers = truth.markers_at(times)
    return Deviations(
        tips=track.fingertip_positions[:, worn.tip_fingers] - markers[:, worn.tips],
        markers=track.marker_positions - markers,
        raw_markers=track.marker_raw_positions - markers,
        joints=track.joint_positions - truth.joints_at(times),
        angles=track.angles - truth.angles_at(times),
        palm=_palm(track.world_from_palm, truth.palm_at(times)),
        visible=truth.visible_at(times) >= VISIBLE_FRACTION,
        measured=track.marker_knowledge == Knowledge.MEASURED)


def distances(offsets: Array) -> Array:
    """Lengths of vectors (..., 3)."""
    return np.asarray(np.linalg.norm(offsets, axis=-1))


def _palm(found: Array, true: Array) -> Array:
    """(N, 6) from two lists of transforms (N, 4, 4); NaN where nothing was found."""
    out = np.full((len(found), 6), np.nan)
    known = np.isfinite(found).all(axis=(1, 2))
    out[:, :3] = found[:, :3, 3] - true[:, :3, 3]
    if known.any():
        turn = Rotation.from_matrix(found[known, :3, :3]) * Rotation.from_matrix(true[known, :3, :3]).inv()
        out[known, 3:] = turn.as_rotvec()
    return out
