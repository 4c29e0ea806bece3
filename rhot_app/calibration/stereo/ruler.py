"""A second known length: what the board's squares are said to be, held against a ruler that the cameras see.

The scale of a calibrated rig is that of the board's squares and of nothing else; a wrong number changes every distance
and no residual. Only another length can tell.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.bundle.model import BundleState
from rhot_app.calibration.stereo.points import locate
from rhot_app.calibration.verdict import Finding, Grade
from rhot_app.errors import CalibrationError

Array = NDArray[np.float64]

END_PX = 1.0
"""Standard deviation of an end that a person marks in a picture, per axis."""
TAPE = 0.05
"""A baseline measured by hand between two lenses is not known better than this share."""

_TOLERATED = 0.02  # a ruler held by hand, read in two pictures, shows no less than this
_FAIR = 0.01


@dataclass(frozen=True, slots=True, eq=False)
class RulerReading:
    """A known distance seen by cameras: `length_m`, and `ends` (C, 2, 2) raw px of its two ends per camera, NaN where a
    camera does not see it."""

    length_m: float
    ends: Array


@dataclass(frozen=True, slots=True)
class RulerResult:
    """`measured_m` by the rig, with its standard deviation `std_m` from the marking of the ends; `said_m`."""

    said_m: float
    measured_m: float
    std_m: float

    @property
    def ratio(self) -> float:
        """Said over measured: what every length of the rig must be multiplied with."""
        return self.said_m / self.measured_m

    @property
    def doubt(self) -> float:
        """By what share the measured length may be wrong, three standard deviations."""
        return 3.0 * self.std_m / self.measured_m

    @property
    def tells(self) -> bool:
        """Whether it is known better than a baseline by a tape: only then can it confirm a length."""
        return self.doubt <= TAPE


def read_ruler(reading: RulerReading, state: BundleState) -> RulerResult:
    """Measure a ruler with a solved rig; raises CalibrationError when its ends cannot be located."""
    length = _length(reading.ends, state)
    if not np.isfinite(length) or length <= 0.0:
        raise CalibrationError("The ruler's ends do not meet in space: mark the same two points, in the same order, in "
                               "the pictures of two cameras, as x,y in pixels from the upper left.")
    variance = 0.0
    for index in np.argwhere(np.isfinite(reading.ends)):
        moved = reading.ends.copy()
        moved[tuple(index)] += 0.1
        variance += ((_length(moved, state) - length) / 0.1 * END_PX) ** 2
    return RulerResult(reading.length_m, length, float(np.sqrt(variance)))


def ruler_finding(result: RulerResult, square_m: float, parts: str = "squares") -> Finding:
    """What the ruler says about the size of the board's `parts`, each of `square_m`."""
    off = abs(result.ratio - 1.0)
    measured = (f"The ruler of {result.said_m * 1e3:.1f} mm measures {result.measured_m * 1e3:.1f} "
                f"± {result.std_m * 1e3:.1f} mm")
    if off > max(_TOLERATED, result.doubt):
        return Finding(
            "square_size", Grade.POOR, f"{measured}, {100 * (1 / result.ratio - 1):+.1f} %.",
            f"The {parts} are not {square_m * 1e3:g} mm: about {square_m * result.ratio * 1e3:.2f} mm fits the ruler. "
            "A printer that scales to the page does this.",
            f"Measure ten {parts} of the board with a ruler, divide by ten and give that as their size.")
    if off > max(_FAIR, result.doubt):
        return Finding("square_size", Grade.FAIR, f"{measured}, {100 * (1 / result.ratio - 1):+.1f} %.",
                       f"The {parts} may not be exactly as big as said.",
                       "Measure the board again over its whole width.")
    if not result.tells:
        return Finding("ruler_vague", Grade.FAIR, f"{measured}, which is too vague to confirm the size of the "
                       f"{parts}.",
                       "The ruler is short or far away, or points at the cameras.",
                       "Take a longer ruler, nearer and across the pictures.")
    return Finding("ruler", Grade.GOOD, f"{measured}: the size of the {parts} is right.")


def baseline_finding(measured_m: float, nominal_m: float, square_m: float, names: tuple[str, str],
                     parts: str = "squares") -> Finding:
    """The baseline against one measured by hand between the lenses."""
    ratio = nominal_m / measured_m
    figure = (f"{names[0]} and {names[1]} are {measured_m * 1e3:.1f} mm apart, by hand {nominal_m * 1e3:.1f} mm "
              f"({100 * (1 / ratio - 1):+z.1f} %)")
    if abs(1.0 / ratio - 1.0) <= TAPE:
        return Finding("baseline", Grade.GOOD, f"{figure}, which agrees.")
    return Finding(
        "baseline", Grade.POOR, f"{figure}; more than {100 * TAPE:.0f} % apart.",
        f"The {parts} are not {square_m * 1e3:g} mm (the baseline speaks for {square_m * ratio * 1e3:.1f} mm), or the "
        "baseline was not measured from lens to lens.",
        f"Measure both again: ten {parts} with a ruler, and from the middle of one lens to the middle of the other.")


def _length(ends: Array, state: BundleState) -> float:
    points = locate(ends, state)
    return float(np.linalg.norm(points[1] - points[0]))
