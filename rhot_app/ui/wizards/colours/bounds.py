"""The second page: bounds of the colours that a person moves."""

from __future__ import annotations

from typing import Any

import msgspec
from PySide6.QtWidgets import QHBoxLayout

from rhot_app.calibration.registry import Calibration, InForce
from rhot_app.ui.common.parts import plain_button
from rhot_app.ui.language import tr, tr_noop
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.wizards.colours.masks import MaskChoice, MaskedPictures, MaskMaker, Show, annotated_by_masks, drift_of
from rhot_app.ui.wizards.colours.paint_list import PaintList, PaintRow
from rhot_app.ui.wizards.colours.pick import PickStep
from rhot_app.ui.wizards.framework.control_row import Control, ControlRow, Value
from rhot_app.ui.wizards.framework.page import Page, shrinkable
from rhot_app.ui.wizards.framework.step import Pictures, SolveStep, StepView
from rhot_node.markers import ChromaModel, MarkerSet

BOUNDS: tuple[Control, ...] = (
    Control("hue_tolerance_deg", tr_noop("Hue, either way"),
            tr_noop("How far a pixel's hue may be from the marker's. Wider bears more shade and other lamps; narrower "
                    "takes less of what has a similar colour."), 2.0, 45.0, 90.0, 14.0, unit="°", decimals=1,
            optional=False, least=1.0),
    Control("magnitude_min", tr_noop("Least colour"),
            tr_noop("How far from grey a pixel must be, in grey levels of chroma. Less bears deeper shade; more leaves "
                    "out pale things."), 4.0, 120.0, 180.0, 24.0, decimals=1, optional=False, least=4.0),
    Control("luma_min", tr_noop("Darkest"), tr_noop("Pixels darker than this are noise."), 0.0, 255.0, 255.0, 12.0,
            decimals=0, optional=False),
    Control("luma_max", tr_noop("Brightest"), tr_noop("Pixels brighter than this are burnt highlights."), 0.0, 255.0,
            255.0, 250.0, decimals=0, optional=False),
)


class BoundsStep(SolveStep):
    """Learns all colours from what was picked, then lets a person move the bounds; Ctrl+Z goes back step by step."""

    watches = True

    def __init__(self, calibration: Calibration, now: InForce, picks: PickStep) -> None:
        super().__init__(calibration, now, lambda: observations(picks, {}) if picks.gathering.names else None,
                         tr("Learning the colours …"), tr("Check the mask"), tr("Go back and pick a colour."))
        self.cameras = picks.cameras
        self.picks = picks
        self.given: dict[str, ChromaModel] = {}
        self.chosen = ""
        self.show: Show = "all"
        self.markers: MarkerSet = picks.base
        self._revision = -1
        self._undone: list[dict[str, ChromaModel]] = []
        self._masked: MaskedPictures = {}
        self._maker = MaskMaker()

    @property
    def names(self) -> tuple[str, ...]:
        """Markers with samples."""
        return self.result.names if self.result is not None else ()

    def enter(self) -> None:
        """Other samples, other colours."""
        if self._revision != self.picks.gathering.revision:
            self._revision = self.picks.gathering.revision
            self.given, self._undone, self._masked = {}, [], {}
            self.markers = self.picks.markers
            self.begin()

    def take_result(self, result: Any) -> None:
        """The learnt bounds."""
        super().take_result(result)
        if self.chosen not in result.names:
            self.chosen = result.names[0]
        self._show_given()

    @property
    def masked(self) -> MaskedPictures:
        """What the cameras' detectors found last."""
        return self._masked

    def value(self, control: Control) -> float | None:
        """A bound of the chosen marker."""
        if self.result is None:
            return None
        return float(getattr(self.model(self.chosen), control.field))

    def model(self, name: str) -> ChromaModel:
        """A marker's bounds as they would be used."""
        return self.markers.markers[self.markers.ids.index(name)].chroma

    def change(self, control: Control, value: float, *, goes_on: bool = False) -> None:
        """Move a bound of the chosen marker; `goes_on`: a slider is still moving, one step back undoes it whole."""
        if self.result is None:
            return
        kept = int(value) if control.field.startswith("luma") else value
        model = msgspec.structs.replace(self.model(self.chosen), **{control.field: kept})
        self._set({**self.given, self.chosen: model}, goes_on=goes_on)

    def learn_again(self) -> None:
        """The chosen marker's bounds as they were learnt."""
        self._set({name: model for name, model in self.given.items() if name != self.chosen})

    def undo(self) -> bool:
        """One step back."""
        if not self._undone:
            return False
        self.given = self._undone.pop()
        self._show_given()
        return True

    @property
    def undoable(self) -> bool:
        """Whether a bound was moved."""
        return bool(self._undone)

    def _set(self, given: dict[str, ChromaModel], *, goes_on: bool = False) -> None:
        if given != self.given:
            if not goes_on or not self._undone:
                self._undone.append(self.given)
            self.given = given
            self._show_given()

    def _show_given(self) -> None:
        assert self.result is not None
        self.markers = msgspec.structs.replace(self.result.markers, markers=tuple(
            msgspec.structs.replace(marker, chroma=self.given.get(marker.id, marker.chroma))
            for marker in self.result.markers.markers))

    def observe(self, pictures: Pictures) -> MaskedPictures:
        """The mask."""
        return self._maker.look(pictures, self.markers, (self.chosen,))

    def accept_observation(self, seen: MaskedPictures) -> None:
        """What was seen."""
        self._masked = seen

    def view(self) -> StepView:
        """Look, and move what does not fit."""
        if self.result is None:
            return super().view()
        chosen = self.markers.ids.index(self.chosen) if self.show == "chosen" else None
        index = self.markers.ids.index(self.chosen)
        found = [picture.seen[index].found for picture in self._masked.values()]
        hint = tr("{marker} is found by {finding} of {count} cameras.", marker=self.chosen, finding=sum(found),
                  count=len(found)) if found else ""
        hint = " ".join([hint, *(f"{name}: {picture.why(index)}" for name, picture in self._masked.items()
                                 if picture.why(index))])
        drift = drift_of(self._masked)
        if drift:
            hint = tr("Since the colours were picked: {sentence}", sentence=drift[0].sentence)
        return StepView(tr("The mask must fit the markers."), done=True, hint=hint,
                        annotated=annotated_by_masks(self._masked, self.markers, chosen, self.show))


def observations(picks: PickStep, given: dict[str, ChromaModel]) -> tuple[Any, ...]:
    """What colours are learnt from; `given`: bounds that a person has set."""
    gathering = picks.gathering
    return gathering.samples, gathering.views, {"skin": gathering.skin, "base": picks.base, "given": given,
                                                "before": gathering.earlier}


class BoundsPage(Page):
    """Choose a marker in the list, move its bounds."""

    def __init__(self, step: BoundsStep, scheme: Scheme) -> None:
        super().__init__(step)
        self._bounds = step
        self.one_large = True
        self.list = PaintList(scheme, ("marker", "hue"))
        self.mask_choice = MaskChoice()
        self.rows = {control.field: ControlRow(control) for control in BOUNDS}
        self.again = plain_button(tr("As learnt"), tr("The chosen marker's bounds as they were learnt from the "
                                                      "samples."))
        self.undo_button = plain_button(tr("Undo"), tr("Ctrl+Z. The last change back."))
        self.column.addWidget(self.list, 1)
        shrinkable(self.list)
        for row in self.rows.values():
            self.column.addWidget(row)
            row.changed.connect(lambda value, goes_on, row=row: self._move(row.control, value, goes_on=goes_on))
        self.list.horizontalHeader().setVisible(False)
        buttons = QHBoxLayout()
        buttons.addWidget(self.again)
        buttons.addWidget(self.undo_button)
        self.column.addWidget(self.mask_choice)
        self.column.addLayout(buttons)
        self.list.picked.connect(self._choose)
        self.mask_choice.currentIndexChanged.connect(self._show)
        self.again.clicked.connect(self._learn_again)
        self.undo_button.clicked.connect(self._undo)

    def _choose(self, name: str) -> None:
        self._bounds.chosen = name
        self.changed.emit()

    def _show(self) -> None:
        self._bounds.show = self.mask_choice.currentData()
        self.changed.emit()

    def _move(self, control: Control, value: Value, *, goes_on: bool) -> None:
        if value is not None:
            self._bounds.change(control, value, goes_on=goes_on)
            self.changed.emit()

    def _learn_again(self) -> None:
        self._bounds.learn_again()
        self.changed.emit()

    def _undo(self) -> None:
        self._bounds.undo()
        self.changed.emit()

    def show_view(self, view: StepView) -> None:
        """The list, and the bounds of the marker chosen."""
        step = self._bounds
        self.list.show_rows(tuple(self._row(name) for name in step.names), step.chosen)
        for row in self.rows.values():
            row.fill(step.value(row.control))
            row.setEnabled(step.result is not None)
        self.again.setEnabled(step.chosen in step.given)
        self.undo_button.setEnabled(step.undoable)

    def _row(self, name: str) -> PaintRow:
        step = self._bounds
        marker = step.markers.markers[step.markers.ids.index(name)]
        text = f"± {marker.chroma.hue_tolerance_deg:.0f}°"
        return PaintRow(name, marker.display_rgb, "half" if name in step.given else "tick",
                        tr("{text}, by hand", text=text) if name in step.given else text)
