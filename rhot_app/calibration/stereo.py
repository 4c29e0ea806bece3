"""The stereo calibration as a whole: shared views of two or more cameras in, a report with its verdict out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

from rhot_app.calibration.lens_start import LensStart
from rhot_app.calibration.ruler import RulerReading, baseline_finding, lengths_finding, read_ruler, ruler_finding
from rhot_app.calibration.stereo_adjust import StereoSolution
from rhot_app.calibration.stereo_checks import arrangement_findings, dropped_findings, fit_findings
from rhot_app.calibration.stereo_lens_checks import LensEvidence, lens_evidence, mismatch_finding
from rhot_app.calibration.stereo_report import StereoFigures, StereoReport, figures_of
from rhot_app.calibration.stereo_solve import solve
from rhot_app.calibration.stereo_views import Dropped, SharedViews
from rhot_app.calibration.verdict import Finding, judge
from rhot_app.errors import CalibrationError
from rhot_app.progress import Progress, silent


@dataclass(frozen=True, slots=True)
class KnownLengths:
    """What else is known about sizes: the distance in m between the first two cameras, measured by hand, and a ruler
    that the cameras saw."""

    baseline_m: float | None = None
    ruler: RulerReading | None = None

    @property
    def which(self) -> Literal["skipped", "baseline", "ruler"]:
        """The better one of those that are there."""
        return "ruler" if self.ruler is not None else "skipped" if self.baseline_m is None else "baseline"


def calibrate(views: SharedViews, lenses: Sequence[LensStart], *, refine: bool = False,
              known: KnownLengths | None = None, remembered: Sequence[LensStart | None] = (),
              dropped: Sequence[Dropped] = (), noticed: Sequence[Finding] = (),
              progress: Progress = silent) -> StereoReport:
    """Put the cameras of `views` together.

    `lenses` one per camera; `refine` lets given ones change within their standard deviations. `remembered` lenses of an
    earlier calibration of the same cameras: nothing is computed from them, but they know mirrored and swapped
    pictures. `dropped` pictures that were already left out when the files were read, and what was `noticed`
    in them. Raises CalibrationError when there is nothing to calibrate from: too few shared shots, a lens for another
    picture size.
    """
    _check_sizes(views, lenses)
    known = known or KnownLengths()
    outcome = solve(views, lenses, refine=refine, progress=progress)
    if isinstance(outcome, Finding):
        summary = f"{' and '.join(views.cameras)} cannot be put together."
        return StereoReport(views.cameras, None, tuple(dropped), summary, judge(summary, [*noticed, outcome]))
    progress("measuring what came out", 0.97)
    figures = figures_of(outcome, lenses, [shot.name for shot in views.shots])
    ruler = None if known.ruler is None else read_ruler(known.ruler, figures.state)
    figures = replace(figures, ruler=ruler, lengths=known.which)
    every = (*dropped, *outcome.dropped)
    evidence = lens_evidence(outcome, [own if own.origin == "given" else before for own, before
                                       in zip(lenses, remembered or [None] * len(lenses), strict=True)])
    findings = [*noticed, *_findings(figures, outcome, lenses, known, evidence, every)]
    progress("stereo calibration", 1.0)
    summary = _summary(figures)
    return StereoReport(views.cameras, figures, every, summary, judge(summary, findings))


def _check_sizes(views: SharedViews, lenses: Sequence[LensStart]) -> None:
    for camera, (name, lens) in enumerate(zip(views.cameras, lenses, strict=True)):
        for view in views.of_camera(camera):
            if view.size != lens.size:
                raise CalibrationError(
                    f"{name}: {view.source or 'a picture'} is {view.width}x{view.height} px, the intrinsics are for "
                    f"{lens.size[0]}x{lens.size[1]}. Take the pictures in the size that the tracking uses, and "
                    "calibrate the intrinsics in the same one.")


def _findings(figures: StereoFigures, solution: StereoSolution, lenses: Sequence[LensStart], known: KnownLengths,
              evidence: LensEvidence, dropped: Sequence[Dropped]) -> list[Finding]:
    found = arrangement_findings(figures, evidence)
    if not found:  # a mirrored or another camera's lens fits badly, too; one reason is enough
        mismatch = mismatch_finding(solution, lenses)
        found += [mismatch] if mismatch is not None else []
    found += fit_findings(figures, lenses_from_views=any(lens.origin == "views" for lens in lenses))
    found += dropped_findings(dropped, len(figures.shots))
    square = figures.board.square_m
    if figures.ruler is not None:
        found.append(ruler_finding(figures.ruler, square))
    if known.baseline_m is not None:
        pair = figures.pairs[0]
        found.append(baseline_finding(pair.baseline_m, known.baseline_m, square, (pair.first, pair.second)))
    return found if figures.lengths != "skipped" else [*found, lengths_finding()]


def _summary(figures: StereoFigures) -> str:
    baselines = ", ".join(f"{pair.first} to {pair.second} {pair.baseline_m * 1e3:.1f} mm" for pair in figures.pairs)
    return (f"rms {figures.rms_px:.2f} px over {len(figures.shots)} shots; {baselines}; squares "
            f"{figures.squares.mean_m * 1e3:.2f} mm.")
