"""What to change on a camera: exposure, flicker and white balance in one report for the wizard (RHOT 7.1)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from rhot_app.calibration.exposure import ExposureReport, Mask, measure_exposure
from rhot_app.calibration.flicker import FlickerReport, FlickerWatch
from rhot_app.calibration.verdict import Verdict, judge
from rhot_app.calibration.white_balance import WhiteBalance, balance_on_grey
from rhot_node.config import CameraSettings
from rhot_node.detect.colour import Box
from rhot_node.detect.image import YuvImage


@dataclass(frozen=True, slots=True)
class CameraAdvice:
    """`flicker`: None until enough frames are seen, `white`: None without a grey patch."""

    exposure: ExposureReport
    flicker: FlickerReport | None
    white: WhiteBalance | None
    verdict: Verdict


class CameraAdvisor:
    """Looks at the pictures of one camera as they come."""

    def __init__(self) -> None:
        self._flicker = FlickerWatch()

    def update(self, image: YuvImage, t_row0_s: float, settings: CameraSettings,
               markers: Mapping[str, Mask] | None = None, grey: Box | None = None) -> CameraAdvice:
        """The advice on a picture taken at `t_row0_s` (mid-exposure of row 0, s, node clock) with these settings.

        `markers`: their paint in the picture; `grey`: a box on something grey. Raises CalibrationError for a box on
        nothing grey.
        """
        self._flicker.add(image, t_row0_s)
        exposure = measure_exposure(image, markers, settings)
        row_time = 1e-6 * settings.row_time_us or None
        flicker = None
        if self._flicker.ready:
            flicker = self._flicker.report(row_time, 1e-6 * settings.exposure_us, settings.fps)
        white = None if grey is None else balance_on_grey(image, grey, settings)
        findings = [*exposure.findings, *(flicker.findings if flicker else ()), *(white.findings if white else ())]
        seen = exposure.picture
        words = f"{100.0 * seen.over:.1f} % too bright, {100.0 * seen.under:.1f} % black"
        words += "" if flicker is None else f", flicker {100.0 * flicker.depth:.1f} %"
        return CameraAdvice(exposure, flicker, white, judge(f"{words}.", findings))

    def restart(self) -> None:
        """Forget the frames so far: the settings have changed."""
        self._flicker = FlickerWatch()
