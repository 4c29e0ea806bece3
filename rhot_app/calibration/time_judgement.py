"""What measured times are worth: whether the movement could show them, and what they say of the nodes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.verdict import Finding, Grade, Verdict, judge

Array = NDArray[np.float64]

FAIR_SD_S, POOR_SD_S = 0.2e-3, 1e-3
"""At 2 m/s a millisecond is 2 mm."""

FAIR_RIVAL, POOR_RIVAL = 1.5, 1.15
FAIR_MISS_PX, POOR_MISS_PX = 1.0, 3.0
SHORT_S = 8.0
WIDE_BOUND_S = 2e-3
DRIFT_S = 0.5e-3
ROW_TIME_SD_S = 4e-6
"""A row time known no better than this says nothing; over 480 rows it makes 2 ms."""

_EDGE_S = 0.145


@dataclass(frozen=True, slots=True)
class CameraTime:
    """One camera's times.

    `correction_s` is to be added to its `time_offset_s` while its node says the row time that it says now
    (`row_time_node_s`), `with_row_time_s` once it says `row_time_s`. `sd_s`, `row_time_sd_s`: standard deviations.
    `speed_px_s`: rms speed of its markers across the epipolar lines, `samples` how many; `direction` is where to move.
    """

    name: str
    reference: bool
    correction_s: float
    sd_s: float
    with_row_time_s: float
    row_time_s: float
    row_time_sd_s: float
    row_time_node_s: float
    speed_px_s: float
    samples: int
    direction: str

    @property
    def row_time_observed(self) -> bool:
        """Whether the recording shows the row time at all."""
        return self.row_time_sd_s <= ROW_TIME_SD_S


@dataclass(frozen=True, slots=True)
class TimeFigures:
    """What is judged; mappings are by camera index, without the reference."""

    cameras: tuple[CameraTime, ...]
    row_times_agree: bool
    duration_s: float
    rms_px: float
    rms_before_px: float
    rivals: Mapping[int, float]
    drifts_s: Mapping[int, Array]
    clock_bounds_s: tuple[float, ...]


def judge_times(figures: TimeFigures) -> Verdict:
    """The verdict on a time calibration."""
    told = ", ".join(f"{camera.name} {1e3 * camera.correction_s:+.2f} ± {1e3 * camera.sd_s:.2f} ms"
                     for camera in figures.cameras if not camera.reference)
    summary = (f"against {figures.cameras[0].name}, times are to be corrected by {told}; markers then miss their "
               f"epipolar lines by {figures.rms_px:.2f} px rms instead of {figures.rms_before_px:.2f}.")
    findings = [finding for index, camera in enumerate(figures.cameras) if not camera.reference
                for finding in (*_movement(camera), *_search(camera, figures.rivals[index]),
                                *_drift(camera, figures.drifts_s[index]))]
    return judge(summary, [*findings, *_geometry(figures), *_row_times(figures), *_recording(figures)])


def _movement(camera: CameraTime) -> list[Finding]:
    if camera.sd_s <= FAIR_SD_S:
        return []
    return [Finding("weak_movement", Grade.POOR if camera.sd_s > POOR_SD_S else Grade.FAIR,
                    f"The offset of {camera.name} is known to ±{1e3 * camera.sd_s:.2f} ms only: its markers moved at "
                    f"{camera.speed_px_s:.0f} px/s rms across the epipolar lines.",
                    "Movement along these lines shows no delay, and slow movement shows little.",
                    f"Wave {camera.direction}, 20 cm wide, once or twice a second, for 20 s.")]


def _search(camera: CameraTime, rival: float) -> list[Finding]:
    if abs(camera.with_row_time_s) > _EDGE_S:
        return [Finding("edge", Grade.POOR, f"The best offset of {camera.name} lies at the edge of what was searched, "
                        f"{1e3 * camera.with_row_time_s:+.0f} ms.", "The true one may lie beyond, or the clocks of "
                        "master and node were not yet known.", "Record again, a few seconds after the start.")]
    if rival >= FAIR_RIVAL:
        return []
    return [Finding("ambiguous", Grade.POOR if rival < POOR_RIVAL else Grade.FAIR,
                    f"Another offset of {camera.name} fits nearly as well ({rival:.2f} times the error).",
                    "The movement repeats itself too evenly.", "Wave irregularly: change speed and place.")]


def _drift(camera: CameraTime, drift_s: Array) -> list[Finding]:
    if len(drift_s) < 2 or np.ptp(drift_s) <= max(DRIFT_S, 6.0 * camera.sd_s):
        return []
    return [Finding("unsteady", Grade.FAIR, f"The offset of {camera.name} changed by {1e3 * np.ptp(drift_s):.1f} ms "
                    "within the recording.", "The node's clock is not steady, or its driver delivers pictures late at "
                    "times.", "Use a cable instead of wireless; if it stays, this camera cannot be timed better.")]


def _geometry(figures: TimeFigures) -> list[Finding]:
    if figures.rms_px <= FAIR_MISS_PX:
        return []
    return [Finding("geometry", Grade.POOR if figures.rms_px > POOR_MISS_PX else Grade.FAIR,
                    f"With corrected times markers still miss their epipolar lines by {figures.rms_px:.1f} px rms.",
                    "The stereo calibration is stale, or a marker was taken for another thing.",
                    "Calibrate the stereo geometry, then the times again.")]


def _row_times(figures: TimeFigures) -> list[Finding]:
    if figures.row_times_agree:
        unseen = [camera.name for camera in figures.cameras if not camera.row_time_observed]
        return [] if not unseen else [
            Finding("row_time_not_seen", Grade.GOOD, f"The row times of {', '.join(unseen)} were not seen; they are "
                    "taken as the nodes say.", "", "Two markers on a stiff thing (or a stiff hand), one above the "
                    "other, waved fast, show them.")]
    told = ", ".join(f"{camera.name} {1e6 * camera.row_time_s:.1f} ± {1e6 * camera.row_time_sd_s:.1f} µs (it says "
                     f"{1e6 * camera.row_time_node_s:.1f})" for camera in figures.cameras)
    seen = all(camera.row_time_observed for camera in figures.cameras)
    remedy = ("Set camera.row_time_us of these nodes, then record and run this again: a camera that says another row "
              "time may also say other times." if seen else
              "Record again with two markers on a stiff thing, one above the other, waved fast: then each row time "
              "shows, not only their difference.")
    return [Finding("row_time", Grade.FAIR, f"Row times: {told}.", "The nodes' row times are not those of their "
                    "cameras; the offsets written are a compromise in the middle of the pictures.", remedy)]


def _recording(figures: TimeFigures) -> list[Finding]:
    found = []
    if figures.duration_s < SHORT_S:
        found.append(Finding("short", Grade.FAIR, f"The recording is {figures.duration_s:.0f} s long.", "",
                             "Twenty seconds tell whether the offset is steady."))
    for camera, bound_s in zip(figures.cameras, figures.clock_bounds_s, strict=True):
        if bound_s > WIDE_BOUND_S:
            found.append(Finding("clock", Grade.FAIR, f"The clock of {camera.name} is known to ±{1e3 * bound_s:.1f} ms "
                                 "only.", "The offset found here holds while the network's delays stay as they are.",
                                 "Use a cable instead of wireless, then calibrate again."))
    return found
