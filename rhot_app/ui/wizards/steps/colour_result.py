"""How far the colours can be told apart: bounds that a person moves, and the judged result."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import msgspec

from rhot_app.calibration.colour.colours import ColourReport
from rhot_app.calibration.registry import Calibration, InForce
from rhot_app.calibration.verdict import Finding, with_findings
from rhot_app.ui.wizards.models.step import Done, Pictures, SolveStep, StepView
from rhot_app.ui.wizards.steps.camera_steps import Control
from rhot_app.ui.wizards.steps.colour_pick import (
    MaskedPictures,
    MaskMaker,
    PickStep,
    Show,
    annotated_by_masks,
    drift_of,
)
from rhot_node.markers import ChromaModel, MarkerSet

# -- Step: move the bounds of the colours ------------------------------------------------------------------------------

BOUNDS: tuple[Control, ...] = (
    Control("hue_tolerance_deg", "Hue, either way", "How far a pixel's hue may be from the marker's. Wider bears more "
            "shade and other lamps; narrower takes less of what has a similar colour.",
            2.0, 45.0, 90.0, 14.0, unit="°", decimals=1, optional=False, least=1.0),
    Control("magnitude_min", "Least colour", "How far from grey a pixel must be, in grey levels of chroma. Less bears "
            "deeper shade; more leaves out pale things.", 4.0, 120.0, 180.0, 24.0, decimals=1, optional=False,
            least=4.0),
    Control("luma_min", "Darkest", "Pixels darker than this are noise.", 0.0, 255.0, 255.0, 12.0, decimals=0,
            optional=False),
    Control("luma_max", "Brightest", "Pixels brighter than this are burnt highlights.", 0.0, 255.0, 255.0, 250.0,
            decimals=0, optional=False),
)


class BoundsStep(SolveStep):
    """Learns all colours from what was picked, then lets a person move the bounds; Ctrl+Z goes back step by step."""

    watches = True

    def __init__(self, calibration: Calibration, now: InForce, picks: PickStep) -> None:
        super().__init__(calibration, now,
                         lambda: observations(picks, {}) if picks.gathering.names else None,
                         "Learning the colours …", "Check the mask", "Go back and pick a colour.")
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
        hint = f"{self.chosen} is found by {sum(found)} of {len(found)} cameras." if found else ""
        hint = " ".join([hint, *(f"{name}: {picture.why(index)}" for name, picture in self._masked.items()
                                 if picture.why(index))])
        drift = drift_of(self._masked)
        if drift:
            hint = f"Since the colours were picked: {drift[0].sentence}"
        return StepView("The mask must fit the markers.", done=True, hint=hint,
                        annotated=annotated_by_masks(self._masked, self.markers, chosen, self.show))


def observations(picks: PickStep, given: dict[str, ChromaModel]) -> tuple[Any, ...]:
    """What colours are learnt from; `given`: bounds that a person has set."""
    gathering = picks.gathering
    return gathering.samples, gathering.views, {"skin": gathering.skin, "base": picks.base, "given": given,
                                                "before": gathering.earlier}


# -- Step: separability of the colours, and what is proposed -----------------------------------------------------------

class SeparationStep(SolveStep):
    """The verdict on the colours with the bounds that a person has left them, and on the light since then."""

    watches = True
    advice = "Read what may be mistaken for a marker, then go on."

    def __init__(self, calibration: Calibration, now: InForce, bounds: BoundsStep) -> None:
        super().__init__(calibration, now, self._judging, "Trying the new bounds …", "Tell them apart",
                         "Go back and pick a colour.")
        self.cameras = bounds.cameras
        self._bounds = bounds
        self._learnt: ColourReport | None = None
        self._given: Mapping[str, ChromaModel] = {}
        self._maker = MaskMaker()

    def _judging(self) -> tuple[Any, ...] | Done | None:
        """Untouched bounds were judged as they were learnt."""
        if self._learnt is None:
            return None
        return observations(self._bounds.picks, dict(self._given)) if self._given else Done(self._learnt)

    def enter(self) -> None:
        """Other bounds, another judgement."""
        if self._learnt is not self._bounds.result or self._given != self._bounds.given:
            self._learnt, self._given = self._bounds.result, dict(self._bounds.given)
            self.begin()

    def observe(self, pictures: Pictures) -> tuple[Finding, ...] | None:
        """How the light stands to the one of the samples; None before they are learnt."""
        result = self.result
        return None if result is None else drift_of(self._maker.look(pictures, result.markers))

    def accept_observation(self, seen: tuple[Finding, ...]) -> None:
        """What is said of the light."""
        if self.report is not None:
            self.report = replace(self.report, verdict=with_findings(self.result.verdict, seen))

    def view(self) -> StepView:
        """The verdict, with what to do about it."""
        if self.result is None:
            return super().view()
        apart = self.result.separability.sentences
        return replace(super().view(), hint="; ".join(apart[:3]) + "." if apart else "No two colours overlap.")
