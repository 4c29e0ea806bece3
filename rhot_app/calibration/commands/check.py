"""``rhot check``: what can be wrong with a rig file and shows without a picture."""

from __future__ import annotations

import argparse
import math
from typing import TYPE_CHECKING, Any

from rhot_app.calibration.commands.arguments import add_rig_or_file, rig_of, tell
from rhot_app.calibration.report import Report
from rhot_app.options import add_json_argument
from rhot_node.terminal import add_examples

if TYPE_CHECKING:
    from rhot_app.calibration.check.checks import RigCheck


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot check``."""
    add_rig_or_file(parser)
    add_json_argument(parser)
    add_examples(parser, "rhot check --rig desk.json", "rhot check --rig desk.json --json")


def run(args: argparse.Namespace) -> int:
    """Check and report; exit code 2 when the rig cannot be tracked with."""
    from rhot_app.project import load_rig

    rig = load_rig(rig_of(args))  # refused before numba is loaded
    from rhot_app.calibration.check.camera_calibration import calibration_text
    from rhot_app.calibration.check.checks import check_rig

    checked, calibration = check_rig(rig), calibration_text(rig)
    said = Report(checked.verdict, notes=(*_lines(checked), f"cameras calibrated: {calibration}"),
                  fields={**_fields(checked), "calibration": calibration})
    tell(said, as_json=args.json)
    return 0 if checked.verdict.acceptable else 2


def _fields(checked: RigCheck) -> dict[str, Any]:
    from rhot_app.calibration.check.checks import WORKING_DISTANCES_M

    return {
        "cameras": [{"name": lens.name, "view_deg": [round(math.degrees(angle), 2) for angle in lens.view_rad],
                     "usable_percent": round(100 * lens.usable, 1)} for lens in checked.lenses],
        "pairs": [{"first": pair.first, "second": pair.second, "baseline_mm": round(pair.baseline_m * 1e3, 3),
                   "toe_in_deg": round(math.degrees(pair.toe_in_rad), 3),
                   "overlap_percent": {f"{z:g}": round(100 * share, 1) for z, share
                                       in zip(WORKING_DISTANCES_M, pair.overlap, strict=True)}}
                  for pair in checked.pairs],
    }


def _lines(checked: RigCheck) -> list[str]:
    from rhot_app.calibration.check.checks import WORKING_DISTANCES_M

    lines = [f"{lens.name}: sees {math.degrees(lens.view_rad[0]):.1f} x {math.degrees(lens.view_rad[1]):.1f} degrees"
             for lens in checked.lenses]
    for pair in checked.pairs:
        shares = ", ".join(f"{100 * share:.0f} % at {z:g} m"
                           for z, share in zip(WORKING_DISTANCES_M, pair.overlap, strict=True))
        lines.append(f"{pair.first} - {pair.second}: {pair.baseline_m * 1e3:.1f} mm apart, axes "
                     f"{math.degrees(pair.toe_in_rad):.1f} degrees, seen by both: {shares}")
    return lines
