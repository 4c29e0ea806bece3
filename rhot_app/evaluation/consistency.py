"""Whether a tracker's covariances are true: normalised estimation error squared (NEES) over seeds, and 3-sigma shares.

A state's error e with covariance P gives e' P^-1 e, which for an honest tracker follows chi-squared with as many
degrees of freedom d as e has numbers (Bar-Shalom, Li, Kirubarajan 2001, 5.4). Errors of one run are correlated in
time, so runs with different seeds are what is averaged: at every instant the mean of S seeds times S follows
chi-squared with S d degrees of freedom, whose 2.5 % and 97.5 % points are the band. An honest tracker is inside it at
95 % of the instants, and its average over time is d.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from rhot_app.evaluation.deviations import Deviations, WornMarkers
from rhot_app.evaluation.track import Track
from rhot_app.tracking.state import Knowledge

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

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


def squares(track: Track, off: Deviations, worn: WornMarkers) -> Squares:
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
