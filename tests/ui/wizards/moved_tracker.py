"""A finger with a tracker on it: the places that a rig sees, and as a program the lines that the tracker's prints."""

from __future__ import annotations

import sys
import time

import numpy as np
from scipy.spatial.transform import Rotation

from rhot_app.geometry.transforms import quaternion_from_rotation, rigid

FOREIGN_FROM_RIG = rigid(Rotation.from_rotvec([0.4, -0.9, 0.3]).as_matrix(), [0.5, -0.2, 1.1])
TRACKER_FROM_FINGER = rigid(np.eye(3), [0.03, 0.05, -0.02])
DELAY_S = 0.037


def rig_from_tracker(t_s: float, turning: bool = True) -> np.ndarray:
    """At monotonic time `t_s`; without `turning` it is moved in parallel."""
    waves = np.sin(np.outer([0.9, 1.7, 2.9], [1.0, 1.31, 0.77]) * 2.0 * t_s + np.arange(9).reshape(3, 3))
    place = np.array([0.0, 0.0, 0.6]) + (np.array([0.07, 0.06, 0.06]) * waves).sum(axis=0)
    turn = 0.25 * waves[:, ::-1].sum(axis=0) * turning
    return rigid(Rotation.from_rotvec(turn).as_matrix(), place)


def place_of_finger(t_s: float, turning: bool = True) -> np.ndarray:
    """(3,) m, rig frame."""
    return (rig_from_tracker(t_s, turning) @ TRACKER_FROM_FINGER)[:3, 3]


def main() -> None:
    """Print poses, 100 a second, until nobody reads."""
    turning, rng = sys.argv[1] != "parallel", np.random.default_rng(2)
    while True:
        t_s = time.monotonic()
        pose = FOREIGN_FROM_RIG @ rig_from_tracker(t_s - DELAY_S, turning)
        numbers = [*(pose[:3, 3] + 1e-4 * rng.normal(size=3)), *quaternion_from_rotation(pose[:3, :3])]
        print(f"{t_s - 5.0:.6f} T20 {' '.join(f'{number:.8f}' for number in numbers)}", flush=True)
        time.sleep(0.01)


if __name__ == "__main__":
    main()
