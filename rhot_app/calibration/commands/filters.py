"""``rhot calibrate filters``: the 1-euro filters' settings from two recordings (RHOT 7.3)."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from rhot_app.calibration.commands.output import show
from rhot_app.calibration.registry import FILTERS
from rhot_app.errors import CalibrationError, input_file, positive_number
from rhot_app.options import add_json_argument, add_out_argument, add_rig_argument
from rhot_node.terminal import add_examples

if TYPE_CHECKING:
    from rhot_app.calibration.filters.meters import FilterTargets, MarkerFigures
    from rhot_app.calibration.filters.tuning import FilterChoice, FilterCurves, FilterReport


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


def run(args: argparse.Namespace) -> int:
    """Tune and report; the rig is written only with ``--out``."""
    from rhot_app.calibration.filters.tuning import tune_filters
    from rhot_app.calibration.recorded_observations import read_instants
    from rhot_app.progress import ProgressLine
    from rhot_app.project import load_rig
    from rhot_app.rig_history import accept

    targets, rig = _targets(args), load_rig(args.rig)
    still, fast = (read_instants(log, rig)[1] for log in (args.log_still, args.log_fast))
    line = ProgressLine("filters")
    report = tune_filters(still, fast, rig, targets, line.report)
    line.finish()
    choice, written = report.choice(per_marker=args.per_marker), ""
    if args.out is not None and choice.verdict.acceptable:
        accept(args.out, report.apply(rig, per_marker=args.per_marker), FILTERS.reason)
        written = str(args.out)
    return show(_fields(report, choice), _lines(report, choice), choice.verdict, as_json=args.json, written=written)


def _targets(args: argparse.Namespace) -> FilterTargets:
    from dataclasses import replace

    from rhot_app.calibration.filters.meters import FilterTargets
    targets = FilterTargets()
    for option, value, field in (("--jitter-mm", args.jitter_mm, "jitter_m"), ("--lag-ms", args.lag_ms, "lag_s")):
        if value is not None:
            if not 0.0 < value < 1000.0:
                raise CalibrationError(f"{option} {value:g}: give a number above 0 and below 1000.")
            targets = replace(targets, **{field: 1e-3 * value})
    return targets


def _fields(report: FilterReport, choice: FilterChoice) -> dict[str, Any]:
    return {
        "targets": {"jitter_mm": 1e3 * report.targets.jitter_m, "lag_ms": 1e3 * report.targets.lag_s},
        "pixel": _filter(report.pixel, report), "position": _filter(report.position, report),
        "markers": {marker.marker_id: _marker(marker) for marker in choice.markers},
    }


def _filter(curves: FilterCurves, report: FilterReport) -> dict[str, Any]:
    import msgspec

    return {
        **msgspec.to_builtins(curves.chosen),
        "markers": {marker.marker_id: msgspec.to_builtins(own) for marker, own in zip(
            report.markers, curves.by_marker, strict=True) if marker.known},
        "curves": {"min_cutoff_hz": curves.min_cutoffs_hz.tolist(), "beta": curves.betas.tolist(), **{
            name: [[_known(value, 1e3) for value in row] for row in rows.tolist()] for name, rows in (
                ("still_jitter_mm", curves.still_jitter_m), ("lag_ms", curves.lag_s), ("error_mm", curves.error_m),
                ("jitter_mm", curves.jitter_m))}},
    }


def _marker(marker: MarkerFigures) -> dict[str, Any]:
    return {"known": marker.known, "speed_m_s": _known(marker.speed_m_s), "raw_jitter_px": _known(marker.raw_jitter_px),
            **{f"{name}_{unit}": _known(getattr(marker, f"{name}_{si}"), 1e3) for name, unit, si in (
                ("raw_jitter", "mm", "m"), ("jitter", "mm", "m"), ("lag", "ms", "s"), ("error", "mm", "m"),
                ("jitter_now", "mm", "m"), ("lag_now", "ms", "s"), ("error_now", "mm", "m"))}}


def _known(value: float, scale: float = 1.0) -> float | None:
    """The value in the unit of the report, None for NaN, which JSON does not have."""
    return scale * value if value == value else None


def _lines(report: FilterReport, choice: FilterChoice) -> list[str]:
    lines = [""]
    for name, unit, curves in (("before depth", "px/s", report.pixel), ("after depth", "m/s", report.position)):
        chosen = curves.chosen
        lines.append(f"{name}: min cutoff {chosen.min_cutoff_hz:g} Hz, beta {chosen.beta:g} Hz per {unit}, derivative "
                     f"cutoff {chosen.derivative_cutoff_hz:g} Hz")
    lines += ["", "marker     jitter at rest, mm: raw   now   new     lag, ms: now   new   error, mm: now   new"]
    for m in choice.markers:
        lines.append(f"{m.marker_id:<10}{1e3 * m.raw_jitter_m:24.2f}{1e3 * m.jitter_now_m:6.2f}{1e3 * m.jitter_m:6.2f}"
                     f"{1e3 * m.lag_now_s:17.1f}{1e3 * m.lag_s:6.1f}{1e3 * m.error_now_m:17.2f}{1e3 * m.error_m:6.2f}")
    return lines
