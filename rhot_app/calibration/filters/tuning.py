"""The filters' settings from two recordings, in the thesis's two steps (RHOT 7.3): held still, then moved fast.

The rule, for the filter before depth and then for the one after it, marker by marker:

1. held still, beta 0: the highest min cutoff whose jitter is within the target, since a higher one lags less;
2. moved fast: the smallest beta whose lag is within the target, and whose rms error is no more than so much lag makes
   of the speed; a smaller one is calmer. Where none is, the one that exceeds the two targets by the smallest factor.

The filter before depth may use up half of the lag, the one after it what is left. What holds for all markers is the
lowest of their cutoffs and the largest of their betas.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import msgspec
import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.calibration.filters.meters import (
    FilterFigures,
    FilterTargets,
    MarkerFigures,
    judge_filters,
    lag,
    motion_of,
    velocities,
)
from rhot_app.calibration.observations import InstantTable
from rhot_app.calibration.verdict import Verdict
from rhot_app.errors import CalibrationError
from rhot_app.filters import jitter, one_euro
from rhot_app.geometry.camera import CameraModel
from rhot_app.geometry.triangulate import cast, empty_rays, triangulate
from rhot_app.progress import Progress, silent
from rhot_app.project import CameraPose, FilterSettings, Intrinsics, OneEuroSettings, Rig

# -- a recording through candidate filters -----------------------------------------------------------------------------
# As in the tracker: filter pixels, triangulate, filter positions.

Array = NDArray[np.float64]

OFF = (math.inf, 0.0, 1.0)
"""Parameters of a 1-euro filter that changes nothing."""


@dataclass(frozen=True, slots=True)
class Footage:
    """What the filters work on. `times_s` (T,); `pixels` (T, C, M, 2), NaN where not to be used; `intrinsics` (C, 13),
    `cameras` (C, 3, 4) camera_from_world m."""

    times_s: Array
    pixels: Array
    intrinsics: Array
    cameras: Array

    @property
    def markers(self) -> int:
        """M."""
        return self.pixels.shape[2]


def make_footage(instants: InstantTable, rig: Rig) -> Footage:
    """The measured part of a recording; a rig without stereo geometry gets the cameras that eq. 6.12 assumes."""
    pixels = np.where(instants.measured[:, None, :, None], instants.pixels, np.nan)
    models = [CameraModel.from_rig(lens, pose) for lens, pose in _lenses(rig)]
    return Footage(instants.times_s, np.ascontiguousarray(pixels), np.array([model.intrinsics for model in models]),
                   np.array([model.camera_from_world[:3] for model in models]))


def simulate(footage: Footage, pixel: Array, position: Array) -> tuple[Array, Array]:
    """Filtered pixels (T, C, M, 2) and positions (T, M, 3) with parameters (M, 3) of both filters."""
    cameras, markers = footage.pixels.shape[1:3]
    pixels, positions = np.empty_like(footage.pixels), np.empty((len(footage.times_s), markers, 3))
    _run(footage.times_s, footage.pixels, footage.intrinsics, footage.cameras,
         np.tile(np.repeat(pixel, 2, axis=0), (cameras, 1)), np.repeat(position, 3, axis=0), pixels, positions)
    return pixels, positions


def _lenses(rig: Rig) -> list[tuple[Intrinsics, CameraPose]]:
    if rig.depth.mode == "stereo":
        return [(node.intrinsics, node.pose) for node in rig.nodes]
    found = []
    for k, node in enumerate(rig.nodes):
        width, height = node.intrinsics.width, node.intrinsics.height
        focal = 0.5 * width / math.tan(0.5 * math.radians(rig.depth.view_angle_deg))
        lens = Intrinsics(width, height, focal, focal, 0.5 * (width - 1), 0.5 * (height - 1))
        found.append((lens, CameraPose(translation_m=(k * rig.depth.baseline_m, 0.0, 0.0))))
    return found


@njit(cache=True)
def _run(times: Array, seen: Array, intrinsics: Array, cameras: Array, pixel_parameters: Array,
         position_parameters: Array, pixels: Array, positions: Array) -> None:
    count, markers = seen.shape[1], seen.shape[2]
    pixel_state = np.full((2 * count * markers, 3), math.nan)
    position_state = np.full((3 * markers, 3), math.nan)
    rays, used, covariance = empty_rays(count), np.empty(count, np.bool_), np.empty((3, 3))
    unit = np.zeros((count, 2, 2))
    unit[:, 0, 0] = unit[:, 1, 1] = 1.0
    for t in range(len(times)):
        one_euro.step(times[t], seen[t].reshape(-1), pixel_parameters, pixel_state, pixels[t].reshape(-1))
        for m in range(markers):
            used[:] = True
            cast(pixels[t, :, m], unit, intrinsics, used, rays)
            triangulate(rays, cameras, used, positions[t, m], covariance)
        flat = positions[t].reshape(-1)
        one_euro.step(times[t], flat, position_parameters, position_state, flat)


# -- choice of the settings (RHOT 7.3) ---------------------------------------------------------------------------------
# In the thesis's two steps: held still, then moved.

Place = Callable[[Array], tuple[Array, Array]]
"""Puts a candidate's parameters (M, 3) before or after depth: parameters of both filters."""

MIN_CUTOFFS_HZ = np.geomspace(0.25, 16.0, 13)
PIXEL_BETAS = np.geomspace(0.02, 20.48, 21)  # Hz per px/s
POSITION_BETAS = np.geomspace(10.0, 10240.0, 21)  # Hz per m/s


@dataclass(frozen=True, slots=True)
class FilterCurves:
    """What each candidate of one filter does. K cutoffs: `still_jitter_m` (K, M) with beta 0. B betas, with the chosen
    cutoff: `lag_s`, `error_m` (B, M) in the fast recording, `jitter_m` (B, M) in the still one. `chosen` is what the
    rule takes for all markers, `by_marker` for each."""

    min_cutoffs_hz: Array
    still_jitter_m: Array
    betas: Array
    lag_s: Array
    error_m: Array
    jitter_m: Array
    chosen: OneEuroSettings
    by_marker: tuple[OneEuroSettings, ...]


@dataclass(frozen=True, slots=True)
class FilterChoice:
    """What settings do to each marker, and the verdict on that."""

    markers: tuple[MarkerFigures, ...]
    verdict: Verdict


@dataclass(frozen=True, slots=True)
class FilterResult:
    """The proposal, the curves behind it, and what it does: `common` with the settings that hold for all markers, `own`
    with each marker's, which are proposed too where it is `per_marker`."""

    targets: FilterTargets
    pixel: FilterCurves = field(repr=False)
    position: FilterCurves = field(repr=False)
    common: FilterChoice
    own: FilterChoice
    per_marker: bool = False

    @property
    def markers(self) -> tuple[MarkerFigures, ...]:
        """What the settings for all markers do to each."""
        return self.common.markers

    @property
    def verdict(self) -> Verdict:
        """The verdict on the settings for all markers."""
        return self.common.verdict

    @property
    def choice(self) -> FilterChoice:
        """What `apply` would do."""
        return self.own if self.per_marker else self.common

    def apply(self, rig: Rig) -> Rig:
        """The rig with the proposed filters, switched on."""
        pixel, position = ({marker.marker_id: own for marker, own in zip(self.markers, curves.by_marker, strict=True)
                            if self.per_marker and marker.known} for curves in (self.pixel, self.position))
        return msgspec.structs.replace(rig, filters=FilterSettings(
            enabled=True, pixel=self.pixel.chosen, position=self.position.chosen, pixel_markers=pixel,
            position_markers=position))


def tune_filters(still: InstantTable, fast: InstantTable, rig: Rig, targets: FilterTargets | None = None,
                 progress: Progress = silent) -> FilterResult:
    """Propose both filters' settings for `rig`; the derivative cutoffs stay as they are.

    Raises CalibrationError when no marker is measured in both recordings.
    """
    targets = targets or FilterTargets()
    bench = FilterBench(make_footage(still, rig), make_footage(fast, rig))
    if not bench.known.any():
        raise CalibrationError("no marker is measured long enough in both recordings. Hold the hand where both cameras "
                               "see it, five seconds still and then five seconds moving at least.")
    markers = len(bench.known)
    half = FilterTargets(targets.jitter_m, 0.5 * targets.lag_s)
    off = np.tile(OFF, (markers, 1))
    progress("trying filters before depth", 0.0)
    pixel = _tune(bench, lambda own: (own, off), PIXEL_BETAS, rig.filters.pixel, half)
    before = _rows(pixel.chosen, markers)
    progress("trying filters after depth", 0.5)
    position = _tune(bench, lambda own: (before, own), POSITION_BETAS, rig.filters.position, targets)
    common, own = (FilterChoice(figures, judge_filters(FilterFigures(targets, figures, bench.drift_m_s)))
                   for figures in (_figures(bench, rig, before, _rows(position.chosen, markers)),
                                   _figures(bench, rig, _own_rows(pixel), _own_rows(position))))
    progress("filters", 1.0)
    return FilterResult(targets, pixel, position, common, own)


def _tune(bench: FilterBench, place: Place, betas: Array, now: OneEuroSettings,
          targets: FilterTargets) -> FilterCurves:
    """Both steps for one filter."""
    def rows(min_cutoff_hz: float, beta: float) -> Array:
        return np.tile((min_cutoff_hz, beta, now.derivative_cutoff_hz), (len(bench.known), 1))

    still = np.array([bench.jitter_m(*place(rows(cutoff, 0.0))) for cutoff in MIN_CUTOFFS_HZ])
    cutoffs = np.array([_highest(MIN_CUTOFFS_HZ, still[:, m] <= targets.jitter_m) for m in range(still.shape[1])])
    cutoff = float(cutoffs[bench.known].min())
    found = [bench.lag_and_error(*place(rows(cutoff, beta))) for beta in betas]
    lags, errors = np.array([one for one, _ in found]), np.array([one for _, one in found])
    calm = np.array([bench.jitter_m(*place(rows(cutoff, beta))) for beta in betas])
    within = (np.abs(lags) <= targets.lag_s) & (errors <= targets.lag_s * bench.speeds_m_s)
    moved = bench.known & np.isfinite(lags).all(axis=0)
    excess = np.maximum(np.abs(lags) / targets.lag_s, calm / targets.jitter_m)
    own = np.array([_smallest(betas, within[:, m], excess[:, m]) for m in range(within.shape[1])])
    beta = float(own[moved].max()) if moved.any() else now.beta
    return FilterCurves(
        MIN_CUTOFFS_HZ, still, betas, lags, errors, calm, _settings(cutoff, beta, now),
        tuple(_settings(cutoffs[m] if bench.known[m] else cutoff, own[m] if moved[m] else beta, now)
              for m in range(len(bench.known))))


def _highest(candidates: Array, good: NDArray[np.bool_]) -> float:
    """The highest candidate up to which all are good; the lowest when none is."""
    return float(candidates[max(int(np.argmin([*good, False])) - 1, 0)])


def _smallest(candidates: Array, good: NDArray[np.bool_], excess: Array) -> float:
    """The smallest candidate from which on all are good; the one of the smallest excess when the largest is not."""
    if not good[-1]:
        return float(candidates[int(np.argmin(np.where(np.isfinite(excess), excess, np.inf)))])
    bad = np.flatnonzero(~good)
    return float(candidates[int(bad[-1]) + 1 if len(bad) else 0])


def _settings(min_cutoff_hz: float, beta: float, now: OneEuroSettings) -> OneEuroSettings:
    """Three digits are more than enough, and a person reads them."""
    return OneEuroSettings(float(f"{min_cutoff_hz:.3g}"), float(f"{beta:.3g}"), now.derivative_cutoff_hz)


def _rows(settings: OneEuroSettings, markers: int) -> Array:
    return np.tile((settings.min_cutoff_hz, settings.beta, settings.derivative_cutoff_hz), (markers, 1))


def _own_rows(curves: FilterCurves) -> Array:
    return np.concatenate([_rows(own, 1) for own in curves.by_marker])


def _figures(bench: FilterBench, rig: Rig, pixel: Array, position: Array) -> tuple[MarkerFigures, ...]:
    """What the proposal does to each marker, beside no filter and the rig's own."""
    ids, filters = rig.markers.ids, rig.filters
    now = tuple(np.concatenate([_rows(own.get(name, common), 1) for name in ids]) for own, common in (
        (filters.pixel_markers, filters.pixel), (filters.position_markers, filters.position)))
    if not filters.enabled:
        now = np.tile(OFF, (len(ids), 1)), np.tile(OFF, (len(ids), 1))
    columns = np.column_stack([
        bench.speeds_m_s, bench.raw_jitter_px, bench.raw_jitter_m,
        bench.jitter_m(pixel, position), *bench.lag_and_error(pixel, position),
        bench.jitter_m(*now), *bench.lag_and_error(*now)])
    return tuple(MarkerFigures(name, bool(known), *figures)
                 for name, known, figures in zip(ids, bench.known, columns.tolist(), strict=True))


# -- the two recordings ------------------------------------------------------------------------------------------------

LEAST_INSTANTS = 40
"""A marker must be measured in so many instants of either recording."""


class FilterBench:
    """M markers. Filters are given as parameters (M, 3): min cutoff, beta, derivative cutoff.

    `known` (M,): measured long enough in both recordings. `raw_jitter_m` and `raw_jitter_px` (M,) without any filter;
    `speeds_m_s` (M,) in the fast recording; `drift_m_s`: how fast the hand that was held still wandered.
    """

    def __init__(self, still: Footage, fast: Footage) -> None:
        self._still, self._fast = still, fast
        off = np.tile(OFF, (still.markers, 1))
        resting, moving = simulate(still, off, off)[1], simulate(fast, off, off)[1]
        self._motions = [motion_of(fast.times_s, moving[:, m]) for m in range(still.markers)]
        self.known = np.minimum(*(np.isfinite(one[..., 0]).sum(axis=0) for one in (resting, moving))) >= LEAST_INSTANTS
        self.raw_jitter_m = self._jitter(resting)
        self.raw_jitter_px = _mean_of_known([self._jitter(still.pixels[:, camera])
                                             for camera in range(still.pixels.shape[1])])
        self.speeds_m_s = np.array([motion.speed for motion in self._motions])
        self.drift_m_s = self._drift(resting)

    def jitter_m(self, pixel: Array, position: Array) -> Array:
        """(M,) of the hand held still."""
        return self._jitter(simulate(self._still, pixel, position)[1])

    def lag_and_error(self, pixel: Array, position: Array) -> tuple[Array, Array]:
        """(M,) lag s and rms error m of the moving hand; NaN for markers that hardly move."""
        filtered = simulate(self._fast, pixel, position)[1]
        found = np.array([lag(self._fast.times_s, filtered[:, m], motion) for m, motion in enumerate(self._motions)])
        return found[:, 0], found[:, 1]

    def _jitter(self, values: Array) -> Array:
        return np.array([jitter.resting(self._still.times_s, values[:, m]) for m in range(values.shape[1])])

    def _drift(self, resting: Array) -> float:
        """The median marker's, m/s rms; 0 when no marker is known."""
        speeds = [np.linalg.norm(velocities(self._still.times_s, resting[:, m], jitter.WINDOW_S), axis=1)
                  for m in np.flatnonzero(self.known)]
        found = [float(np.sqrt(np.mean(np.square(one[np.isfinite(one)])))) for one in speeds if np.isfinite(one).any()]
        return float(np.median(found)) if found else 0.0


def _mean_of_known(rows: list[Array]) -> Array:
    """(M,) mean of the rows that are not NaN."""
    stacked = np.array(rows)
    known = np.isfinite(stacked)
    return np.where(known, stacked, 0.0).sum(axis=0) / np.where(known.any(axis=0), known.sum(axis=0), np.nan)
