"""The step in which the learnt bounds of every colour can be moved while the mask shows what passes."""

from __future__ import annotations

from typing import Any

import msgspec

from rhot_app.calibration.colour.colours import ColourReport, solve_colours
from rhot_app.ui.wizards.models.camera_settings import Control
from rhot_app.ui.wizards.models.colour_mask import MaskedPictures, MaskMaker, drift_of, mask_overlay
from rhot_app.ui.wizards.models.colour_pick import PickStep, Show
from rhot_app.ui.wizards.models.step import Pictures, Step, StepView, Task
from rhot_node.markers import ChromaModel, MarkerSet

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


class BoundsStep(Step):
    """Learns all colours from what was picked, then lets a person move the bounds; Ctrl+Z goes back step by step."""

    title = "Check the mask"
    watches = True

    def __init__(self, picks: PickStep) -> None:
        self.cameras = picks.cameras
        self.picks = picks
        self.report: ColourReport | None = None
        self.given: dict[str, ChromaModel] = {}
        self.chosen = ""
        self.show: Show = "all"
        self.problem = ""
        self.markers: MarkerSet = picks.base
        self._revision = -1
        self._undone: list[dict[str, ChromaModel]] = []
        self._sights: MaskedPictures = {}
        self._maker = MaskMaker()

    @property
    def names(self) -> tuple[str, ...]:
        """Markers with samples."""
        return self.report.names if self.report is not None else ()

    def enter(self) -> None:
        """Other samples, other colours."""
        if self._revision != self.picks.gathering.revision:
            self._revision = self.picks.gathering.revision
            self.report, self.given, self._undone, self._sights = None, {}, [], {}
            self.markers = self.picks.markers

    def task(self) -> Task | None:
        """Learn, unless that is done."""
        if self.report is not None or not self.picks.gathering.names:
            return None
        return learning(self.picks, {}, "Learning the colours …")

    def take_result(self, result: Any) -> None:
        """The learnt bounds."""
        self.report, self.problem = result, ""
        if self.chosen not in result.names:
            self.chosen = result.names[0]
        self._show_given()

    def take_failure(self, sentence: str) -> None:
        """Why there are none."""
        self.problem = sentence

    def value(self, control: Control) -> float | None:
        """A bound of the chosen marker."""
        if self.report is None:
            return None
        return float(getattr(self.model(self.chosen), control.field))

    def model(self, name: str) -> ChromaModel:
        """A marker's bounds as they would be used."""
        return self.markers.markers[self.markers.ids.index(name)].chroma

    def change(self, control: Control, value: float, *, goes_on: bool = False) -> None:
        """Move a bound of the chosen marker; `goes_on`: a slider is still moving, one step back undoes it whole."""
        if self.report is None:
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
        assert self.report is not None
        self.markers = msgspec.structs.replace(self.report.markers, markers=tuple(
            msgspec.structs.replace(marker, chroma=self.given.get(marker.id, marker.chroma))
            for marker in self.report.markers.markers))

    def see(self, pictures: Pictures) -> MaskedPictures:
        """The mask."""
        return self._maker.look(pictures, self.markers, (self.chosen,))

    def take(self, seen: MaskedPictures) -> None:
        """What was seen."""
        self._sights = seen

    def view(self) -> StepView:
        """Look, and move what does not fit."""
        if self.report is None:
            return StepView("Go back and pick a colour." if not self.picks.gathering.names else
                            "It did not work out." if self.problem else "One moment.", hint=self.problem)
        chosen = self.markers.ids.index(self.chosen) if self.show == "chosen" else None
        overlays = {} if self.show == "none" else {
            name: mask_overlay(sight, self.markers, chosen) for name, sight in self._sights.items()}
        index = self.markers.ids.index(self.chosen)
        found = [sight.seen[index].found for sight in self._sights.values()]
        hint = f"{self.chosen} is found by {sum(found)} of {len(found)} cameras." if found else ""
        hint = " ".join([hint, *(f"{name}: {sight.why(index)}" for name, sight in self._sights.items()
                                 if sight.why(index))])
        drift = drift_of(self._sights)
        if drift:
            hint = f"Since the colours were picked: {drift[0].sentence}"
        return StepView("The mask must fit the markers.", done=True, hint=hint, overlays=overlays)


def learning(picks: PickStep, given: dict[str, ChromaModel], title: str) -> Task:
    """The work of learning and judging; `given`: bounds that a person has set."""
    gathering = picks.gathering
    return Task(title, solve_colours, (gathering.samples, gathering.views),
                {"skin": gathering.skin, "base": picks.base, "given": given, "before": gathering.earlier})
