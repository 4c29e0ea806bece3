"""Accuracy of the whole system on the twin: motions, presets, distances and losses side by side.

Each row renders a run, plays it in real time through real node daemons, UDP and the engine, and compares what was
published with the truth:

    python benchmarks/accuracy.py [--seconds 20] [--seed 1] [--recording FILE.tsv] [--json FILE] [--only NAME ...]
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
from tables import arguments, publish, table

from rhot_app.errors import RhotError
from rhot_app.evaluation.run import COLUMNS, evaluate_frames
from rhot_app.simulator.film.film import film
from rhot_app.simulator.film.shot import make_shot
from rhot_app.simulator.scene.scene import Scene, TwinSettings, make_scene, twin_defaults


@dataclass(frozen=True)
class Row:
    """One line of the table; rows of one scene and motion share their frames."""

    name: str
    motion: str
    preset: str = "wide"
    distance_m: float = 0.6
    losses: tuple[float, ...] = (0.0,)


def rows(recording: str | None) -> list[Row]:
    """What is measured. `recording` is a path of real motion, or None."""
    chosen = [
        Row("grasp", "grasp", losses=(0.0, 0.2)), Row("pinch", "pinch"), Row("fast", "fast"), Row("wave", "wave"),
        Row("rest", "rest"), Row("grasp 0.4 m", "grasp", distance_m=0.4), Row("grasp 1.0 m", "grasp", distance_m=1.0),
        Row("grasp fast preset", "grasp", preset="fast"), Row("fast fast preset", "fast", preset="fast"),
        Row("grasp fast preset 1.0 m", "grasp", preset="fast", distance_m=1.0),
    ]
    if recording is not None:
        chosen.append(Row("recording", recording))
    return chosen


def scene_of(row: Row, seed: int) -> Scene:
    """The twin's defaults but for what the row says."""
    merged = msgspec.to_builtins(twin_defaults()) | {"preset": row.preset, "distance_m": row.distance_m}
    return make_scene(msgspec.convert(merged, TwinSettings), seed)


def measure(row: Row, seconds: float, seed: int) -> list[tuple[str, dict[str, Any]]]:
    """The row's figures, once per loss, on the same frames."""
    scene = scene_of(row, seed)
    results = []
    with tempfile.TemporaryDirectory(prefix="rhot-") as work:
        frames = Path(work) / "frames"
        film(make_shot(scene, row.motion, seconds), frames)
        for loss in row.losses:
            place = Path(work) / f"{loss:g}"
            place.mkdir()
            name = row.name if not loss else f"{row.name}, {100 * loss:g} % lost"
            results.append((name, evaluate_frames(frames, place, loss=loss)))
    return results


def main() -> int:
    """Measure all rows, print the table, write JSON."""
    parser = arguments(__doc__)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--recording", metavar="FILE", help="a Qualisys .tsv or Leap .csv recording of real motion")
    parser.add_argument("--only", nargs="*", metavar="NAME", help="rows to measure")
    args = parser.parse_args()
    results: list[tuple[str, dict[str, Any]]] = []
    try:
        for row in rows(args.recording):
            if not args.only or row.name in args.only:
                results += measure(row, args.seconds, args.seed)
    except RhotError as exc:
        print(f"{row.name}: {exc}", file=sys.stderr)
        return 2
    publish(args, dict(results), table(
        [f"{args.seconds:g} s", *(head for _, head, _ in COLUMNS), "age p50, ms"],
        [[name, *(figures[key] if figures[key] is None else form.format(figures[key]) for key, _, form in COLUMNS),
          figures["state_age_ms"]["p50"]] for name, figures in results]))
    return 0


if __name__ == "__main__":
    sys.exit(main())
