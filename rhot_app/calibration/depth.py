"""Depth correction without a board (RHOT 7.2.3): the power law D = k |disparity|^z through measured distances.

The cameras need not be calibrated. The law takes up what parallel axes and equal view angles (eq. 6.12) leave out.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.depth_judgement import DepthFigures, judge_depth
from rhot_app.calibration.depth_table import DepthRow, DepthTable, RejectedRow
from rhot_app.calibration.verdict import Verdict
from rhot_app.errors import CalibrationError
from rhot_app.geometry.disparity import depth_error, depth_from_disparity, depth_from_power_law
from rhot_app.project import DepthSettings, Rig

Array = NDArray[np.float64]

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
class DepthReport:
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


def fit_depth(table: DepthTable, geometry: DepthGeometry | None = None) -> DepthReport:
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
    return DepthReport(
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
