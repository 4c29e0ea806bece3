"""What was found about a lens: the solve as a step, with the residuals over the live picture, and the proposal."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from rhot_app.calibration.lens.camera_calibration import with_lens
from rhot_app.calibration.lens.certainty import WORKING_DISTANCE_M
from rhot_app.calibration.lens.intrinsics import IntrinsicsReport, solve
from rhot_app.project import Intrinsics, Rig
from rhot_app.ui.wizards.feed import Image, Picture
from rhot_app.ui.wizards.models.drawing import Dots, Line, Mark, Overlay, Tag
from rhot_app.ui.wizards.models.lens_steps import LensShowStep
from rhot_app.ui.wizards.models.proposal import Proposal, RigChange, Row
from rhot_app.ui.wizards.models.rig_rows import lens_figures
from rhot_app.ui.wizards.models.step import Pictures, Step, StepView, Task

REASON = "intrinsics of"
ARROW_PX = 20.0
"""Residuals are hundredths or tenths of a pixel; the longest arrow should be about so long in the picture."""


class LensSolveStep(Step):
    """The solve; then the picture with the residuals, or straightened by the new lens."""

    title = "The lens"
    watches = True

    def __init__(self, show: LensShowStep) -> None:
        self._show = show
        self._asked: tuple[int, ...] = ()
        self._straight: dict[str, Picture] = {}
        self.report: IntrinsicsReport | None = None
        self.problem = ""
        self.straighten = False
        self.square_pixels = False

    def set_square_pixels(self, on: bool) -> None:
        """Force fx = fy, and solve again."""
        if on != self.square_pixels:
            self.square_pixels, self.report = on, None

    def enter(self) -> None:
        """Other views need another solve."""
        self.cameras = (self._show.camera,)
        asked = tuple(id(view) for view in self._show.views)
        if asked != self._asked:
            self._asked, self.report, self.problem, self._straight = asked, None, "", {}

    def task(self) -> Task | None:
        """The solve, as long as there is no answer."""
        if self.report is not None:
            return None
        views = tuple(replace(view, source=f"view {number}") for number, view in enumerate(self._show.views, 1))
        return Task("Finding the lens", solve, (views, self._show.board), {"square_pixels": self.square_pixels})

    def take_result(self, result: Any) -> None:
        """The answer."""
        self.report, self.problem = result, ""

    def take_failure(self, sentence: str) -> None:
        """Why there is none."""
        self.problem = sentence

    def see(self, pictures: Pictures) -> dict[str, Picture]:
        """The pictures as the new lens straightens them, when that is asked for."""
        report = self.report
        if report is None or not self.straighten:
            return {}
        return {name: replace(picture, bgr=straightened(picture.bgr, report.intrinsics))
                for name, picture in pictures.items() if picture.bgr.shape[1::-1] == report.size}

    def take(self, seen: dict[str, Picture]) -> None:
        """The straightened pictures."""
        self._straight = seen

    def view(self) -> StepView:
        """The verdict, and the residuals over the picture."""
        if self.report is None:
            return StepView("One moment: the lens is being found.", hint=self.problem)
        usable = self.report.verdict.acceptable
        sentence = "Read the verdict, then press Next." if usable else "Do what the verdict says, then come back."
        overlays = {} if self.straighten else {self._show.camera: residual_marks(self.report)}
        return StepView(sentence, done=usable, verdict=self.report.verdict, overlays=overlays,
                        pictures=self._straight if self.straighten else {})


def straightened(bgr: Image, lens: Intrinsics) -> Image:
    """The picture as a lens without distortion would show it: what is straight in the room becomes straight."""
    matrix = np.array([[lens.fx, 0.0, lens.cx], [0.0, lens.fy, lens.cy], [0.0, 0.0, 1.0]])
    return np.asarray(cv2.undistort(bgr, matrix, np.array(lens.distortion)), np.uint8)


def residual_marks(report: IntrinsicsReport) -> Overlay:
    """Where corners were, and the mean residual of each part of the picture as an arrow, exaggerated as stated."""
    field, (width, height) = report.field, report.size
    rows, cols = field.count.shape
    longest = float(np.nanmax(np.linalg.norm(field.mean, axis=-1), initial=0.0))
    times = 10.0 ** np.floor(np.log10(ARROW_PX / longest)) if longest > 0.0 else 1.0
    marks: list[Mark] = [Dots(field.places, "accent", radius=1.2, filled=True)]
    for row in range(rows):
        for col in range(cols):
            mean = field.mean[row, col]
            if np.isfinite(mean).all():
                start = np.array([(col + 0.5) * width / cols, (row + 0.5) * height / rows])
                marks += [Line(np.array([start, start + times * mean]), "caution", width=2.5),
                          Dots(start[None], "caution", radius=2.5, filled=True)]
    return (*marks, Tag(6.0, height - 24.0, f"arrows: residuals × {times:,.0f}"))


def lens_proposal(rig: Rig, path: Path | None, camera: str, report: IntrinsicsReport) -> Proposal:
    """The rig with the new lens, and its figures beside the old ones."""
    after = with_lens(rig, camera, report.intrinsics)
    reason = f"{REASON} {camera}"
    afterwards = ("Calibrate the other cameras' lenses, then put the cameras together: their places were found with "
                  "the old lens.") if len(rig.nodes) > 1 else ""
    return Proposal(reason, report.verdict, _rows(rig, after, camera, report), (RigChange(rig, after, path, reason),),
                    afterwards)


def _rows(before: Rig, after: Rig, camera: str, report: IntrinsicsReport) -> tuple[Row, ...]:
    old, new = (next(lens_figures(node) for node in rig.nodes if node.name == camera) for rig in (before, after))
    std = report.std
    certain = {f"{camera}: focal length": f" ± {std[:2].max():.1f} px",
               f"{camera}: centre": f" ± {std[2:4].max():.1f} px"}
    rows = [Row(name, old[name], text.removesuffix(" px") + certain[name] if name in certain else text)
            for name, text in new.items()]
    rows.append(Row("corners, rms", "", f"{report.rms_px:.2f} px over {len(report.views)} views"))
    rows.append(Row(f"error expected at {WORKING_DISTANCE_M:g} m", "", f"{1e3 * report.errors.typical_m:.2f} mm, "
                    f"{1e3 * report.errors.worst_m:.2f} mm in the corners"))
    return tuple(rows)
