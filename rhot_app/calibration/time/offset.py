"""Offset and rolling-shutter row time of each camera from moving markers.

Echoes of the clock cannot see what a driver waits before it hands a picture over, nor a way that is slower there than
back. A marker that moves across the epipolar lines can: whoever sees it late sees it off its line, by speed times
delay. Needs calibrated geometry; the first camera is the reference.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import msgspec
import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.check.health import misfit_cause
from rhot_app.calibration.observations import ObservationTable
from rhot_app.calibration.time.fit import OffsetSearch, TimeFit, fit, search
from rhot_app.calibration.time.model import TimeModel, Times
from rhot_app.calibration.time.tracks import build_tracks
from rhot_app.calibration.verdict import Finding, Grade, Verdict, judge
from rhot_app.errors import CalibrationError
from rhot_app.progress import Progress, silent
from rhot_app.project import Rig, RigNode

Array = NDArray[np.float64]

CENTROID_BIAS_PX = 0.005
"""How far the bias of a marker's centroid (some hundredths of a pixel, by its place on the pixels and by what hides it)
may go with its speed: what no amount of samples averages out."""

PLOT_POINTS = 2000
_PART_S = 5.0


@dataclass(frozen=True, slots=True)
class TimePlot:
    """The fit of one camera as a picture: each sample's miss (N,) px over its speed across the epipolar line (N,) px/s,
    as the times stand and corrected; a delay is the slope. The search: rms px over trial offsets. `parts_s` (K,) and
    `drift_s` (K,): by how much single stretches of the recording disagree with the whole."""

    speed_px_s: Array
    before_px: Array
    after_px: Array
    offsets_s: Array
    rms_px: Array
    parts_s: Array
    drift_s: Array


@dataclass(frozen=True, slots=True)
class TimeResult:
    """`cameras` in the rig's order, the first is the reference. `plots` (one per other camera) by its index."""

    cameras: tuple[CameraTime, ...]
    row_times_agree: bool
    plots: dict[int, TimePlot] = field(repr=False)
    verdict: Verdict

    def apply(self, rig: Rig) -> Rig:
        """The rig with corrected `time_offset_s`, right for nodes that go on saying the row times they say now."""
        nodes = tuple(camera.applied(node, camera.correction_s)
                      for node, camera in zip(rig.nodes, self.cameras, strict=True))
        return msgspec.structs.replace(rig, nodes=nodes)


def calibrate_times(table: ObservationTable, rig: Rig, progress: Progress = silent) -> TimeResult:
    """Solve for all cameras of `rig` from what they saw.

    Raises CalibrationError when there are not two calibrated cameras that saw the same moving markers.
    """
    _require_geometry(rig)
    model = TimeModel(build_tracks(table, rig))
    progress("searching the cameras' offsets", 0.0)
    start, searches = search(model)
    free = fit(model, start, progress=lambda text, part: progress(text, 0.2 + 0.4 * part))
    held = fit(model, start, hold_rows=True, progress=lambda text, part: progress(text, 0.6 + 0.4 * part))
    agree = _rows_agree(model, free)
    used = held if agree else free
    cameras = tuple(_camera(model, index, free, held, agree) for index in range(len(model.cameras)))
    before = model.misses(Times(np.zeros(len(cameras)), start.row_times_s))
    plots = {found.camera: _plot(model, found, used, before) for found in searches}
    figures = TimeFigures(
        cameras, agree, duration_s=table.duration_s, rms_px=_rms(used.left_px), rms_before_px=_rms(before),
        rivals={found.camera: found.rival for found in searches},
        drifts_s={camera: plot.drift_s for camera, plot in plots.items()},
        clock_bounds_s=tuple(camera.clock_bound_s for camera in model.cameras), misfit=misfit_cause(rig))
    progress("times", 1.0)
    return TimeResult(cameras, agree, plots, judge_times(figures))


def _require_geometry(rig: Rig) -> None:
    if len(rig.nodes) < 2:
        raise CalibrationError(f"the rig {rig.name!r} has one camera; times are compared between two or more.")
    places = {node.pose.translation_m for node in rig.nodes}
    if rig.depth.mode != "stereo" or len(places) < len(rig.nodes):
        raise CalibrationError(f"the rig {rig.name!r} does not say where its cameras stand; calibrate the stereo "
                               "geometry first, times come after it.")


def _rows_agree(model: TimeModel, free: TimeFit) -> bool:
    """Whether the nodes' row times may be true: within 3 standard deviations, all together, or too near to matter."""
    cameras = len(model.cameras)
    away = free.times.row_times_s - np.array([camera.row_time_s for camera in model.cameras])
    if np.abs(away).max() < 1e-6:
        return True
    mahalanobis_sq = float(away @ np.linalg.solve(free.covariance[cameras:, cameras:], away))
    return mahalanobis_sq < 9.0 + 2.0 * cameras


def _camera(model: TimeModel, index: int, free: TimeFit, held: TimeFit, agree: bool) -> CameraTime:
    across = _across(model, held, index)
    used, speed = held if agree else free, _rms(across)
    return CameraTime(
        name=model.cameras[index].name, reference=index == 0,
        correction_s=0.0 if index == 0 else float(held.times.offsets_s[index]),
        sd_s=0.0 if index == 0 else math.hypot(used.sd.offsets_s[index], CENTROID_BIAS_PX / max(speed, 1e-3)),
        with_row_time_s=0.0 if index == 0 else float(used.times.offsets_s[index]),
        row_time_s=float(free.times.row_times_s[index]), row_time_sd_s=float(free.sd.row_times_s[index]),
        row_time_node_s=model.cameras[index].row_time_s, speed_px_s=speed,
        samples=int(np.count_nonzero(across)), direction=_direction(model, index))


def _across(model: TimeModel, found: TimeFit, index: int) -> Array:
    """Speeds across the epipolar lines of all samples that tell this camera's time, px/s."""
    slopes = found.slopes[:, index]
    return slopes[np.isfinite(found.left_px) & (slopes != 0.0)]


def _direction(model: TimeModel, index: int) -> str:
    """Which way to move so that this camera's time shows: across the epipolar line in the middle of its picture."""
    pair = next(pair for pair in model.pairs if index in (pair.first, pair.second))
    essential = pair.essential if index == pair.second else pair.essential.T
    line = essential @ np.array([0.0, 0.0, 1.0])
    return "up and down" if abs(line[1]) >= abs(line[0]) else "left and right"


def _plot(model: TimeModel, found: OffsetSearch, used: TimeFit, before: Array) -> TimePlot:
    slopes = used.slopes[:, found.camera]
    rows = np.flatnonzero(np.isfinite(before) & np.isfinite(used.left_px) & (slopes != 0.0))
    parts = (model.miss_times_s[rows] // _PART_S).astype(int)
    numbers = np.unique(parts)
    drift = np.array([_left_offset(used.left_px[rows[parts == k]], slopes[rows[parts == k]]) for k in numbers])
    shown = rows[np.linspace(0, len(rows) - 1, min(PLOT_POINTS, len(rows))).astype(int)] if len(rows) else rows
    return TimePlot(slopes[shown], before[shown], used.left_px[shown], found.offsets_s, found.rms_px,
                    (numbers + 0.5) * _PART_S, drift)


def _left_offset(left_px: Array, slopes: Array) -> float:
    """The offset that residuals still show, s, by least squares without the wildest tenth."""
    kept = np.abs(left_px) <= np.quantile(np.abs(left_px), 0.9)
    return -float(left_px[kept] @ slopes[kept]) / max(float(slopes[kept] @ slopes[kept]), 1e-9)


def _rms(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(np.square(known)))) if len(known) else 0.0


# -- what measured times are worth -------------------------------------------------------------------------------------

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

    def applied(self, node: RigNode, correction_s: float) -> RigNode:
        """The node of this camera with corrected times; the reference as it is."""
        if self.reference:
            return node
        return msgspec.structs.replace(node, time_offset_s=node.time_offset_s + correction_s,
                                       time_offset_sd_s=self.sd_s)

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
    misfit: str


def judge_times(figures: TimeFigures) -> Verdict:
    """The verdict on a time calibration."""
    offsets = ", ".join(f"{camera.name} {1e3 * camera.correction_s:+.2f} ± {1e3 * camera.sd_s:.2f} ms"
                        for camera in figures.cameras if not camera.reference)
    summary = (f"against {figures.cameras[0].name}, times are to be corrected by {offsets}; markers then miss their "
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
                    f"{figures.misfit} Or a marker was taken for another thing.",
                    "Calibrate the stereo geometry, then the times again.")]


def _row_times(figures: TimeFigures) -> list[Finding]:
    if figures.row_times_agree:
        unseen = [camera.name for camera in figures.cameras if not camera.row_time_observed]
        return [] if not unseen else [
            Finding("row_time_not_seen", Grade.GOOD, f"The row times of {', '.join(unseen)} were not seen; they are "
                    "taken as the nodes say.", "", "Two markers on a stiff thing (or a stiff hand), one above the "
                    "other, waved fast, show them.")]
    row_times = ", ".join(f"{camera.name} {1e6 * camera.row_time_s:.1f} ± {1e6 * camera.row_time_sd_s:.1f} µs (it says "
                          f"{1e6 * camera.row_time_node_s:.1f})" for camera in figures.cameras)
    seen = all(camera.row_time_observed for camera in figures.cameras)
    remedy = ("Set camera.row_time_us of these nodes, then record and run this again: a camera that says another row "
              "time may also say other times." if seen else
              "Record again with two markers on a stiff thing, one above the other, waved fast: then each row time "
              "shows, not only their difference.")
    return [Finding("row_time", Grade.FAIR, f"Row times: {row_times}.", "The nodes' row times are not those of their "
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
