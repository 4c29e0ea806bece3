"""What a depth correction is worth: units, signs, shape of the law, scatter and range, in words."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.depth_table import RejectedRow
from rhot_app.calibration.verdict import Finding, Grade, Verdict, judge

Array = NDArray[np.float64]

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
    told = "; ".join(f"{row.where}: {row.reason}" for row in figures.rejected[:5])
    more = f"; and {len(figures.rejected) - 5} more" if len(figures.rejected) > 5 else ""
    return [Finding("rejected_rows", Grade.FAIR, f"{len(figures.rejected)} rows were not used ({told}{more}).", "",
                    "Correct them in the table or leave them out.")]
