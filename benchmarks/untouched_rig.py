"""Alarms of the self-calibration over rendered takes of a rig that nobody touches, and of the same rig turned.

    python benchmarks/untouched_rig.py [--motions pinch,wave,roam] [--minutes 30] [--seed 1] [--sketched] [--json FILE]

The nodes' own detector finds the markers in the twin's pictures (`rhot_app.evaluation.data_sets`), so its errors last
as they do live; filming takes longer than what is filmed. `--sketched` does without pictures, a hundred times faster:
the twin's centroids with the detector's noise and slow bias (`rhot_app.simulator.film.ideal_observations`). As in the
engine, the poses are judged every ten seconds. `held`: the most that refined poses predicted of observations that were
held back from them, in log likelihood; an alarm needs 13.8. Then the same takes with one camera whose pose in the rig
is turned by 0.3 degrees about a random axis: after how many seconds that is noticed.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from typing import Any

import msgspec
import numpy as np
from tables import arguments, publish, table

from rhot_app.errors import RhotError
from rhot_app.estimation.se3 import exp_so3, quaternion_from_rotation, rotation_from_quaternion
from rhot_app.evaluation.data_sets import DataSet, Order, data_set, data_sets_folder
from rhot_app.progress import ProgressLine
from rhot_app.project import Rig
from rhot_app.simulator.scene.scene import make_scene, twin_defaults
from rhot_app.sources.replay import LogValidator
from rhot_app.tracking.refinement.refined_rig import Refinement
from rhot_app.tracking.refinement.rig_refinement import RigRefiner
from rhot_app.tracking.tracker import CameraObservations

JUDGED_S, TURN_RAD, WITHIN_S = 10.0, math.radians(0.3), 60.0


def turned(rig: Rig, seed: int) -> Rig:
    """The second camera's pose turned by 0.3 degrees about a random axis."""
    axis = np.random.default_rng([seed, 0x70]).normal(size=3)
    node, pose = rig.nodes[1], rig.nodes[1].pose
    turn = rotation_from_quaternion(pose.rotation_wxyz) @ exp_so3(TURN_RAD * axis / np.linalg.norm(axis))
    w, x, y, z = (float(value) for value in quaternion_from_rotation(turn))
    moved = msgspec.structs.replace(pose, rotation_wxyz=(w, x, y, z))
    return msgspec.structs.replace(rig, nodes=(rig.nodes[0], msgspec.structs.replace(node, pose=moved),
                                               *rig.nodes[2:]))


def judged(take: DataSet, rig: Rig) -> Iterator[tuple[float, Refinement]]:
    """Seconds since the first frame, and the refinement, every ten seconds."""
    validator, refiner, first_ns, due_s = LogValidator(rig), RigRefiner(rig), 0, JUDGED_S
    for record in take.records():
        frame = validator.feed(record)
        if not isinstance(frame, CameraObservations):
            continue
        refiner.take(frame)
        first_ns = first_ns or frame.t_row0_master_ns
        now_s = 1e-9 * (frame.t_row0_master_ns - first_ns)
        if now_s >= due_s:
            due_s += JUDGED_S
            found = refiner.step()
            if found is not None:
                yield now_s, found


def study(take: DataSet, seed: int) -> dict[str, Any]:
    """Of one take: alarms on the exact rig, and seconds until the turned one is noticed (NaN: never)."""
    exact = [found for _, found in judged(take, take.rig)]
    noticed = next((now_s for now_s, found in judged(take, turned(take.rig, seed)) if not found.holds), math.nan)
    return {"judged": len(exact), "alarms": sum(not found.holds for found in exact),
            "held": max(found.held_out for found in exact), "least_p": min(found.probability for found in exact),
            "before_px": exact[-1].before_px, "after_px": exact[-1].after_px, "noticed_s": noticed}


def main() -> int:
    """Print a row for each motion; exit code 1 for an alarm, or a turned camera that is not noticed within a minute."""
    parser = arguments(__doc__)
    parser.add_argument("--motions", default="pinch,wave,roam")
    parser.add_argument("--minutes", type=float, default=30.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--sketched", action="store_true", help="no pictures")
    args = parser.parse_args()
    found: dict[str, Any] = {}
    try:
        for motion in args.motions.split(","):
            order = Order(make_scene(twin_defaults(), args.seed), motion, 60.0 * args.minutes, sketched=args.sketched)
            take = data_set(order, data_sets_folder(), lambda title: ProgressLine(f"filming {title}"), anew=True)
            found[motion] = study(take, args.seed)
    except RhotError as exc:
        print(exc, file=sys.stderr)
        return 2
    publish(args, found, table(
        [f"{args.minutes:g} min each", "judged", "alarms", "least p", "held", "rays miss, px", "refined",
         "0.3 degrees noticed after, s"],
        [[motion, one["judged"], one["alarms"], f"{one['least_p']:.0e}", one["held"], one["before_px"],
          one["after_px"], one["noticed_s"]] for motion, one in found.items()]))
    return int(any(one["alarms"] or not one["noticed_s"] <= WITHIN_S for one in found.values()))


if __name__ == "__main__":
    sys.exit(main())
