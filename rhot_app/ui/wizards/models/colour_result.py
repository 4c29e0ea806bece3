"""How far the colours can be told apart: the judged report, its histogram and matrix, and what is proposed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from rhot_app.calibration.colour.colours import ColourReport
from rhot_app.calibration.colour.surroundings import HUE_STEP_DEG
from rhot_app.calibration.verdict import Finding, judged_anew
from rhot_app.project import Rig
from rhot_app.ui.models.palette import hex_of
from rhot_app.ui.wizards.models.chart import Chart, ChartedStep, Curve
from rhot_app.ui.wizards.models.colour_bounds import BoundsStep, learning
from rhot_app.ui.wizards.models.colour_mask import MaskMaker, drift_of
from rhot_app.ui.wizards.models.proposal import Change, NodeChange, Proposal, RigChange, Row
from rhot_app.ui.wizards.models.rig_rows import rig_rows
from rhot_app.ui.wizards.models.step import Pictures, StepView, Task
from rhot_node.markers import ChromaModel

REASON = "colour calibration"

_HEADROOM = 1.05  # of the chart above the highest column


class ApartStep(ChartedStep):
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
        return self.report and replace(self.report, verdict=judged_anew(self.report.verdict, self._drift))

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
        return StepView(sentence, done=True, hint=hint, verdict=judged.verdict)


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
    return Chart("Colours of the room beside those of the markers", "hue (angle of chroma), °",
                 "colour pixels per picture", tuple(curves), log_y=True)


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
    changes: list[Change] = [RigChange(rig, after, path, REASON)]
    shown = {f"{old.id}: colour": (old.display_rgb, new.display_rgb)
             for old, new in zip(rig.markers.markers, report.markers.markers, strict=True)}
    rows = [replace(row, swatches=shown.get(row.what)) for row in rig_rows(rig, after)]
    for node in rig.nodes:
        if node.node_id in node_settings:
            before = node_settings[node.node_id]["markers"]
            changes.append(NodeChange(node.node_id, {"markers": before}, {"markers": markers}))
            rows.append(Row(f"{node.name}: colours", "as the rig" if before == msgspec.to_builtins(rig.markers)
                            else "others than the rig", "the new ones, as the rig"))
        elif not node.text_datagrams:
            rows.append(Row(f"{node.name}: colours", "not known", "not changed: the node does not answer"))
    return Proposal(REASON, report.verdict, tuple(rows), tuple(changes))
