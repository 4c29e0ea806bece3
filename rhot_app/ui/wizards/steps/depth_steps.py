"""The depth wizard without its widgets: distances measured by hand, disparities seen, the law through them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.depth.fit import LEAST_ROWS, DepthReport, fit_depth, geometry_of, replaced_calibration
from rhot_app.calibration.depth.table import DepthRow, DepthTable
from rhot_app.calibration.registry import DEPTH
from rhot_app.calibration.verdict import Verdict, with_findings
from rhot_app.charts import Chart, Curve
from rhot_app.errors import CalibrationError
from rhot_app.project import DepthSettings, Rig
from rhot_app.state import HandState
from rhot_app.ui.backend.feed import Picture
from rhot_app.ui.models.proposal import Proposal, RigChange, Row
from rhot_app.ui.wizards.models.drawing import Callout, Dots
from rhot_app.ui.wizards.models.step import AnnotatedPicture, Bar, ChartedStep, Pictures, Step, StepView
from rhot_node.detect.fast import FastDetector
from rhot_node.detect.image import from_bgr
from rhot_node.wire.messages import MarkerObservation

ENOUGH = 8
LOOK_S = 1.0

_LEAST_STATES = 5
_STILL_PX = 1.0


class DistanceStep(Step):
    """A marker is held at a distance that a person has measured; Space takes what the cameras see in a second."""

    title = "Measure"
    watches = captures = True

    def __init__(self, rig: Rig, recent: Callable[[float], Sequence[HandState]]) -> None:
        """`recent` gives the states of the last seconds."""
        self.rig = rig
        self.marker = 0
        self.distance_m = 0.3
        self.rows: list[DepthRow] = []
        self.report: DepthReport | None = None
        self.problem = ""
        self._recent = recent
        self._detectors: dict[str, FastDetector] = {}
        self._seen: Mapping[str, tuple[Picture, tuple[MarkerObservation, ...]]] = {}
        self._warning = " ".join(finding.sentence for finding in replaced_calibration(rig))

    @property
    def keeps(self) -> bool:
        """Measuring takes a person minutes."""
        return bool(self.rows)

    def disparities(self) -> NDArray[np.float64]:
        """(N,) px, left minus right, of the chosen marker over the last second."""
        pixels = [state.camera_pixels[:2, self.marker, 0] for state in self._recent(LOOK_S)]
        seen = np.array([x[0] - x[1] for x in pixels], dtype=np.float64)
        return seen[np.isfinite(seen)]

    def see(self, pictures: Pictures) -> dict[str, tuple[Picture, tuple[MarkerObservation, ...]]]:
        """The markers in each picture."""
        return {name: (picture, self._detectors.setdefault(name, FastDetector(self.rig.markers)).detect(
            from_bgr(picture.bgr))) for name, picture in pictures.items()}

    def take(self, seen: dict[str, tuple[Picture, tuple[MarkerObservation, ...]]]) -> None:
        """The markers seen last."""
        self._seen = seen

    def capture(self) -> bool:
        """Take the distance entered with the disparity seen; whether it could be."""
        seen = self.disparities()
        name = self.rig.markers.ids[self.marker]
        self.problem = ""
        if len(seen) < _LEAST_STATES:
            self.problem = (f"The marker {name} is not seen by both cameras. Start tracking, and hold it into both "
                            "pictures.")
        elif seen.std() > _STILL_PX:
            self.problem = (f"The marker moves ({seen.std():.1f} px). Lay it down or rest the hand, then press Space "
                            "again.")
        else:
            table = DepthTable()
            row = table.add(self.distance_m, seen)
            if row is not None:
                self.rows.append(row)
                self._fit()
                return True
            self.problem = f"This cannot be measured: {table.rejected[0].reason}."
        return False

    def remove(self, index: int) -> None:
        """Take one row out."""
        del self.rows[index]
        self._fit()

    def undo(self) -> bool:
        """Take the last row out."""
        if not self.rows:
            return False
        self.remove(len(self.rows) - 1)
        return True

    def _fit(self) -> None:
        table = DepthTable()
        for row in self.rows:
            table.take(row)
        self.report = None
        if len(self.rows) >= LEAST_ROWS:
            try:
                self.report = fit_depth(table, geometry_of(self.rig))
            except CalibrationError as exc:
                self.problem = str(exc)

    def view(self) -> StepView:
        """What to do next, and how many distances there are."""
        bars = (Bar("distances", min(len(self.rows) / ENOUGH, 1.0), f"{len(self.rows)} of {ENOUGH} or more"),
                Bar("spread", self._spread(), "from near to far: the farthest three times the nearest"))
        enough = all(bar.full for bar in bars)
        return StepView(self._sentence(), done=self.report is not None and enough,
                        hint=self.problem or ("" if self.rows else self._warning), bars=bars,
                        passable=self.report is not None, kept=len(self.rows),
                        annotated={name: self._annotated(*seen) for name, seen in self._seen.items()})

    def _annotated(self, picture: Picture, seen: tuple[MarkerObservation, ...]) -> AnnotatedPicture:
        """The chosen marker where it is in this picture."""
        mark = seen[self.marker]
        if not mark.found:
            return AnnotatedPicture(picture)
        return AnnotatedPicture(picture, (Dots(np.array([[mark.x, mark.y]])),
                                          Callout(mark.x, mark.y, self.rig.markers.ids[self.marker])))

    def _sentence(self) -> str:
        if not self.rows:
            return "Hold the marker straight before the cameras, enter its distance, press Space."
        if len(self.rows) < ENOUGH:
            return "Now at another distance."
        return "Enough. Go on, or measure more." if self._spread() >= 1.0 else "Now much nearer, or much farther away."

    def _spread(self) -> float:
        distances = [row.distance_m for row in self.rows]
        return min((max(distances) / min(distances) - 1.0) / 2.0, 1.0) if distances else 0.0


class LawStep(ChartedStep):
    """The chart of the law and what it is worth."""

    title = "The law"

    def __init__(self, distances: DistanceStep) -> None:
        self._distances = distances
        self._report: DepthReport | None = None

    def enter(self) -> None:
        """Other rows, another chart."""
        if self._distances.report is not self._report:
            self._report = self._distances.report
            self.charts = () if self._report is None else (chart_of(self._report),)

    def view(self) -> StepView:
        """The verdict."""
        if self._report is None:
            return StepView(f"Go back and measure at least {LEAST_ROWS} distances.")
        return StepView("The points should lie on the line, inside the band.", done=True,
                        verdict=verdict_of(self._report, self._distances.rig))


def verdict_of(report: DepthReport, rig: Rig) -> Verdict:
    """On the law, and on what it replaces in the rig."""
    return with_findings(report.verdict, replaced_calibration(rig))


def chart_of(report: DepthReport) -> Chart:
    """Figure 7.8 of the thesis: distance over disparity, the law, eq. 6.12 and the error band."""
    chart = report.chart
    measured = np.array([row.distance_m for row in report.rows])
    disparities = np.abs([row.disparity_px for row in report.rows])
    return Chart(f"D = {100 * report.k_m:.1f} cm · |x|^{report.z:.4f}", "disparity, px", "distance, cm", (
        Curve("fitted law", chart.disparity_px, 100 * chart.fitted_m),
        Curve("parallel cameras", chart.disparity_px, 100 * chart.theory_m, "dashes"),
        Curve("one pixel more or less", chart.disparity_px, 100 * chart.low_m, "band", 100 * chart.high_m),
        Curve("measured", disparities, 100 * measured, "dots")))


def propose(report: DepthReport | None, rig: Rig, path: Path | None) -> Proposal | None:
    """The rig that takes distances from disparity by this law."""
    if report is None:
        return None
    after = msgspec.structs.replace(rig, depth=report.settings)
    rows = (Row("distance from", _way(rig.depth), _way(after.depth)),
            Row("k", _number(rig.depth.k, "m"), _number(after.depth.k, "m")),
            Row("z", _number(rig.depth.z, ""), _number(after.depth.z, "")))
    return Proposal(DEPTH.reason, verdict_of(report, rig), rows, (RigChange(rig, after, path, DEPTH.reason),))


def _way(depth: DepthSettings) -> str:
    return "calibrated cameras" if depth.mode == "stereo" else "disparity alone"


def _number(value: float | None, unit: str) -> str:
    return "–" if value is None else f"{value:.4f} {unit}".rstrip()
