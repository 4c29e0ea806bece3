"""Lines 2 and 4: distances against a ruler (RHOT 7.2.3, table 10.1) and a rod of known length.

No residual of a calibration shows a wrong baseline; only another length does. Which way the two lines are wrong tells
the cause: a wrong baseline or square size stretches everything alike, a wrong focal length only what points away from
the cameras, a wrong angle between the cameras grows with the distance.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from rhot_app.calibration.depth.fit import fit_depth, geometry_of
from rhot_app.calibration.depth.table import DepthTable
from rhot_app.certificate import thesis
from rhot_app.certificate.document import Figure, Line, figure, in_words, not_measured, number
from rhot_app.certificate.geometry import axes_of
from rhot_app.certificate.intervals import UNKNOWN, Interval, mean_of, sd_of
from rhot_app.certificate.recordings import READING_SD_M, CertifiedRecording
from rhot_app.errors import CalibrationError
from rhot_app.geometry.camera import CameraModel
from rhot_app.project import Rig

Array = NDArray[np.float64]

DEPTH, ROD = "Depth against a ruler", "Rod of known length"
LEAST_DISTANCES = 4

SHOWS_PERCENT = 1.0
"""A wrong length of this much must show: an interval that is wider to either side agrees with anything."""

_MEASURE = "Hold a marker still at eight distances or more, from 20 to 100 cm, and type each distance."
_SWEEP = "Move the rod slowly through the whole volume for 20 s, turning it every way, both markers in sight."


@dataclass(frozen=True, slots=True)
class DistanceReading:
    """What the rig says of one distance that was measured by hand: `seen` m, its standard error included; disparities
    (N,) px, left minus right."""

    ruler_m: float
    seen: Interval
    disparities: Array


def read_distance(recording: CertifiedRecording, marker: str, ruler_m: float, rig: Rig) -> DistanceReading:
    """One still marker; `seen` is NaN when it was not located. Raises CertificateError for a marker the rig lacks."""
    m = recording.marker(marker)
    depth = mean_of(axes_of(rig).depth(recording.positions[:, m]))
    columns = [recording.pixels[recording.cameras == camera, m, 0] for camera in range(2)]
    shared = min(len(column) for column in columns)
    return DistanceReading(ruler_m, depth, columns[0][:shared] - columns[1][:shared])


def judge_depth(readings: Sequence[DistanceReading], rig: Rig) -> Line:
    """Scale and zero of the rig's distances by weighted least squares, and the thesis's own figures."""
    good = [one for one in readings if math.isfinite(one.seen.value)]
    if len(good) < LEAST_DISTANCES:
        return not_measured("depth", DEPTH, f"{len(good)} distances were located, {LEAST_DISTANCES} are needed.",
                            _MEASURE)
    ruler, seen = np.array([one.ruler_m for one in good]), np.array([one.seen.value for one in good])
    sd = np.hypot(READING_SD_M, [one.seen.half_width / 1.96 for one in good])
    if ruler.max() < 1.2 * ruler.min():
        return not_measured("depth", DEPTH, "all distances are nearly the same.", _MEASURE)
    line = _fit(np.column_stack([np.ones_like(ruler), ruler]), seen, sd)
    bend = _fit(np.column_stack([np.ones_like(ruler), ruler * ruler]), seen - ruler, sd)
    scale = Interval(line.values[1] - 1.0, line.low(1) - 1.0, line.high(1) - 1.0).scaled(100.0)
    zero = Interval(line.values[0], line.low(0), line.high(0)).scaled(1e3)
    off = 100.0 * (seen / ruler - 1.0)
    left = Interval(*(1e3 * x for x in _spread_about_line(line.residuals)))
    geometry = geometry_of(rig)
    figures = [
        figure("scale error", "%", scale, expected=0.0),
        figure("zero", "mm", zero),
        figure("rms about the line", "mm", left),
        Figure("largest deviation", "%", float(off[np.argmax(np.abs(off))]),
               thesis=f"{thesis.DEVIATION_PERCENT:g} %, corrected {thesis.CORRECTED_PERCENT:g} % (table 10.1)"),
        Figure("one pixel at 1 m (eq. 7.3)", "mm", 1e3 * float(geometry.error_m(np.array([1.0]))[0]),
               thesis="about 20 mm"),
        *_law(good, rig)]
    curves: dict[str, list[float | None]] = {
        "ruler_m": ruler.tolist(), "seen_m": seen.tolist(), "sd_m": sd.tolist(),
        "one_pixel_m": geometry.error_m(ruler).tolist()}
    measured = (f"Over {len(good)} distances from {100 * ruler.min():.0f} to {100 * ruler.max():.0f} cm the rig's "
                f"scale is off by {in_words(scale, '%')}; about that line they scatter by {number(left.value)} mm rms.")
    if scale.holds(0.0) and scale.half_width > SHOWS_PERCENT:
        return not_measured("depth", DEPTH, f"an error of {SHOWS_PERCENT:g} % would not show. {measured}", _MEASURE,
                            tuple(figures), curves)
    if scale.holds(0.0):
        return Line("depth", DEPTH, "agrees", f"{measured} The interval holds 0. {_offset(zero)}".strip(),
                    figures=tuple(figures), curves=curves)
    angle = bend.cost < line.cost and not bend.low(1) <= 0.0 <= bend.high(1)
    cause = ("The error grows with the square of the distance: the angle between the cameras is not what the rig file "
             "says." if angle else f"All distances are {_too(scale.value)} by one factor: the baseline (or the board's "
             "square size, or a focal length) is not what the rig file says.")
    remedy = ("Something moved a camera: repeat the stereo calibration." if angle else
              f"Measure lens to lens: the rig file says {1e3 * geometry.baseline_m:.1f} mm, this ruler says "
              f"{1e3 * geometry.baseline_m / line.values[1]:.1f} mm. Then measure ten squares of the board.")
    return Line("depth", DEPTH, "differs", measured, cause, remedy, tuple(figures), curves)


def _offset(zero: Interval) -> str:
    if zero.holds(0.0):
        return ""
    return (f"The ruler's zero lies {number(abs(zero.value))} mm {'behind' if zero.value < 0.0 else 'before'} the "
            "lenses' centres of projection, which is no error of the rig.")


def _too(error: float) -> str:
    return f"{abs(error):.1f} % too {'long' if error > 0.0 else 'short'}"


def _law(readings: Sequence[DistanceReading], rig: Rig) -> list[Figure]:
    """The thesis's power law through the same distances, for its own sake; nothing where it has no meaning."""
    if len(rig.nodes) != 2 or not _parallel(rig):
        return []
    table = DepthTable()
    for one in readings:
        table.add(one.ruler_m, one.disparities)
    try:
        fitted = fit_depth(table, geometry_of(rig))
    except CalibrationError:
        return []
    reach = float(stats.t.ppf(0.975, max(len(fitted.rows) - 2, 1))) * fitted.z_sd
    return [figure("exponent z of eq. 7.4", "", Interval(fitted.z, fitted.z - reach, fitted.z + reach),
                   thesis=f"{thesis.POWER_Z:g}; parallel cameras have -1"),
            Figure("factor k of eq. 7.4", "m", fitted.k_m, thesis=f"{thesis.POWER_K_M:g} m with B = 75 mm at 640 px")]


def _parallel(rig: Rig) -> bool:
    """Within the 5 degrees beyond which disparity says nothing of distance at the working distance."""
    first, second = (CameraModel.from_rig(node.intrinsics, node.pose).world_from_camera[:3, 2] for node in rig.nodes)
    return rig.depth.mode == "disparity" or float(first @ second) > math.cos(math.radians(5.0))


@dataclass(frozen=True, slots=True)
class _Fit:
    """Weighted least squares: `values` (P,), their standard deviations, Student's factor for 95 %, `residuals` (N,) in
    the data's unit, `cost` the weighted sum of squares."""

    values: Array
    sds: Array
    factor: float
    residuals: Array
    cost: float

    def low(self, k: int) -> float:
        return float(self.values[k] - self.factor * self.sds[k])

    def high(self, k: int) -> float:
        return float(self.values[k] + self.factor * self.sds[k])


def _fit(design: Array, data: Array, sd: Array) -> _Fit:
    """Where the data scatter more than `sd` says, the scatter counts, and Student's t with it; else `sd` does."""
    weighted = design / sd[:, None]
    covariance = np.linalg.inv(weighted.T @ weighted)
    values = covariance @ (weighted.T @ (data / sd))
    residuals = data - design @ values
    cost, freedom = float(np.sum(np.square(residuals / sd))), len(data) - design.shape[1]
    inflation = max(1.0, cost / max(freedom, 1))
    factor = float(stats.t.ppf(0.975, max(freedom, 1)) if inflation > 1.0 else stats.norm.ppf(0.975))
    return _Fit(values, np.sqrt(inflation * np.diag(covariance)), factor, residuals, cost)


def _spread_about_line(residuals: Array) -> tuple[float, float, float]:
    """rms of the residuals of a line, and its chi-squared interval."""
    freedom, total = len(residuals) - 2, float(residuals @ residuals)
    low, high = stats.chi2.ppf((0.975, 0.025), freedom)
    return math.sqrt(total / freedom), math.sqrt(total / low), math.sqrt(total / high)


# -- line 4: rod of known length ---------------------------------------------------------------------------------------

def judge_rod(recording: CertifiedRecording, markers: tuple[str, str], length_m: float, rig: Rig) -> Line:
    """The rod's length wherever and however it is held. `length_m` was read off a ruler."""
    axes = axes_of(rig)
    first, second = (recording.positions[:, recording.marker(name)] for name in markers)
    both = np.isfinite(first[:, 0]) & np.isfinite(second[:, 0])
    first, second = first[both], second[both]
    if len(first) < 50:
        return not_measured("rod", ROD, f"both ends were located in {len(first)} instants only.", _SWEEP)
    along = second - first
    lengths = np.linalg.norm(along, axis=1)
    off = lengths / length_m - 1.0
    depth = axes.depth(0.5 * (first + second))
    reading = READING_SD_M / length_m
    error = mean_of(off).widened(reading).scaled(100.0)
    jitter = sd_of([off * length_m]).scaled(1e3)
    figures = [figure("length error", "%", error, expected=0.0),
               figure("length error in mm", "mm", error.scaled(10.0 * length_m), expected=0.0),
               figure("SD of the length", "mm", jitter)]
    edges = np.quantile(depth, np.linspace(0.0, 1.0, 4))
    for low, high in pairwise(edges):
        chosen = (depth >= low) & (depth <= high)
        figures.append(figure(f"length error from {100 * low:.0f} to {100 * high:.0f} cm", "%",
                              mean_of(off[chosen]).widened(reading).scaled(100.0), expected=0.0))
    across, away = _by_direction(off, np.square((along @ axes.ahead) / lengths), reading)
    figures += [figure("length error across the view", "%", across), figure("length error along the view", "%", away)]
    step = max(1, len(off) // 400)
    curves: dict[str, list[float | None]] = {"depth_m": depth[::step].tolist(),
                                             "length_mm": (1e3 * lengths[::step]).tolist(),
                                             "stated_mm": [1e3 * length_m]}
    measured = (f"The rod of {1e3 * length_m:g} mm is seen {1e3 * lengths.mean():.1f} mm long, off by "
                f"{in_words(error, '%')}; its length scatters by {number(jitter.value)} mm.")
    asked = [one for one in (error, across, away) if math.isfinite(one.value)]
    if all(one.together(len(asked)).holds(0.0) for one in asked):
        if error.half_width > SHOWS_PERCENT:
            return not_measured("rod", ROD, f"an error of {SHOWS_PERCENT:g} % would not show. {measured}",
                                f"Take a longer rod. {_SWEEP}", tuple(figures), curves)
        turned = len(asked) > 1 and max(one.half_width for one in asked) <= SHOWS_PERCENT
        how = ("The intervals hold 0, along the view and across it, too." if turned else
               "The interval holds 0. The rod was turned too little for a wrong focal length to show.")
        return Line("rod", ROD, "agrees", f"{measured} {how}", figures=tuple(figures), curves=curves)
    cause, remedy = _why(error, across, away, off, depth, rig)
    return Line("rod", ROD, "differs", measured, cause, remedy, tuple(figures), curves)


def _by_direction(off: Array, along: Array, reading: float) -> tuple[Interval, Interval]:
    """The relative error, %, of a rod across the view and of one along it: a line through the errors (N,) over the
    square of the direction's cosine (N,). Unknown when the rod was not turned."""
    if np.ptp(along) < 0.3:
        return UNKNOWN, UNKNOWN
    centred = along - along.mean()
    slope = float(centred @ off / (centred @ centred))
    middle = mean_of(off - slope * centred).widened(reading)
    slope_half = mean_of(centred * (off - off.mean() - slope * centred)).half_width / float(np.mean(centred * centred))
    ends = []
    for place in (0.0, 1.0):
        value = middle.value + slope * (place - along.mean())
        half = math.hypot(middle.half_width, slope_half * abs(place - along.mean()))
        ends.append(Interval(value, value - half, value + half).scaled(100.0))
    return ends[0], ends[1]


def _why(error: Interval, across: Interval, away: Interval, off: Array, depth: Array, rig: Rig) -> tuple[str, str]:
    baseline = geometry_of(rig).baseline_m if len(rig.nodes) == 2 else math.nan
    said = "" if math.isnan(baseline) else (f" The rig file says {1e3 * baseline:.1f} mm; this rod says "
                                            f"{1e3 * baseline / (1.0 + 0.01 * error.value):.1f} mm.")
    if math.isfinite(across.value) and across.holds(0.0) and not away.holds(0.0):
        return ("Only what points away from the cameras has a wrong length: a focal length is not what the rig file "
                "says, or the cameras' angle.", "Calibrate the intrinsics again, then stereo.")
    near, far = (mean_of(off[depth <= np.quantile(depth, 1 / 3)]), mean_of(off[depth >= np.quantile(depth, 2 / 3)]))
    if abs(far.value - near.value) > math.hypot(far.half_width, near.half_width):
        return ("The error changes with the distance: the angle between the cameras is not what the rig file says.",
                "Something moved a camera: repeat the stereo calibration.")
    return (f"Every length is {_too(error.value)}, near and far alike: the baseline, or the size of the board's "
            f"squares that it was found with, is {_too(error.value)}.",
            f"Measure lens to lens and ten squares of the board.{said}")
