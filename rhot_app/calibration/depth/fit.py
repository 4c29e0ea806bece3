"""Depth from disparity (RHOT eq. 6.12), and its correction by a power law D = k |disparity|^z (RHOT 7.2.3).

The cameras need not be calibrated. The law takes up what parallel axes and equal view angles (eq. 6.12) leave out.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rhot_app.calibration.check.camera_calibration import NOT_CALIBRATED, calibration_finding, calibration_text
from rhot_app.calibration.depth.table import DepthRow, DepthTable, RejectedRow
from rhot_app.calibration.verdict import Finding, Grade, Verdict, judge
from rhot_app.errors import CalibrationError
from rhot_app.project import DepthSettings, Rig

# -- depth from disparity (RHOT eq. 6.12) ------------------------------------------------------------------------------
# Without calibration: parallel axes, equal cameras.

Array = NDArray[np.float64]


def depth_from_disparity(disparity_px: ArrayLike, baseline_m: float, width_px: float, view_angle_rad: float) -> Array:
    """Distance in m from the disparity X_L - X_R in px (RHOT eq. 6.12); NaN where it is not positive.

    D = B x0 / (2 tan(phi0 / 2) (X_L - X_R)), with the image width x0 and the horizontal view angle phi0.
    """
    return baseline_m * width_px / (2.0 * math.tan(view_angle_rad / 2.0)) / _positive(disparity_px)


def depth_from_power_law(disparity_px: ArrayLike, k: float, z: float) -> Array:
    """Distance D = k |x|^z of a disparity in px (RHOT eq. 7.4), in the unit in which `k` was fitted.

    The thesis found k = 4543.3 (cm) and z = -1.035. NaN where the disparity is not positive.
    """
    return np.asarray(k * _positive(disparity_px) ** z)


def depth_error(depth_m: ArrayLike, baseline_m: float, angle_error_rad: float) -> Array:
    """Error in m that a viewing angle's error makes at `depth_m`: D^2 / B tan(dphi) (RHOT eq. 7.3)."""
    return np.asarray(np.square(np.asarray(depth_m, dtype=np.float64)) / baseline_m * math.tan(angle_error_rad))


def _positive(disparity_px: ArrayLike) -> Array:
    disparity = np.asarray(disparity_px, dtype=np.float64)
    return np.where(disparity > 0.0, disparity, np.nan)


# -- depth correction by a power law (RHOT 7.2.3) ----------------------------------------------------------------------
# D = k |disparity|^z, fitted to measured distances.

LEAST_ROWS = 3

WILD = 0.25
"""A row that is off by more than this part of its distance is a typing error or another marker; it is not used."""

_LEAST_SPREAD = 1.05
_CHART_POINTS = 60


@dataclass(frozen=True, slots=True)
class DepthGeometry:
    """What eq. 6.12 and 7.1 need of the cameras; the defaults are the thesis's."""

    baseline_m: float = 0.075
    view_angle_rad: float = math.radians(62.2)
    width_px: int = 640

    @property
    def constant_m(self) -> float:
        """Distance times disparity of parallel cameras, m px: B x0 / (2 tan(phi0 / 2))."""
        return self.baseline_m * self.width_px / (2.0 * math.tan(0.5 * self.view_angle_rad))

    def error_m(self, distance_m: Array) -> Array:
        """What one pixel means at each distance, m (eq. 7.1 and 7.3)."""
        return depth_error(distance_m, self.baseline_m, self.view_angle_rad / self.width_px)


def geometry_of(rig: Rig) -> DepthGeometry:
    """The geometry that a rig of two cameras states: its `depth` where that is in use, else lenses and poses."""
    width = rig.nodes[0].intrinsics.width
    if rig.depth.mode == "disparity":
        return DepthGeometry(rig.depth.baseline_m, math.radians(rig.depth.view_angle_deg), width)
    first, second = (np.array(node.pose.translation_m) for node in rig.nodes)
    baseline = float(np.linalg.norm(second - first)) or DepthGeometry().baseline_m
    return DepthGeometry(baseline, 2.0 * math.atan(0.5 * width / rig.nodes[0].intrinsics.fx), width)


@dataclass(frozen=True, slots=True)
class DepthChart:
    """Curves of figure 7.8 over disparity (N,) px: the fitted law, eq. 6.12, and the fit plus and minus eq. 7.3, m."""

    disparity_px: Array
    fitted_m: Array
    theory_m: Array
    low_m: Array
    high_m: Array


@dataclass(frozen=True, slots=True)
class DepthResult:
    """The fitted law and how well it holds. Per used row (N,): `corrected_m` by the law, `theory_m` by eq. 6.12,
    `error_m` what one pixel means there (eq. 7.3). `k_m` makes metres; `z_sd` is the standard deviation of `z`."""

    k_m: float
    z: float
    z_sd: float
    geometry: DepthGeometry
    rows: tuple[DepthRow, ...]
    rejected: tuple[RejectedRow, ...]
    corrected_m: Array
    theory_m: Array
    error_m: Array
    chart: DepthChart = field(repr=False)
    verdict: Verdict

    @property
    def residuals_m(self) -> Array:
        """(N,) corrected minus measured distance."""
        return self.corrected_m - np.array([row.distance_m for row in self.rows])

    @property
    def settings(self) -> DepthSettings:
        """The rig's `depth`: distances from disparity by this law."""
        return DepthSettings(mode="disparity", baseline_m=self.geometry.baseline_m,
                             view_angle_deg=math.degrees(self.geometry.view_angle_rad), k=self.k_m, z=self.z)


def fit_depth(table: DepthTable, geometry: DepthGeometry | None = None) -> DepthResult:
    """Least squares in log-log space through |disparity| and distance (RHOT eq. 7.4, figure 7.8).

    Raises CalibrationError when fewer than three rows can be used or all have the same distance.
    """
    geometry = geometry or DepthGeometry()
    rows, rejected = _without_wild_rows(table)
    distances = np.array([row.distance_m for row in rows])
    disparities = np.abs([row.disparity_px for row in rows])
    _require_spread(distances, disparities)
    log_k, z, z_sd = _line(np.log(disparities), np.log(distances))
    k_m = math.exp(log_k)
    corrected = depth_from_power_law(disparities, k_m, z)
    figures = DepthFigures(
        k_m=k_m, z=z, constant_m=float(np.median(distances * disparities)), expected_m=geometry.constant_m,
        distances_m=distances, disparities_px=np.array([row.disparity_px for row in rows]),
        relative=corrected / distances - 1.0, rejected=rejected, unit_is_guessed=table.unit_is_guessed)
    return DepthResult(
        k_m=k_m, z=z, z_sd=z_sd, geometry=geometry, rows=rows, rejected=rejected, corrected_m=corrected,
        theory_m=depth_from_disparity(disparities, geometry.baseline_m, geometry.width_px, geometry.view_angle_rad),
        error_m=geometry.error_m(distances), chart=_chart(disparities, k_m, z, geometry), verdict=judge_depth(figures))


def _without_wild_rows(table: DepthTable) -> tuple[tuple[DepthRow, ...], tuple[RejectedRow, ...]]:
    """The rows near the median of the lines through all pairs of points (Theil and Sen), and the rejected ones."""
    rows = table.rows
    if len(rows) < LEAST_ROWS:
        reasons = "; ".join(f"{row.where}: {row.reason}" for row in table.rejected[:3])
        raise CalibrationError(f"{len(rows)} rows of the table can be used, {LEAST_ROWS} are needed, better eight. "
                               f"{reasons}".rstrip())
    x, y = np.log(np.abs([row.disparity_px for row in rows])), np.log([row.distance_m for row in rows])
    first, second = np.triu_indices(len(rows), 1)
    apart = np.abs(x[first] - x[second]) > 1e-3
    slope = float(np.median((y[first] - y[second])[apart] / (x[first] - x[second])[apart])) if apart.any() else -1.0
    off = np.abs(np.exp(y - slope * x - np.median(y - slope * x)) - 1.0)
    if np.count_nonzero(off <= WILD) < max(LEAST_ROWS, 0.6 * len(rows)):
        return tuple(rows), tuple(table.rejected)  # no law to be wild against; the verdict will say so
    wild = [RejectedRow(row.where, f"{100 * row.distance_m:.4g} cm with {row.disparity_px:g} px lies {100 * far:.0f} % "
                                   "off the line through the others")
            for row, far in zip(rows, off, strict=True) if far > WILD]
    return (tuple(row for row, far in zip(rows, off, strict=True) if far <= WILD), (*table.rejected, *wild))


def _require_spread(distances: Array, disparities: Array) -> None:
    for what, values in (("distance", distances), ("disparity", disparities)):
        if values.max() < _LEAST_SPREAD * values.min():
            raise CalibrationError(f"all rows have nearly the same {what}, which determines no law. Measure from near "
                                   "to far, such as 20 to 100 cm in steps of 5 cm.")


def _line(x: Array, y: Array) -> tuple[float, float, float]:
    """Least squares: intercept, slope and the slope's standard deviation (NaN for an exact line through two)."""
    centred = x - x.mean()
    spread = float(centred @ centred)
    slope = float(centred @ y) / spread
    intercept = float(y.mean() - slope * x.mean())
    residuals = y - intercept - slope * x
    return intercept, slope, math.sqrt(float(residuals @ residuals) / (len(x) - 2) / spread)


def _chart(disparities: Array, k_m: float, z: float, geometry: DepthGeometry) -> DepthChart:
    grid = np.geomspace(disparities.min(), disparities.max(), _CHART_POINTS)
    fitted = depth_from_power_law(grid, k_m, z)
    error = geometry.error_m(fitted)
    theory = depth_from_disparity(grid, geometry.baseline_m, geometry.width_px, geometry.view_angle_rad)
    return DepthChart(grid, fitted, theory, fitted - error, fitted + error)


# -- what a depth correction is worth ----------------------------------------------------------------------------------

FAIR_RMS, POOR_RMS = 0.03, 0.10
FAIR_EXPONENT, POOR_EXPONENT = 0.1, 0.4
"""How far z may be from -1: parallel equal cameras have -1, the thesis found -1.035."""

FEW_ROWS = 6
NARROW = 1.8  # farthest by nearest distance below which k and z hang on the noise
_UNIT_FACTORS = {0.001: ("mm", "m"), 0.01: ("cm", "m"), 0.1: ("mm", "cm"), 10.0: ("cm", "mm"), 100.0: ("m", "cm"),
                 1000.0: ("m", "mm")}
"""How much too large the constant is when distances said to be in the first unit are in the second."""

_UNIT_MARGIN = 2.0
_SURPRISING = 1.5


@dataclass(frozen=True, slots=True)
class DepthFigures:
    """What is judged. `constant_m`: median of distance times disparity, m px, and `expected_m` of parallel cameras.
    Per used row (N,): `distances_m`, signed `disparities_px`, `relative` error of the fitted law."""

    k_m: float
    z: float
    constant_m: float
    expected_m: float
    distances_m: Array
    disparities_px: Array
    relative: Array
    rejected: tuple[RejectedRow, ...]
    unit_is_guessed: bool

    @property
    def rms(self) -> float:
        """Of the relative errors."""
        return math.sqrt(float(np.mean(np.square(self.relative))))


def judge_depth(figures: DepthFigures) -> Verdict:
    """The verdict on a fitted law."""
    near, far = 100 * figures.distances_m.min(), 100 * figures.distances_m.max()
    summary = (f"distances from {near:.4g} to {far:.4g} cm are met to {100 * figures.rms:.1f} % rms by "
               f"D = {100 * figures.k_m:.1f} cm |x|^{figures.z:.3f}, fitted to {len(figures.relative)} rows.")
    return judge(summary, [*_units(figures), *_signs(figures), *_shape(figures), *_scatter(figures),
                           *_range(figures), *_rows(figures)])


def _units(figures: DepthFigures) -> list[Finding]:
    ratio = figures.constant_m / figures.expected_m
    figure = (f"Distance times disparity is {100 * figures.constant_m:.0f} cm px; cameras of this baseline and view "
              f"angle have {100 * figures.expected_m:.0f} cm px.")
    for factor, (said, meant) in _UNIT_FACTORS.items():
        if factor / _UNIT_MARGIN < ratio < factor * _UNIT_MARGIN:
            return [Finding("units", Grade.POOR, figure, f"The distances look as if they were in {meant}, not {said}.",
                            "Name the column after its unit (real_m, real_cm or real_mm) or convert the values.")]
    if not 1.0 / _SURPRISING < ratio < _SURPRISING:
        return [Finding("constant", Grade.FAIR, figure,
                        "Baseline or view angle are not what is assumed, or the unit of the distances is not.",
                        "Give the true --baseline-mm and --view-angle-deg, and check the unit.")]
    if figures.unit_is_guessed:
        return [Finding("unit_guessed", Grade.FAIR, "The header gives no unit of the distances.", "",
                        "They were taken as cm, which fits the cameras. Name the column real_cm.")]
    return []


def _signs(figures: DepthFigures) -> list[Finding]:
    negative = int(np.count_nonzero(figures.disparities_px < 0.0))
    if 0 < negative < len(figures.disparities_px):
        return [Finding("mixed_signs", Grade.FAIR,
                        f"{negative} of {len(figures.disparities_px)} disparities are negative, the others positive.",
                        "Some were taken left minus right, some right minus left, or the cameras were swapped.",
                        "The magnitudes were used. Check these rows.")]
    return []


def _shape(figures: DepthFigures) -> list[Finding]:
    away = abs(figures.z + 1.0)
    if away <= FAIR_EXPONENT:
        return []
    grade = Grade.POOR if away > POOR_EXPONENT else Grade.FAIR
    cause = ("The columns may be exchanged, or the second one is no disparity." if figures.z > -POOR_EXPONENT else
             "The cameras squint (their axes are not parallel), or some distances were not measured from the cameras.")
    return [Finding("exponent", grade, f"The exponent is {figures.z:.3f}; parallel cameras have -1.", cause,
                    "Set the cameras parallel and measure from the lenses, or calibrate the stereo rig with a board.")]


def _scatter(figures: DepthFigures) -> list[Finding]:
    if figures.rms <= FAIR_RMS:
        return []
    worst = int(np.argmax(np.abs(figures.relative)))
    return [Finding("scatter", Grade.POOR if figures.rms > POOR_RMS else Grade.FAIR,
                    f"The distances scatter by {100 * figures.rms:.1f} % rms about the law, at worst "
                    f"{100 * figures.relative[worst]:+.0f} % at {100 * figures.distances_m[worst]:.4g} cm.",
                    "The marker moved or was partly hidden, or a ruler was read wrongly.",
                    "Hold the marker still on the middle axis of the cameras and measure these rows again.")]


def _range(figures: DepthFigures) -> list[Finding]:
    found = []
    span = float(figures.distances_m.max() / figures.distances_m.min())
    if span < NARROW:
        found.append(Finding("narrow", Grade.FAIR, f"The farthest distance is only {span:.2f} times the nearest.", "",
                             "Outside this range the law is a guess; measure from 20 to 100 cm."))
    if len(figures.distances_m) < FEW_ROWS:
        found.append(Finding("few_rows", Grade.FAIR, f"Only {len(figures.distances_m)} rows were used.", "",
                             "Measure eight distances or more, so that a wrong one shows."))
    return found


def _rows(figures: DepthFigures) -> list[Finding]:
    if not figures.rejected:
        return []
    reasons = "; ".join(f"{row.where}: {row.reason}" for row in figures.rejected[:5])
    more = f"; and {len(figures.rejected) - 5} more" if len(figures.rejected) > 5 else ""
    return [Finding("rejected_rows", Grade.FAIR, f"{len(figures.rejected)} rows were not used ({reasons}{more}).", "",
                    "Correct them in the table or leave them out.")]


def replaced_calibration(rig: Rig) -> list[Finding]:
    """What is lost when `rig` finds distances from disparity alone from now on; nothing unless its cameras are
    calibrated."""
    found = calibration_finding(rig)
    if rig.depth.mode == "disparity" or (found is not None and found.finding.figure == NOT_CALIBRATED):
        return []
    how = "" if rig.calibration is None else f" ({calibration_text(rig)})"
    return [Finding("replaces_calibration", Grade.FAIR, f"This rig finds distances from calibrated cameras{how}.",
                    "Disparity alone is less exact: it takes them for equal and parallel.",
                    "Keep the calibration, or repeat the stereo calibration, unless you want this law.")]
