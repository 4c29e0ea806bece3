"""The depth calibration: the power law of disparity from measured distances, without a board (RHOT 7.2.3)."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from rhot_app.calibration.registry import Calibration, Command, InForce, Observed
from rhot_app.calibration.report import Figure, Report, Table
from rhot_app.calibration.verdict import with_findings
from rhot_app.errors import CalibrationError, input_file, positive_number
from rhot_app.options import add_json_argument, add_out_argument, add_rig_argument
from rhot_node.terminal import add_examples

if TYPE_CHECKING:
    from rhot_app.calibration.depth.fit import DepthGeometry, DepthResult
    from rhot_app.calibration.depth.table import DepthTable
    from rhot_app.calibration.proposal import Proposal
    from rhot_app.progress import Progress
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


def observe(args: argparse.Namespace, progress: Progress) -> Observed:
    """The table, and the cameras' geometry by arguments, rig or thesis. The rig is in force where it is written."""
    from rhot_app.calibration.depth.table import read_depth_table
    from rhot_app.project import load_rig

    if args.out is not None and args.rig is None:
        raise CalibrationError("--out writes a rig, so --rig must say which one.")
    rig = None if args.rig is None else load_rig(args.rig)
    if rig is not None and len(rig.nodes) != 2:
        raise CalibrationError(f"{args.rig}: disparity needs two cameras, the rig has {len(rig.nodes)}.")
    now = None if rig is None or args.out is None else InForce(rig, args.rig)
    return Observed((read_depth_table(args.table), _geometry(args, rig)), now)


def solve(table: DepthTable, geometry: DepthGeometry, now: InForce | None, *, progress: Progress) -> DepthResult:
    """The law. Raises CalibrationError."""
    from rhot_app.calibration.depth.fit import fit_depth

    return fit_depth(table, geometry)


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


def report(result: DepthResult, now: InForce | None) -> Report:
    """The law and how well each row obeys it; what it takes the place of is in the verdict."""
    import numpy as np

    from rhot_app.calibration.depth.fit import replaced_calibration
    from rhot_app.charts import Chart, Curve

    verdict = with_findings(result.verdict, replaced_calibration(now.rig)) if now is not None else result.verdict
    chart, geometry = result.chart, result.geometry
    rows = []
    for row, *metres in zip(result.rows, result.corrected_m, result.theory_m, result.error_m, strict=True):
        real = 100.0 * row.distance_m
        corrected, theory, error = (100.0 * float(one) for one in metres)
        rows.append((Figure("distance", real, "cm", decimals=1, key="real_cm"),
                     Figure("disparity", row.disparity_px, "px", key="disparity_px"),
                     Figure("by the law", corrected, "cm", decimals=3, key="corrected_cm"),
                     Figure("off", 100.0 * (corrected / real - 1.0), "%", key="corrected_dev_pct"),
                     Figure("by eq. 6.12", theory, "cm", decimals=3, key="calculated_cm"),
                     Figure("off", 100.0 * (theory / real - 1.0), "%", key="calculated_dev_pct"),
                     Figure("one px is", error, "cm", key="theoretical_error_cm")))
    curves = (Curve("fitted law", chart.disparity_px, 100 * chart.fitted_m),
              Curve("parallel cameras", chart.disparity_px, 100 * chart.theory_m, "dashes"),
              Curve("one pixel more or less", chart.disparity_px, 100 * chart.low_m, "band", 100 * chart.high_m),
              Curve("measured", np.abs([row.disparity_px for row in result.rows]),
                    100 * np.array([row.distance_m for row in result.rows]), "dots"))
    return Report(
        verdict, (Figure("distance from", "disparity alone"), Figure("k", 100.0 * result.k_m, "cm", decimals=2),
                  Figure("z", result.z, sd=result.z_sd, key="z", sd_key="z_sd")),
        (Table("rows", tuple(rows)),), ("Distance is k · |disparity|^z.",
                                        *(f"left out: {row.where}: {row.reason}" for row in result.rejected)),
        {"k": 100.0 * result.k_m, "k_unit": "cm px^-z", "baseline_mm": 1e3 * geometry.baseline_m,
         "rows_used": len(result.rows), "corrected_cm": 100.0 * result.corrected_m,
         "residuals_cm": 100.0 * result.residuals_m,
         "rows_rejected": [{"row": row.where, "reason": row.reason} for row in result.rejected],
         "chart": {"disparity_px": chart.disparity_px, "fitted_cm": 100.0 * chart.fitted_m,
                   "theory_cm": 100.0 * chart.theory_m, "low_cm": 100.0 * chart.low_m,
                   "high_cm": 100.0 * chart.high_m}},
        (Chart(f"D = {100 * result.k_m:.1f} cm · |x|^{result.z:.4f}", "disparity, px", "distance, cm", curves),))


def propose(result: DepthResult, now: InForce) -> Proposal:
    """The rig that takes distances from disparity by this law."""
    import msgspec

    from rhot_app.calibration.proposal import proposed

    after = msgspec.structs.replace(now.rig, depth=result.settings)
    return proposed(CALIBRATION.reason, report(result, now), now.rig, after)


CALIBRATION = Calibration(
    "depth", "Depth without a board", "Distance from disparity, from a marker at measured distances.",
    "depth calibration",
    Command("depth", "distance from disparity, without a board, from a table of measured distances", add_arguments,
            observe),
    solve=solve, report=report, propose=propose)
