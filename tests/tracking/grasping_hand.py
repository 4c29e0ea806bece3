"""The grasping hand that most tests of the tracker look at, and what the tracker makes of it."""

from __future__ import annotations

import numpy as np
from synthetic_rig import WIDE, Preset, Trajectory, Viewing, hand_trajectory, make_rig, observe, run

from rhot_app.project import Rig
from rhot_app.state import HandState, Knowledge
from rhot_app.tracking.scene import make_tracker

RIG = make_rig()
GRASP = hand_trajectory(RIG, "grasp", 5.0)
REST = GRASP(np.array([0.0]))[0]
MEASURED, INFERRED, UNKNOWN = Knowledge.MEASURED, Knowledge.INFERRED, Knowledge.UNKNOWN
VIEWING = Viewing()


def states_of(viewing: Viewing = VIEWING, rig: Rig = RIG, preset: Preset = WIDE, trajectory: Trajectory = GRASP,
              seconds: float = 4.0) -> list[HandState]:
    """What a new tracker says of this trajectory."""
    return run(make_tracker(rig), observe(rig, preset, trajectory, seconds, viewing))
