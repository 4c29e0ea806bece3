"""Accuracy with nails, dots, rings and worn paint, compared with whole fingertips in the same motion.

    python benchmarks/paints.py [--motion tap] [--seconds 4] [--seed 1] [--only NAME ...] [--logs DIR] [--json FILE]

The twin's hand at 0.6 m is rendered and goes through the nodes' detector, the classic and the estimator. Each
paint is rendered from the sides of the hand that `PAINTS` names: `palm` or `back` towards the cameras.
Columns:

    in view     share of marker frames in which both cameras see nine tenths of the paint that faces them
    tips seen   share of the fingertips' frames in which both cameras see any of their paint
    measured    share of the markers in view that the tracker reports as measured
    tips, angles   rms errors of measured fingertips, at the paint's position, and of angles of painted fingers

The markers are those of rhot6 with the fields of `PAINTS`. `segment` is rhot6 itself, for comparison.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import msgspec
from tables import arguments, publish, table

from rhot_app.errors import RhotError
from rhot_app.evaluation.compare import TRACKERS, judge
from rhot_app.evaluation.data_sets import Order, data_set
from rhot_app.evaluation.run import SETTLE_S
from rhot_app.hand.skeleton import WRIST_ROLE
from rhot_app.progress import ProgressLine
from rhot_app.simulator.scene.scene import make_scene, twin_defaults
from rhot_node.files import resource_path
from rhot_node.markers import MarkerSet, load_markers, save_markers

WHITE, BLACK, BLUE_GLOVE, BLACK_GLOVE = (235, 232, 225), (32, 32, 36), (60, 84, 150), (38, 38, 42)
FLAT: dict[str, Any] = {"shape": "disc", "radius_mm": None}
RING: dict[str, Any] = {"patch": "ring", "length_mm": 10.0, "shape": "band"}
BOTH = ("palm", "back")
COLUMNS = {"measured_share": "measured", "tip_measured_mm": "fingertips, mm", "angles_deg": "angles, deg"}


@dataclass(frozen=True)
class Paint:
    """A kind of paint: marker fields of `tips` and `wrist`, the twin's settings `scene`, and the `sides` in view."""

    tips: dict[str, Any] = field(default_factory=dict)
    wrist: dict[str, Any] = field(default_factory=dict)
    scene: dict[str, Any] = field(default_factory=dict)
    sides: tuple[str, ...] = ("palm",)


PAINTS = {
    "segment": Paint(sides=BOTH),
    "nail only": Paint(FLAT | {"patch": "nail", "length_mm": 11.0}, sides=("back", "palm")),
    "pulp dot": Paint(FLAT | {"patch": "pulp", "length_mm": 8.0}, sides=BOTH),
    "ring": Paint(RING, sides=BOTH),
    "tape with gap": Paint(RING | {"gap_deg": 60.0, "rest_rgb": WHITE}, sides=BOTH),
    "uneven 20 %": Paint(scene={"uneven_paint": 0.2}),
    "worn 30 %": Paint(scene={"worn_paint": 0.3}),
    "blue glove": Paint(scene={"glove_rgb": BLUE_GLOVE}),
    "black glove": Paint(scene={"glove_rgb": BLACK_GLOVE}),
    "band, half its length": Paint(wrist={"length_mm": 11.0, "rest_mm": 11.0, "rest_rgb": BLACK}),
    "band, half around": Paint(wrist={"gap_deg": 180.0, "gap_side": "radial", "rest_rgb": BLACK}),
}


def painted(paint: Paint) -> MarkerSet:
    """rhot6 with this paint."""
    whole = load_markers(resource_path("markers", "rhot6.json"))
    return msgspec.structs.replace(whole, markers=tuple(
        msgspec.structs.replace(marker, **(paint.wrist if marker.role == WRIST_ROLE else paint.tips))
        for marker in whole.markers))


def rows(name: str, args: argparse.Namespace, folder: Path) -> list[dict[str, Any]]:
    """A paint's figures from each of its sides."""
    paint, out = PAINTS[name], []
    tips = [marker.role != WRIST_ROLE for marker in painted(paint).markers]
    markers = folder / f"{name.replace(' ', '-').replace('%', 'percent')}.json"
    save_markers(markers, painted(paint))
    for side in paint.sides:
        settings = msgspec.structs.replace(twin_defaults(), markers=str(markers), facing=side, **paint.scene)
        line = ProgressLine(f"filming {name}, {side}")
        film = data_set(Order(make_scene(settings, args.seed), args.motion, args.seconds), args.logs or folder,
                    lambda _, line=line: line)
        line.finish()
        after = film.truth.cameras[0].times_s >= SETTLE_S
        parts = film.truth.visible_at(film.truth.cameras[0].times_s[after])
        out.append({"paint": name, "side": side, "in_view": float((parts >= 0.9).mean()),
                    "tips_seen": float((parts[:, tips] > 0.0).mean()),
                    **{tracker: judge(film, TRACKERS[tracker]).figures for tracker in TRACKERS}})
    return out


def main() -> int:
    """Film, track, print."""
    parser = arguments(__doc__)
    parser.add_argument("--motion", default="tap", metavar="M", help="motion of the hand (default tap)")
    parser.add_argument("--seconds", type=float, default=4.0, metavar="S",
                        help="length; the first second is not judged (default 4)")
    parser.add_argument("--seed", type=int, default=1, metavar="N", help="seed of the scene (default 1)")
    parser.add_argument("--only", nargs="+", choices=tuple(PAINTS), default=tuple(PAINTS), metavar="NAME",
                        help=f"which of: {', '.join(PAINTS)}")
    parser.add_argument("--logs", type=Path, default=None, metavar="DIR", help="keep what was filmed here")
    args = parser.parse_args()
    try:
        with tempfile.TemporaryDirectory(prefix="rhot-paints-") as work:
            figures = [row for name in args.only for row in rows(name, args, Path(work))]
    except RhotError as exc:
        print(f"paints: {exc}", file=sys.stderr)
        return 2
    publish(args, figures, table(
        ["paint, side towards the cameras", "in view", "tips seen",
         *(f"{head}: {tracker}" for head in COLUMNS.values() for tracker in TRACKERS)],
        [[f"{row['paint']}, {row['side']}", row["in_view"], row["tips_seen"],
          *(row[tracker][key] for key in COLUMNS for tracker in TRACKERS)]
         for row in sorted(figures, key=lambda row: BOTH.index(row["side"]))]))
    return 0


if __name__ == "__main__":
    sys.exit(main())
