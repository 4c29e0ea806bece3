"""The measures of the 3-D mouse (`rhot mouse measure --pictures`), as tables.

    python benchmarks/mouse.py [--seed 1] [--places 20] [--sketched] [--json FILE]

A scripted hand before the twin's cameras: the measures of Rehg 1995, 4.3.5. Lengths are the cursor's. `--sketched`
makes observations without images, but for the speeds.
"""

from __future__ import annotations

import sys

import numpy as np
from tables import arguments, publish, table

from rhot_app.mouse.measure import measures
from rhot_app.mouse.play import SetUp
from rhot_app.progress import ProgressLine

AXES = ("x_mm", "y_mm", "height_mm")


def main() -> int:
    """Measure and print."""
    parser = arguments(__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--places", type=int, default=20, help="balls to pick and place, a seed each")
    parser.add_argument("--sketched", action="store_true", help="without images")
    args = parser.parse_args()
    figures = measures(args.seed, args.places, set_up=SetUp(pictures=not args.sketched),
                       watch=lambda title: ProgressLine(f"rendering {title}"))
    late, found, away = figures["latency"], figures["throughput"], [one["away_mm"] for one in figures["place"]]
    rows = [["a state is ready after the hand was there, ms: p50, p99",
             f"{late['ready_p50_ms']:.0f}, {late['ready_p99_ms']:.0f}"],
            ["lag of the cursor behind the hand, ms", late["lag_ms"]],
            *([f"target test, {name} hand, bit/s", found[name] and found[name]["bits_per_s"]]
              for name in ("true", "tracked"))]
    if away:
        rows += [[f"balls within their radius of 25 mm, of {len(away)}",
                  sum(one["placed"] for one in figures["place"])],
                 ["their distances, mm: median, worst", f"{np.median(away):.0f}, {max(away):.0f}"]]
    publish(args, figures,
            table(["peak speed along the table, m/s", "time in which the hand is held"],
                  [[f"{one['speed_m_per_s']:g}", f"{100.0 * one['held']:.0f} %"] for one in figures["speed"]]),
            table(["error of the cursor while one thing is moved, mm rms (peak)", "right", "forward", "height"],
                  [[one["moved"], *(f"{one['rms'][axis]:.1f} ({one['peak'][axis]:.1f})" for axis in AXES)]
                   for one in figures["coupling"]]),
            table(["palm turned on the table: jitter, mm", "right", "forward", "height"],
                  [[f"{one['turn_deg']:g} degrees", *(one[axis] for axis in AXES)] for one in figures["resolution"]]),
            table(["second camera covered, mm rms", "right", "forward", "height"],
                  [[name, *(figures["one_camera"][key][axis] for axis in AXES)]
                   for name, key in (("palm anywhere", "free"), ("palm on the table", "on_table"))]),
            table(["", "result"], rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())
