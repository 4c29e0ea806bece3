"""The filter calibration: the 1-euro filters' settings from a hand at rest and a fast one (RHOT 7.3)."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from rhot_app.calibration.registry import Calibration, Command, InForce, Observed
from rhot_app.calibration.report import Figure, Report, Table
from rhot_app.errors import CalibrationError, input_file, positive_number
from rhot_app.options import add_json_argument, add_out_argument, add_rig_argument
from rhot_node.terminal import add_examples

if TYPE_CHECKING:
    from rhot_app.calibration.filters.meters import FilterTargets, MarkerFigures
    from rhot_app.calibration.filters.tuning import FilterCurves, FilterResult
    from rhot_app.calibration.proposal import Proposal
    from rhot_app.calibration.report import Array
    from rhot_app.charts import Chart, Curve
    from rhot_app.progress import Progress
    from rhot_app.project import Rig


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot calibrate filters``."""
    parser.add_argument("--log-still", type=input_file, required=True, metavar="LOG",
                        help="10 s of a hand held still, recorded by rhot engine --log or the app")
    parser.add_argument("--log-fast", type=input_file, required=True, metavar="LOG",
                        help="10 s of a hand that waves briskly")
    add_rig_argument(parser, "the rig, calibrated", required=True)
    add_out_argument(parser, "write the rig with the proposed filters")
    parser.add_argument("--per-marker", action="store_true", help="write each marker's own settings too")
    parser.add_argument("--jitter-mm", type=positive_number, default=None, metavar="J",
                        help="jitter at rest that is allowed, mm rms (default 0.4)")
    parser.add_argument("--lag-ms", type=positive_number, default=None, metavar="L",
                        help="lag of fast movement that is allowed, ms (default 1)")
    add_json_argument(parser)
    add_examples(
        parser, "rhot calibrate filters --log-still still.rhotlog --log-fast wave.rhotlog --rig desk.json",
        "rhot calibrate filters --log-still still.rhotlog --log-fast wave.rhotlog --rig desk.json --out desk.json")


def observe(args: argparse.Namespace, progress: Progress) -> Observed:
    """The recordings; they are read by `solve`."""
    from rhot_app.project import load_rig

    return Observed((args.log_still, args.log_fast, _targets(args), args.per_marker),
                    InForce(load_rig(args.rig), args.rig))


def _targets(args: argparse.Namespace) -> FilterTargets:
    from rhot_app.calibration.filters.meters import FilterTargets
    targets = FilterTargets()
    for option, value, field in (("--jitter-mm", args.jitter_mm, "jitter_m"), ("--lag-ms", args.lag_ms, "lag_s")):
        if value is not None:
            if not 0.0 < value < 1000.0:
                raise CalibrationError(f"{option} {value:g}: give a number above 0 and below 1000.")
            targets = replace(targets, **{field: 1e-3 * value})
    return targets


def solve(still: Path, fast: Path, targets: FilterTargets, per_marker: bool, now: InForce, *,
          progress: Progress) -> FilterResult:
    """The filters from two recordings. Raises CalibrationError and RecordingError."""
    from rhot_app.calibration.filters.tuning import tune_filters
    from rhot_app.calibration.recorded_observations import read_instants

    progress("reading the recordings", 0.0)
    resting, moving = (read_instants(log, now.rig)[1] for log in (still, fast))
    return replace(tune_filters(resting, moving, now.rig, targets, progress), per_marker=per_marker)


FilterStage = Literal["pixel", "position"]
UNITS: dict[FilterStage, str] = {"pixel": "px/s", "position": "m/s"}


def report(result: FilterResult, now: InForce, stage: FilterStage = "position") -> Report:
    """Both filters, and what they do to every marker; the charts are of one `stage`."""
    choice, targets = result.choice, result.targets
    notes = []
    for name, unit, curves in (("before depth", UNITS["pixel"], result.pixel),
                               ("after depth", UNITS["position"], result.position)):
        chosen = curves.chosen
        notes.append(f"{name}: min cutoff {chosen.min_cutoff_hz:g} Hz, beta {chosen.beta:g} Hz per {unit}, "
                     f"derivative cutoff {chosen.derivative_cutoff_hz:g} Hz")
    return Report(
        choice.verdict, tables=(Table("markers", tuple(_marker(marker) for marker in choice.markers), by_name=True),),
        notes=tuple(notes), fields={
            "targets": {"jitter_mm": 1e3 * targets.jitter_m, "lag_ms": 1e3 * targets.lag_s},
            "pixel": _filter(result.pixel, result), "position": _filter(result.position, result)},
        charts=charts_of(result, now.rig, stage))


def _filter(curves: FilterCurves, result: FilterResult) -> dict[str, Any]:
    import msgspec

    return {
        **msgspec.to_builtins(curves.chosen),
        "markers": {marker.marker_id: msgspec.to_builtins(own) for marker, own in zip(
            result.markers, curves.by_marker, strict=True) if marker.known},
        "curves": {"min_cutoff_hz": curves.min_cutoffs_hz, "beta": curves.betas,
                   "still_jitter_mm": 1e3 * curves.still_jitter_m, "lag_ms": 1e3 * curves.lag_s,
                   "error_mm": 1e3 * curves.error_m, "jitter_mm": 1e3 * curves.jitter_m}}


def _marker(one: MarkerFigures) -> tuple[Figure, ...]:
    return (Figure("marker", one.marker_id), Figure("", one.known, key="known"),
            Figure("", one.speed_m_s, key="speed_m_s"), Figure("", one.raw_jitter_px, key="raw_jitter_px"),
            Figure("jitter at rest, raw", 1e3 * one.raw_jitter_m, "mm", key="raw_jitter_mm"),
            Figure("now", 1e3 * one.jitter_now_m, "mm", key="jitter_now_mm"),
            Figure("new", 1e3 * one.jitter_m, "mm", key="jitter_mm"),
            Figure("lag, now", 1e3 * one.lag_now_s, "ms", decimals=1, key="lag_now_ms"),
            Figure("new", 1e3 * one.lag_s, "ms", decimals=1, key="lag_ms"),
            Figure("error, now", 1e3 * one.error_now_m, "mm", key="error_now_mm"),
            Figure("new", 1e3 * one.error_m, "mm", key="error_mm"))


def propose(result: FilterResult, now: InForce) -> Proposal:
    """The rig with the proposed filters, and what they do to every marker."""
    from rhot_app.calibration.proposal import Row, proposed

    rows = []
    for one in result.choice.markers:
        if one.known:
            *_, jitter_now, jitter, lag_now, lag, _, _ = _marker(one)
            rows += [Row(f"{one.marker_id}: jitter at rest", jitter_now.text, jitter.text),
                     Row(f"{one.marker_id}: lag", lag_now.text, lag.text)]
    return proposed(CALIBRATION.reason, report(result, now), now.rig, result.apply(now.rig), rows=tuple(rows))


def charts_of(result: FilterResult, rig: Rig, stage: FilterStage) -> tuple[Chart, ...]:
    """The thesis's two steps: jitter over min cutoff, lag over beta, with what is allowed and what is chosen."""
    from rhot_app.charts import Chart

    curves: FilterCurves = getattr(result, stage)
    targets, half = result.targets, 0.5 if stage == "pixel" else 1.0
    jitter, lag = 1e3 * curves.still_jitter_m, 1e3 * curves.lag_s
    return (Chart("Held still: jitter with beta 0", "min cutoff, Hz", "jitter, mm", (
                *_by_marker(result, rig, curves.min_cutoffs_hz, jitter),
                *_marks(curves.min_cutoffs_hz, jitter, 1e3 * targets.jitter_m, curves.chosen.min_cutoff_hz)),
                log_x=True),
            Chart("Moved fast: lag with that min cutoff", f"beta, Hz per {UNITS[stage]}", "lag, ms", (
                *_by_marker(result, rig, curves.betas, lag),
                *_marks(curves.betas, lag, 1e3 * half * targets.lag_s, curves.chosen.beta)), log_x=True))


def _by_marker(result: FilterResult, rig: Rig, x: Array, y: Array) -> list[Curve]:
    """One curve for each marker that has figures, in its own colour."""
    import numpy as np

    from rhot_app.charts import Curve, hex_of

    colours = {marker.id: hex_of(marker.display_rgb) for marker in rig.markers.markers}
    return [Curve(marker.marker_id, x, y[:, m], colour=colours[marker.marker_id])
            for m, marker in enumerate(result.markers) if np.isfinite(y[:, m]).all()]


def _marks(x: Array, y: Array, allowed: float, chosen: float) -> tuple[Curve, Curve]:
    import numpy as np

    from rhot_app.charts import Curve

    top = max(float(np.nanmax(y, initial=0.0)), 1.2 * allowed)
    return (Curve("allowed", x[[0, -1]], np.full(2, allowed), "dashes"),
            Curve("chosen", np.full(2, chosen), np.array([0.0, top]), "dashes"))


CALIBRATION = Calibration(
    "filters", "Filters", "How much jitter and how much lag, from a hand held still and one that moves fast.",
    "filter tuning",
    Command("filters", "the filters' settings, from a hand held still and one that moves fast", add_arguments, observe),
    solve=solve, report=report, propose=propose, solver="rhot_app.calibration.filters.tuning")
