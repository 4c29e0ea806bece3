"""The rig that a stereo calibration proposes, and its figures beside those in force."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rhot_app.calibration.lens.camera_calibration import lengths_text
from rhot_app.calibration.stereo.report import WORKING_DISTANCE_M, PairFigures, StereoFigures, StereoReport
from rhot_app.calibration.stereo.rig import calibrated_rig, rig_findings
from rhot_app.calibration.stereo.world_frame import WorldFrame
from rhot_app.calibration.verdict import judge
from rhot_app.project import Rig, RigNode
from rhot_app.ui.wizards.models.proposal import Proposal, RigChange, Row
from rhot_app.ui.wizards.models.rig_rows import place_figures

REASON = "stereo calibration"


def stereo_proposal(rig: Rig, path: Path | None, report: StereoReport, world: WorldFrame | None) -> Proposal | None:
    """What the last page shows and uses; None while the cameras could not be put together."""
    figures = report.figures
    if figures is None:
        return None
    after = calibrated_rig(rig, figures, world)
    found = [*report.verdict.findings, *rig_findings(after, report.cameras)]
    found += world.verdict.findings if world is not None else ()
    unique = {finding.figure: finding for finding in found}
    return Proposal(REASON, judge(report.summary, list(unique.values())), _rows(rig, after, figures),
                    (RigChange(rig, after, path, REASON),))


def _rows(before: Rig, after: Rig, figures: StereoFigures) -> tuple[Row, ...]:
    rows = [Row(f"{pair.first} to {pair.second}: distance", _distance(before, pair),
                f"{1e3 * pair.baseline_m:.2f} ± {1e3 * _baseline_std(pair):.2f} mm") for pair in figures.pairs]
    old = {name: text for node in before.nodes for name, text in place_figures(node).items()}
    new = {name: text for node in after.nodes for name, text in place_figures(node).items()}
    rows += [Row(name, old[name], text) for name, text in new.items()]
    rows.append(Row("corners, rms", "", f"{figures.rms_px:.2f} px"))
    rows.append(Row("squares, measured", f"{1e3 * figures.board.square_m:.2f} mm by ruler",
                    f"{1e3 * figures.squares.mean_m:.2f} mm"))
    rows.append(Row("lengths", lengths_text(before), lengths_text(after)))
    by_calibration, by_noise = (1e3 * error for error in figures.error_m)
    rows.append(Row(f"error expected at {WORKING_DISTANCE_M:g} m", "", f"{by_calibration:.2f} mm by the calibration, "
                    f"{by_noise:.2f} mm by noise"))
    return tuple(rows)


def _distance(rig: Rig, pair: PairFigures) -> str:
    places = {node.name: np.array(node.pose.translation_m) for node in rig.nodes}
    return f"{1e3 * np.linalg.norm(places[pair.second] - places[pair.first]):.2f} mm"


def _baseline_std(pair: PairFigures) -> float:
    """Of the length of T, by the standard deviations of its parts."""
    return float(np.linalg.norm(pair.translation_m * pair.translation_std_m) / pair.baseline_m)


def chosen_nodes(rig: Rig) -> tuple[RigNode, ...]:
    """The cameras that have pictures."""
    return tuple(node for node in rig.nodes if not node.text_datagrams)
