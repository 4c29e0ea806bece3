"""Figures of one track against the truth, and of several runs together. Keys end in their unit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from rhot_app.evaluation.score import DEGREE, VISIBLE_FRACTION, count_swaps, rms, scaled
from rhot_app.evaluation.track import DISPLAY_HZ, TrackedStates
from rhot_app.hand.skeleton import ANGLE_SLICES, FINGERS, TIP_ROLES
from rhot_app.project import Rig
from rhot_app.simulator.film.truth import Truth
from rhot_app.state import Knowledge

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


def deviations(track: TrackedStates, truth: Truth, worn: WornMarkers) -> Deviations:
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


# -- consistency: normalised estimation error squared (NEES) -----------------------------------------------------------
# A state's error e with covariance P gives e' P^-1 e, which for an honest tracker follows chi-squared with as many
# degrees of freedom d as e has numbers (Bar-Shalom, Li, Kirubarajan 2001, 5.4). Errors of one run are correlated in
# time, so runs with different seeds are what is averaged: at every instant the mean of S seeds times S follows
# chi-squared with S d degrees of freedom, whose 2.5 % and 97.5 % points are the band. An honest tracker is inside it at
# 95 % of the instants, and its average over time is d.

INSTANT_S = 0.025
"""States of different seeds are compared at instants this far apart: the newest state of each in that time."""

BAND = 0.95
SIGMAS = 3.0
DEGREES = {"tips": 3, "joints": 3, "palm": 6, "markers": 3, "angles": 1}


@dataclass(frozen=True, slots=True)
class Squares:
    """One run. `at_instants`: by quantity (B, K), NEES of K things at B instants from scene time 0, NaN without a state
    or covariance. `within`: by quantity, how many axes of what is called measured are within 3 sigma, and of how many.
    """

    at_instants: dict[str, Array]
    within: dict[str, tuple[int, int]]


@dataclass(frozen=True, slots=True)
class Consistency:
    """All seeds of a motion, one quantity. `average`: over time, seeds and things, in units of its degrees of freedom:
    1 when honest, more when too sure. `band`: what the average over all seeds at one instant keeps to at 95 % of the
    instants, same units. `inside`: part of the instants inside. `within`: part within 3 sigma. None: no covariance."""

    average: float | None
    band: tuple[float, float]
    inside: float | None
    within: float | None


def squares(track: TrackedStates, off: Deviations, worn: WornMarkers) -> Squares:
    """The normalised squares of one run."""
    tips = track.fingertip_covariances[:, worn.tip_fingers]
    estimates = np.isfinite(track.joint_covariances).any()  # else its markers' covariances are those of raw positions
    markers = off.markers if estimates else off.raw_markers
    values = {
        "tips": normalised(off.tips, tips),
        "joints": normalised(off.joints, track.joint_covariances),
        "palm": normalised(off.palm, track.palm_covariance)[:, None],
        "markers": normalised(markers, track.marker_covariances),
        "angles": np.square(off.angles / np.where(track.angle_sd > 0.0, track.angle_sd, np.nan)),
    }
    everywhere = np.ones((len(track.times_s), 1), dtype=bool)
    within = {
        "tips": axes_within(off.tips, tips, off.measured[:, worn.tips]),
        "joints": axes_within(off.joints, track.joint_covariances, track.joint_knowledge == Knowledge.MEASURED),
        "palm": axes_within(off.palm[:, None], track.palm_covariance[:, None], everywhere),
        "markers": axes_within(markers, track.marker_covariances, off.measured),
        "angles": axes_within(off.angles[..., None], np.square(track.angle_sd)[..., None, None],
                              track.angle_knowledge == Knowledge.MEASURED),
    }
    return Squares({name: at_instants(track.times_s, value) for name, value in values.items()}, within)


def normalised(errors: Array, covariances: Array) -> Array:
    """(...) e' P^-1 e of errors (..., d) and covariances (..., d, d); NaN where either is unknown or P is singular."""
    out = np.full(errors.shape[:-1], np.nan)
    known = np.asarray(np.isfinite(errors).all(axis=-1) & np.isfinite(covariances).all(axis=(-2, -1)))
    known[known] = np.linalg.cond(covariances[known]) < 1e14
    e = errors[known]
    out[known] = np.einsum("ni,ni->n", e, np.linalg.solve(covariances[known], e[..., None])[..., 0])
    return out


def at_instants(times_s: Array, values: Array) -> Array:
    """(B, K): the last of the values (N, K) in every interval of INSTANT_S since scene time 0."""
    slots = np.floor(times_s / INSTANT_S).astype(np.int64)
    out = np.full((int(slots.max()) + 1, values.shape[1]), np.nan)
    for slot, value in zip(slots, values, strict=True):  # in the order of time: the last one stays
        out[slot] = value
    return out


def axes_within(errors: Array, covariances: Array, chosen: Mask) -> tuple[int, int]:
    """How many axes of the chosen errors (..., d) are within 3 sigma, and of how many whose sigma is known."""
    sigma = np.sqrt(np.diagonal(covariances, axis1=-2, axis2=-1))
    known = chosen[..., None] & np.isfinite(errors) & np.isfinite(sigma)
    return int((np.abs(errors[known]) <= SIGMAS * sigma[known]).sum()), int(known.sum())


def consistency(runs: Sequence[Squares], quantity: str) -> Consistency:
    """All seeds' runs of one motion together."""
    degrees = DEGREES[quantity]
    length = min(len(run.at_instants[quantity]) for run in runs)
    values = np.stack([run.at_instants[quantity][:length] for run in runs])  # (S, B, K)
    count = np.isfinite(values).sum(axis=0)
    low, high = band(len(runs), degrees)
    good, known = (sum(run.within[quantity][k] for run in runs) for k in (0, 1))
    share = good / known if known else None
    complete = count == len(runs)  # where a seed has nothing to say the band would be another
    if not complete.any():
        return Consistency(None, (low, high), None, share)
    means = values.mean(axis=0)[complete] / degrees
    return Consistency(float(np.nanmean(values)) / degrees, (low, high),
                       float(((means >= low) & (means <= high)).mean()), share)


def band(seeds: int, degrees: int) -> tuple[float, float]:
    """Where the mean of as many seeds' NEES lies with 95 %, in units of the degrees of freedom."""
    low, high = chi2.ppf([0.5 - 0.5 * BAND, 0.5 + 0.5 * BAND], seeds * degrees) / (seeds * degrees)
    return float(low), float(high)


# Keys end in their unit.

Figures = dict[str, float | None]

_ADDED = ("swaps",)  # over runs these add up; everything else is averaged, root mean square or plain
_PLAIN = ("states_per_s", "measured_share", "predicted_3_sd_share")


def accuracy(track: TrackedStates, off: Deviations, truth: Truth, worn: WornMarkers) -> Figures:
    """The figures of one run.

    ``tip_visible``: fingertips whose marker both cameras truly see, whatever the tracker says of them;
    ``tip_measured``: those that it calls measured; ``tip_all``: every state; ``tip_display``: of the newest state at
    each tick of a display, against the truth at the tick; ``tip_predicted``: of what the tracker predicts at the tick,
    and which part of its axes is within three of its stated standard deviations. `angles`: of the fingers that wear a
    marker.
    """
    tips = distances(off.tips)
    ahead, stated = predicted(track, truth, worn)
    within, judged = axes_within(ahead, stated, np.ones(ahead.shape[:2], np.bool_))
    span_s = float(track.times_s[-1] - track.times_s[0])
    return {
        "tip_visible_mm": scaled(rms(tips[off.visible[:, worn.tips]]), 1e3),
        "tip_measured_mm": scaled(rms(tips[off.measured[:, worn.tips]]), 1e3),
        "tip_all_mm": scaled(rms(tips), 1e3),
        "tip_display_mm": scaled(rms(display_error(track, truth, worn)), 1e3),
        "tip_predicted_mm": scaled(rms(distances(ahead)), 1e3),
        "predicted_3_sd_share": within / judged if judged else None,
        "marker_mm": scaled(rms(distances(off.markers)[off.visible]), 1e3),
        "angles_deg": scaled(rms(off.angles[:, worn.angles]), DEGREE),
        "palm_turn_deg": scaled(rms(distances(off.palm[:, 3:])), DEGREE),
        "swaps": float(count_swaps(track.marker_positions, truth.markers_at(track.times_s))),
        "measured_share": float(off.measured[off.visible].mean()) if off.visible.any() else None,
        "states_per_s": (len(track.times_s) - 1) / span_s if span_s > 0.0 else None,
    }


def display_error(track: TrackedStates, truth: Truth, worn: WornMarkers) -> Array:
    """(D, T) m: at each tick of a display, how far the fingertips of the newest state received are from where they are
    now. No prediction: what the state says of its own instant is shown."""
    ticks = np.arange(track.receive_s[0], track.receive_s[-1], 1.0 / DISPLAY_HZ)
    newest = np.searchsorted(track.receive_s, ticks, side="right") - 1
    shown = track.fingertip_positions[newest][:, worn.tip_fingers]
    return distances(shown - truth.markers_at(ticks)[:, worn.tips])


def predicted(track: TrackedStates, truth: Truth, worn: WornMarkers) -> tuple[Array, Array]:
    """What the tracker, asked at each tick of a display, says of the tick: how far off fingertips are, (K, T, 3) m, and
    their covariances (K, T, 3, 3) m^2. K is 0 when it predicts nothing."""
    if track.predicted is None:
        return np.empty((0, len(worn.tips), 3)), np.empty((0, len(worn.tips), 3, 3))
    ticks = track.predicted.times_s
    asked = (ticks >= track.receive_s[0]) & (ticks <= track.receive_s[-1])
    shown = track.predicted.fingertip_positions[asked][:, worn.tip_fingers]
    return (shown - truth.markers_at(ticks[asked])[:, worn.tips],
            track.predicted.fingertip_covariances[asked][:, worn.tip_fingers])


def pooled(runs: Sequence[Figures]) -> Figures:
    """One set of figures for several runs of equal length: errors root mean square, swaps added up, rates averaged."""
    return {name: _pool(name, [figures[name] for figures in runs]) for name in runs[0]}


def ratio(figure: float | None, reference: float | None) -> float | None:
    """How many times the reference the figure is; None where one is missing or the reference is zero."""
    return None if figure is None or not reference else figure / reference


def _pool(name: str, values: Sequence[float | None]) -> float | None:
    known = np.array([value for value in values if value is not None])
    if not known.size:
        return None
    if name in _ADDED:
        return float(known.sum())
    return float(known.mean()) if name in _PLAIN else rms(known)
