"""What would be left of the model tracker's errors, cameras covered or markers hidden, if the palm were known exactly.

    python benchmarks/known_palm.py [--seeds 20] [--motion grasp] [--markers rhot6]

The trials and logs (without pictures) of `benchmarks/trackers.py --sketched`, side by side: the tracker as it is, and
one that is told the true palm - place, turn, velocities - before and after every frame. What remains are fingers out of
sight that go where nobody sees them; no way of finding the palm can do away with that.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from functools import partial

import msgspec
import numpy as np
from scipy.spatial.transform import Rotation

from rhot_app.errors import RhotError
from rhot_app.evaluation import scenarios
from rhot_app.evaluation.accuracy import Figures
from rhot_app.evaluation.takes import Order, Take, take, takes_folder
from rhot_app.evaluation.track import rig_with
from rhot_app.progress import ProgressLine
from rhot_app.project import Rig, TrackerSettings
from rhot_app.simulator.node_log import T0_MASTER_NS
from rhot_app.simulator.scene import make_scene, twin_defaults
from rhot_app.simulator.truth import Truth
from rhot_app.tracking.kalman.estimate import ACCELERATION, ANGLES, ROTATION, VELOCITY
from rhot_app.tracking.kalman.rows import PALM_PART
from rhot_app.tracking.kalman.timeline import TimedBlock
from rhot_app.tracking.model_tracker import ModelTracker
from rhot_app.tracking.tracker import Tracker

KNOWN_SD = {0: 1e-4, VELOCITY: 1e-2, ACCELERATION: 1.0}
"""Standard deviations of the palm's pose, m and rad, and its derivatives, once it has been told."""

STEP_S = 2e-3

Trial = Callable[[Take, Rig, Tracker | None], Figures]


class PalmKnown(ModelTracker):
    """The model tracker, told of the true palm with every frame."""

    def __init__(self, rig: Rig, truth: Truth) -> None:
        super().__init__(rig)
        self._truth = truth

    def observe(self, block: TimedBlock) -> None:
        """As of a `ModelTracker`."""
        self._tell()
        super().observe(block)
        self._tell()

    def _tell(self) -> None:
        t_s = 1e-9 * (self._timeline.t_ns - T0_MASTER_NS)
        if not STEP_S < t_s < self._truth.times_s[-1] - STEP_S:
            return
        estimate, covariance = self._hand.estimate, self._hand.estimate.covariance
        before, now, after = self._truth.palm_at(t_s + STEP_S * np.array([-1.0, 0.0, 1.0]))
        estimate.world[:] = now
        estimate.velocity[:ROTATION] = (after[:3, 3] - before[:3, 3]) / (2.0 * STEP_S)
        turned = Rotation.from_matrix(after[:3, :3] @ before[:3, :3].T).as_rotvec()
        estimate.velocity[ROTATION:ANGLES] = turned / (2.0 * STEP_S)
        estimate.acceleration[:ROTATION] = (after[:3, 3] - 2.0 * now[:3, 3] + before[:3, 3]) / STEP_S**2
        estimate.acceleration[ROTATION:ANGLES] = estimate.turning[:] = 0.0
        for first, deviation in KNOWN_SD.items():
            palm = slice(first, first + ANGLES)
            covariance[palm], covariance[:, palm] = 0.0, 0.0
            covariance[palm, palm] = deviation**2 * np.eye(ANGLES)
        estimate.unseen[:, self._wearing.worn.part == PALM_PART] = 0.0


TRIALS: dict[str, Trial] = {
    "blind": partial(scenarios.one_camera_blind, says_so=True),
    "silent": partial(scenarios.one_camera_blind, says_so=False),
    "hidden": partial(scenarios.markers_hidden, share=0.3, together=True),
    "hidden-apart": partial(scenarios.markers_hidden, share=0.3, together=False),
}


def main() -> int:
    """Run the trials and print a line of each as it is done."""
    parser = argparse.ArgumentParser(description="The model tracker in trouble, as it is and with the palm known.")
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--seconds", type=float, default=8.0, help="length of a take (default 8)")
    parser.add_argument("--motion", default="grasp")
    parser.add_argument("--markers", default="rhot6", metavar="SET")
    args = parser.parse_args()
    if args.seeds < 1:
        parser.error("--seeds must be 1 or more")
    if not 2.0 <= args.seconds < float("inf"):
        parser.error("--seconds must be 2 or more")
    settings = msgspec.structs.replace(twin_defaults(), markers=args.markers)
    print(f"{'fingertips mm rms (worst)':28s}{'as it is':>16s}{'palm known':>16s}")
    try:
        takes = [take(Order(make_scene(settings, seed), args.motion, args.seconds, sketched=True), takes_folder(),
                      lambda title: ProgressLine(f"filming {title}")) for seed in range(1, args.seeds + 1)]
        for name, trial in TRIALS.items():
            cells = []
            for knowing in (False, True):
                figures = scenarios.gather([_run(trial, one, knowing) for one in takes])
                cells.append(f"{figures['tips_mm']:.1f} ({figures['tips_max_mm']:.0f})")
            print(f"{name:28s}{cells[0]:>16s}{cells[1]:>16s}", flush=True)
    except RhotError as exc:
        print(exc, file=sys.stderr)
        return 2
    return 0


def _run(trial: Trial, one: Take, knowing: bool) -> Figures:
    rig = rig_with(one.rig, TrackerSettings(kind="model"))
    return trial(one, rig, PalmKnown(rig, one.truth) if knowing else None)


if __name__ == "__main__":
    sys.exit(main())
