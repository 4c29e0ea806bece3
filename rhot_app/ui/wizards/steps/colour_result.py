"""How far the colours can be told apart: the judged report, its histogram and matrix, and what is proposed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from rhot_app.calibration.colour.colours import ColourReport, solve_colours
from rhot_app.calibration.colour.surroundings import HUE_STEP_DEG
from rhot_app.calibration.registry import COLOURS
from rhot_app.calibration.verdict import Finding, with_findings
from rhot_app.charts import Chart, Curve
from rhot_app.project import Rig
from rhot_app.ui.models.palette import hex_of
from rhot_app.ui.models.proposal import Change, NodeChange, Proposal, RigChange, Row
from rhot_app.ui.models.rows import rig_rows
from rhot_app.ui.wizards.models.step import ChartedStep, Pictures, Step, StepView, Task
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
        self._masked: MaskedPictures = {}
        self._maker = MaskMaker()

    @property
    def names(self) -> tuple[str, ...]:
        """Markers with samples."""
        return self.report.names if self.report is not None else ()

    def enter(self) -> None:
        """Other samples, other colours."""
        if self._revision != self.picks.gathering.revision:
            self._revision = self.picks.gathering.revision
            self.report, self.given, self._undone, self._masked = None, {}, [], {}
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

    @property
    def masked(self) -> MaskedPictures:
        """What the cameras' detectors found last."""
        return self._masked

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
        self._masked = seen

    def view(self) -> StepView:
        """Look, and move what does not fit."""
        if self.report is None:
            return StepView("Go back and pick a colour." if not self.picks.gathering.names else
                            "It did not work out." if self.problem else "One moment.", hint=self.problem)
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


def learning(picks: PickStep, given: dict[str, ChromaModel], title: str) -> Task:
    """The work of learning and judging; `given`: bounds that a person has set."""
    gathering = picks.gathering
    return Task(title, solve_colours, (gathering.samples, gathering.views),
                {"skin": gathering.skin, "base": picks.base, "given": given, "before": gathering.earlier})


# -- Step: separability of the colours, and what is proposed -----------------------------------------------------------


_HEADROOM = 1.05  # of the chart above the highest column


class SeparationStep(ChartedStep):
    """The verdict on the colours with the bounds that a person has left them, and on the light since then."""

    title = "Tell them apart"
    watches = True

    def __init__(self, bounds: BoundsStep) -> None:
        self.cameras = bounds.cameras
        self.report: ColourReport | None = None
        self._bounds = bounds
        self._learnt: ColourReport | None = None
        self._given: Mapping[str, ChromaModel] = {}
        self._problem = ""
        self._maker = MaskMaker()
        self._drift: tuple[Finding, ...] = ()

    @property
    def judged(self) -> ColourReport | None:
        """The report with what the cameras say of the light now."""
        return self.report and replace(self.report, verdict=with_findings(self.report.verdict, self._drift))

    @property
    def keeps(self) -> bool:
        """A report is worth a question."""
        return self.report is not None

    def enter(self) -> None:
        """Other bounds, another judgement; untouched ones were judged as they were learnt."""
        if self._learnt is not self._bounds.report or self._given != self._bounds.given:
            self._learnt, self._given, self._problem = self._bounds.report, dict(self._bounds.given), ""
            self._take(None if self._given else self._learnt)

    def task(self) -> Task | None:
        """Judge what was moved by hand."""
        if self.report is not None or self._learnt is None:
            return None
        return learning(self._bounds.picks, dict(self._given), "Trying the new bounds …")

    def take_result(self, result: Any) -> None:
        """The judgement."""
        self._take(result)

    def take_failure(self, sentence: str) -> None:
        """Why there is none."""
        self._problem = sentence

    def see(self, pictures: Pictures) -> tuple[Finding, ...] | None:
        """How the light stands to the one of the samples; None before they are learnt."""
        report = self.report
        return None if report is None else drift_of(self._maker.look(pictures, report.markers))

    def take(self, seen: tuple[Finding, ...]) -> None:
        """What is said of the light."""
        self._drift = seen

    def _take(self, report: ColourReport | None) -> None:
        self.report, self._drift = report, ()
        self.charts = () if report is None else (hue_chart(report),)

    def view(self) -> StepView:
        """The verdict, with what to do about it."""
        judged = self.judged
        if judged is None:
            return StepView("Go back and pick a colour." if self._learnt is None else
                            "It did not work out." if self._problem else "One moment.", hint=self._problem)
        apart = judged.separability.sentences
        hint = "; ".join(apart[:3]) + "." if apart else "No two colours overlap."
        sentence = "Read what may be mistaken for a marker, then go on." if judged.verdict.acceptable else \
            "Read what is wrong, then go back."
        return StepView(sentence, done=judged.verdict.acceptable, hint=hint, verdict=judged.verdict)


def hue_chart(report: ColourReport) -> Chart:
    """Which hues the room has, and which of them each marker's bounds let through."""
    room = report.room.hue_px
    left = -180.0 + HUE_STEP_DEG * np.arange(len(room))
    x = np.stack([left, left + HUE_STEP_DEG], axis=1).ravel()
    top = 10.0 ** (_HEADROOM * np.log10(max(float(room.max()), 10.0)))
    chosen = {marker.id: marker for marker in report.markers.markers}
    curves = [Curve("the room", x, np.repeat(np.maximum(room, 1.0), 2))]
    for one in report.samples:
        marker = chosen[one.name]
        middle = float(np.degrees(marker.chroma.hue_rad))
        low, high = middle - marker.chroma.hue_tolerance_deg, middle + marker.chroma.hue_tolerance_deg
        for turn in (-360.0, 0.0, 360.0):  # a band across red is drawn at both ends
            ends = np.clip(np.array([low + turn, high + turn]), -180.0, 180.0)
            if ends[1] > ends[0]:
                name = one.name if low + turn < middle + turn <= 180.0 and middle + turn > -180.0 else ""
                curves.append(Curve(name, ends, np.ones(2), "band", np.full(2, top), hex_of(one.rgb)))
    return Chart("Colours of the room and of the markers", "hue (angle of chroma), °",
                 "pixels per picture", tuple(curves), log_y=True)


def matrix_cells(report: ColourReport) -> tuple[tuple[str, ...], list[tuple[str, list[float]]]]:
    """The heads of the columns; each row's marker, and what share 0..1 of each column's colour is taken for it."""
    apart = report.separability
    return (*report.names, *apart.others), [(name, [float(share) for share in row])
                                            for name, row in zip(report.names, apart.matrix, strict=True)]


def propose(report: ColourReport | None, rig: Rig, path: Path | None,
            node_settings: Mapping[int, dict[str, Any]]) -> Proposal | None:
    """The rig with the new marker set, and every node with the very same."""
    if report is None:
        return None
    after = msgspec.structs.replace(rig, markers=report.markers)
    markers = msgspec.to_builtins(report.markers)
    changes: list[Change] = [RigChange(rig, after, path, COLOURS.reason)]
    shown = {f"{old.id}: colour": (old.display_rgb, new.display_rgb)
             for old, new in zip(rig.markers.markers, report.markers.markers, strict=True)}
    rows = [replace(row, swatches=shown.get(row.what)) for row in rig_rows(rig, after)]
    for node in rig.nodes:
        if node.node_id in node_settings:
            before = node_settings[node.node_id]["markers"]
            changes.append(NodeChange(node.node_id, {"markers": before}, {"markers": markers}))
            rows.append(Row(f"colours in camera {node.name}", "the rig's" if before == msgspec.to_builtins(rig.markers)
                            else "not the rig's", "the new ones"))
        elif not node.text_datagrams:
            rows.append(Row(f"colours in camera {node.name}", "not known", "not changed: the node does not answer"))
    return Proposal(COLOURS.reason, report.verdict, tuple(rows), tuple(changes))
