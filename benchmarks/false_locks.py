"""How often a missing marker is reported as measured: the twin's hand with paint missing, through the whole chain.

    python benchmarks/false_locks.py [--frames N] [--trackers classic,estimator] [--json FILE]

The hand has no paint at all, or lacks one marker. It is before cloth, or before a cluttered desk with objects in
saturated colours. Rendered pictures go through the nodes' detector, the wire and each tracker. A false lock is a marker
that is reported as measured although it is missing, or more than 20 mm (a fingertip's length) from its true position.
`measured` is the share of the painted markers, in all states, that are reported as measured. `--frames` counts both
cameras and all cases together. Exit code 1 with any false lock.
"""

from __future__ import annotations

import sys
import tempfile
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
from tables import arguments, publish, table
from twin_frames import twin_scene

from rhot_app.engine.offline.replay_summary import replay_states
from rhot_app.engine.pipeline import warm_up
from rhot_app.evaluation.data_sets import DataSet, Order, data_set
from rhot_app.evaluation.track import rig_with
from rhot_app.project import TrackerSettings
from rhot_app.simulator.film.node_log import T0_MASTER_NS
from rhot_app.sources.replay import LogValidator
from rhot_app.state import Knowledge
from rhot_app.tracking.scene import make_tracker

MOTIONS = ("grasp", "fast", "wave", "spread", "rest")
SECONDS = 3.125  # of each scene: 125 frames a camera
FAR_M = 0.02


def tally(filmed: DataSet, missing: frozenset[str], kind: str) -> Counter[str]:
    """Counts of one tracker on one recording: `false` locks, `measured` and painted (`worn`) markers, `states`."""
    rig = rig_with(filmed.rig, TrackerSettings(kind=kind))
    tracker = make_tracker(rig)
    warm_up(tracker, rig)
    gone = np.array([name in missing for name in rig.markers.ids])
    counts: Counter[str] = Counter()
    for state in replay_states(filmed.records(), LogValidator(rig), tracker):
        measured = state.marker_knowledge == Knowledge.MEASURED
        truth = filmed.truth.markers_at(np.array([1e-9 * (state.t_master_ns - T0_MASTER_NS)]))[0]
        far = np.linalg.norm(state.marker_positions - truth, axis=1) > FAR_M
        counts["false"] += int(np.count_nonzero(measured & (gone | far)))
        counts["measured"] += int(np.count_nonzero(measured & ~gone & ~far))
        counts["worn"] += int(np.count_nonzero(~gone))
        counts["states"] += 1
    return counts


def case(background: str, bare: bool, frames: int, kinds: list[str], folder: Path) -> dict[str, Any]:
    """At least `frames` frames of one room, of hands without paint or with one marker missing."""
    filmed_frames, seed = 0, 100
    counts: dict[str, Counter[str]] = {kind: Counter() for kind in kinds}
    while filmed_frames < frames:
        scene = twin_scene(background, seed=seed)
        ids = scene.markers.ids
        missing = frozenset(ids if bare else (ids[seed % len(ids)],))
        order = Order(scene, MOTIONS[seed % len(MOTIONS)], SECONDS, unpainted=missing)
        filmed = data_set(order, folder, anew=True)
        for kind in kinds:
            counts[kind] += tally(filmed, missing, kind)
        filmed_frames += 2 * round(SECONDS * scene.preset.fps)
        seed += 1
    return {"frames": filmed_frames, **{kind: dict(counts[kind]) for kind in kinds}}


def main() -> int:
    """Run, print what was measured, write the JSON."""
    parser = arguments(__doc__)
    parser.add_argument("--frames", type=int, default=10_000)
    parser.add_argument("--trackers", default="classic,estimator")
    options = parser.parse_args()
    kinds = options.trackers.split(",")
    report: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as folder:
        for background in ("cloth", "clutter"):
            for bare in (True, False):
                name = f"{background}, {'no paint' if bare else 'one marker missing'}"
                report[name] = case(background, bare, options.frames // 4, kinds, Path(folder))
    publish(options, report, table(["room, hand", "frames", "tracker", "states", "false locks", "measured"], [
        [name, found["frames"], kind, found[kind].get("states", 0), found[kind].get("false", 0),
         f"{found[kind].get('measured', 0) / worn:.3f}" if (worn := found[kind].get("worn", 0)) else None]
        for name, found in report.items() for kind in kinds]))
    return int(any(report[name][kind].get("false", 0) for name in report for kind in kinds))


if __name__ == "__main__":
    sys.exit(main())
