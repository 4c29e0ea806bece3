"""``rhot calibrate depth``: the power law of disparity from a table of measured distances (RHOT 7.2.3)."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from rhot_app.calibration.commands.output import require_folder, show
from rhot_app.calibration.registry import DEPTH
from rhot_app.errors import CalibrationError, input_file, positive_number
from rhot_app.options import add_json_argument, add_out_argument, add_rig_argument
from rhot_node.terminal import add_examples

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from rhot_app.calibration.depth.fit import DepthGeometry, DepthReport
    from rhot_app.calibration.depth.table import DepthRow
    from rhot_app.project import Rig


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot calibrate depth``."""
    parser.add_argument("--table", type=input_file, required=True, metavar="CSV",
                        help="measured distances and disparities, columns real_cm and disparity_px")
    add_rig_argument(parser, "the rig whose two cameras were used")
    add_out_argument(parser, "write the rig with this law as its way to find distance")
    parser.add_argument("--baseline-mm", type=positive_number, metavar="B",
                        help="distance of the cameras, to compare with theory (default: the rig's, or 75)")
    parser.add_argument("--view-angle-deg", type=positive_number, metavar="A",
                        help="horizontal view angle of both cameras (default: the rig's, or 62.2)")
    add_json_argument(parser)
    add_examples(parser, "rhot calibrate depth --table distances.csv",
                 "rhot calibrate depth --table distances.csv --rig desk.json --out desk.json")


def run(args: argparse.Namespace) -> int:
    """Fit and report; the rig is written only with ``--out``."""
    import msgspec

    from rhot_app.calibration.depth.fit import fit_depth, replaced_calibration
    from rhot_app.calibration.depth.table import read_depth_table
    from rhot_app.calibration.verdict import with_findings
    from rhot_app.project import load_rig
    from rhot_app.rig_history import accept

    if args.out is not None and args.rig is None:
        raise CalibrationError("--out writes a rig, so --rig must say which one.")
    require_folder(args.out)
    rig = None if args.rig is None else load_rig(args.rig)
    if rig is not None and len(rig.nodes) != 2:
        raise CalibrationError(f"{args.rig}: disparity needs two cameras, the rig has {len(rig.nodes)}.")
    report = fit_depth(read_depth_table(args.table), _geometry(args, rig))
    verdict, written = report.verdict, ""
    if rig is not None and args.out is not None and verdict.acceptable:
        verdict = with_findings(verdict, replaced_calibration(rig))
        accept(args.out, msgspec.structs.replace(rig, depth=report.settings), DEPTH.reason)
        written = str(args.out)
    return show(_fields(report), _lines(report), verdict, as_json=args.json, written=written)


def _geometry(args: argparse.Namespace, rig: Rig | None) -> DepthGeometry:
    """What the arguments say, then what the rig says, then the thesis."""
    import math
    from dataclasses import replace

    from rhot_app.calibration.depth.fit import DepthGeometry, geometry_of
    from rhot_app.errors import CalibrationError

    geometry = DepthGeometry() if rig is None else geometry_of(rig)
    if args.baseline_mm is not None:
        if not args.baseline_mm > 0.0:
            raise CalibrationError(f"--baseline-mm {args.baseline_mm:g}: give the cameras' distance in mm, above 0.")
        geometry = replace(geometry, baseline_m=1e-3 * args.baseline_mm)
    if args.view_angle_deg is not None:
        if not 1.0 < args.view_angle_deg < 170.0:
            raise CalibrationError(f"--view-angle-deg {args.view_angle_deg:g}: give degrees between 1 and 170.")
        geometry = replace(geometry, view_angle_rad=math.radians(args.view_angle_deg))
    return geometry


def _fields(report: DepthReport) -> dict[str, Any]:
    def cm(metres: NDArray[np.float64]) -> list[float]:
        return list((100.0 * metres).tolist())

    columns = zip(report.rows, cm(report.corrected_m), cm(report.theory_m), cm(report.error_m), strict=True)
    chart = report.chart
    return {
        "k": 100.0 * report.k_m, "z": report.z, "z_sd": report.z_sd, "k_unit": "cm px^-z",
        "baseline_mm": 1e3 * report.geometry.baseline_m, "rows_used": len(report.rows),
        "rows_rejected": [{"row": row.where, "reason": row.reason} for row in report.rejected],
        "corrected_cm": cm(report.corrected_m), "residuals_cm": cm(report.residuals_m),
        "rows": [_row(row, *figures) for row, *figures in columns],
        "chart": {"disparity_px": chart.disparity_px.tolist(), "fitted_cm": cm(chart.fitted_m),
                  "theory_cm": cm(chart.theory_m), "low_cm": cm(chart.low_m), "high_cm": cm(chart.high_m)},
    }


def _row(row: DepthRow, corrected_cm: float, theory_cm: float, error_cm: float) -> dict[str, float]:
    real_cm = 100.0 * row.distance_m
    return {"real_cm": real_cm, "disparity_px": row.disparity_px,
            "corrected_cm": corrected_cm, "corrected_dev_pct": 100.0 * (corrected_cm / real_cm - 1.0),
            "calculated_cm": theory_cm, "calculated_dev_pct": 100.0 * (theory_cm / real_cm - 1.0),
            "theoretical_error_cm": error_cm}


def _lines(report: DepthReport) -> list[str]:
    lines = ["", f"D = k |x|^z   k = {100.0 * report.k_m:.3f} cm   z = {report.z:.6f} ± {report.z_sd:.6f}", "",
             "  real cm  disparity px  corrected cm      %   eq. 6.12 cm      %   one px is cm"]
    for row, corrected, theory, error in zip(report.rows, report.corrected_m, report.theory_m, report.error_m,
                                             strict=True):
        real = row.distance_m
        lines.append(f"{100 * real:9.1f}{row.disparity_px:14.2f}{100 * corrected:14.3f}"
                     f"{100 * (corrected / real - 1):+7.2f}{100 * theory:14.3f}{100 * (theory / real - 1):+7.2f}"
                     f"{100 * error:15.2f}")
    return lines
