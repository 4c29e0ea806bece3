"""The depth wizard: distance from disparity without a board (RHOT 7.2.3)."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from PySide6.QtWidgets import QComboBox, QDoubleSpinBox, QFormLayout, QLabel

from rhot_app.calibration.depth.fit import LEAST_ROWS, DepthResult, fit_depth, geometry_of, replaced_calibration
from rhot_app.calibration.depth.table import DepthRow, DepthTable
from rhot_app.errors import CalibrationError, EngineError
from rhot_app.project import Rig
from rhot_app.state import HandState
from rhot_app.ui.backend.feed import Picture, StateFeed
from rhot_app.ui.common.parts import plain_button
from rhot_app.ui.common.record_table import Column, RecordTable
from rhot_app.ui.language import tr, tr_noop
from rhot_app.ui.models.rows import marker_name
from rhot_app.ui.wizards.framework.definition import Definition, WizardContext, accept_result
from rhot_app.ui.wizards.framework.drawing import Callout, Dots
from rhot_app.ui.wizards.framework.page import ChartPage, Page, shrinkable
from rhot_app.ui.wizards.framework.step import AnnotatedPicture, Bar, Done, Pictures, SolveStep, Step, StepView
from rhot_node.detect.fast import FastDetector
from rhot_node.detect.image import from_bgr
from rhot_node.wire.messages import MarkerObservation


def make_wizard(context: WizardContext, clock: Callable[[], float] = time.monotonic) -> Definition:
    """Measure, look at the law, use it."""
    if context.listen is None:
        raise EngineError(tr("this window cannot hear the markers; open the wizard from the main window."))
    states, rig = StateFeed(context.listen, clock), context.rig
    distances = DistanceStep(rig, states.recent)
    law = SolveStep(context.calibration, context.now,
                    lambda: None if distances.result is None else Done(distances.result), tr("Fitting the law …"),
                    tr("The law"), tr("Go back and measure at least {least_rows} distances.", least_rows=LEAST_ROWS))
    law.advice = tr("The points should lie on the line, inside the band.")
    accept = accept_result(context, law, tr("Measure some distances first."))
    return Definition((DistancePage(distances, states), ChartPage(law, context.scheme), accept), put_back=states.stop)


# -- the step of the distances -----------------------------------------------------------------------------------------

ENOUGH = 8
LOOK_S = 1.0

_LEAST_STATES = 5
_STILL_PX = 1.0


class DistanceStep(Step):
    """A marker is held at a distance that a person has measured; Space takes what the cameras see in a second."""

    title = tr_noop("Measure")
    watches = captures = True

    def __init__(self, rig: Rig, recent: Callable[[float], Sequence[HandState]]) -> None:
        """`recent` gives the states of the last seconds."""
        self.rig = rig
        self.marker = 0
        self.distance_m = 0.3
        self.rows: list[DepthRow] = []
        self.result: DepthResult | None = None
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

    def observe(self, pictures: Pictures) -> dict[str, tuple[Picture, tuple[MarkerObservation, ...]]]:
        """The markers in each picture."""
        return {name: (picture, self._detectors.setdefault(name, FastDetector(self.rig.markers)).detect(
            from_bgr(picture.bgr))) for name, picture in pictures.items()}

    def accept_observation(self, seen: dict[str, tuple[Picture, tuple[MarkerObservation, ...]]]) -> None:
        """The markers seen last."""
        self._seen = seen

    def capture(self) -> bool:
        """Take the distance entered with the disparity seen; whether it could be."""
        seen = self.disparities()
        name = marker_name(self.rig.markers.ids[self.marker])
        self.problem = ""
        if len(seen) < _LEAST_STATES:
            self.problem = (tr("The marker {name} is not seen by both cameras. Start tracking, and hold it into both "
                               "pictures.", name=name))
        elif seen.std() > _STILL_PX:
            self.problem = (tr("The marker moves ({std:.1f} px). Lay it down or rest the hand, then press Space again.",
                               std=seen.std()))
        else:
            table = DepthTable()
            row = table.add(self.distance_m, seen)
            if row is not None:
                self.rows.append(row)
                self._fit()
                return True
            self.problem = tr("This cannot be measured: {reason}.", reason=table.rejected[0].reason)
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
        self.result = None
        if len(self.rows) >= LEAST_ROWS:
            try:
                self.result = fit_depth(table, geometry_of(self.rig))
            except CalibrationError as exc:
                self.problem = str(exc)

    def view(self) -> StepView:
        """What to do next, and how many distances there are."""
        bars = (Bar(tr("distances"), min(len(self.rows) / ENOUGH, 1.0),
                    tr("{rows} of {enough} or more", rows=len(self.rows), enough=ENOUGH)),
                Bar(tr("spread", "of distances"), self._spread(),
                    tr("from near to far: the farthest three times the nearest")))
        enough = all(bar.full for bar in bars)
        return StepView(self._sentence(), done=self.result is not None and enough,
                        hint=self.problem or ("" if self.rows else self._warning), bars=bars,
                        passable=self.result is not None, kept=len(self.rows),
                        annotated={name: self._annotated(*seen) for name, seen in self._seen.items()})

    def _annotated(self, picture: Picture, seen: tuple[MarkerObservation, ...]) -> AnnotatedPicture:
        """The chosen marker where it is in this picture."""
        mark = seen[self.marker]
        if not mark.found:
            return AnnotatedPicture(picture)
        return AnnotatedPicture(picture, (Dots(np.array([[mark.x, mark.y]])),
                                          Callout(mark.x, mark.y, marker_name(self.rig.markers.ids[self.marker]))))

    def _sentence(self) -> str:
        if not self.rows:
            return tr("Hold the marker straight before the cameras, enter its distance, press Space.")
        if len(self.rows) < ENOUGH:
            return tr("Now at another distance.")
        return tr("Enough. Go on, or measure more.") if self._spread() >= 1.0 else tr("Now much nearer, or much "
                                                                                      "farther away.")

    def _spread(self) -> float:
        distances = [row.distance_m for row in self.rows]
        return min((max(distances) / min(distances) - 1.0) / 2.0, 1.0) if distances else 0.0


# -- the page of the distances -----------------------------------------------------------------------------------------

def _columns() -> tuple[Column[DepthRow], ...]:
    return (
        Column(tr("cm"), lambda row: f"{100 * row.distance_m:.1f}", number=True),
        Column(tr("px"), lambda row: f"{row.disparity_px:.2f}", number=True),
        Column("± px", lambda row: f"{row.sd_px:.2f}", number=True))


class DistancePage(Page):
    """Space or the button takes a row; Delete takes the chosen one out, Ctrl+Z the last one."""

    def __init__(self, step: DistanceStep, states: StateFeed) -> None:
        super().__init__(step)
        self.distances = step
        self._states = states
        self._shown: list[DepthRow] = []
        self.marker = QComboBox()
        self.marker.addItems([marker_name(one) for one in step.rig.markers.ids])
        self.marker.setToolTip(tr("The marker that is held at the distance."))
        self.marker.currentIndexChanged.connect(self._choose)
        self.distance = QDoubleSpinBox()
        self.distance.setRange(5.0, 500.0)
        self.distance.setDecimals(1)
        self.distance.setSuffix(" cm")
        self.distance.setValue(100 * step.distance_m)
        self.distance.setToolTip(tr("From the middle between both lenses straight to the marker, by a tape measure."))
        self.distance.valueChanged.connect(self._enter)
        self.seen = QLabel()
        self.take_button = plain_button(tr("Take this distance"), tr("Space. Takes the disparity that both cameras "
                                                                     "have seen in the last second."), self._take)
        form = QFormLayout()
        form.addRow(tr("Marker"), self.marker)
        form.addRow(tr("Distance"), self.distance)
        form.addRow(tr("Disparity"), self.seen)
        self.table = RecordTable(_columns())
        self.table.setToolTip(tr("Distance, mean disparity and its spread within the second."))
        self.table.fill_width()
        self.remove_button = plain_button(tr("Remove the chosen row"), clicked=self._remove)
        self.table.chosen_changed.connect(self._show_removable)
        self.column.addLayout(form)
        self.column.addWidget(self.take_button)
        self.column.addWidget(self.table, 1)
        shrinkable(self.table)
        self.column.addWidget(self.remove_button)
        self.first_field = self.distance
        self.twin_facts = tr("Shows one marker at: choose the distance that you enter here.")
        self._show_removable()

    def entered(self) -> None:
        """Hear the markers from now on."""
        self._states.start()

    def show_view(self, view: StepView) -> None:
        """The disparity seen now, and the rows."""
        seen = self.distances.disparities()
        self.seen.setText(tr("{mean:.2f} ± {std:.2f} px", mean=seen.mean(), std=seen.std()) if len(seen)
                          else tr("not seen by both cameras"))
        if self.distances.rows != self._shown:
            self._shown = list(self.distances.rows)
            self.table.show_records(self._shown)
            self.table.clearSelection()
            self._show_removable()

    def _choose(self, index: int) -> None:
        self.distances.marker = index
        self.changed.emit()

    def _enter(self, value: float) -> None:
        self.distances.distance_m = 0.01 * value

    def _take(self) -> None:
        self.distances.capture()
        self.changed.emit()

    def _remove(self) -> None:
        self.distances.remove(self.table.chosen_rows[0])
        self.changed.emit()

    def _show_removable(self) -> None:
        self.remove_button.setEnabled(self.table.chosen is not None)
